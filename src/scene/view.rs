//! The part of a photo that a picture shows: zoom, shift and rotation of plate and camera together.

use crate::camera::Camera;
use crate::error::Result;
use crate::geom::{Point2, Pose, UnitQuaternion, Vector2, Vector3};
use crate::image::Image;
use crate::scene::bounds::{SHIFT, TURN, ZOOM};
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// The visible part of the photo; the default is all of it.
///
/// What is outside the photo is never visible: a rotation zooms in as far as necessary.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct View {
    /// Magnification relative to the whole photo, at least 1. Default: 1.
    pub zoom: f64,
    /// Position of the part: -1 at the photo's left and upper edge, 1 at its right and lower one.
    /// Default: 0, 0.
    pub shift: [f64; 2],
    /// Rotation of the camera about its optical axis, clockwise, degrees. Default: 0.
    pub turn_deg: f64,
}

impl Default for View {
    fn default() -> Self {
        Self {
            zoom: 1.0,
            shift: [0.0; 2],
            turn_deg: 0.0,
        }
    }
}

impl View {
    /// Whether it is all of the photo.
    pub fn is_whole(&self) -> bool {
        *self == Self::default()
    }

    /// The camera that sees this part, with a picture as large as that of the photo's camera.
    ///
    /// # Method
    /// Exact, for pixels of any shape: a rotation about the optical axis, a longer focal length and
    /// another principal point.
    pub fn camera(&self, photo: &Camera) -> Camera {
        if self.is_whole() {
            return *photo;
        }
        let (focal, turn) = (photo.focal_px, self.turn());
        let zoom = self.zoom_used(photo);
        let seen = (self.center(photo) - photo.principal_px.coords).component_div(&focal);
        let offset = turn.inverse() * seen.push(0.0);
        let principal = half_size(photo) - zoom * focal.component_mul(&offset.xy());
        let turned = Pose::from_parts(Vector3::zeros().into(), turn.inverse());
        Camera {
            focal_px: focal * zoom,
            principal_px: principal.into(),
            camera_from_world: turned * photo.camera_from_world,
            ..*photo
        }
    }

    /// The visible part of a plate, as large as the plate; `photo` is the camera of the whole
    /// plate, and `value` gives the plate between pixels.
    ///
    /// A rotation and a zoom about the principal point leave a radial distortion unchanged.
    pub fn plate<P: Copy + Send + Sync>(
        &self,
        photo: &Camera,
        value: impl Fn(Point2<f64>) -> P + Sync,
    ) -> Image<P> {
        let (camera, turn) = (self.camera(photo), self.turn());
        let [width, height] = photo.image.map(|side| side as usize);
        Image::from_fn(width, height, |x, y| {
            let px = Vector2::new(x as f64 + 0.5, y as f64 + 0.5) - camera.principal_px.coords;
            let ray = turn * px.component_div(&camera.focal_px).push(1.0);
            value(photo.principal_px + ray.xy().component_mul(&photo.focal_px))
        })
    }

    /// Rotation from the picture's axes to the photo's.
    fn turn(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.turn_deg.to_radians())
    }

    /// The zoom at which everything visible is inside the photo.
    pub(crate) fn zoom_used(&self, photo: &Camera) -> f64 {
        let reach = self.reach(photo).component_div(&half_size(photo));
        self.zoom.max(reach.max())
    }

    /// Pixels from the middle of the visible part to its outermost points, without zoom.
    fn reach(&self, photo: &Camera) -> Vector2<f64> {
        let half = half_size(photo).component_div(&photo.focal_px);
        let turn = self.turn().to_rotation_matrix().matrix().abs();
        let turned = turn * half.push(0.0);
        turned.xy().component_mul(&photo.focal_px)
    }

    /// The photo's pixel in the middle of the visible part.
    fn center(&self, photo: &Camera) -> Vector2<f64> {
        let half = half_size(photo);
        let room = half - self.reach(photo) / self.zoom_used(photo);
        half + room.component_mul(&Vector2::from(self.shift))
    }

    /// Fails on the first impossible value.
    pub(super) fn check(&self) -> Result<()> {
        ZOOM.check("view.zoom", self.zoom)?;
        for side in self.shift {
            SHIFT.check("view.shift", side)?;
        }
        TURN.check("view.turn_deg", self.turn_deg)
    }
}

fn half_size(camera: &Camera) -> Vector2<f64> {
    Vector2::from(camera.image.map(f64::from)) / 2.0
}

/// Ranges of the view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ViewRanges {
    /// Factor on the size of everything, at least 1. Default: 1.
    pub zoom: Range,
    /// From the photo's left edge (-1) to its right one (1). Default: 0.
    pub shift_x: Range,
    /// From the photo's upper edge (-1) to its lower one (1). Default: 0.
    pub shift_y: Range,
    /// Rotation, degrees. Default: 0.
    pub turn_deg: Range,
}

impl Default for ViewRanges {
    fn default() -> Self {
        Self {
            zoom: Range::fixed(1.0),
            shift_x: Range::fixed(0.0),
            shift_y: Range::fixed(0.0),
            turn_deg: Range::fixed(0.0),
        }
    }
}

impl ViewRanges {
    pub(super) fn draw(&self, draws: &Draws) -> View {
        View {
            zoom: self.zoom.draw(draws, "view.zoom"),
            shift: [
                self.shift_x.draw(draws, "view.shift_x"),
                self.shift_y.draw(draws, "view.shift_y"),
            ],
            turn_deg: self.turn_deg.draw(draws, "view.turn_deg"),
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.zoom.check("view.zoom", &ZOOM)?;
        self.shift_x.check("view.shift_x", &SHIFT)?;
        self.shift_y.check("view.shift_y", &SHIFT)?;
        self.turn_deg.check("view.turn_deg", &TURN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tilted_camera as photo;
    use crate::filter::sample_bilinear_clamped;
    use crate::pixel::LinearRgb;

    fn views() -> impl Iterator<Item = View> {
        let turns = [-170.0, -12.0, 0.0, 3.0, 90.0];
        let zooms = [1.0, 1.3, 4.0];
        let shifts = [[0.0, 0.0], [-1.0, 1.0], [1.0, 0.4]];
        turns.into_iter().flat_map(move |turn_deg| {
            zooms.into_iter().flat_map(move |zoom| {
                shifts.map(|shift| View {
                    zoom,
                    shift,
                    turn_deg,
                })
            })
        })
    }

    fn seen_by(view: &View) -> Image<LinearRgb> {
        let plate = plate();
        view.plate(&photo(), |at| sample_bilinear_clamped(&plate, at.x, at.y))
    }

    /// A plate whose colours are its columns and rows.
    fn plate() -> Image<LinearRgb> {
        Image::from_fn(160, 120, |x, y| {
            LinearRgb::new(x as f32 + 0.5, y as f32 + 0.5, 0.0)
        })
    }

    #[test]
    fn camera_and_plate_show_the_same() {
        for view in views() {
            let (camera, seen) = (view.camera(&photo()), seen_by(&view));
            for (x, y) in [(0, 0), (80, 60), (159, 3), (40, 119)] {
                let px = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                let point = camera.ray(px).at(0.9);
                let (back, _) = photo().project(point).unwrap();
                let color = seen[(x, y)];
                let found = Point2::new(f64::from(color.r), f64::from(color.g));
                assert!((found - back).norm() < 1.0, "{view:?}: {found} {back}");
            }
        }
    }

    #[test]
    fn only_what_the_photo_shows_is_seen_up_to_its_edges() {
        for view in views() {
            let camera = view.camera(&photo());
            let corners = [[0.0, 0.0], [160.0, 0.0], [160.0, 120.0], [0.0, 120.0]];
            let seen = corners.map(|corner| {
                let point = camera.ray(Point2::from(corner)).at(0.9);
                photo().project(point).unwrap().0
            });
            let least = seen
                .iter()
                .fold([f64::MAX; 2], |m, p| [m[0].min(p.x), m[1].min(p.y)]);
            let most = seen
                .iter()
                .fold([f64::MIN; 2], |m, p| [m[0].max(p.x), m[1].max(p.y)]);
            assert!(least[0] > -1e-9 && least[1] > -1e-9, "{view:?}: {least:?}");
            assert!(
                most[0] < 160.0 + 1e-9 && most[1] < 120.0 + 1e-9,
                "{view:?}: {most:?}"
            );
            if view.shift[0] == -1.0 {
                assert!(least[0].abs() < 1e-9 && (most[1] - 120.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_shift_ends_at_the_photo_s_edges() {
        let ranges = ViewRanges {
            shift_x: Range::fixed(2.0),
            ..ViewRanges::default()
        };
        let told = "view.shift_x: 2, expected -1 to 1 (the photo's edges)";
        assert_eq!(ranges.check().unwrap_err().to_string(), told);
    }

    #[test]
    fn all_of_the_photo_is_left_as_it_is() {
        assert_eq!(View::default().camera(&photo()), photo());
        let drawn = ViewRanges::default().draw(&Draws::new(1, 2));
        assert!(drawn.is_whole());
        assert_eq!(seen_by(&drawn), plate());
    }

    #[test]
    fn a_clockwise_turn_of_the_camera_turns_the_picture_the_other_way() {
        let view = View {
            turn_deg: 90.0,
            zoom: 2.0,
            ..View::default()
        };
        let seen = seen_by(&view);
        // What was on the right is now at the top.
        assert!(seen[(80, 5)].r > seen[(80, 110)].r + 20.0);
    }
}
