//! The radial distortion of a lens: from where a pinhole camera sees a point to where the picture
//! shows it, and back.

use super::pinhole::Camera;
use crate::bounds::number;
use crate::error::{Error, Result};
use crate::geom::{Point2, Vector2};
use nalgebra::{Matrix2, Matrix3};

/// Newton's steps until the radius stays: it is a root of a cubic, approached from one side.
const MAX_STEPS: usize = 60;
/// Relative change of the radius that counts as none.
const CONVERGED: f64 = 1e-15;
/// Change of a radius, as a share of it, at the fold of a barrel.
const SHARE_AT_FOLD: f64 = -1.0 / 3.0;
/// The part of a barrel's radius up to its fold that a picture may use: three fifths of the
/// resolution are left there at the corners.
const USED_PART_OF_FOLD: f64 = 0.77;

/// OpenCV's k1 at work in a picture: a point that a pinhole camera sees at `x` focal lengths from
/// the principal point is shown at `x (1 + k1 |x|^2)`.
///
/// In focal lengths, so that the same number holds for every size and part of a photo. A negative
/// k1 is a barrel, a positive one a pincushion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialDistortion {
    focal_px: Vector2<f64>,
    principal_px: Point2<f64>,
    image: [f64; 2],
    k1: f64,
}

impl RadialDistortion {
    /// What a lens of this k1 does to the pictures of a camera.
    pub fn new(camera: &Camera, k1: f64) -> Self {
        Self {
            focal_px: camera.focal_px,
            principal_px: camera.principal_px,
            image: camera.image.map(f64::from),
            k1,
        }
    }

    /// Whether it moves nothing.
    pub fn is_none(&self) -> bool {
        self.k1 == 0.0
    }

    /// Where the picture shows what a pinhole camera sees at a position. Beyond where the lens
    /// folds the picture over, which it does not show, farther out at the fold's scale.
    pub fn distort(&self, px: Point2<f64>) -> Point2<f64> {
        let x = self.in_focal_lengths(px);
        let share = (self.k1 * x.norm_squared()).max(SHARE_AT_FOLD);
        self.in_pixels(x * (1.0 + share))
    }

    /// Where a pinhole camera sees what the picture shows at a position. Beyond where the lens
    /// folds the picture over, the fold.
    pub fn undistort(&self, px: Point2<f64>) -> Point2<f64> {
        if self.is_none() {
            return px;
        }
        let x = self.in_focal_lengths(px);
        let shown = x.norm();
        if shown == 0.0 {
            return px;
        }
        self.in_pixels(x * (self.undistorted_radius(shown) / shown))
    }

    /// The affine map that [`undistort`](Self::undistort) is close to a position, for `(x, y, 1)`.
    pub(crate) fn undistort_near(&self, px: Point2<f64>) -> Matrix3<f64> {
        let slope = self.undistort_slope(px);
        let offset = self.undistort(px) - slope * px;
        let [along_x, along_y] = [slope.column(0), slope.column(1)];
        Matrix3::from_columns(&[along_x.push(0.0), along_y.push(0.0), offset.push(1.0)])
    }

    /// The picture shows what a pinhole camera sees at a position: it is not beyond the fold.
    pub(super) fn shows(&self, px: Point2<f64>) -> bool {
        self.in_focal_lengths(px).norm() < self.fold()
    }

    /// How many pixels of the picture a pixel of a pinhole camera is at a position of its, along both
    /// axes.
    pub(super) fn distort_slope(&self, px: Point2<f64>) -> Matrix2<f64> {
        self.slope_in_pixels(&self.slope_in_focal_lengths(px))
    }

    fn slope_in_focal_lengths(&self, px: Point2<f64>) -> Matrix2<f64> {
        let x = self.in_focal_lengths(px);
        Matrix2::identity() * self.growth(x.norm()) + x * x.transpose() * (2.0 * self.k1)
    }

    /// How many pixels of a pinhole camera a pixel of the picture is at a position, along both
    /// axes.
    pub(super) fn undistort_slope(&self, px: Point2<f64>) -> Matrix2<f64> {
        let bent = self.slope_in_focal_lengths(self.undistort(px));
        self.slope_in_pixels(&bent.try_inverse().unwrap_or_else(Matrix2::identity))
    }

    fn slope_in_pixels(&self, slope: &Matrix2<f64>) -> Matrix2<f64> {
        let [fx, fy] = [self.focal_px.x, self.focal_px.y];
        Matrix2::new(
            slope[(0, 0)],
            slope[(0, 1)] * fx / fy,
            slope[(1, 0)] * fy / fx,
            slope[(1, 1)],
        )
    }

    /// Least and largest position, along both axes, at which a pinhole camera sees what is in the
    /// picture.
    pub fn undistorted_bounds(&self) -> [Point2<f64>; 2] {
        let seen = self.outermost().map(|px| self.undistort(px));
        let low = seen.iter().fold(seen[0], |low, px| low.inf(px));
        let high = seen.iter().fold(seen[0], |high, px| high.sup(px));
        [low, high]
    }

    /// Where the picture's edges are farthest from the principal point, and nearest to it: a radius
    /// grows by a share that rises or falls with it.
    fn outermost(&self) -> [Point2<f64>; 8] {
        let [w, h] = self.image;
        let c = self.principal_px;
        let (x, y) = (c.x.clamp(0.0, w), c.y.clamp(0.0, h));
        [
            [0.0, 0.0],
            [w, 0.0],
            [w, h],
            [0.0, h],
            [x, 0.0],
            [x, h],
            [0.0, y],
            [w, y],
        ]
        .map(Point2::from)
    }

    /// The picture's radius that is farthest from the principal point, focal lengths.
    pub fn reach(&self) -> f64 {
        let radii = self.outermost().map(|px| self.in_focal_lengths(px).norm());
        radii.into_iter().fold(0.0, f64::max)
    }

    /// The largest change, per pixel, of how far a pixel moves by a pixel: what bends a straight
    /// line.
    pub fn curvature(&self) -> f64 {
        let focal = self.focal_px.min();
        let radius = self.undistorted_radius(self.reach());
        let slope = self.slope(radius).min(1.0);
        6.0 * self.k1.abs() * radius / (focal * slope.powi(3))
    }

    /// The radius that the lens shows at a radius, focal lengths; where the picture folds, the
    /// fold's.
    ///
    /// # Method
    /// Newton from the radius itself: the cubic is convex for a pincushion, where that is beyond
    /// the root, and concave for a barrel, where it is before it, so that no step passes the root.
    fn undistorted_radius(&self, shown: f64) -> f64 {
        let fold = self.fold();
        // A fold is shown at two thirds of its radius.
        if shown >= 2.0 / 3.0 * fold {
            return fold;
        }
        let mut radius = shown;
        for _ in 0..MAX_STEPS {
            let step = (radius * self.growth(radius) - shown) / self.slope(radius);
            radius -= step;
            if step.abs() <= CONVERGED * radius {
                break;
            }
        }
        radius
    }

    /// The radius beyond which a barrel shows points no farther out, focal lengths.
    pub fn fold(&self) -> f64 {
        if self.k1 < 0.0 {
            (-1.0 / (3.0 * self.k1)).sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// What a radius is multiplied by.
    fn growth(&self, radius: f64) -> f64 {
        1.0 + self.k1 * radius * radius
    }

    /// Change of the radius shown per radius.
    fn slope(&self, radius: f64) -> f64 {
        1.0 + 3.0 * self.k1 * radius * radius
    }

    fn in_focal_lengths(&self, px: Point2<f64>) -> Vector2<f64> {
        (px - self.principal_px).component_div(&self.focal_px)
    }

    fn in_pixels(&self, x: Vector2<f64>) -> Point2<f64> {
        self.principal_px + x.component_mul(&self.focal_px)
    }
}

/// The least k1 of a lens that took the pictures of a camera: beyond, their corners fold over.
pub(crate) fn least_k1(camera: &Camera) -> f64 {
    let used = USED_PART_OF_FOLD;
    least_k1_with(camera, used * (1.0 - used * used / 3.0))
}

/// The same of a lens by which straight pictures of a camera are bent.
pub(crate) fn least_bending_k1(camera: &Camera) -> f64 {
    least_k1_with(camera, USED_PART_OF_FOLD)
}

/// With which the corners are at this part of the fold's radius.
fn least_k1_with(camera: &Camera, part: f64) -> f64 {
    let reach = RadialDistortion::new(camera, 0.0).reach();
    -(part / reach).powi(2) / 3.0
}

/// Fails on a k1 that is less than the least one.
pub(crate) fn check_fold(at: &str, k1: f64, least: f64) -> Result<()> {
    if k1 >= least {
        return Ok(());
    }
    let shown = number((1e6 * k1).round() / 1e6);
    let what = format!(
        "{shown}, expected at least {least:.3}: below it, the corners of this camera's pictures fold over, or nearly do"
    );
    Err(Error::value(at, what))
}

/// Checks that a lens of this k1 can have taken the pictures of a camera that was solved with it.
///
/// # Errors
/// [`Error::Value`] for a barrel that folds their corners over, or a pincushion that shows them at
/// more than twice their distance from the principal point.
pub fn check_lens(camera: &Camera, k1: f64) -> Result<()> {
    check_fold("camera.k1", k1, least_k1(camera))?;
    let reach = RadialDistortion::new(camera, 0.0).reach();
    check_pincushion(k1, 4.0 / (reach * reach))
}

/// Fails on a k1 that is more than the largest one.
fn check_pincushion(k1: f64, most: f64) -> Result<()> {
    if k1 <= most {
        return Ok(());
    }
    let what = format!(
        "{}, expected at most {most:.3}: above it, this camera's pictures would show their corners at more than twice the \
         distance from the principal point",
        number(k1)
    );
    Err(Error::value("camera.k1", what))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::camera::pinhole::k1_from_kappa;
    use crate::camera::simulate::Scenario;
    use crate::camera::{SolveOptions, distorted, solve};
    use crate::geom::{Point3, Vector3};

    const LENSES: [f64; 5] = [-0.3, -0.02, 0.0, 0.05, 0.4];

    /// A tilted camera whose pixels are not square and whose principal point is off the middle.
    pub(crate) fn camera() -> Camera {
        let level = Camera::look_at(
            Point3::new(0.1, -0.4, 1.2),
            Point3::new(0.02, 0.03, 0.0),
            150.0,
            [160, 120],
        );
        Camera {
            focal_px: Vector2::new(150.0, 170.0),
            principal_px: Point2::new(77.0, 64.0),
            ..level
        }
    }

    fn positions() -> impl Iterator<Item = Point2<f64>> {
        (0..=16).flat_map(|i| (0..=12).map(move |j| Point2::new(10.0 * i as f64, 10.0 * j as f64)))
    }

    #[test]
    fn a_pincushion_is_one_that_a_lens_can_have() {
        let reach = RadialDistortion::new(&camera(), 0.0).reach();
        let most = 4.0 / (reach * reach);
        // Where the radius shown is twice the real one.
        let lens = RadialDistortion::new(&camera(), most);
        assert!((reach / lens.undistorted_radius(reach) - 2.0).abs() < 1e-6);
        assert!(check_lens(&camera(), 0.999 * most).is_ok());
        let told = check_lens(&camera(), 1.001 * most).unwrap_err().to_string();
        assert!(told.contains("expected at most"), "{told}");
    }

    #[test]
    fn there_and_back_is_where_it_was() {
        for k1 in LENSES {
            let lens = RadialDistortion::new(&camera(), k1);
            for px in positions() {
                let back = lens.distort(lens.undistort(px));
                assert!((back - px).norm() < 1e-11, "{k1}: {px} {back}");
            }
        }
    }

    #[test]
    fn it_is_opencv_s_k1() {
        // x' = x / z, x'' = x' (1 + k1 r^2), u = fx x'' + cx: OpenCV's documentation of calib3d.
        let (camera, k1) = (camera(), -0.2);
        let seen = camera.camera_from_world * Point3::new(0.3, 0.2, 0.05);
        let (x, y) = (seen.x / seen.z, seen.y / seen.z);
        let growth = 1.0 + k1 * (x * x + y * y);
        let expected = Point2::new(150.0 * x * growth + 77.0, 170.0 * y * growth + 64.0);
        let (ideal, _) = camera.project(Point3::new(0.3, 0.2, 0.05)).unwrap();
        let found = RadialDistortion::new(&camera, k1).distort(ideal);
        assert!((found - expected).norm() < 1e-11, "{found} {expected}");
    }

    #[test]
    fn a_solved_camera_and_the_pictures_share_a_lens() {
        let mut label = Scenario::default().tilted(25.0).view(1, 0).label;
        label.camera.k1 = Some(-0.05);
        let solution = solve(&label, &SolveOptions::default()).unwrap();
        let k1 = k1_from_kappa(&solution.camera, solution.kappa);
        assert!((k1 + 0.05).abs() < 1e-4, "{k1}");
        let lens = RadialDistortion::new(&solution.camera, k1);
        for at in [[0.2, 0.1, 0.0], [-0.3, 0.2, 0.05]] {
            let world = Point3::from(at);
            let (ideal, _) = solution.camera.project(world).unwrap();
            let solved = distorted(&solution.camera, solution.kappa, world);
            assert!((lens.distort(ideal) - solved).norm() < 1e-8, "{solved}");
        }
    }

    #[test]
    fn a_size_and_a_part_of_a_photo_have_the_same_k1() {
        let (photo, k1) = (camera(), -0.2);
        let half = photo.resized([80, 60]);
        let part = Camera {
            principal_px: photo.principal_px - Vector2::new(30.0, 20.0),
            ..photo
        };
        for px in positions() {
            let seen = RadialDistortion::new(&photo, k1).distort(px);
            let small = RadialDistortion::new(&half, k1).distort(px / 2.0);
            assert!((small - seen / 2.0).norm() < 1e-11);
            let moved = Vector2::new(30.0, 20.0);
            let inside = RadialDistortion::new(&part, k1).distort(px - moved);
            assert!((inside + moved - seen).norm() < 1e-11);
        }
    }

    #[test]
    fn the_affine_map_is_the_tangent() {
        for k1 in LENSES {
            let lens = RadialDistortion::new(&camera(), k1);
            for px in positions() {
                let map = lens.undistort_near(px);
                for step in [Vector2::new(0.5, 0.0), Vector2::new(-0.3, 0.4)] {
                    let near = map * (px + step).to_homogeneous();
                    let off = (near.xy() - lens.undistort(px + step).coords).norm();
                    let bound = 0.5 * lens.curvature() * step.norm_squared();
                    assert!(off <= bound * 1.2 + 1e-11, "{k1}: {px}: {off} {bound}");
                    assert_eq!(near.z, 1.0);
                }
            }
        }
    }

    #[test]
    fn bounds_hold_all_that_is_seen_and_nothing_more() {
        for k1 in LENSES {
            let lens = RadialDistortion::new(&camera(), k1);
            let [low, high] = lens.undistorted_bounds();
            let seen: Vec<_> = positions().map(|px| lens.undistort(px)).collect();
            assert!(
                seen.iter()
                    .all(|p| p.x >= low.x - 1e-9 && p.x <= high.x + 1e-9)
            );
            assert!(
                seen.iter()
                    .all(|p| p.y >= low.y - 1e-9 && p.y <= high.y + 1e-9)
            );
            let least = seen.iter().fold(f64::MAX, |m, p| m.min(p.x));
            assert!((least - low.x).abs() < 0.1, "{k1}: {least} {low}");
        }
    }

    #[test]
    fn what_a_barrel_cannot_show_is_farther_out_than_what_it_shows() {
        let lens = RadialDistortion::new(&camera(), -0.3);
        let along = (0..400).map(|i| lens.distort(Point2::new(77.0 + f64::from(i), 64.0)).x);
        assert!(along.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn a_barrel_folds_where_its_slope_ends() {
        let lens = RadialDistortion::new(&camera(), -3.0);
        assert!((lens.fold() - 1.0 / 3.0).abs() < 1e-12);
        let beyond = lens.undistort(Point2::new(1000.0, 64.0));
        assert!(
            (beyond - Point2::new(127.0, 64.0)).norm() < 1e-9,
            "{beyond}"
        );
        let away = Vector3::new(0.0, 0.0, 1.0);
        assert!(lens.undistort_near(camera().principal_px).row(2) == away.transpose());
    }
}
