//! The paper's sources of variation, switched off one at a time.
//!
//! Draws are keyed by their path and not by what was drawn before, so two recipes that differ in
//! one switch give scenes that differ in nothing else: scene `k` of one and scene `k` of the other
//! are a pair.

use serde::{Deserialize, Serialize};

/// A source of variation that a recipe can do without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variation {
    /// Change of the objects' colours: they keep those of their photos.
    Colour,
    /// Labelled photos of the place: only the first is used, for pictures without objects too.
    Viewpoint,
    /// Photos of an asset: only its first is used.
    Photo,
    /// Where lights are, how bright and of which colour: each stays at the middle of its ranges.
    /// How large they are, which is how soft shadows are, still varies.
    Light,
    /// New choices of objects for every scene: there are only 50, as in the paper.
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
    /// Name, as of its folder.
    pub name: &'static str,
    /// What is off.
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
