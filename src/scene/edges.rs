//! How the edges of cut-outs are treated.

use crate::scene::Draws;
use serde::{Deserialize, Serialize};

/// Treatment of the edges of all objects in a picture. Labels are those of [`AsIs`](Self::AsIs)
/// whatever it is, so that a detector cannot find objects by how they were pasted.
///
/// Several treatments side by side: [Dwibedi, Misra and Hebert 2017], who paste each object with
/// several blendings.
///
/// [Dwibedi, Misra and Hebert 2017]: https://arxiv.org/abs/1708.01642
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeTreatment {
    /// As the cut-out has them.
    #[default]
    AsIs,
    /// Softer by a Gaussian of half a pixel.
    Soft,
    /// Half a pixel further in.
    Eroded,
    /// Blended into what is behind along the outline.
    Poisson,
}

impl EdgeTreatment {
    /// Whether they are left alone.
    pub fn are_as_is(&self) -> bool {
        *self == Self::AsIs
    }

    /// Whether cut-outs themselves are changed, not the picture that they are in.
    pub fn reshape_cut_outs(&self) -> bool {
        matches!(self, Self::Soft | Self::Eroded)
    }

    /// One of some; as they are, and nothing drawn, where there is none.
    pub(super) fn draw(choices: &[Self], draws: &Draws) -> Self {
        match choices.len() {
            0 => Self::AsIs,
            n => choices[draws.choose("edges", n)],
        }
    }
}
