//! What is odd about a label or a solution without making it useless.

use serde::{Deserialize, Serialize};

/// Something a person should look at; the solution stands nevertheless.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Warning {
    /// The corners ran criss-cross and were sorted, clockwise from the first.
    #[error("the corners cross each other; sorted clockwise, starting at the first")]
    Reordered,
    /// The corners ran anticlockwise; the second and the fourth were exchanged.
    #[error("the corners run anticlockwise; the second and fourth were exchanged")]
    Reversed,
    /// The rectangle is small in the picture.
    #[error("the longest side is only {longest_px:.1} px; expected at least 50")]
    SmallQuad {
        /// Length of the longest side, pixels.
        longest_px: f64,
    },
    /// A corner lies far outside the picture.
    #[error("corner {corner} lies more than a diagonal outside the picture")]
    Outside {
        /// Which corner, from 0.
        corner: usize,
    },
    /// The optical axis is almost parallel to the surface.
    #[error("grazing view: the camera looks along the surface ({tilt_deg:.1} degrees from above)")]
    Grazing {
        /// Angle between optical axis and surface normal, degrees.
        tilt_deg: f64,
    },
}
