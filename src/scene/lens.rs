//! What a lens does that a pinhole does not: it bends straight lines, and is sharp at one distance.

use crate::bounds::Bounds;
use crate::camera::{Camera, RadialDistortion};
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::scene::bounds::{F_NUMBER, FOCUS, K1, SENSOR};
use crate::scene::check::field;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// Width of the sensor of a 35 mm camera, millimetres.
const FULL_FRAME_MM: f64 = 36.0;
/// The part of a barrel's radius up to its fold that a picture may use: three fifths of the
/// resolution are left there at the corners.
const USED_PART_OF_FOLD: f64 = 0.77;

/// The lens of a scene's camera; the default is a pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Lens {
    /// OpenCV's first coefficient of radial distortion, negative for a barrel. Default: 0.
    pub k1: f64,
    /// The plate was taken without distortion and is bent as cards are. Default: no, the plate
    /// shows `k1` already.
    pub bends_plate: bool,
    /// Focal length over the diameter of the aperture. Default: none, all is sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Depth that is in focus, metres along the optical axis. Default: that of the surface's
    /// centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_m: Option<f64>,
    /// Longer side of the sensor that the whole photo was taken with, millimetres. Default: 36.
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

/// A lens of an aperture that is in focus at one depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Diameter of its aperture, metres.
    pub aperture_m: f64,
    /// Depth that is in focus, metres.
    pub focus_m: f64,
}

impl ThinLens {
    /// Radius of the circle of confusion of a point at a depth, in pixels of a camera of this focal
    /// length.
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

    /// It changes the plate.
    pub(super) fn moves_plate(&self) -> bool {
        self.bends_plate && self.k1 != 0.0
    }

    /// The camera of the whole photo as this lens takes it: longer where a barrel would see more
    /// than the photo shows.
    ///
    /// # Method
    /// Farthest out is a corner, at a radius of R focal lengths: it stays in the corner if the
    /// focal length grows as much as the lens shortens R.
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

    /// Where the photo shows what the whole picture taken by this lens shows at a position.
    pub(super) fn photo_px(&self, photo: &Camera, px: Point2<f64>) -> Point2<f64> {
        if !self.moves_plate() {
            return px;
        }
        let bent = self.camera(photo);
        let ideal = RadialDistortion::new(&bent, self.k1).undistort(px);
        let focal_lengths = (ideal - bent.principal_px).component_div(&bent.focal_px);
        photo.principal_px + focal_lengths.component_mul(&photo.focal_px)
    }

    /// The distortion that a plate has before anything is done to it.
    pub(crate) fn distortion_of_plate(&self, photo: &Camera) -> RadialDistortion {
        let k1 = if self.bends_plate { 0.0 } else { self.k1 };
        RadialDistortion::new(photo, k1)
    }

    /// The aperture and the focus for a photo's camera; none where all is sharp.
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
    pub(super) fn check(&self, at: &str) -> Result<()> {
        K1.check(&field(at, "k1"), self.k1)?;
        SENSOR.check(&field(at, "sensor_mm"), self.sensor_mm)?;
        check_optional(self.f_number, &field(at, "f_number"), &F_NUMBER)?;
        check_optional(self.focus_m, &field(at, "focus_m"), &FOCUS)
    }

    /// Fails on a barrel that folds the corners of a camera's pictures over, or nearly.
    pub(super) fn check_fold(&self, photo: &Camera) -> Result<()> {
        let least = self.least_k1(photo);
        if self.k1 >= least {
            return Ok(());
        }
        let what = format!(
            "{}, expected at least {least:.3}: beyond, the corners of this camera's pictures fold over",
            self.k1
        );
        Err(Error::value("lens.k1", what))
    }

    fn least_k1(&self, photo: &Camera) -> f64 {
        let used = USED_PART_OF_FOLD;
        let shown = if self.bends_plate {
            used
        } else {
            used * (1.0 - used * used / 3.0)
        };
        let reach = RadialDistortion::new(photo, self.k1).reach();
        -(shown / reach).powi(2) / 3.0
    }
}

fn check_optional(value: Option<f64>, at: &str, bounds: &Bounds) -> Result<()> {
    value.map_or(Ok(()), |value| bounds.check(at, value))
}

/// What the lens is drawn from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LensRanges {
    /// OpenCV's k1 for photos whose label and camera have none: photo and objects are bent alike.
    /// Default: 0.
    pub k1: Range,
    /// Focal length over the diameter of the aperture. Default: none, all is sharp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<Range>,
    /// Depth that is in focus, metres. Default: that of the surface's centre.
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
    /// The lens before a background whose photo has a distortion of its own, or 0.
    pub(super) fn draw(&self, draws: &Draws, photo_k1: f64) -> Lens {
        let bends_plate = photo_k1 == 0.0 && self.k1 != Range::fixed(0.0);
        let k1 = if bends_plate {
            self.k1.draw(draws, "lens.k1")
        } else {
            photo_k1
        };
        Lens {
            k1,
            bends_plate,
            f_number: draw_optional(self.f_number, draws, "lens.f_number"),
            focus_m: draw_optional(self.focus_m, draws, "lens.focus_m"),
            sensor_mm: self.sensor_mm,
        }
    }

    pub(super) fn check(&self) -> Result<()> {
        self.k1.check("lens.k1", &K1)?;
        SENSOR.check("lens.sensor_mm", self.sensor_mm)?;
        check_optional_range(self.f_number, "lens.f_number", &F_NUMBER)?;
        check_optional_range(self.focus_m, "lens.focus_m", &FOCUS)
    }
}

fn draw_optional(range: Option<Range>, draws: &Draws, path: &str) -> Option<f64> {
    range.map(|range| range.draw(draws, path))
}

fn check_optional_range(range: Option<Range>, at: &str, bounds: &Bounds) -> Result<()> {
    range.map_or(Ok(()), |range| range.check(at, bounds))
}
