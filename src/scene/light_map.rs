//! Distribution of the light over the surface.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::filter::sample_bilinear_clamped;
use crate::image::Image;
use crate::scene::bounds::SHARE;
use crate::scene::check::{MAX_CELLS, is_grid};
use serde::{Deserialize, Serialize};

const FACTOR: Bounds = Bounds::new(0.0, 1000.0, "light a thousand times as bright as elsewhere");

/// Factors on the light that falls on objects, by their position over the surface: the effect of
/// lamps that the scene does not contain.
///
/// The surface itself stays as in its plate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightMap {
    /// One factor per cell of a grid over the surface, in rows from its upper edge to its lower
    /// one, each from left to right; bilinear between the centres of cells, and clamped to the
    /// nearest cell beyond. Empty: the same everywhere.
    Known(Vec<Vec<f32>>),
    /// Found by the `light` stage: the brightness of the surface in the plate over its median, as
    /// far as the scene's own lights do not explain it, to the power of `share`.
    MatchSurface {
        /// 0 is the same everywhere, 1 takes all of the plate's gradients.
        share: f64,
    },
}

impl Default for LightMap {
    fn default() -> Self {
        Self::Known(Vec::new())
    }
}

impl LightMap {
    /// Whether it changes nothing.
    pub fn is_even(&self) -> bool {
        *self == Self::default()
    }

    /// Fails on rows that are not a grid of factors, and on an invalid share.
    pub(super) fn check(&self) -> Result<()> {
        match self {
            Self::Known(rows) => check_rows(rows),
            Self::MatchSurface { share } => SHARE.check("light_map.match_surface.share", *share),
        }
    }
}

fn check_rows(rows: &[Vec<f32>]) -> Result<()> {
    if !is_grid(rows) {
        let what =
            format!("{rows:?}, expected at most {MAX_CELLS} rows with equal numbers of factors");
        return Err(Error::value("light_map.known", what));
    }
    let mut factors = rows.iter().flatten();
    factors.try_for_each(|&factor| FACTOR.check("light_map.known", f64::from(factor)))
}

/// A light map over a surface of known size.
#[derive(Clone, Debug)]
pub struct LightGrid {
    factors: Image<f32>,
    size: [f64; 2],
}

impl LightGrid {
    /// None for empty rows.
    pub(crate) fn new(rows: &[Vec<f32>], size: [f64; 2]) -> Option<Self> {
        let columns = rows.first()?.len();
        Some(Self {
            factors: Image::from_vec(columns, rows.len(), rows.concat()),
            size,
        })
    }

    /// The factor over a point of the surface.
    pub(crate) fn factor_at(&self, x: f64, y: f64) -> f32 {
        let [u, v] = [x / self.size[0] + 0.5, 0.5 - y / self.size[1]];
        let (columns, rows) = self.factors.size();
        sample_bilinear_clamped(&self.factors, u * columns as f64, v * rows as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_lie_in_the_middle_of_their_cells_and_are_linear_between() {
        let rows = [vec![1.0, 2.0], vec![3.0, 5.0]];
        let grid = LightGrid::new(&rows, [0.4, 0.2]).unwrap();
        for (at, factor) in [
            ([-0.1, 0.05], 1.0),
            ([0.1, 0.05], 2.0),
            ([-0.1, -0.05], 3.0),
            ([0.1, -0.05], 5.0),
            ([0.0, 0.05], 1.5),
            ([0.0, 0.0], 2.75),
            ([-0.9, 0.9], 1.0),
        ] {
            assert!(
                (grid.factor_at(at[0], at[1]) - factor).abs() < 1e-6,
                "{at:?}"
            );
        }
    }

    #[test]
    fn what_is_no_grid_of_factors_is_refused() {
        let told = |rows: &[&[f32]]| {
            let rows = rows.iter().map(|row| row.to_vec()).collect();
            LightMap::Known(rows).check().unwrap_err().to_string()
        };
        assert!(told(&[&[1.0, 2.0], &[1.0]]).contains("light_map.known: "));
        assert!(told(&[&[]]).contains("rows with equal numbers of factors"));
        assert!(told(&[&[1.0, -1.0]]).contains("-1"));
        assert!(told(&[&[f32::NAN]]).contains("light_map.known"));
        let share = LightMap::MatchSurface { share: 1.5 };
        assert!(share.check().is_err());
        assert!(LightMap::Known(vec![vec![0.5, 2.0]]).check().is_ok());
    }
}
