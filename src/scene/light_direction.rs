//! Direction of the light, if the recipe does not give it.

use crate::bounds::Bounds;
use crate::error::Result;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

const DEVIATION: Bounds = Bounds::new(-10.0, 10.0, "standard deviations of the estimate");

/// Factor that gives uniform numbers in this range a standard deviation of 1.
const UNIT_DEVIATION: f64 = 1.732_050_807_568_877_2;

/// Position of a scene's first light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightDirection {
    /// As the scene gives it.
    #[default]
    Known,
    /// Found by the `light` stage from which of the surface's walls are bright in the plate. The
    /// light keeps its height and size; the ambient light is found with it.
    MatchWalls {
        /// Deviation from the estimate, in standard deviations: in azimuth, and in the tilt from
        /// the vertical.
        deviations: [f64; 2],
    },
}

impl LightDirection {
    /// Whether there is nothing to find.
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

/// Source of the direction of a recipe's first light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightDirectionSource {
    /// The ranges of the light.
    #[default]
    Drawn,
    /// Estimated from the walls in the photo, within the error of the estimate.
    MatchWalls,
    /// The same, without the error.
    MatchWallsExactly,
}

impl LightDirectionSource {
    /// Whether it is the light's own ranges.
    pub fn is_drawn(&self) -> bool {
        *self == Self::Drawn
    }

    /// The direction without variation beyond the ranges of the light.
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
