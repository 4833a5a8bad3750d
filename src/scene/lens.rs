//! What distinguishes a lens from a pinhole: distortion, and limited depth of field.

use crate::camera::{self, Camera, RadialDistortion};
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::scene::bounds::{F_NUMBER, FOCUS, K1, SENSOR};
use crate::scene::{Background, CameraSource, Draws, Range};
use serde::{Deserialize, Serialize};

/// Width of the sensor of a 35 mm camera, millimetres.
const FULL_FRAME_MM: f64 = 36.0;

/// The lens of a scene's camera; the default is a pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lens {
    /// OpenCV's first coefficient of radial distortion, negative for a barrel. Default: 0.
    pub k1: f64,
    /// Whether the plate was taken without distortion and is distorted like the cards. Default: no,
    /// the plate already shows `k1`.
    pub bends_plate: bool,
    /// Focal length over the diameter of the aperture. Default: none, everything is sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Depth in focus, metres along the optical axis. Default: that of the surface's centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_m: Option<f64>,
    /// Longer side of the part of the sensor that the whole picture shows, millimetres. Default:
    /// 36.
    pub sensor_mm: f64,
}

impl Default for Lens {
    fn default() -> Self {
        Self {
            k1: 0.0,
            bends_plate: false,
            f_number: None,
            focus_m: None,
            sensor_mm: FULL_FRAME_MM,
        }
    }
}

/// A lens with an aperture, in focus at one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Diameter of its aperture, metres.
    pub aperture_m: f64,
    /// Depth in focus, metres.
    pub focus_m: f64,
}

impl ThinLens {
    /// Radius of the circle of confusion of a point at a depth, in pixels of a camera with this
    /// focal length.
    ///
    /// # Method
    /// Rays from the point through the aperture's rim meet the plane in focus in a circle of
    /// diameter `aperture |focus - depth| / depth`, which is `focal / focus` as large in the
    /// picture.
    pub fn blur_radius_px(&self, depth: f64, focal_px: f64) -> f64 {
        let defocus = (1.0 / depth - 1.0 / self.focus_m).abs();
        0.5 * self.aperture_m * focal_px * defocus
    }
}

impl Lens {
    /// Whether it is a pinhole.
    pub fn is_pinhole(&self) -> bool {
        *self == Self::default()
    }

    /// Whether it distorts the plate.
    pub(super) fn moves_plate(&self) -> bool {
        self.bends_plate && self.k1 != 0.0
    }

    /// The camera of the whole photo with this lens: its focal length is longer where barrel
    /// distortion would show more than the photo does.
    ///
    /// # Method
    /// The farthest point is a corner, at a radius of R focal lengths: it stays in the corner if
    /// the focal length grows by the factor by which the lens shortens R.
    pub(super) fn camera(&self, photo: &Camera) -> Camera {
        if !self.moves_plate() || self.k1 > 0.0 {
            return *photo;
        }
        let reach = RadialDistortion::new(photo, self.k1).reach();
        let shortened = (1.0 + self.k1 * reach * reach).max(2.0 / 3.0);
        Camera {
            focal_px: photo.focal_px / shortened,
            ..*photo
        }
    }

    /// Magnification of the middle of the whole picture relative to the photo.
    pub(super) fn zoom(&self, photo: &Camera) -> f64 {
        self.camera(photo).focal_px.x / photo.focal_px.x
    }

    /// The photo's position of what the whole picture shows at a position with this lens.
    pub(super) fn photo_px(&self, photo: &Camera, px: Point2<f64>) -> Point2<f64> {
        if !self.moves_plate() {
            return px;
        }
        let bent = self.camera(photo);
        let ideal = RadialDistortion::new(&bent, self.k1).undistort(px);
        let focal_lengths = (ideal - bent.principal_px).component_div(&bent.focal_px);
        photo.principal_px + focal_lengths.component_mul(&photo.focal_px)
    }

    /// The distortion of a plate as it was photographed.
    pub(crate) fn distortion_of_plate(&self, photo: &Camera) -> RadialDistortion {
        RadialDistortion::new(photo, self.k1_of_plate())
    }

    /// Its coefficient.
    pub(crate) fn k1_of_plate(&self) -> f64 {
        if self.bends_plate { 0.0 } else { self.k1 }
    }

    /// The aperture and the focus for a photo's camera; none if everything is sharp.
    pub(super) fn thin_lens(&self, photo: &Camera) -> Option<ThinLens> {
        let f_number = self.f_number?;
        let longer_px = f64::from(photo.image[0].max(photo.image[1]));
        let focal_m = 1e-3 * self.sensor_mm * photo.focal_px.max() / longer_px;
        let surface_m = photo.camera_from_world.translation.vector.z;
        Some(ThinLens {
            aperture_m: focal_m / f_number,
            focus_m: self.focus_m.unwrap_or(surface_m),
        })
    }

    /// Fails on the first impossible value.
    pub(super) fn check(&self) -> Result<()> {
        K1.check("lens.k1", self.k1)?;
        SENSOR.check("lens.sensor_mm", self.sensor_mm)?;
        self.f_number
            .map_or(Ok(()), |n| F_NUMBER.check("lens.f_number", n))?;
        self.focus_m
            .map_or(Ok(()), |focus| FOCUS.check("lens.focus_m", focus))
    }

    /// Fails if barrel distortion folds over the corners of a camera's pictures, or nearly does.
    pub(super) fn check_fold(&self, photo: &Camera) -> Result<()> {
        camera::check_fold("lens.k1", self.k1, self.least_k1(photo))
    }

    fn least_k1(&self, photo: &Camera) -> f64 {
        if self.bends_plate {
            camera::least_bending_k1(photo)
        } else {
            camera::least_k1(photo)
        }
    }
}

/// An error that also names the background.
fn told_of(error: Error, background: &str) -> Error {
    match error {
        Error::Value { at, what } => Error::value(at, format!("{what} (background {background})")),
        other => other,
    }
}

/// Ranges of the lens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LensRanges {
    /// OpenCV's k1 for photos whose label and camera have none: photo and objects are distorted
    /// alike. Default: 0.
    pub k1: Range,
    /// Focal length over the diameter of the aperture. Default: none, everything is sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<Range>,
    /// Depth in focus, metres. Default: that of the surface's centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_m: Option<Range>,
    /// Longer side of the sensor, millimetres. Default: 36.
    pub sensor_mm: f64,
}

impl Default for LensRanges {
    fn default() -> Self {
        Self {
            k1: Range::fixed(0.0),
            f_number: None,
            focus_m: None,
            sensor_mm: FULL_FRAME_MM,
        }
    }
}

impl LensRanges {
    /// Fails if the strongest barrel distortion folds over the pictures of a background.
    pub(super) fn check_folds(&self, background: &Background) -> Result<()> {
        let CameraSource::Known(camera) = &background.camera else {
            return Ok(());
        };
        let bends_plate = self.bends_plate(background.k1);
        let lens = Lens {
            k1: if bends_plate {
                self.k1.min
            } else {
                background.k1
            },
            bends_plate,
            ..Lens::default()
        };
        lens.check_fold(camera)
            .map_err(|e| told_of(e, &background.name))
    }

    /// Whether the plate is distorted: if its photo has no distortion of its own.
    fn bends_plate(&self, photo_k1: f64) -> bool {
        photo_k1 == 0.0 && !self.k1.is_zero()
    }

    /// The lens for a background.
    pub(super) fn draw(&self, draws: &Draws, background: &Background) -> Lens {
        let photo_k1 = background.k1;
        let bends_plate = self.bends_plate(photo_k1);
        let k1 = if bends_plate {
            self.k1.draw(draws, "lens.k1")
        } else {
            photo_k1
        };
        Lens {
            k1,
            bends_plate,
            f_number: Range::draw_optional(self.f_number, draws, "lens.f_number"),
            focus_m: Range::draw_optional(self.focus_m, draws, "lens.focus_m"),
            sensor_mm: self.sensor_mm * background.shown_share,
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.k1.check("lens.k1", &K1)?;
        SENSOR.check("lens.sensor_mm", self.sensor_mm)?;
        Range::check_optional(self.f_number, "lens.f_number", &F_NUMBER)?;
        Range::check_optional(self.focus_m, "lens.focus_m", &FOCUS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tilted_camera;
    use crate::geom::{Point3, Vector2};
    use crate::scene::{DrawLog, View};

    fn photo() -> Camera {
        Camera {
            focal_px: Vector2::new(150.0, 152.0),
            ..tilted_camera()
        }
    }

    fn views() -> [View; 3] {
        let zoomed = View {
            zoom: 1.5,
            shift: [0.7, -1.0],
            turn_deg: 20.0,
        };
        let turned = View {
            turn_deg: -90.0,
            ..View::default()
        };
        [View::default(), zoomed, turned]
    }

    /// Where the picture shows a point, and where the photo does.
    fn seen(lens: &Lens, view: &View, world: Point3<f64>) -> [Point2<f64>; 2] {
        let camera = view.camera(&lens.camera(&photo()));
        let (ideal, _) = camera.project(world).unwrap();
        let px = RadialDistortion::new(&camera, lens.k1).distort(ideal);
        let (straight, _) = photo().project(world).unwrap();
        let photo_k1 = if lens.bends_plate { 0.0 } else { lens.k1 };
        [
            px,
            RadialDistortion::new(&photo(), photo_k1).distort(straight),
        ]
    }

    #[test]
    fn photo_and_cards_are_bent_alike() {
        for (k1, bends_plate) in [(-0.2, true), (0.2, true), (-0.2, false), (0.1, false)] {
            let lens = Lens {
                k1,
                bends_plate,
                ..Lens::default()
            };
            for view in views() {
                let bent = lens.camera(&photo());
                // The plate's colours are its positions.
                let plate = view.plate(&bent, |px| {
                    let at = lens.photo_px(&photo(), px);
                    crate::pixel::LinearRgb::new(at.x as f32, at.y as f32, 0.0)
                });
                for (x, y) in [(5, 5), (80, 60), (150, 10), (30, 110)] {
                    let camera = view.camera(&bent);
                    let px = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let ideal = RadialDistortion::new(&camera, k1).undistort(px);
                    let [back, expected] = seen(&lens, &view, camera.ray(ideal).at(0.9));
                    let shown = plate[(x, y)];
                    let found = Point2::new(f64::from(shown.r), f64::from(shown.g));
                    assert!((back - px).norm() < 1e-9);
                    assert!(
                        (found - expected).norm() < 1e-3,
                        "{lens:?} {view:?}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_the_photo_does_not_show_is_never_seen() {
        for k1 in [-0.3, -0.1, 0.1, 0.3] {
            let lens = Lens {
                k1,
                bends_plate: true,
                ..Lens::default()
            };
            let corners = [
                [0.0, 0.0],
                [160.0, 0.0],
                [160.0, 120.0],
                [0.0, 120.0],
                [80.0, 0.0],
            ];
            let seen = corners.map(|px| lens.photo_px(&photo(), px.into()));
            assert!(
                seen.iter().all(|p| p.x > -1e-9 && p.x < 160.0 + 1e-9),
                "{k1}: {seen:?}"
            );
            assert!(
                seen.iter().all(|p| p.y > -1e-9 && p.y < 120.0 + 1e-9),
                "{k1}: {seen:?}"
            );
            // A barrel shows all of it: the farthest corner is its own.
            let nearest = seen[1].x.max(seen[2].x);
            assert!(k1 > 0.0 || nearest > 155.0, "{k1}: {seen:?}");
        }
    }

    #[test]
    fn nothing_is_drawn_by_default_and_a_photo_keeps_its_own_lens() {
        let log = DrawLog::default();
        let draws = Draws::new(3, 4).logged(&log);
        let straight = background(0.0);
        assert!(LensRanges::default().draw(&draws, &straight).is_pinhole());
        let ranges = LensRanges {
            k1: Range::new(-0.2, 0.1),
            ..LensRanges::default()
        };
        let own = ranges.draw(&draws, &background(-0.07));
        assert_eq!((own.k1, own.bends_plate), (-0.07, false));
        assert!(log.into_draws().is_empty());
        let drawn = ranges.draw(&Draws::new(3, 4), &straight);
        assert!(drawn.bends_plate && (-0.2..0.1).contains(&drawn.k1));
        assert_eq!(drawn, ranges.draw(&Draws::new(3, 4), &straight));
    }

    fn background(k1: f64) -> Background {
        Background {
            k1,
            ..Background::new("tray", [0.4, 0.3], CameraSource::Known(photo()))
        }
    }

    #[test]
    fn a_part_of_a_photo_is_taken_by_a_part_of_the_sensor() {
        let cropped = Background {
            shown_share: 0.5,
            ..background(0.0)
        };
        let lens = LensRanges::default().draw(&Draws::new(3, 4), &cropped);
        assert_eq!(lens.sensor_mm, 18.0);
    }

    #[test]
    fn a_range_that_folds_some_pictures_over_is_refused_at_once() {
        let ranges = LensRanges {
            k1: Range::new(-1.5, 0.0),
            ..LensRanges::default()
        };
        assert!(ranges.check_folds(&background(0.0)).is_err());
        // A photo that has a distortion keeps it.
        assert!(ranges.check_folds(&background(-0.07)).is_ok());
    }

    #[test]
    fn an_aperture_is_that_of_the_sensor() {
        let lens = Lens {
            f_number: Some(2.0),
            sensor_mm: 8.0,
            ..Lens::default()
        };
        let thin = lens.thin_lens(&photo()).unwrap();
        // 152 of 160 pixels are 7.6 mm of 8.
        assert!((thin.aperture_m - 0.0038).abs() < 1e-12, "{thin:?}");
        let (_, center_m) = photo().project(Point3::origin()).unwrap();
        assert!((thin.focus_m - center_m).abs() < 1e-12);
        assert_eq!(Lens::default().thin_lens(&photo()), None);
    }

    #[test]
    fn what_cannot_be_right_is_told() {
        let reported = |lens: Lens| lens.check().unwrap_err().to_string();
        let good = Lens::default();
        let nan = Lens {
            k1: f64::NAN,
            ..good
        };
        assert!(reported(nan).starts_with("lens.k1: NaN"));
        let no_number = Lens {
            f_number: Some(f64::NAN),
            ..good
        };
        assert!(reported(no_number).starts_with("lens.f_number: NaN, expected 0.5 to 1000"));
        let closed = Lens {
            f_number: Some(0.0),
            ..good
        };
        assert!(reported(closed).starts_with("lens.f_number: 0, expected 0.5 to 1000"));
        for bends_plate in [false, true] {
            let lens = Lens {
                k1: -1.5,
                bends_plate,
                ..good
            };
            let told = lens.check_fold(&photo()).unwrap_err().to_string();
            assert!(
                told.starts_with("lens.k1: -1.5, expected at least -0."),
                "{told}"
            );
            let least = Lens {
                k1: lens.least_k1(&photo()),
                ..lens
            };
            assert!(least.check_fold(&photo()).is_ok());
            let bent = RadialDistortion::new(&least.camera(&photo()), least.k1);
            assert!(bent.reach() < 2.0 / 3.0 * bent.fold(), "{least:?}");
        }
    }

    #[test]
    fn old_scenes_have_no_lens() {
        assert!(toml::from_str::<Lens>("").unwrap().is_pinhole());
        assert!(toml::from_str::<Lens>("k2 = 0.1").is_err());
    }
}
