//! How well a camera is known: the covariance of its unknowns and what follows from it.

use super::model::{
    CENTER, KAPPA, LN_FOCAL, LN_SCALE, PRINCIPAL, Square, State, UNKNOWNS, Unknowns, clear_unknown,
};
use super::prior::Prior;
use super::problem::Problem;
use super::rectangle::corner_points;
use super::refine::{Minimum, unit_diagonal};
use crate::geom::Point3;
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector3};

/// Information on the logarithm of the focal length below this part of its diagonal is rounding.
const ROUNDING_SHARE: f64 = 1e-13;
/// Points of the grid, per side, at which the height error is taken.
const GRID_SIDE: usize = 4;
/// Below this sine of the tilt its direction is undefined.
const LEAST_TILT_SINE: f64 = 1e-9;

/// Covariance of the unknowns, and what it says of the focal length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Uncertainty {
    pub(crate) covariance: Square,
    pub(crate) focal: FocalShare,
    /// Condition number of the information from the picture alone.
    pub(crate) condition: f64,
}

/// How much of the information about the focal length comes from the picture, and how much from its
/// prior.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FocalShare {
    /// Standard deviation of its logarithm; infinite where nothing is known.
    pub(crate) sigma: f64,
    /// Part of the information that comes from the picture, 0 to 1.
    pub(crate) share: f64,
    /// What the picture alone gives for its logarithm: the value and its standard deviation.
    pub(crate) from_data: Option<Prior>,
}

impl FocalShare {
    /// That of a focal length that was given as exact.
    const FIXED: Self = Self {
        sigma: 0.0,
        share: 0.0,
        from_data: None,
    };

    /// Difference between the picture and the prior, in standard deviations of the difference.
    pub(crate) fn prior_conflict(&self, prior: Prior) -> Option<f64> {
        let data = self.from_data?;
        (!prior.is_fixed() && !prior.is_flat())
            .then(|| (data.mean - prior.mean) / libm::hypot(data.sigma, prior.sigma))
    }
}

impl Uncertainty {
    pub(crate) fn new(minimum: &Minimum, prior: Prior) -> Self {
        let (covariance, information) = covariance(&minimum.information);
        let condition = condition(&minimum.information, prior);
        let focal = focal_share(minimum.state.ln_focal, information, prior);
        Self {
            covariance,
            focal,
            condition,
        }
    }

    /// Standard deviation of the tilt, radians.
    pub(crate) fn tilt_sigma(&self, state: &State) -> f64 {
        let normal = state.pose.rotation.column(2);
        let sin = libm::hypot(normal.x, normal.y);
        let c = &self.covariance;
        if sin < LEAST_TILT_SINE {
            return ((c[(0, 0)] + c[(1, 1)]) / 2.0).sqrt();
        }
        // The axis of the tilt, in the picture's plane.
        let (x, y) = (normal.y / sin, -normal.x / sin);
        let variance = x * x * c[(0, 0)] + 2.0 * x * y * c[(0, 1)] + y * y * c[(1, 1)];
        variance.max(0.0).sqrt()
    }

    /// Covariance of the camera's place over the rectangle.
    pub(crate) fn center_covariance(&self, state: &State) -> Matrix3<f64> {
        let slope = state.pose.rotation.transpose() * turned_center_slope(state);
        slope * self.covariance * slope.transpose()
    }

    /// Covariance of where a point of the rectangle's units is seen; none behind the camera.
    fn point_covariance_px(
        &self,
        problem: &Problem,
        state: &State,
        point: Vector3<f64>,
    ) -> Option<Matrix2<f64>> {
        let (_, slope) = state.slope(&(point / problem.units.unit), false)?;
        Some(
            slope.transpose()
                * self.covariance
                * slope
                * (problem.units.unit_px * problem.units.unit_px),
        )
    }

    /// The same at the rectangle's corners, squared pixels.
    pub(crate) fn corner_covariances_px(
        &self,
        problem: &Problem,
        state: &State,
    ) -> [Matrix2<f64>; 4] {
        corner_points(problem.size).map(|c| {
            self.point_covariance_px(problem, state, c.coords)
                .unwrap_or(Matrix2::repeat(f64::INFINITY))
        })
    }

    /// Root mean square error, pixels, of points over the rectangle at a height of `height` metres.
    pub(crate) fn height_sigma_px(&self, problem: &Problem, state: &State, height: f64) -> f64 {
        let variances = grid_at_height(problem.size, height)
            .map(|point| self.point_variance_px(problem, state, point.coords));
        (variances.sum::<f64>() / (GRID_SIDE * GRID_SIDE) as f64).sqrt()
    }

    /// Variance of both coordinates together.
    fn point_variance_px(&self, problem: &Problem, state: &State, point: Vector3<f64>) -> f64 {
        self.point_covariance_px(problem, state, point)
            .map_or(f64::INFINITY, |c| repaired_variance(c.trace()))
    }

    /// Standard deviation of a coordinate of the principal point, pixels.
    pub(crate) fn principal_sigma_px(&self, problem: &Problem) -> f64 {
        let variance = self.covariance[(PRINCIPAL, PRINCIPAL)]
            + self.covariance[(PRINCIPAL + 1, PRINCIPAL + 1)];
        problem.units.unit_px * (variance / 2.0).sqrt()
    }
}

/// Change of the camera's centre, in the camera's axes, per unknown.
fn turned_center_slope(state: &State) -> SMatrix<f64, 3, UNKNOWNS> {
    let t = state.translation();
    let mut slope = SMatrix::<f64, 3, UNKNOWNS>::zeros();
    slope
        .fixed_columns_mut::<3>(0)
        .copy_from(&-t.cross_matrix());
    for axis in 0..2 {
        slope[(axis, CENTER + axis)] = -1.0 / state.pose.scale;
        slope[(axis, PRINCIPAL + axis)] = 1.0 / state.pose.scale;
    }
    slope.set_column(LN_SCALE, &t);
    slope[(2, LN_FOCAL)] = -t.z;
    slope
}

/// A variance after rounding: not negative, and infinite where it is NaN.
pub(crate) fn repaired_variance(value: f64) -> f64 {
    if value.is_nan() {
        f64::INFINITY
    } else {
        value.max(0.0)
    }
}

/// Points of a grid over a rectangle, metres, at a height.
pub(crate) fn grid_at_height([w, h]: [f64; 2], height: f64) -> impl Iterator<Item = Point3<f64>> {
    (0..GRID_SIDE * GRID_SIDE).map(move |i| {
        let (x, y) = (grid_share(i % GRID_SIDE), grid_share(i / GRID_SIDE));
        Point3::new(x * w, y * h, height)
    })
}

/// Where a point of the grid stands on its side, from -0.5 to 0.5.
fn grid_share(k: usize) -> f64 {
    k as f64 / (GRID_SIDE - 1) as f64 - 0.5
}

/// Inverse of the information, and the information left on the focal length when all else is free.
///
/// The focal length is split off first (its Schur complement): it is the one unknown that may have
/// no information at all, and then its variance is huge while the rest stays as it is. Fixed
/// unknowns have no information and get no variance.
fn covariance(information: &Square) -> (Square, f64) {
    let scale = unit_diagonal(information);
    let (rest, coupling) = without_focal(scaled(information, &scale));
    let Some(mut inverse) = inverse_or_rounded(&rest) else {
        return (Square::repeat(f64::INFINITY), 0.0);
    };
    inverse[(LN_FOCAL, LN_FOCAL)] = 0.0;
    let mut response = -(inverse * coupling);
    let own = f64::from(information[(LN_FOCAL, LN_FOCAL)] > 0.0);
    let left = information_left(own, &coupling, &response);
    if own > 0.0 {
        response[LN_FOCAL] = 1.0;
        inverse += response * response.transpose() / left.max(ROUNDING_SHARE);
    }
    clear_uninformed(&mut inverse, information);
    (
        unscaled(&inverse, &scale),
        unscaled_information(left, scale[LN_FOCAL]),
    )
}

/// On the focal length, when all else answers to it.
fn information_left(own: f64, coupling: &Unknowns, response: &Unknowns) -> f64 {
    (own + coupling.dot(response)).max(0.0)
}

fn unscaled(covariance: &Square, scale: &Unknowns) -> Square {
    covariance.component_mul(&(scale * scale.transpose()))
}

/// Information in an unknown's own unit; zero where there is only rounding.
fn unscaled_information(scaled: f64, scale: f64) -> f64 {
    if scaled > ROUNDING_SHARE {
        scaled / (scale * scale)
    } else {
        0.0
    }
}

/// The information with the focal length decoupled from the rest, and the coupling that was there.
fn without_focal(mut rest: Square) -> (Square, Unknowns) {
    let mut coupling: Unknowns = rest.column(LN_FOCAL).into();
    coupling[LN_FOCAL] = 0.0;
    clear_unknown(&mut rest, LN_FOCAL);
    rest[(LN_FOCAL, LN_FOCAL)] = 1.0;
    (rest, coupling)
}

/// The inverse of a positive matrix, or of one that only rounding keeps from being positive.
fn inverse_or_rounded(matrix: &Square) -> Option<Square> {
    matrix
        .cholesky()
        .or_else(|| (matrix + Square::identity() * ROUNDING_SHARE).cholesky())
        .map(|c| c.inverse())
}

/// No variance for unknowns without information.
fn clear_uninformed(covariance: &mut Square, information: &Square) {
    for i in (0..UNKNOWNS).filter(|&i| information[(i, i)] == 0.0) {
        clear_unknown(covariance, i);
    }
}

/// With a unit diagonal, also where there is no information.
fn scaled(information: &Square, scale: &Unknowns) -> Square {
    let mut scaled = information.component_mul(&(scale * scale.transpose()));
    scaled.fill_diagonal(1.0);
    scaled
}

/// What is known of the focal length, from the information left on its logarithm.
pub(crate) fn focal_share(ln_focal: f64, information: f64, prior: Prior) -> FocalShare {
    if prior.is_fixed() {
        return FocalShare::FIXED;
    }
    let from_data = (information - prior.information()).max(0.0);
    let share = if information > 0.0 {
        from_data / information
    } else {
        0.0
    };
    let alone = Prior {
        mean: without_prior(ln_focal, prior, share),
        sigma: 1.0 / from_data.sqrt(),
    };
    FocalShare {
        sigma: 1.0 / information.sqrt(),
        share,
        from_data: (alone.mean.is_finite() && alone.sigma.is_finite()).then_some(alone),
    }
}

/// The logarithm of the focal length that the picture alone gives, if it has this share in the
/// value.
fn without_prior(ln_focal: f64, prior: Prior, share: f64) -> f64 {
    let start = if prior.is_flat() {
        ln_focal
    } else {
        prior.mean
    };
    start + (ln_focal - start) / share
}

/// Condition number of the information with a unit diagonal, without the prior of the focal length.
fn condition(information: &Square, prior: Prior) -> f64 {
    let mut data = *information;
    data[(LN_FOCAL, LN_FOCAL)] -= prior.information();
    if data.iter().any(|value| !value.is_finite()) {
        return 1.0 / f64::EPSILON;
    }
    let values = scaled(&data, &unit_diagonal(&data)).symmetric_eigenvalues();
    values.max() / values.min().max(f64::EPSILON)
}

/// Names of the unknowns, in the order of the covariance.
pub const UNKNOWN_NAMES: [&str; KAPPA + 1] = [
    "rotation_x",
    "rotation_y",
    "rotation_z",
    "center_u",
    "center_v",
    "ln_scale",
    "ln_focal",
    "stretch",
    "principal_x",
    "principal_y",
    "kappa",
];
