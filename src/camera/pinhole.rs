//! The pinhole camera.

use crate::geom::{Homography, Point2, Point3, Pose, Ray, UnitQuaternion, Vector2, Vector3};
use crate::image::Roi;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A pinhole camera without distortion: where it stands and how it maps the world to pixels.
///
/// Axes are x right, y down, z forward; `camera_from_world` maps world metres into that frame.
/// Pixel conventions are those of [`geom`](crate::geom).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// Focal lengths along x and y, pixels; equal for square pixels.
    pub focal_px: Vector2<f64>,
    /// Principal point, pixels from the picture's top-left corner.
    pub principal_px: Point2<f64>,
    /// Pose of the world in the camera's frame.
    pub camera_from_world: Pose,
}

impl Camera {
    /// A camera straight above the centre of the surface, the picture's top towards `+y`.
    ///
    /// `height` is in metres; the principal point is the middle of the picture, `image` its width
    /// and height in pixels.
    ///
    /// # Panics
    /// When `height` is not above 0: from below it would look up.
    ///
    /// ```
    /// use petcomp::Camera;
    /// use petcomp::geom::Point3;
    /// let camera = Camera::looking_down(1.0, 800.0, [640, 480]);
    /// let (px, depth) = camera.project(Point3::new(0.1, 0.0, 0.0)).unwrap();
    /// assert!((px.x - 400.0).abs() < 1e-9 && (px.y - 240.0).abs() < 1e-9 && depth == 1.0);
    /// ```
    pub fn looking_down(height: f64, focal_px: f64, image: [u32; 2]) -> Self {
        assert!(height > 0.0, "height: {height}, expected above 0 (metres)");
        Self::look_at(
            Point3::new(0.0, 0.0, height),
            Point3::origin(),
            focal_px,
            image,
        )
    }

    /// A camera at `eye` that looks at `target`, upright: `+z` of the world is up in the picture,
    /// or `+y` where the camera looks straight down or up.
    ///
    /// ```
    /// use petcomp::Camera;
    /// use petcomp::geom::Point3;
    /// let camera = Camera::look_at(Point3::new(0.0, -1.0, 1.0), Point3::origin(), 800.0, [640, 480]);
    /// assert!((camera.tilt().to_degrees() - 45.0).abs() < 1e-9);
    /// ```
    pub fn look_at(eye: Point3<f64>, target: Point3<f64>, focal_px: f64, image: [u32; 2]) -> Self {
        let rotation = upright_rotation(&(target - eye));
        Self {
            image,
            focal_px: [focal_px; 2].into(),
            principal_px: image.map(|side| f64::from(side) / 2.0).into(),
            camera_from_world: Pose::from_parts((-(rotation * eye.coords)).into(), rotation),
        }
    }

    /// The camera's centre in the world.
    pub fn center(&self) -> Point3<f64> {
        self.camera_from_world
            .inverse_transform_point(&Point3::origin())
    }

    /// Pixel position and depth (metres along the optical axis) of a world point; none at or behind
    /// the camera.
    pub fn project(&self, world: Point3<f64>) -> Option<(Point2<f64>, f64)> {
        let c = self.camera_from_world * world;
        let px = Point2::new(c.x / c.z * self.focal_px.x, c.y / c.z * self.focal_px.y)
            + self.principal_px.coords;
        (c.z > 0.0).then_some((px, c.z))
    }

    /// The ray through a pixel position. Its parameter *is* the depth along the optical axis, in
    /// metres.
    pub fn ray(&self, px: Point2<f64>) -> Ray {
        let d = (px - self.principal_px).component_div(&self.focal_px);
        Ray {
            origin: self.center(),
            direction: self.camera_from_world.rotation.inverse() * d.push(1.0),
        }
    }

    /// Angle between the optical axis and the normal of the surface `z = 0`, radians; 0 looks
    /// straight down.
    pub fn tilt(&self) -> f64 {
        let axis = self.camera_from_world.rotation.inverse() * Vector3::z();
        libm::acos((-axis.z).clamp(-1.0, 1.0))
    }

    /// Height above the surface, metres.
    pub(crate) fn height_m(&self) -> f64 {
        self.center().z
    }

    pub(crate) fn tilt_deg(&self) -> f64 {
        self.tilt().to_degrees()
    }

    /// The matrix K of focal lengths and principal point.
    pub fn intrinsics(&self) -> Matrix3<f64> {
        let (f, c) = (self.focal_px, self.principal_px);
        Matrix3::new(f.x, 0.0, c.x, 0.0, f.y, c.y, 0.0, 0.0, 1.0)
    }

    /// Surface metres (`z = 0`) to pixels.
    pub fn pixel_from_surface(&self) -> Homography {
        let r = self.camera_from_world.rotation.to_rotation_matrix();
        let (r, t) = (r.matrix(), self.camera_from_world.translation.vector);
        let plane = Matrix3::from_columns(&[r.column(0).into(), r.column(1).into(), t]);
        Homography(self.intrinsics() * plane)
    }

    /// The same view with so many pixels more on every side.
    pub(crate) fn widened(&self, margin_px: u32) -> Self {
        Self {
            image: self.image.map(|side| side + 2 * margin_px),
            principal_px: self.principal_px + Vector2::repeat(f64::from(margin_px)),
            ..*self
        }
    }

    /// The same view taken at another picture size: what the camera becomes when its picture is
    /// resized.
    pub fn resized(&self, image: [u32; 2]) -> Self {
        let [from, to] = [self.image, image].map(|size| Vector2::from(size.map(f64::from)));
        let k = to.component_div(&from);
        Self {
            image,
            focal_px: self.focal_px.component_mul(&k),
            principal_px: self.principal_px.coords.component_mul(&k).into(),
            ..*self
        }
    }

    /// The camera of a part of its picture.
    pub(crate) fn cropped(&self, part: Roi) -> Self {
        Self {
            image: [part.width as u32, part.height as u32],
            principal_px: self.principal_px - Vector2::new(part.x as f64, part.y as f64),
            ..*self
        }
    }

    /// The camera of the middle of its picture in the shape of another picture, at that one's size.
    pub(crate) fn covering(&self, image: [u32; 2]) -> Self {
        self.cropped(Roi::middle_of(self.image, image))
            .resized(image)
    }
}

/// The camera's axes when it looks along a direction, upright.
fn upright_rotation(forward: &Vector3<f64>) -> UnitQuaternion<f64> {
    let is_vertical = forward.cross(&Vector3::z()).norm() < 1e-9 * forward.norm();
    let up = if is_vertical {
        Vector3::y()
    } else {
        Vector3::z()
    };
    UnitQuaternion::look_at_lh(forward, &-up)
}

/// Diagonal of a picture of some size.
pub(super) fn diagonal_px([width, height]: [u32; 2]) -> f64 {
    libm::hypot(f64::from(width), f64::from(height))
}

/// OpenCV's k1 of a camera whose radial distortion is known by half the picture's diagonal, as
/// [`Solution::kappa`](super::Solution::kappa) is.
pub(crate) fn k1_from_kappa(camera: &Camera, kappa: f64) -> f64 {
    kappa * (2.0 * camera.focal_px.x / diagonal_px(camera.image)).powi(2)
}

/// Where a point is seen through a lens with distortion; not finite behind the camera.
pub fn distorted(camera: &Camera, kappa: f64, point: Point3<f64>) -> Point2<f64> {
    let half = diagonal_px(camera.image) / 2.0;
    let Some((px, _)) = camera.project(point) else {
        return Point2::new(f64::NAN, f64::NAN);
    };
    let off = px - camera.principal_px;
    camera.principal_px + off * (1.0 + kappa * (off / half).norm_squared())
}

/// Pieces of a straight line in space, where a lens bends it.
const PIECES: usize = 12;

/// Where a straight line in space is seen through a lens with distortion; none where a part is
/// behind the camera.
pub(super) fn distorted_line(
    camera: &Camera,
    kappa: f64,
    [a, b]: [Point3<f64>; 2],
) -> Option<Vec<Point2<f64>>> {
    let pieces = if kappa == 0.0 { 1 } else { PIECES };
    let points = (0..=pieces).map(|i| a + (b - a) * (i as f64 / pieces as f64));
    let seen: Vec<_> = points.map(|p| distorted(camera, kappa, p)).collect();
    let is_seen = |px: &Point2<f64>| px.x.is_finite() && px.y.is_finite();
    seen.iter().all(is_seen).then_some(seen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tilted_camera;
    use crate::geom::Plane;

    /// Turned about all three axes.
    fn rolled_camera() -> Camera {
        let level = tilted_camera();
        let roll = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.7);
        Camera {
            camera_from_world: roll * level.camera_from_world,
            ..level
        }
    }

    #[test]
    #[should_panic(expected = "height: -1, expected above 0 (metres)")]
    fn no_camera_below_the_surface_looks_down() {
        Camera::looking_down(-1.0, 80.0, [64, 48]);
    }

    #[test]
    fn a_pixel_s_ray_projects_back_to_it() {
        let cam = rolled_camera();
        let px = Point2::new(123.4, 32.1);
        let (back, depth) = cam.project(cam.ray(px).at(0.8)).expect("in front");
        assert!((back - px).norm() < 1e-10 && (depth - 0.8).abs() < 1e-12);
    }

    #[test]
    fn the_homography_agrees_with_projection() {
        let cam = rolled_camera();
        let (px, _) = cam.project(Point3::new(0.2, -0.1, 0.0)).expect("in front");
        assert!((cam.pixel_from_surface().map(Point2::new(0.2, -0.1)) - px).norm() < 1e-10);
    }

    #[test]
    fn resizing_keeps_the_view() {
        let (cam, p) = (rolled_camera(), Point3::new(0.1, 0.05, 0.02));
        let half = cam.resized([80, 60]);
        let (a, b) = (
            cam.project(p).expect("in front").0,
            half.project(p).expect("in front").0,
        );
        assert!((a / 2.0 - b).norm() < 1e-10);
    }

    #[test]
    fn tilt_is_measured_from_straight_down() {
        let cam = rolled_camera();
        let ray = cam.ray(cam.principal_px);
        assert!(Plane::surface().intersect(&ray).is_some());
        let cos = ray.direction.normalize().dot(&-Vector3::z());
        assert!((cam.tilt() - cos.acos()).abs() < 1e-9);
    }
}
