//! How large an object is, with the error of its size.

use super::rectified::{RectifiedPhoto, ScreenScale};
use super::scale::Scale;
use super::size::oriented_size;
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::{Point2, Vector2};
use crate::matte::CutOut;

/// Size of an object from its outline and a scale.
pub(super) struct MeasuredSize {
    /// Pixels of the cut-out for a metre.
    pub(super) px_per_metre: f64,
    /// Length and width of the tight outline.
    pub(super) object_m: [f64; 2],
    /// Standard error of both, with how far a given size is from them; as large as the length where
    /// the scale is that of an object of which a part is missing.
    pub(super) error_m: f64,
    /// The given size does not fit the outline.
    pub(super) size_mismatch: Option<Diagnostic>,
}

/// Standard error of one side of an outline, pixels of the picture that was searched: root mean
/// square over the four sides of the boxes of 48 rendered bottles, each against the renderer's
/// exact box, was 0.39 for the tight outline (0.41 on 36 photos, 0.29 on 12 of other seeds) and
/// 0.48 for the hull; of the two the larger.
const SIDE_ERROR_PX: f64 = 0.5;
/// Given and measured proportions may differ by this share.
const PROPORTION_SLACK: f64 = 0.05;

impl MeasuredSize {
    pub(super) fn new(cut: &CutOut, scale: Scale, photo: &RectifiedPhoto) -> Self {
        let tight = oriented_size(&cut.outline.hull());
        let screen = photo.scale(middle_px(cut)).unwrap_or(ScreenScale {
            px_per_metre: 1.0,
            sigma: 0.0,
        });
        let px_per_metre = scale_of_outline(tight, scale, screen.px_per_metre, cut.scale);
        let error_px = outline_error_px(cut, tight);
        let object_m = match scale {
            // As it was given, whatever rounding makes of it.
            Scale::Length(length) => [length, tight[1] / px_per_metre],
            _ => tight.map(|px| px / px_per_metre),
        };
        let measured_m = libm::hypot(error_px / px_per_metre, screen.sigma * object_m[0]);
        let error_m = libm::hypot(measured_m, distance_from_given(object_m, scale));
        let is_of_a_part = cut.segmentation.is_truncated() && scale.is_of_object();
        Self {
            px_per_metre,
            object_m,
            error_m: if is_of_a_part { object_m[0] } else { error_m },
            size_mismatch: size_mismatch(tight, error_px, scale, object_m),
        }
    }
}

/// Pixels of a cut-out for a metre, by its tight outline or by the screen's scale; `enlargement` is
/// its scale over the photo's.
fn scale_of_outline(tight: [f64; 2], scale: Scale, screen_scale: f64, enlargement: f64) -> f64 {
    match scale {
        Scale::PxPerMetre(photo_scale) => photo_scale * enlargement,
        Scale::Screen(..) | Scale::Marker(_) | Scale::Display => screen_scale * enlargement,
        Scale::Length(length) => tight[0] / length,
        Scale::Size(size) => least_squares_scale(tight, size),
    }
}

/// The scale that fits both sides best.
fn least_squares_scale(tight: [f64; 2], [l, w]: [f64; 2]) -> f64 {
    (tight[0] * l + tight[1] * w) / (l * l + w * w)
}

/// How far length or width is from what a tape measured, metres: one scale cannot give both where
/// the outline has other proportions.
fn distance_from_given(object_m: [f64; 2], scale: Scale) -> f64 {
    match scale {
        Scale::Size(given) => {
            let [length, width] = [0, 1].map(|side| (object_m[side] - given[side]).abs());
            length.max(width)
        }
        _ => 0.0,
    }
}

/// Standard error of the length of an outline, and how far its tips may lie beyond it, pixels of
/// the cut-out.
fn outline_error_px(cut: &CutOut, tight: [f64; 2]) -> f64 {
    let hull = oriented_size(&cut.hull);
    let side_px = SIDE_ERROR_PX * cut.segmentation.reduction * cut.scale;
    let tips_px = 0.5 * (hull[0] - tight[0]).abs().max((hull[1] - tight[1]).abs());
    libm::hypot(std::f64::consts::SQRT_2 * side_px, tips_px)
}

/// The middle of the object's hull in pixels of the photo.
fn middle_px(cut: &CutOut) -> Point2<f64> {
    let count = cut.hull.len().max(1) as f64;
    let corners = cut.hull.iter().map(|p| p.coords / count);
    let middle = corners.fold(Vector2::zeros(), |sum, p| sum + p);
    Point2::from(middle / cut.scale + Vector2::new(cut.roi.x as f64, cut.roi.y as f64))
}

/// The warning about a given size of other proportions than the outline, with the size that was
/// taken.
fn size_mismatch(
    tight: [f64; 2],
    error_px: f64,
    scale: Scale,
    taken_m: [f64; 2],
) -> Option<Diagnostic> {
    let Scale::Size([length, width]) = scale else {
        return None;
    };
    let (given, seen) = (width / length, tight[1] / tight[0]);
    let slack = PROPORTION_SLACK + error_px / tight[1];
    ((given / seen - 1.0).abs() > slack).then(|| mismatch_warning(1.0 / seen, 1.0 / given, taken_m))
}

/// About lengths over widths.
fn mismatch_warning(seen: f64, given: f64, taken_m: [f64; 2]) -> Diagnostic {
    let [length, width] = taken_m.map(|m| 1e3 * m);
    let message = format!(
        "the outline is {seen:.2} times as long as wide, the given size {given:.2} times; taken as \
         {length:.1} x {width:.1} mm"
    );
    Diagnostic::warning(Code::SizeMismatch, message)
}
