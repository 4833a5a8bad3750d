//! Contents of a scene file of the reference renderer; lengths in metres, matrices by rows.

use crate::pixel::LinearRgb;
use crate::scene::{Grade, LightShape};
use serde::{Deserialize, Serialize};

/// The whole file. Keys that only Blender needs (physics, material) are ignored.
#[derive(Serialize, Deserialize)]
pub(super) struct CyclesFile {
    pub(super) render: CyclesRender,
    pub(super) camera: CyclesCamera,
    pub(super) tray: CyclesTray,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) plate: Option<CyclesPicture>,
    pub(super) quads: Vec<CyclesQuad>,
    #[serde(default)]
    pub(super) lights: Vec<CyclesLight>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) environment: Option<CyclesEnvironment>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) ground: Option<CyclesGround>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesRender {
    pub(super) width: u32,
    pub(super) height: u32,
    #[serde(default)]
    pub(super) samples: u32,
    #[serde(default)]
    pub(super) max_bounces: u32,
}

#[derive(Serialize, Deserialize)]
#[expect(non_snake_case, reason = "the keys of the file")]
pub(super) struct CyclesCamera {
    pub(super) K: [[f64; 3]; 3],
    pub(super) R: [[f64; 3]; 3],
    pub(super) t: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) resolution: Option<[u32; 2]>,
    /// The least and the greatest visible depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) clip: Option<[f64; 2]>,
    /// OpenCV's first coefficient of radial distortion.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) k1: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) aperture: Option<CyclesAperture>,
}

/// Diameter of the aperture, and the depth in focus.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct CyclesAperture {
    pub(super) diameter: f64,
    pub(super) focus: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesTray {
    pub(super) size: [f64; 2],
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesGround {
    pub(super) extent: [f64; 2],
    /// For interreflection, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) albedo: Option<f32>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesPicture {
    pub(super) path: String,
}

/// A card; `texture` is premultiplied; with a `film`, which is its opacity per channel, `texture`
/// is what the film adds.
#[derive(Serialize, Deserialize)]
pub(super) struct CyclesQuad {
    pub(super) id: u32,
    pub(super) size: [f64; 2],
    pub(super) pose: [[f64; 4]; 4],
    #[serde(flatten)]
    pub(super) front: CyclesSide,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) back: Option<CyclesSide>,
    #[serde(default)]
    pub(super) hue_shift: f32,
    #[serde(default = "one")]
    pub(super) saturation: f32,
    #[serde(default = "one")]
    pub(super) value: f32,
}

impl CyclesQuad {
    pub(super) fn grade(&self) -> Grade {
        Grade {
            hue_deg: self.hue_shift,
            saturation: self.saturation,
            value: self.value,
            ..Grade::default()
        }
    }
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesSide {
    pub(super) texture: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) film: Option<String>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct CyclesLight {
    #[serde(default)]
    pub(super) shape: CyclesShape,
    pub(super) size: CyclesSize,
    pub(super) power: f64,
    #[serde(default = "white")]
    pub(super) color: LinearRgb,
    pub(super) position: [f64; 3],
    #[serde(default)]
    pub(super) target: [f64; 3],
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum CyclesShape {
    #[default]
    Rectangle,
    Square,
    Disk,
    Ellipse,
}

impl From<CyclesShape> for LightShape {
    fn from(shape: CyclesShape) -> Self {
        match shape {
            CyclesShape::Rectangle | CyclesShape::Square => Self::Rectangle,
            CyclesShape::Disk | CyclesShape::Ellipse => Self::Ellipse,
        }
    }
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum CyclesSize {
    One(f64),
    Two([f64; 2]),
}

impl CyclesSize {
    /// Both sides.
    pub(super) fn sides(self) -> [f64; 2] {
        match self {
            Self::One(side) => [side; 2],
            Self::Two(sides) => sides,
        }
    }
}

/// A constant colour, or a picture; degrees.
#[derive(Serialize, Deserialize)]
pub(super) struct CyclesEnvironment {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) color: Option<LinearRgb>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) path: Option<String>,
    #[serde(default = "one")]
    pub(super) strength: f32,
    #[serde(default)]
    pub(super) rotation_z: f64,
}

fn one() -> f32 {
    1.0
}

fn white() -> LinearRgb {
    LinearRgb::WHITE
}
