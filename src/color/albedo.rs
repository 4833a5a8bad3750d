//! Share of light that a surface reflects.

use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};

/// Share of light that a matte surface reflects, above 0 and at most 1.
///
/// In files a number, or three: red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "expected a share of light, or one of red, of green and of blue"
)]
pub enum Albedo {
    /// Of all light, as luminance; the surface's colour is not known.
    Luminance(f64),
    /// Of red, green and blue, scene-linear.
    Color(LinearRgb),
}

impl Albedo {
    /// White paper in the light under which the surface has this scene-linear colour. Without a
    /// known colour of the surface that light counts as white.
    pub(crate) fn white_beside(&self, surface: LinearRgb) -> LinearRgb {
        match *self {
            Self::Luminance(albedo) => {
                LinearRgb::grey((f64::from(surface.luminance()) / albedo) as f32)
            }
            Self::Color(albedo) => LinearRgb::new(
                surface.r / albedo.r,
                surface.g / albedo.g,
                surface.b / albedo.b,
            ),
        }
    }

    /// The same in every channel where the surface's colour is not known.
    pub(crate) fn color(&self) -> LinearRgb {
        match *self {
            Self::Luminance(albedo) => LinearRgb::grey(albedo as f32),
            Self::Color(albedo) => albedo,
        }
    }

    /// The smallest and the largest share.
    pub(crate) fn range(&self) -> [f64; 2] {
        match *self {
            Self::Luminance(albedo) => [albedo; 2],
            Self::Color(LinearRgb { r, g, b }) => [r.min(g).min(b), r.max(g).max(b)].map(f64::from),
        }
    }
}
