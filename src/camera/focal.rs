//! What is known of the focal length before the picture is looked at, and where it came from afterwards.

use super::label::Label;
use serde::{Deserialize, Serialize};

/// Diagonal of the 36 mm x 24 mm frame that 35 mm equivalents refer to, millimetres.
pub(crate) const FULL_FRAME_DIAGONAL_MM: f64 = 43.266_615_305_567_87;
/// Nothing known: one longer picture side, 36 mm equivalent, the median of pocket cameras.
const USUAL_FOCAL: f64 = 1.0;

/// Where a solution's focal length comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FocalSource {
    /// The four corners.
    Measured,
    /// The corners and what was known before, both.
    Mixed,
    /// What was known before (EXIF or a usual lens); the corners say nothing of it.
    Prior,
    /// The label gave it.
    Fixed,
}

/// The focal length in pixels that the label gives or implies; none where it says nothing.
pub(crate) fn stated_px(label: &Label) -> Option<f64> {
    let [w, h] = label.image_size().map(f64::from);
    let equivalent = label.camera.focal_35mm.map(|mm| mm * libm::hypot(w, h) / FULL_FRAME_DIAGONAL_MM);
    label.camera.focal_px.or(equivalent)
}

/// The focal length in pixels of a usual lens.
pub(crate) fn usual_px(image: [u32; 2]) -> f64 {
    USUAL_FOCAL * f64::from(image[0].max(image[1]))
}
