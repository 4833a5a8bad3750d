//! Where a camera stands over a screen, by a rectangle of known size in the screen's plane, and how
//! well the scale is known from that.

use crate::camera::{self, CHI2_99, Camera, Label, Solution};
use crate::error::{Error, Result};
use crate::geom::{Point2, Point3};
use crate::io::Header;

/// Error of a tape measure beside a side of a screen or marker, as a share.
pub(super) const TAPE_SIGMA: f64 = 0.003;
/// Error of the height at which the outline of an object lies, as a share of its thickness.
pub(super) const HEIGHT_SIGMA: f64 = 0.25;
/// Less probable fits are those of another rectangle.
const IMPOSSIBLE_P_VALUE: f64 = 1e-6;
/// Less probable fits need a review.
const IMPROBABLE_P_VALUE: f64 = 0.01;

/// A rectangle of known size in the plane of the screen, and where its corners are seen, from the
/// top left, clockwise.
pub(super) struct ReferenceRectangle {
    pub(super) size: [f64; 2],
    pub(super) corners_px: [Point2<f64>; 4],
    pub(super) sigma_px: f64,
}

/// Where the camera stands over the screen, and how well the scale is known from that.
pub(super) struct ScreenPose {
    /// The reference is the plane `z = 0`, centred.
    pub(super) camera: Camera,
    /// Width and height of the reference as they are seen.
    pub(super) size: [f64; 2],
    /// Error of a corner as a share of the reference's side.
    corner_sigma: f64,
    /// Error of the camera's height as a share of it.
    height_sigma: f64,
    /// By how much lengths would differ if the sides were exchanged, where the photo fits either
    /// way; as a share.
    pub(super) swap_error: f64,
    /// The corners are hardly those of a rectangle of this size.
    pub(super) is_poor_fit: bool,
}

impl ScreenPose {
    /// Solves for the camera of a photo of `image` pixels; width and height of the reference may be
    /// exchanged.
    pub(super) fn solve(
        reference: &ReferenceRectangle,
        image: [u32; 2],
        header: &Header,
    ) -> Result<Self> {
        let (best, other) = reference.solutions(image, header)?;
        check_fit(&best, reference.size)?;
        Ok(Self {
            camera: best.camera,
            size: best.size,
            corner_sigma: reference.sigma_px / reference.mean_side_px(),
            height_sigma: best.sigma.center[(2, 2)].max(0.0).sqrt() / best.camera.center().z,
            swap_error: other.map_or(0.0, |other| swap_error(&best, &other)),
            is_poor_fit: best.fit.p_value.is_some_and(|p| p < IMPROBABLE_P_VALUE),
        })
    }

    /// Standard error of a length at a place over the screen, as a share.
    ///
    /// An error of the corners tilts the plane that they give: its scale is off the more, the
    /// farther a place is from them.
    pub(super) fn sigma(&self, place: Point3<f64>) -> f64 {
        let share = place.z / (self.camera.center().z - place.z);
        let of_height = share * libm::hypot(2.0 * HEIGHT_SIGMA, self.height_sigma);
        [of_height, TAPE_SIGMA, self.swap_error]
            .into_iter()
            .fold(self.tilt_sigma(place), libm::hypot)
    }

    /// The part of that error by the corners.
    fn tilt_sigma(&self, place: Point3<f64>) -> f64 {
        let [w, h] = self.size;
        let away = libm::hypot(place.x, place.y) / (0.5 * (w + h));
        self.corner_sigma * libm::hypot(1.0, 2.0 * away)
    }
}

/// By how much lengths differ between two solutions that fit about as well; 0 where the other fits
/// much worse.
fn swap_error(best: &Solution, other: &Solution) -> f64 {
    if other.fit.chi2 < best.fit.chi2 + CHI2_99 {
        (best.fit.px_per_metre / other.fit.px_per_metre - 1.0).abs()
    } else {
        0.0
    }
}

impl ReferenceRectangle {
    /// The camera that fits best, and the one with width and height exchanged where that fits, too.
    fn solutions(&self, image: [u32; 2], header: &Header) -> Result<(Solution, Option<Solution>)> {
        let [w, h] = self.size;
        let as_given = self.solved([w, h], image, header);
        let swapped = if w == h {
            Err(scale_unknown(""))
        } else {
            self.solved([h, w], image, header)
        };
        better_first(as_given, swapped)
    }

    /// The camera that sees the reference, if its sides had this `size`, metres.
    fn solved(&self, size: [f64; 2], image: [u32; 2], header: &Header) -> Result<Solution> {
        let mut label = Label::new(image, self.corners_px.map(Into::into), size);
        label.surface.corner_sigma_px = Some(self.sigma_px);
        label.surface.dimension_sigma_m = Some(TAPE_SIGMA * size[0].min(size[1]));
        camera::apply_exif(&mut label, header);
        camera::solve(&label, &Default::default()).map_err(|e| scale_unknown(&e.to_string()))
    }

    fn mean_side_px(&self) -> f64 {
        let corners = self.corners_px;
        let sides = (0..4).map(|i| corners[(i + 1) % 4] - corners[i]);
        sides.map(|side| side.norm()).sum::<f64>() / 4.0
    }
}

/// The error of a photo from whose screen no scale can be inferred.
pub(super) fn scale_unknown(why: &str) -> Error {
    let instead = "measure the object's length with a tape instead";
    Error::Photo {
        what: format!("the scale of the screen cannot be inferred: {why}; {instead}"),
    }
}

fn check_fit(solution: &Solution, [w, h]: [f64; 2]) -> Result<()> {
    match solution.fit.p_value {
        Some(p) if p < IMPOSSIBLE_P_VALUE => Err(scale_unknown(&format!(
            "its corners do not fit {w} x {h} m; are width and height right?"
        ))),
        _ => Ok(()),
    }
}

/// The solution that fits better, and the other one; the first error where there is none.
fn better_first(
    first: Result<Solution>,
    second: Result<Solution>,
) -> Result<(Solution, Option<Solution>)> {
    match (first, second) {
        (Ok(first), Ok(second)) if second.fit.chi2 < first.fit.chi2 => Ok((second, Some(first))),
        (Ok(first), second) => Ok((first, second.ok())),
        (Err(_), Ok(second)) => Ok((second, None)),
        (Err(error), Err(_)) => Err(error),
    }
}
