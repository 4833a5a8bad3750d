//! Where light comes from that no recipe knows.

use crate::bounds::Bounds;
use crate::error::Result;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

const DEVIATION: Bounds = Bounds::new(-10.0, 10.0, "standard deviations of the estimate");

/// Evenly spread numbers of this range have a standard deviation of 1.
const UNIT_DEVIATION: f64 = 1.732_050_807_568_877_2;

/// Where a scene's first light stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightDirection {
    /// Where the scene says.
    #[default]
    Known,
    /// Found by the `light` stage: by which of the surface's walls the plate shows bright. The light
    /// keeps its height and size; what comes from all around is found with it.
    MatchWalls {
        /// How far from the estimate it stands, standard deviations: about the vertical, and in the
        /// tilt from it.
        deviations: [f64; 2],
    },
}

impl LightDirection {
    /// Whether nothing is to be found.
    pub fn is_known(&self) -> bool {
        *self == Self::Known
    }

    pub(super) fn check(&self) -> Result<()> {
        match self {
            Self::Known => Ok(()),
            Self::MatchWalls { deviations } => deviations
                .iter()
                .try_for_each(|d| DEVIATION.check("light_direction.match_walls.deviations", *d)),
        }
    }
}

/// What the direction of a recipe's first light is drawn from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightDirectionSource {
    /// The ranges of the light.
    #[default]
    Drawn,
    /// What the walls in the photo tell of it, within the error of that.
    MatchWalls,
    /// The same, as if it had no error.
    MatchWallsExactly,
}

impl LightDirectionSource {
    /// Whether it is the light's own ranges.
    pub fn is_drawn(&self) -> bool {
        *self == Self::Drawn
    }

    /// The direction that does not vary beyond the ranges of the light.
    pub(super) fn at_middle(self) -> Self {
        match self {
            Self::Drawn => Self::Drawn,
            Self::MatchWalls | Self::MatchWallsExactly => Self::MatchWallsExactly,
        }
    }

    pub(super) fn draw(self, draws: &Draws) -> LightDirection {
        match self {
            Self::Drawn => LightDirection::Known,
            Self::MatchWalls => LightDirection::MatchWalls {
                deviations: ["azimuth", "tilt"].map(|name| {
                    let within = Range::new(-UNIT_DEVIATION, UNIT_DEVIATION);
                    within.draw(draws, &format!("light_direction.{name}"))
                }),
            },
            Self::MatchWallsExactly => LightDirection::MatchWalls {
                deviations: [0.0; 2],
            },
        }
    }
}
