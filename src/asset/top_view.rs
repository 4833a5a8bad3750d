//! A rectangle over a screen as it is seen from straight above.

use super::screen_pose::{ScreenPose, scale_unknown};
use crate::camera::{Camera, rectify};
use crate::error::Result;
use crate::filter::Pyramid;
use crate::geom::{Point2, Point3, Pose, UnitQuaternion, Vector3};
use crate::image::Image;
use crate::pixel::LinearRgb;

/// What is drawn in from the border of the screen, as a share of its sides: edges and worn corners.
const SCREEN_INSET: f64 = 0.02;
/// A camera looks less steeply at a screen than this, as the sine of the angle, or its photo is not for measuring.
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
        // Lines of sight to a rectangle pass a plane above it in a smaller rectangle, nearer to below the camera.
        let (center, share) = (pose.camera.center(), height / pose.camera.center().z);
        let middle = Vector3::new(center.x * share, center.y * share, height);
        let size = pose
            .size
            .map(|side| (1.0 - share) * (1.0 - 2.0 * SCREEN_INSET) * side);
        Self::new(
            pose,
            Pose::from_parts(middle.into(), UnitQuaternion::identity()),
            size,
        )
    }

    /// The largest part of a photo that is an upright rectangle in the plane, too.
    pub(super) fn of_photo(pose: ScreenPose, height: f64) -> Result<Self> {
        let PhotoFootprint { corners, across } = PhotoFootprint::new(&pose.camera, height)
            .ok_or_else(|| scale_unknown("the camera looks along it; photograph it from above"))?;
        let turn =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), libm::atan2(across.y, across.x));
        let corners = corners.map(|corner| turn.inverse() * corner.coords);
        let [x0, x1] = middle_two(corners.map(|c| c.x));
        let [y0, y1] = middle_two(corners.map(|c| c.y));
        let middle = turn * Vector3::new((x0 + x1) / 2.0, (y0 + y1) / 2.0, height);
        Ok(Self::new(
            pose,
            Pose::from_parts(middle.into(), turn),
            [x1 - x0, y1 - y0],
        ))
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
        if self
            .size
            .iter()
            .any(|side| side * self.px_per_metre < MIN_SIDE_PX)
        {
            return Err(scale_unknown("its corners leave nothing of the photo"));
        }
        let camera = &self.pose.camera;
        let camera = Camera {
            camera_from_world: camera.camera_from_world * self.screen_from_view,
            ..*camera
        };
        let camera = camera.resized(size_px(&photo));
        rectify(&Pyramid::new(photo), &camera, self.size, self.px_per_metre)
    }

    /// Standard error of a length at a pixel of the view, as a share.
    pub(super) fn sigma(&self, at: Point2<f64>) -> f64 {
        let [x, y] = [
            at.x / self.px_per_metre - self.size[0] / 2.0,
            self.size[1] / 2.0 - at.y / self.px_per_metre,
        ];
        self.pose
            .sigma(self.screen_from_view * Point3::new(x, y, 0.0))
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
        let place = |x: f64, y: f64| place_at_height(camera, Point2::new(x, y), height);
        let corners = [
            place(0.0, 0.0)?,
            place(w, 0.0)?,
            place(w, h)?,
            place(0.0, h)?,
        ];
        let middle = place(w / 2.0, h / 2.0)?;
        let across = place(w / 2.0 + 1.0, h / 2.0)? - middle;
        Some(Self { corners, across })
    }
}

/// What a pixel shows of a plane at a height over the screen; none where the camera looks along the plane.
fn place_at_height(camera: &Camera, pixel: Point2<f64>, height: f64) -> Option<Point3<f64>> {
    let ray = camera.ray(pixel);
    let sine = -ray.direction.normalize().z;
    (sine > MIN_SINE_TO_SCREEN).then(|| ray.at((height - ray.origin.z) / ray.direction.z))
}

fn middle_two(mut values: [f64; 4]) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [values[1], values[2]]
}

/// The finer of the photo's scales in the middle of a view, pixels per metre: nothing of the photo is lost.
fn finest_scale(camera: &Camera, screen_from_view: Pose, size: [f64; 2]) -> f64 {
    let step = SCALE_STEP * size[0].min(size[1]);
    let pixel = |x: f64, y: f64| {
        camera
            .project(screen_from_view * Point3::new(x, y, 0.0))
            .map_or(Point2::origin(), |(pixel, _)| pixel)
    };
    [
        pixel(step, 0.0) - pixel(-step, 0.0),
        pixel(0.0, step) - pixel(0.0, -step),
    ]
    .map(|along| along.norm() / (2.0 * step))
    .into_iter()
    .fold(0.0, f64::max)
}

/// Width and height of a photo, pixels.
pub(super) fn size_px(photo: &Image<LinearRgb>) -> [u32; 2] {
    [photo.width() as u32, photo.height() as u32]
}
