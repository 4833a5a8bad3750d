//! Lights and exposure as a scene gives them.

use crate::color::Albedo;
use crate::pixel::LinearRgb;
use serde::{Deserialize, Serialize};

/// A flat light that emits from one side with the same radiance everywhere, `power * color / (pi *
/// area)`.
///
/// Its size is its softness: an occluder at height `z` under a light at distance `D` and of size
/// `s` has a penumbra of about `z s / (D - z)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AreaLight {
    /// Outline. Default: `rectangle`.
    #[serde(default)]
    pub shape: LightShape,
    /// Centre, metres.
    pub position: [f64; 3],
    /// The point that it faces. Default: the origin.
    #[serde(default)]
    pub target: [f64; 3],
    /// Side lengths (diameters of an ellipse), metres.
    pub size: [f64; 2],
    /// Power, watts.
    pub power: f64,
    /// Colour, scene-linear. Default: white.
    #[serde(default = "default_color")]
    pub color: LinearRgb,
}

impl AreaLight {
    /// A white rectangle that faces the origin; lengths in metres, watts.
    pub fn new(position: [f64; 3], size: [f64; 2], power: f64) -> Self {
        Self {
            shape: LightShape::Rectangle,
            position,
            target: [0.0; 3],
            size,
            power,
            color: LinearRgb::WHITE,
        }
    }
}

/// Outline of an area light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightShape {
    /// A rectangle (or square).
    #[default]
    Rectangle,
    /// An ellipse (or disk).
    Ellipse,
}

/// Factor from rendered radiance to plate values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Exposure {
    /// `2^ev`.
    Ev(f64),
    /// Found by the `light` stage: a matte white card on the surface becomes as bright as the
    /// plate's own white, times `2^gain_ev`.
    MatchPlate {
        /// EV, relative to the match.
        gain_ev: f64,
    },
    /// Found by the `light` stage: a matte card of this albedo on the surface becomes as bright as
    /// the surface itself in the plate, times `2^gain_ev`.
    MatchSurface {
        /// Share of light that the surface reflects.
        albedo: Albedo,
        /// EV, relative to the match.
        gain_ev: f64,
    },
}

/// Colour by which all lights and the constant environment are multiplied.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightTint {
    /// This one.
    Known(LinearRgb),
    /// Found by the `light` stage: the colour of the surface in the plate over its albedo, to the
    /// power of `share`.
    MatchSurface {
        /// 0 keeps white light, 1 takes all of the colour.
        share: f64,
        /// Albedo of the surface. Default: neutral.
        #[serde(default = "default_color", skip_serializing_if = "is_white")]
        albedo: LinearRgb,
    },
}

impl Default for LightTint {
    fn default() -> Self {
        Self::Known(LinearRgb::WHITE)
    }
}

impl LightTint {
    /// Whether it changes nothing.
    pub fn is_white(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Ev(0.0)
    }
}

pub(super) fn is_white(color: &LinearRgb) -> bool {
    *color == LinearRgb::WHITE
}

fn default_color() -> LinearRgb {
    LinearRgb::WHITE
}
