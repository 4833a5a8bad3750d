//! Where a camera sees a point, and how that changes with the unknowns.
//!
//! # Method
//! The eleven unknowns are chosen so that the one weak direction stands alone: from straight above
//! the focal length (and the principal point) has no influence on any residual while all else stays
//! well conditioned. Focal length and distance would be almost perfectly correlated; the logarithm
//! of the scale, focal length over distance, is not.

use super::rectangle::ScaledPose;
use crate::geom::Vector2;
use nalgebra::{Matrix2, Rotation3, SMatrix, SVector, Vector3};

/// Number of unknowns.
pub(crate) const UNKNOWNS: usize = 11;
/// Indices of the unknowns; rotation is 0, 1, 2.
pub(crate) const CENTER: usize = 3;
pub(crate) const LN_SCALE: usize = 5;
pub(crate) const LN_FOCAL: usize = 6;
pub(crate) const STRETCH: usize = 7;
pub(crate) const PRINCIPAL: usize = 8;
pub(crate) const KAPPA: usize = 10;
/// Points nearer to the camera's plane than this part of the rectangle's depth are not seen.
const NEAREST_DEPTH: f64 = 1e-6;

/// A value per unknown.
pub(crate) type Unknowns = SVector<f64, UNKNOWNS>;
/// A value per pair of unknowns: information or covariance.
pub(crate) type Square = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
/// Change of a picture position (a column each for x and y) per unknown.
pub(crate) type Slope = SMatrix<f64, UNKNOWNS, 2>;

/// Sets everything about an unknown to zero.
pub(crate) fn clear_unknown(square: &mut Square, unknown: usize) {
    square.row_mut(unknown).fill(0.0);
    square.column_mut(unknown).fill(0.0);
}

/// A camera over a rectangle; units as in [`camera`](super).
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub(crate) pose: ScaledPose,
    pub(crate) ln_focal: f64,
    pub(crate) focal: f64,
    /// Logarithm of what the ratio of the sides has to be multiplied by.
    pub(crate) stretch: f64,
    /// How that is shared between the sides.
    pub(crate) stretch_shares: StretchShares,
    /// What its sides become.
    pub(crate) sides: [f64; 2],
    /// Principal point, relative to where it is expected.
    pub(crate) principal: Vector2<f64>,
    /// Radial distortion.
    pub(crate) kappa: f64,
    /// OpenCV's coefficient, where it is stated: kappa then follows the focal length.
    pub(crate) k1: Option<f64>,
}

/// Which parts of the stretch go into x and into y: a measured side stays as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StretchShares([f64; 2]);

impl StretchShares {
    /// The area stays: both sides are measured.
    pub(crate) const BOTH: Self = Self([0.5, -0.5]);
    /// The width stays: only it is measured.
    pub(crate) const HEIGHT: Self = Self([0.0, -1.0]);
    /// The height stays: only it is measured.
    pub(crate) const WIDTH: Self = Self([1.0, 0.0]);
}

/// A point of known position, and where it was seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observation {
    pub(crate) point: Vector3<f64>,
    /// It was measured on its own and does not stretch with the rectangle.
    pub(crate) rigid: bool,
    pub(crate) seen: Vector2<f64>,
    /// One over the noise.
    pub(crate) weight: f64,
}

/// A point as a pinhole camera sees it.
struct PinholeView {
    /// Its offset from the rectangle's centre, in the camera's axes.
    turned: Vector3<f64>,
    /// Focal lengths per length: scale over focal length.
    nearness: f64,
    /// Its depth over that of the rectangle's centre.
    depth: f64,
    /// Where it is seen, relative to the principal point.
    position: Vector2<f64>,
}

impl ScaledPose {
    /// After the pose's part of a small step.
    #[inline]
    fn stepped(&self, step: &Unknowns) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0));
        Self {
            rotation: turn.matrix() * self.rotation,
            center: self.center + step.fixed_rows::<2>(CENTER),
            scale: self.scale * libm::exp(step[LN_SCALE]),
        }
    }

    /// The pose's part of the step that leads to another pose.
    fn step_to(&self, other: &Self) -> Unknowns {
        let turn = Rotation3::from_matrix_unchecked(other.rotation * self.rotation.transpose());
        let mut step = Unknowns::zeros();
        step.fixed_rows_mut::<3>(0).copy_from(&turn.scaled_axis());
        step.fixed_rows_mut::<2>(CENTER)
            .copy_from(&(other.center - self.center));
        step[LN_SCALE] = libm::log(other.scale / self.scale);
        step
    }
}

impl State {
    /// A camera over a rectangle that is as measured.
    pub(crate) fn new(
        pose: ScaledPose,
        focal: f64,
        k1: Option<f64>,
        stretch_shares: StretchShares,
    ) -> Self {
        Self {
            pose,
            ln_focal: libm::log(focal),
            focal,
            stretch: 0.0,
            stretch_shares,
            sides: [1.0; 2],
            principal: Vector2::zeros(),
            kappa: k1.map_or(0.0, |k1| kappa_from_k1(k1, focal)),
            k1,
        }
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

    pub(crate) fn with_ln_focal(self, ln_focal: f64) -> Self {
        let focal = libm::exp(ln_focal);
        Self {
            ln_focal,
            focal,
            kappa: self.k1.map_or(self.kappa, |k1| kappa_from_k1(k1, focal)),
            ..self
        }
    }

    fn with_stretch(self, stretch: f64) -> Self {
        let StretchShares(shares) = self.stretch_shares;
        Self {
            stretch,
            sides: shares.map(|share| libm::exp(share * stretch)),
            ..self
        }
    }

    /// Position of the rectangle's centre in the camera's frame.
    pub(crate) fn translation(&self) -> Vector3<f64> {
        (self.pose.center - self.principal).push(self.focal) / self.pose.scale
    }

    /// The camera's place over the rectangle.
    pub(crate) fn camera_center(&self) -> Vector3<f64> {
        -(self.pose.rotation.transpose() * self.translation())
    }

    /// After a small step in every unknown.
    pub(crate) fn stepped(&self, step: &Unknowns) -> Self {
        let moved = Self {
            pose: self.pose.stepped(step),
            principal: self.principal + step.fixed_rows::<2>(PRINCIPAL),
            kappa: self.kappa + step[KAPPA],
            ..*self
        };
        moved
            .with_ln_focal(self.ln_focal + step[LN_FOCAL])
            .with_stretch(self.stretch + step[STRETCH])
    }

    /// The step that leads from here to another state.
    pub(crate) fn step_to(&self, other: &Self) -> Unknowns {
        let mut step = self.pose.step_to(&other.pose);
        for unknown in LN_FOCAL..UNKNOWNS {
            step[unknown] = other.value(unknown) - self.value(unknown);
        }
        step
    }

    /// A point of the rectangle's frame as stretched.
    fn stretched(&self, point: &Vector3<f64>, rigid: bool) -> Vector3<f64> {
        let [x, y] = if rigid { [1.0; 2] } else { self.sides };
        Vector3::new(point.x * x, point.y * y, point.z)
    }

    /// Where a point is seen; none at or behind the camera.
    pub(crate) fn project(&self, point: &Vector3<f64>, rigid: bool) -> Option<Vector2<f64>> {
        let seen = self.pinhole(&self.stretched(point, rigid))?;
        Some(self.distorted(&seen.position))
    }

    /// Where a point is seen and how that changes with the unknowns; none at or behind the camera.
    pub(crate) fn slope(&self, point: &Vector3<f64>, rigid: bool) -> Option<(Vector2<f64>, Slope)> {
        let stretched = self.stretched(point, rigid);
        let seen = self.pinhole(&stretched)?;
        let per_stretch = self.stretch_derivative(&stretched, rigid);
        let near = self.pose.scale / seen.depth;
        let axes = [0, 1].map(|axis| seen.axis_slope(axis, near, &per_stretch));
        let mut slope = Slope::from_columns(&axes);
        self.distort_slope(&seen.position, &mut slope);
        Some((self.distorted(&seen.position), slope))
    }

    /// Projection without distortion; none at or behind the camera.
    #[inline]
    fn pinhole(&self, stretched: &Vector3<f64>) -> Option<PinholeView> {
        let ScaledPose {
            rotation,
            center,
            scale,
        } = self.pose;
        let nearness = scale / self.focal;
        let turned = rotation * stretched;
        let depth = 1.0 + nearness * turned.z;
        let position = (turned.xy() * scale + center - self.principal) / depth;
        (depth > NEAREST_DEPTH).then_some(PinholeView {
            turned,
            nearness,
            depth,
            position,
        })
    }

    /// Change of a stretched point per stretch, in the camera's axes.
    #[inline]
    fn stretch_derivative(&self, stretched: &Vector3<f64>, rigid: bool) -> Vector3<f64> {
        let [x, y] = if rigid {
            [0.0; 2]
        } else {
            self.stretch_shares.0
        };
        self.pose.rotation * Vector3::new(x * stretched.x, y * stretched.y, 0.0)
    }

    /// What distortion makes of the change of a position.
    #[inline]
    fn distort_slope(&self, position: &Vector2<f64>, slope: &mut Slope) {
        let r2 = position.norm_squared();
        if self.kappa != 0.0 {
            let bent = Matrix2::identity() * (1.0 + self.kappa * r2)
                + position * position.transpose() * (2.0 * self.kappa);
            *slope *= bent;
        }
        for axis in 0..2 {
            slope[(PRINCIPAL + axis, axis)] += 1.0;
            slope[(KAPPA, axis)] = position[axis] * r2;
            if self.k1.is_some() {
                slope[(LN_FOCAL, axis)] -= 2.0 * self.kappa * slope[(KAPPA, axis)];
            }
        }
    }

    /// Where the lens shows what is at a position without distortion.
    #[inline]
    fn distorted(&self, position: &Vector2<f64>) -> Vector2<f64> {
        self.principal + position * (1.0 + self.kappa * position.norm_squared())
    }

    /// Logarithm of the camera's height over the surface and how it changes with the unknowns; none
    /// below it.
    pub(crate) fn ln_height(&self) -> Option<(f64, Unknowns)> {
        let normal: Vector3<f64> = self.pose.rotation.column(2).into();
        let height = -normal.dot(&self.translation());
        (height > 0.0).then(|| {
            let slope = self.height_slope(&normal, height);
            (libm::log(height), slope / height)
        })
    }

    /// How the camera's height over a surface of this normal changes with the unknowns.
    fn height_slope(&self, normal: &Vector3<f64>, height: f64) -> Unknowns {
        let t = self.translation();
        let mut slope = Unknowns::zeros();
        slope.fixed_rows_mut::<3>(0).copy_from(&-normal.cross(&t));
        for axis in 0..2 {
            slope[CENTER + axis] = -normal[axis] / self.pose.scale;
            slope[PRINCIPAL + axis] = normal[axis] / self.pose.scale;
        }
        slope[LN_SCALE] = -height;
        slope[LN_FOCAL] = -normal.z * t.z;
        slope
    }
}

/// Radial distortion of a lens with OpenCV's coefficient, which counts in focal lengths.
pub(crate) fn kappa_from_k1(k1: f64, focal: f64) -> f64 {
    k1 / (focal * focal)
}

impl PinholeView {
    /// Change of the position along an axis; `near` is picture lengths per length at the point's
    /// depth.
    #[inline]
    fn axis_slope(&self, axis: usize, near: f64, per_stretch: &Vector3<f64>) -> Unknowns {
        let (turned, position) = (&self.turned, self.position[axis]);
        let far = self.nearness / self.depth;
        // The change of the position along this axis per change of the turned point.
        let mut per_point = Vector3::new(0.0, 0.0, -position * far);
        per_point[axis] = near;
        let mut slope = Unknowns::zeros();
        slope
            .fixed_rows_mut::<3>(0)
            .copy_from(&turned.cross(&per_point));
        slope[CENTER + axis] = 1.0 / self.depth;
        slope[LN_SCALE] = per_point.dot(turned);
        slope[LN_FOCAL] = position * far * turned.z;
        slope[STRETCH] = per_point.dot(per_stretch);
        slope[PRINCIPAL + axis] = -1.0 / self.depth;
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    fn state(stretch_shares: StretchShares) -> State {
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rotation = Rotation3::from_euler_angles(0.4, -0.3, 0.8).into_inner() * flip;
        let pose = ScaledPose {
            rotation,
            center: Vector2::new(0.2, -0.1),
            scale: 0.6,
        };
        let state = State::new(pose, 1.3, None, stretch_shares).with_stretch(0.03);
        State {
            principal: Vector2::new(0.01, -0.02),
            kappa: 0.02,
            ..state
        }
    }

    /// The change of a value per unknown, by central differences.
    fn differences<const N: usize>(
        state: State,
        value: impl Fn(&State) -> SVector<f64, N>,
    ) -> SMatrix<f64, UNKNOWNS, N> {
        const H: f64 = 1e-6;
        let step = |i: usize, h: f64| {
            let mut step = Unknowns::zeros();
            step[i] = h;
            value(&state.stepped(&step)).transpose()
        };
        SMatrix::from_rows(&std::array::from_fn::<_, UNKNOWNS, _>(|i| {
            (step(i, H) - step(i, -H)) / (2.0 * H)
        }))
    }

    #[test]
    fn slopes_agree_with_differences() {
        for (stretch_shares, rigid) in [
            (StretchShares::BOTH, false),
            (StretchShares::HEIGHT, false),
            (StretchShares::WIDTH, false),
            (StretchShares::WIDTH, true),
        ] {
            let (state, point) = (state(stretch_shares), Vector3::new(0.5, -0.4, 0.2));
            let (seen, slope) = state.slope(&point, rigid).unwrap();
            assert!((seen - state.project(&point, rigid).unwrap()).norm() < 1e-15);
            let expected = differences(state, |s| s.project(&point, rigid).unwrap());
            assert!(
                (slope - expected).abs().max() < 1e-9,
                "{}",
                slope - expected
            );
        }
    }

    #[test]
    fn a_stated_coefficient_bends_more_the_shorter_the_focal_length() {
        let free = state(StretchShares::BOTH);
        let state = State {
            k1: Some(free.kappa * free.focal * free.focal),
            ..free
        };
        let point = Vector3::new(0.5, -0.4, 0.2);
        let (_, mut slope) = state.slope(&point, false).unwrap();
        // Then it is no unknown.
        slope.row_mut(KAPPA).fill(0.0);
        let expected = differences(state, |s| s.project(&point, false).unwrap());
        assert!((slope - expected).abs().max() < 1e-9);
    }

    #[test]
    fn a_step_to_a_state_leads_there() {
        let (from, step) = (
            state(StretchShares::BOTH),
            Unknowns::from_fn(|i, _| 0.01 * (i as f64 - 4.0)),
        );
        assert!((from.step_to(&from.stepped(&step)) - step).norm() < 1e-12);
    }

    #[test]
    fn the_slope_of_the_height_agrees_with_differences() {
        let state = state(StretchShares::BOTH);
        let expected = differences(state, |s| SVector::<f64, 1>::new(s.ln_height().unwrap().0));
        let (_, slope) = state.ln_height().unwrap();
        assert!((slope - expected).abs().max() < 1e-9);
    }

    #[test]
    fn a_point_behind_the_camera_is_not_seen() {
        let (state, behind) = (state(StretchShares::BOTH), Vector3::new(0.0, 0.0, 1e3));
        assert!(state.project(&behind, true).is_none() && state.slope(&behind, true).is_none());
    }
}
