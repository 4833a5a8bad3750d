//! Treatment of the edges of cut-outs.

use crate::scene::Draws;
use serde::{Deserialize, Serialize};

/// Treatment of the edges of all objects in a picture. Labels are always those of
/// [`AsIs`](Self::AsIs), so that a detector cannot find objects by how they were pasted.
///
/// Mixing several treatments follows [Dwibedi, Misra and Hebert 2017], who paste each object with
/// several blendings.
///
/// [Dwibedi, Misra and Hebert 2017]: https://arxiv.org/abs/1708.01642
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeTreatment {
    /// As in the cut-out.
    #[default]
    AsIs,
    /// Softened by a Gaussian of half a pixel.
    Soft,
    /// Moved inwards by half a pixel.
    Eroded,
    /// Blended into the background along the outline.
    Poisson,
}

impl EdgeTreatment {
    /// Whether edges are left unchanged.
    pub fn are_as_is(&self) -> bool {
        *self == Self::AsIs
    }

    /// Whether the cut-outs themselves are changed, rather than the finished picture.
    pub fn reshape_cut_outs(&self) -> bool {
        matches!(self, Self::Soft | Self::Eroded)
    }

    /// One of the choices; with none to choose from, nothing is drawn and edges stay as they are.
    pub(super) fn draw(choices: &[Self], draws: &Draws) -> Self {
        match choices.len() {
            0 => Self::AsIs,
            n => choices[draws.choose("edges", n)],
        }
    }
}
