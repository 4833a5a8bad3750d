//! The paper's sources of variation, switched off one at a time.
//!
//! Draws are keyed by their path and not by what was drawn before, so scenes of two recipes that
//! differ in one switch differ in nothing else: scene `k` of one and scene `k` of the other are a
//! pair.

use serde::{Deserialize, Serialize};

/// A source of variation that a recipe can switch off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variation {
    /// Change of the objects' colours; if off, they are those of the photos.
    Colour,
    /// Labelled photos of the place; if off, only the first is used, also for pictures without
    /// objects.
    Viewpoint,
    /// Photos of an asset; if off, only its first is used.
    Photo,
    /// Position, brightness and colour of lights; if off, each stays at the middle of its ranges.
    /// Their size, and so the softness of shadows, still varies.
    Light,
    /// New selections of objects for every scene; if off, there are only 50, as in the paper.
    Selection,
}

impl Variation {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Colour,
        Self::Viewpoint,
        Self::Photo,
        Self::Light,
        Self::Selection,
    ];
}

/// A dataset of the paper's Table 1: which sources of variation are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ablation {
    /// Name, also of its folder.
    pub name: &'static str,
    /// Sources that are off.
    pub off: &'static [Variation],
}

impl Ablation {
    /// The paper's datasets, in its order.
    pub const PAPER: [Self; 7] = [
        Self::new("all", &[]),
        Self::new("original_colour", &[Variation::Colour]),
        Self::new("single_viewpoint", &[Variation::Viewpoint]),
        Self::new("single_photo", &[Variation::Photo]),
        Self::new("single_light", &[Variation::Light]),
        Self::new("repeat_selections", &[Variation::Selection]),
        Self::new("all_off", &Variation::ALL),
    ];

    const fn new(name: &'static str, off: &'static [Variation]) -> Self {
        Self { name, off }
    }
}
