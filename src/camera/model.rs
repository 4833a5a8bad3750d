//! What a camera sees of a point, and how that changes with everything the solver may turn.
//!
//! # Method
//! The eleven unknowns are chosen so that the one weak direction stands alone: from straight above the focal length (and
//! the principal point) has no influence on any residual while all else stays well conditioned. Focal length and distance
//! would be almost perfectly correlated; the logarithm of the scale, focal length over distance, is not.

use super::rectangle::Stance;
use crate::geom::Vector2;
use nalgebra::{Matrix2x3, Matrix3, Rotation3, SMatrix, SVector, Vector3};

/// Number of unknowns.
pub(crate) const UNKNOWNS: usize = 11;
/// Indices of the unknowns; rotation is 0, 1, 2.
pub(crate) const CENTER: usize = 3;
pub(crate) const LN_SCALE: usize = 5;
pub(crate) const LN_FOCAL: usize = 6;
pub(crate) const STRETCH: usize = 7;
pub(crate) const PRINCIPAL: usize = 8;
pub(crate) const KAPPA: usize = 10;
/// Points nearer to the camera's plane than this part of the rectangle's distance are not seen.
const NEAREST: f64 = 1e-6;

/// A value per unknown.
pub(crate) type Unknowns = SVector<f64, UNKNOWNS>;
/// A value per pair of unknowns: information or covariance.
pub(crate) type Square = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
/// Change of a picture position per unknown.
pub(crate) type Slope = SMatrix<f64, 2, UNKNOWNS>;

/// A camera over a rectangle; units as in [`camera`](super).
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub(crate) stance: Stance,
    pub(crate) ln_focal: f64,
    /// Logarithm of what the ratio of the sides has to be multiplied by.
    pub(crate) stretch: f64,
    /// Principal point, relative to where it is expected.
    pub(crate) principal: Vector2<f64>,
    /// Radial distortion.
    pub(crate) kappa: f64,
}

/// Which part of the stretch goes into x and which into y; tells what stays exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Elastic(pub(crate) [f64; 2]);

impl Elastic {
    /// The area stays: both sides are measured.
    pub(crate) const BOTH: Self = Self([0.5, -0.5]);
    /// The width stays: only it is measured.
    pub(crate) const HEIGHT: Self = Self([0.0, -1.0]);
    /// The height stays: only it is measured.
    pub(crate) const WIDTH: Self = Self([1.0, 0.0]);
    /// Nothing gives: a point that was measured on its own.
    pub(crate) const RIGID: Self = Self([0.0, 0.0]);
}

/// A point of known place, and where it was seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) point: Vector3<f64>,
    pub(crate) elastic: Elastic,
    pub(crate) seen: Vector2<f64>,
    /// One over the noise.
    pub(crate) weight: f64,
}

impl State {
    pub(crate) fn new(stance: Stance, focal: f64, kappa: f64) -> Self {
        Self { stance, ln_focal: libm::log(focal), stretch: 0.0, principal: Vector2::zeros(), kappa }
    }

    /// The unknown at an index from [`LN_FOCAL`] on.
    pub(crate) fn value(&self, unknown: usize) -> f64 {
        match unknown {
            LN_FOCAL => self.ln_focal,
            STRETCH => self.stretch,
            KAPPA => self.kappa,
            _ => self.principal[unknown - PRINCIPAL],
        }
    }

    pub(crate) fn focal(&self) -> f64 {
        libm::exp(self.ln_focal)
    }

    /// Position of the rectangle's centre in the camera's frame.
    pub(crate) fn translation(&self) -> Vector3<f64> {
        (self.stance.center - self.principal).push(self.focal()) / self.stance.scale
    }

    /// The camera's place over the rectangle.
    pub(crate) fn camera_center(&self) -> Vector3<f64> {
        -(self.stance.rotation.transpose() * self.translation())
    }

    /// After a small step in every unknown.
    pub(crate) fn stepped(&self, step: &Unknowns) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0));
        Self {
            stance: Stance {
                rotation: turn.matrix() * self.stance.rotation,
                center: self.stance.center + step.fixed_rows::<2>(CENTER),
                scale: self.stance.scale * libm::exp(step[LN_SCALE]),
            },
            ln_focal: self.ln_focal + step[LN_FOCAL],
            stretch: self.stretch + step[STRETCH],
            principal: self.principal + step.fixed_rows::<2>(PRINCIPAL),
            kappa: self.kappa + step[KAPPA],
        }
    }

    /// A point of the rectangle's frame as stretched.
    fn stretched(&self, point: &Vector3<f64>, elastic: Elastic) -> Vector3<f64> {
        let Elastic([x, y]) = elastic;
        if self.stretch == 0.0 {
            return *point;
        }
        Vector3::new(point.x * libm::exp(x * self.stretch), point.y * libm::exp(y * self.stretch), point.z)
    }

    /// Where a point is seen; none at or behind the camera.
    pub(crate) fn project(&self, point: &Vector3<f64>, elastic: Elastic) -> Option<Vector2<f64>> {
        let turned = self.stance.rotation * self.stretched(point, elastic);
        let w = 1.0 + self.stance.scale / self.focal() * turned.z;
        let n = turned.xy() * self.stance.scale + self.stance.center - self.principal;
        let straight = n / w;
        (w > NEAREST).then(|| self.principal + straight * (1.0 + self.kappa * straight.norm_squared()))
    }

    /// Where a point is seen and how that changes with the unknowns; none at or behind the camera.
    pub(crate) fn slope(&self, point: &Vector3<f64>, elastic: Elastic) -> Option<(Vector2<f64>, Slope)> {
        let Stance { rotation, center, scale } = self.stance;
        let nearness = scale / self.focal();
        let stretched = self.stretched(point, elastic);
        let q = rotation * stretched;
        let n = q.xy() * scale + center - self.principal;
        let w = 1.0 + nearness * q.z;
        if w <= NEAREST {
            return None;
        }
        let straight = n / w;
        let bend = 1.0 + self.kappa * straight.norm_squared();
        let approach = n * (nearness / (w * w));
        let per_q = Matrix2x3::new(scale / w, 0.0, -approach.x, 0.0, scale / w, -approach.y);
        let Elastic([ex, ey]) = elastic;
        let pull = rotation * Vector3::new(ex * stretched.x, ey * stretched.y, 0.0);

        let mut slope = Slope::zeros();
        slope.fixed_columns_mut::<3>(0).copy_from(&(per_q * -q.cross_matrix()));
        for axis in 0..2 {
            slope[(axis, CENTER + axis)] = 1.0 / w;
            slope[(axis, PRINCIPAL + axis)] = -1.0 / w;
        }
        slope.set_column(LN_SCALE, &(q.xy() * (scale / w) - approach * q.z));
        slope.set_column(LN_FOCAL, &(approach * q.z));
        slope.set_column(STRETCH, &(per_q * pull));
        if self.kappa != 0.0 {
            let bent = Matrix3::identity().fixed_view::<2, 2>(0, 0) * bend
                + straight * straight.transpose() * (2.0 * self.kappa);
            slope = bent * slope;
        }
        for axis in 0..2 {
            slope[(axis, PRINCIPAL + axis)] += 1.0;
        }
        slope.set_column(KAPPA, &(straight * straight.norm_squared()));
        Some((self.principal + straight * bend, slope))
    }

    /// Logarithm of the camera's height over the surface and how it changes with the unknowns; none below it.
    pub(crate) fn ln_height(&self) -> Option<(f64, Unknowns)> {
        let t = self.translation();
        let normal: Vector3<f64> = self.stance.rotation.column(2).into();
        let height = -normal.dot(&t);
        let mut slope = Unknowns::zeros();
        slope.fixed_rows_mut::<3>(0).copy_from(&-normal.cross(&t));
        for axis in 0..2 {
            slope[CENTER + axis] = -normal[axis] / self.stance.scale;
            slope[PRINCIPAL + axis] = normal[axis] / self.stance.scale;
        }
        slope[LN_SCALE] = -height;
        slope[LN_FOCAL] = -normal.z * t.z;
        (height > 0.0).then(|| (libm::log(height), slope / height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rotation = Rotation3::from_euler_angles(0.4, -0.3, 0.8).into_inner() * flip;
        let stance = Stance { rotation, center: Vector2::new(0.2, -0.1), scale: 0.6 };
        let mut state = State::new(stance, 1.3, 0.02);
        (state.stretch, state.principal) = (0.03, Vector2::new(0.01, -0.02));
        state
    }

    /// The change of a value per unknown, by central differences.
    fn differences<const N: usize>(value: impl Fn(&State) -> SVector<f64, N>) -> SMatrix<f64, N, UNKNOWNS> {
        const H: f64 = 1e-6;
        let step = |i: usize, h: f64| {
            let mut step = Unknowns::zeros();
            step[i] = h;
            value(&state().stepped(&step))
        };
        SMatrix::from_columns(&std::array::from_fn::<_, UNKNOWNS, _>(|i| (step(i, H) - step(i, -H)) / (2.0 * H)))
    }

    #[test]
    fn slopes_agree_with_differences() {
        for elastic in [Elastic::BOTH, Elastic::HEIGHT, Elastic::WIDTH, Elastic::RIGID] {
            let point = Vector3::new(0.5, -0.4, 0.2);
            let (seen, slope) = state().slope(&point, elastic).unwrap();
            assert!((seen - state().project(&point, elastic).unwrap()).norm() < 1e-15);
            let expected = differences(|s| s.project(&point, elastic).unwrap());
            assert!((slope - expected).abs().max() < 1e-9, "{}", slope - expected);
        }
    }

    #[test]
    fn the_slope_of_the_height_agrees_with_differences() {
        let expected = differences(|s| SVector::<f64, 1>::new(s.ln_height().unwrap().0));
        let (_, slope) = state().ln_height().unwrap();
        assert!((slope.transpose() - expected).abs().max() < 1e-9);
    }

    #[test]
    fn a_point_behind_the_camera_is_not_seen() {
        let behind = Vector3::new(0.0, 0.0, 1e3);
        assert!(state().project(&behind, Elastic::RIGID).is_none() && state().slope(&behind, Elastic::RIGID).is_none());
    }
}
