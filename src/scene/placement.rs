//! Objects and their placement.

use crate::asset::Role;
use crate::geom::{Pose, UnitQuaternion};
use crate::pixel::LinearRgb;
use crate::scene::Bend;
use crate::scene::light::is_white;
use serde::{Deserialize, Serialize};

/// One occurrence of an asset in a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name of the asset.
    pub asset: String,
    /// Its role in the picture: a distractor has no label, whatever its asset is; an asset that is
    /// a distractor never has one. Default: `object`.
    #[serde(default, skip_serializing_if = "Role::is_object")]
    pub role: Role,
    /// Which of the asset's photos, from 0.
    #[serde(default)]
    pub photo: usize,
    /// Photo that its back shows; by default its front, seen through.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back: Option<usize>,
    /// Width and height of the card, metres.
    pub size: [f64; 2],
    /// Thickness of the falling body, metres.
    pub thickness: f64,
    /// Corners of the falling convex prism, counter-clockwise, in the card's plane (x right, y up
    /// from its middle), metres; empty if the whole card falls as a box.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outline: Vec<[f64; 2]>,
    /// Mass, kilograms.
    pub mass: f64,
    /// Where the card is, or where it falls from.
    pub placement: Placement,
    /// Change of its colours.
    #[serde(default)]
    pub grade: Grade,
    /// Bend of its card; its body falls like a flat one.
    #[serde(default, skip_serializing_if = "Bend::is_flat")]
    pub bend: Bend,
}

impl Object {
    /// An object of this width and height, thickness (metres) and mass (kilograms) that shows its
    /// asset's first photo, unbent and in its own colours, and falls as a box.
    pub fn new(
        asset: impl Into<String>,
        size: [f64; 2],
        thickness: f64,
        mass: f64,
        placement: Placement,
    ) -> Self {
        Self {
            asset: asset.into(),
            role: Role::default(),
            photo: 0,
            back: None,
            size,
            thickness,
            outline: Vec::new(),
            mass,
            placement,
            grade: Grade::default(),
            bend: Bend::default(),
        }
    }

    /// Scales it by a factor; the mass follows the volume.
    pub(super) fn scale_by(&mut self, factor: f64) {
        self.size = self.size.map(|length| length * factor);
        for corner in &mut self.outline {
            *corner = corner.map(|length| length * factor);
        }
        self.thickness *= factor;
        self.mass *= factor * factor * factor;
    }
}

/// Paths of the draws of each object: `objects[2]`, `distractors[0]`; distractors come last. Each
/// role has its own numbering, so that one more of either changes no draw of the other.
pub(super) fn draw_paths(objects: &[Object]) -> Vec<String> {
    let count = objects
        .iter()
        .filter(|object| object.role.is_object())
        .count();
    let indices = 0..objects.len();
    indices
        .map(|i| match i.checked_sub(count) {
            None => format!("objects[{i}]"),
            Some(j) => format!("distractors[{j}]"),
        })
        .collect()
}

/// Where an object is, or where it starts to fall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Placement {
    /// At rest at this pose (`world_from_card`).
    At(Pose),
    /// Falls from here under gravity.
    Drop {
        /// Point of the surface it starts above, metres.
        above: [f64; 2],
        /// Height of its centre over the surface, metres.
        height: f64,
        /// Its orientation at the start.
        rotation: UnitQuaternion<f64>,
    },
    /// Went over the rim and is in no picture.
    Gone,
}

/// Colour change: a dye in see-through plastic, the strength of glints, then hue, saturation and
/// value of the linear colour; the default changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Grade {
    /// Hue shift, degrees. Default: 0.
    pub hue_deg: f32,
    /// Factor on the saturation, which is then clamped to 0..1. Default: 1.
    pub saturation: f32,
    /// Factor on the value. Default: 1.
    pub value: f32,
    /// Transmittance of a dye in see-through plastic, on top of its own colour. Default: 1, 1, 1.
    #[serde(skip_serializing_if = "is_white")]
    pub tint: LinearRgb,
    /// Factor on glints, which come from the studio's light. Default: 1.
    #[serde(skip_serializing_if = "is_one")]
    pub glints: f32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
fn is_one(factor: &f32) -> bool {
    *factor == 1.0
}

impl Grade {
    /// Whether plastic is dyed or glints are changed.
    pub fn changes_surface(&self) -> bool {
        !is_white(&self.tint) || !is_one(&self.glints)
    }
}

impl Default for Grade {
    fn default() -> Self {
        Self {
            hue_deg: 0.0,
            saturation: 1.0,
            value: 1.0,
            tint: LinearRgb::WHITE,
            glints: 1.0,
        }
    }
}
