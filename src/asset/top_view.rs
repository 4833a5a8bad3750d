//! A rectangle over a screen, seen from straight above.

use super::screen_pose::{ScreenPose, scale_unknown};
use crate::camera::{Camera, rectify};
use crate::error::Result;
use crate::filter::Pyramid;
use crate::geom::{Point2, Point3, Pose, UnitQuaternion, Vector3};
use crate::image::Image;
use crate::pixel::LinearRgb;

/// What is drawn in from the border of the screen, as a share of its sides: edges and worn corners.
const SCREEN_INSET: f64 = 0.02;
/// A camera looks less steeply at a screen than this, as the sine of the angle, or its photo is not
/// for measuring.
const MIN_SINE_TO_SCREEN: f64 = 0.25;
/// Shortest side that can hold an object and its background, pixels.
const MIN_SIDE_PX: f64 = 16.0;
/// Step over which the scale of a photo is measured, as a share of the view's shorter side.
const SCALE_STEP: f64 = 1e-4;

/// A rectangle at the height of an object, seen from straight above.
pub(super) struct TopView {
    pub(super) pose: ScreenPose,
    /// Where the rectangle lies: its own plane `z = 0`, centred.
    screen_from_view: Pose,
    size: [f64; 2],
    pub(super) px_per_metre: f64,
}

impl TopView {
    /// What is seen over the inside of a screen.
    pub(super) fn of_screen(pose: ScreenPose, height: f64) -> Self {
        // Lines of sight to a rectangle pass a plane above it in a smaller rectangle, nearer to
        // below the camera.
        let (center, share) = (pose.camera.center(), height / pose.camera.center().z);
        let middle = Vector3::new(center.x * share, center.y * share, height);
        let seen = (1.0 - share) * (1.0 - 2.0 * SCREEN_INSET);
        let size = pose.size.map(|side| seen * side);
        let screen_from_view = Pose::from_parts(middle.into(), UnitQuaternion::identity());
        Self::new(pose, screen_from_view, size)
    }

    /// The largest part of a photo that is an upright rectangle in the plane, too.
    pub(super) fn of_photo(pose: ScreenPose, height: f64) -> Result<Self> {
        let footprint = PhotoFootprint::new(&pose.camera, height)
            .ok_or_else(|| scale_unknown("the camera looks along it; photograph it from above"))?;
        let turn = footprint.turn();
        let [[x0, x1], [y0, y1]] = footprint.inner_rectangle(&turn);
        let middle = turn * Vector3::new((x0 + x1) / 2.0, (y0 + y1) / 2.0, height);
        let screen_from_view = Pose::from_parts(middle.into(), turn);
        Ok(Self::new(pose, screen_from_view, [x1 - x0, y1 - y0]))
    }

    fn new(pose: ScreenPose, screen_from_view: Pose, size: [f64; 2]) -> Self {
        let px_per_metre = finest_scale(&pose.camera, screen_from_view, size);
        Self {
            pose,
            screen_from_view,
            size,
            px_per_metre,
        }
    }

    /// The rectangle as a photo from the same place shows it.
    pub(super) fn rectify(&self, photo: Image<LinearRgb>) -> Result<Image<LinearRgb>> {
        let mut sides_px = self.size.iter().map(|side| side * self.px_per_metre);
        if sides_px.any(|side| side < MIN_SIDE_PX) {
            return Err(scale_unknown("its corners leave too little of the photo"));
        }
        let camera = self.camera().resized(size_px(&photo));
        rectify(
            &Pyramid::new(photo),
            &camera,
            0.0,
            self.size,
            self.px_per_metre,
        )
    }

    /// The camera over the rectangle's own plane.
    fn camera(&self) -> Camera {
        let camera = &self.pose.camera;
        Camera {
            camera_from_world: camera.camera_from_world * self.screen_from_view,
            ..*camera
        }
    }

    /// Standard error of a length at a pixel of the view, as a share.
    pub(super) fn sigma(&self, at: Point2<f64>) -> f64 {
        self.pose.sigma(self.screen_from_view * self.point_at(at))
    }

    /// The point of the view's own plane at a pixel.
    fn point_at(&self, pixel: Point2<f64>) -> Point3<f64> {
        let x = pixel.x / self.px_per_metre - self.size[0] / 2.0;
        let y = self.size[1] / 2.0 - pixel.y / self.px_per_metre;
        Point3::new(x, y, 0.0)
    }
}

/// Where a photo meets the plane of its object.
struct PhotoFootprint {
    /// Of the photo's corners, in order.
    corners: [Point3<f64>; 4],
    /// From the photo's middle one pixel to the right.
    across: Vector3<f64>,
}

impl PhotoFootprint {
    /// None where the camera looks along the plane.
    fn new(camera: &Camera, height: f64) -> Option<Self> {
        let [w, h] = camera.image.map(f64::from);
        let [a, b, c, d] = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]
            .map(|at| place_at_height(camera, at.into(), height));
        let [middle, right] = [[w / 2.0, h / 2.0], [w / 2.0 + 1.0, h / 2.0]]
            .map(|at| place_at_height(camera, at.into(), height));
        Some(Self {
            corners: [a?, b?, c?, d?],
            across: right? - middle?,
        })
    }

    /// How far the photo is turned on the plane.
    fn turn(&self) -> UnitQuaternion<f64> {
        let angle = libm::atan2(self.across.y, self.across.x);
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
    }

    /// Ends along x and y, in a frame turned so, of the largest rectangle inside.
    fn inner_rectangle(&self, turn: &UnitQuaternion<f64>) -> [[f64; 2]; 2] {
        let corners = self.corners.map(|corner| turn.inverse() * corner.coords);
        [
            middle_two(corners.map(|c| c.x)),
            middle_two(corners.map(|c| c.y)),
        ]
    }
}

/// What a pixel shows of a plane at a height over the screen; none where the camera looks along the
/// plane.
fn place_at_height(camera: &Camera, pixel: Point2<f64>, height: f64) -> Option<Point3<f64>> {
    let ray = camera.ray(pixel);
    let sine = -ray.direction.normalize().z;
    (sine > MIN_SINE_TO_SCREEN).then(|| ray.at((height - ray.origin.z) / ray.direction.z))
}

fn middle_two(mut values: [f64; 4]) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [values[1], values[2]]
}

/// The finer of the photo's scales in the middle of a view, pixels per metre: nothing of the photo
/// is lost.
fn finest_scale(camera: &Camera, screen_from_view: Pose, size: [f64; 2]) -> f64 {
    let step = SCALE_STEP * size[0].min(size[1]);
    let steps = [[step, 0.0], [0.0, step]].map(|[x, y]| {
        let [ahead, behind] =
            [[x, y], [-x, -y]].map(|at| pixel_over_screen(camera, screen_from_view, at));
        (ahead - behind).norm() / (2.0 * step)
    });
    steps.into_iter().fold(0.0, f64::max)
}

/// The pixel that shows a point of a view.
fn pixel_over_screen(camera: &Camera, screen_from_view: Pose, [x, y]: [f64; 2]) -> Point2<f64> {
    let seen = camera.project(screen_from_view * Point3::new(x, y, 0.0));
    seen.map_or(Point2::origin(), |(pixel, _)| pixel)
}

/// Width and height of a photo, pixels.
pub(super) fn size_px(photo: &Image<LinearRgb>) -> [u32; 2] {
    [photo.width() as u32, photo.height() as u32]
}
