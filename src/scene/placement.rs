//! Objects and where they are.

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
    /// What it is in the picture for: a distractor has no label, whatever its asset is; an asset
    /// that is a distractor never has one. Default: `object`.
    #[serde(default, skip_serializing_if = "Role::is_object")]
    pub role: Role,
    /// Which of the asset's photos, from 0.
    #[serde(default)]
    pub photo: usize,
    /// Which photo its back shows; by default the same one, seen through.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub back: Option<usize>,
    /// Width and height of the card, metres.
    pub size: [f64; 2],
    /// Thickness of the body that falls, metres.
    pub thickness: f64,
    /// Corners of the convex prism that falls, counter-clockwise, in the card's plane (x right, y
    /// up from its middle), metres; empty where the whole card falls as a box.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outline: Vec<[f64; 2]>,
    /// Mass, kilograms.
    pub mass: f64,
    /// Where the card is, or from where it falls.
    pub placement: Placement,
    /// Change of its colours.
    #[serde(default)]
    pub grade: Grade,
    /// How its card is curved; its body falls as a flat one.
    #[serde(default, skip_serializing_if = "Bend::is_flat")]
    pub bend: Bend,
}

impl Object {
    /// Makes it larger by a factor, its mass with its volume.
    pub(super) fn scale_by(&mut self, factor: f64) {
        self.size = self.size.map(|length| length * factor);
        for corner in &mut self.outline {
            *corner = corner.map(|length| length * factor);
        }
        self.thickness *= factor;
        self.mass *= factor * factor * factor;
    }
}

/// Paths of the draws of each object, distractors coming last: `objects[2]`, `distractors[0]`. Each
/// role has numbers of its own, so that one more of either moves no draw of the other.
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

/// Where an object is, or how it gets there.
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
    /// Went over the rim: in no picture.
    Gone,
}

/// A change of colour: a dye in what is see-through, the strength of glints, then hue, saturation
/// and value of the linear colour; the default changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Grade {
    /// Hue turned by this many degrees. Default: 0.
    pub hue_deg: f32,
    /// Saturation times this, then clamped to 0..1. Default: 1.
    pub saturation: f32,
    /// Value times this. Default: 1.
    pub value: f32,
    /// Transmittance of a dye in see-through plastic, on top of its own colour. Default: 1, 1, 1.
    #[serde(skip_serializing_if = "is_white")]
    pub tint: LinearRgb,
    /// Glints of the studio's light times this. Default: 1.
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
