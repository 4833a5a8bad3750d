//! Walls along the edges of the surface: how high, and how far they lean outwards.

use crate::bounds::{SLOPE, WALL_HEIGHT};
use crate::error::Result;
use crate::geom::Vector3;
use crate::scene::{Draws, Range};
use serde::{Deserialize, Serialize};

/// Height of a wall of unknown height, as a share of the surface's shorter side: a lip that stops
/// sliding objects.
const LIP_RATIO: f64 = 0.05;

/// Walls along all edges of a surface. An object that goes over their rim is gone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Height of the rim over the surface, metres; 0 is a table without walls.
    pub height: f64,
    /// How far the walls lean outwards, degrees from upright. Default: 0.
    #[serde(default)]
    pub slope_deg: f64,
}

impl Wall {
    /// A wall along a surface of this size, possibly with unknown values: a missing height is that
    /// of a lip, a missing slope is 0.
    pub fn new(size: [f64; 2], height: Option<f64>, slope_deg: Option<f64>) -> Self {
        Self {
            height: height.unwrap_or(LIP_RATIO * size[0].min(size[1])),
            slope_deg: slope_deg.unwrap_or(0.0),
        }
    }

    /// Distance of the rim outside the surface's edges, metres.
    pub fn outset(&self) -> f64 {
        self.height * libm::tan(self.slope_deg.to_radians())
    }

    /// The inner sides of the four walls of a surface: each from its lower left corner, clockwise
    /// as seen from the middle.
    pub fn inner_faces(&self, size: [f64; 2]) -> [[Vector3<f64>; 4]; 4] {
        let (edge, out) = (size.map(|side| side / 2.0), self.outset());
        let rim = edge.map(|half| half + out);
        let (low, high) = (rectangle_at(0.0, edge), rectangle_at(self.height, rim));
        [0, 1, 2, 3].map(|i| {
            let next = (i + 1) % 4;
            [low[i], high[i], high[next], low[next]]
        })
    }

    pub(super) fn check(&self) -> Result<()> {
        WALL_HEIGHT.check("surface.wall.height", self.height)?;
        SLOPE.check("surface.wall.slope_deg", self.slope_deg)
    }
}

/// Corners of a level rectangle with these half sides, clockwise from above, from `(-x, y)`.
fn rectangle_at(z: f64, [x, y]: [f64; 2]) -> [Vector3<f64>; 4] {
    [[-x, y], [x, y], [x, -y], [-x, -y]].map(|[x, y]| Vector3::new(x, y, z))
}

/// Ranges of a scene's walls, which override the background's label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WallRanges {
    /// Height of the rim over the surface, metres. Default: the label's, or a lip of a twentieth of
    /// the surface's shorter side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<Range>,
    /// How far the walls lean outwards, degrees from upright. Default: the label's, or 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope_deg: Option<Range>,
}

impl WallRanges {
    /// Walls along a surface of this size with the label `labelled`.
    pub(super) fn draw(&self, draws: &Draws, size: [f64; 2], labelled: Option<Wall>) -> Wall {
        let height = Range::draw_optional(self.height, draws, "walls.height");
        let slope_deg = Range::draw_optional(self.slope_deg, draws, "walls.slope_deg");
        Wall::new(
            size,
            height.or(labelled.map(|wall| wall.height)),
            slope_deg.or(labelled.map(|wall| wall.slope_deg)),
        )
    }

    pub(super) fn check(&self) -> Result<()> {
        Range::check_optional(self.height, "walls.height", &WALL_HEIGHT)?;
        Range::check_optional(self.slope_deg, "walls.slope_deg", &SLOPE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inner_faces_lie_on_planes_that_lean_outwards() {
        let (size, slope) = ([0.56, 0.37], 8_f64.to_radians());
        let wall = Wall {
            height: 0.075,
            slope_deg: 8.0,
        };
        let inward = [[0.0, -1.0], [-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
        for (face, [x, y]) in wall.inner_faces(size).iter().zip(inward) {
            let normal = Vector3::new(x * slope.cos(), y * slope.cos(), slope.sin());
            let half = if x == 0.0 { size[1] } else { size[0] } / 2.0;
            for corner in face {
                assert!((normal.dot(corner) + half * slope.cos()).abs() < 1e-12);
            }
            assert_eq!(
                [face[0].z, face[1].z, face[2].z, face[3].z],
                [0.0, 0.075, 0.075, 0.0]
            );
            // Its first three corners run clockwise as seen from the middle.
            let turn = (face[1] - face[0]).cross(&(face[2] - face[1]));
            assert!(turn.dot(&normal) < 0.0);
        }
    }

    #[test]
    fn what_the_recipe_says_wins_over_the_label_key_by_key() {
        let labelled = Some(Wall {
            height: 0.075,
            slope_deg: 8.0,
        });
        let ranges = WallRanges {
            slope_deg: Some(Range::fixed(20.0)),
            ..WallRanges::default()
        };
        let draws = Draws::new(0, 0);
        let drawn = ranges.draw(&draws, [0.6, 0.4], labelled);
        assert_eq!([drawn.height, drawn.slope_deg], [0.075, 20.0]);
        let lip = WallRanges::default().draw(&draws, [0.6, 0.4], None);
        assert_eq!([lip.height, lip.slope_deg], [0.05 * 0.4, 0.0]);
    }

    #[test]
    fn impossible_walls_are_told() {
        let told = |text: &str| {
            let ranges: WallRanges = toml::from_str(text).unwrap();
            ranges.check().unwrap_err().to_string()
        };
        assert!(told("height = -0.1").starts_with("walls.height: -0.1, expected 0 to 50 m"));
        assert!(told("slope_deg = [10, 90]").starts_with("walls.slope_deg: [10, 90], expected"));
    }
}
