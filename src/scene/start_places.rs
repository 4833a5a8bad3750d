//! Where objects start over the surface: anywhere, from a heap to evenly spread, or by a histogram.

use crate::error::{Error, Result};
use crate::scene::bounds::SHARE;
use crate::scene::check::{MAX_CELLS, is_grid};
use crate::scene::draw::weighted_place;
use crate::scene::{Draws, DropRanges, Range};

/// Step of the even sequence from one point to the next: the inverse of the plastic number, and its
/// square.
const EVEN_STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

impl DropRanges {
    /// Fails on invalid places.
    pub(super) fn check_places(&self) -> Result<()> {
        self.check_positions()?;
        match &self.spread {
            Some(_) if !self.positions.is_empty() => Err(Error::value(
                "start.spread",
                "given together with start.positions, expected one of them",
            )),
            Some(spread) => spread.check("start.spread", &SHARE),
            None => Ok(()),
        }
    }

    fn check_positions(&self) -> Result<()> {
        let rows = &self.positions;
        if rows.is_empty() || (is_grid(rows) && are_weights(rows)) {
            return Ok(());
        }
        let what = format!(
            "{rows:?}, expected at most {MAX_CELLS} rows with equal numbers of weights, 0 or above and not all 0"
        );
        Err(Error::value("start.positions", what))
    }

    /// The start places of a scene's objects.
    pub(super) fn places<'a>(&'a self, draws: &'a Draws<'a>) -> StartPlaces<'a> {
        StartPlaces {
            start: self,
            even: self.spread.map(|spread| EvenPlaces::draw(&spread, draws)),
            draws,
        }
    }
}

fn are_weights(rows: &[Vec<f64>]) -> bool {
    let weights = || rows.iter().flatten();
    weights().all(|w| w.is_finite() && *w >= 0.0) && weights().sum::<f64>() > 0.0
}

/// Where the objects of one scene start.
pub(super) struct StartPlaces<'a> {
    start: &'a DropRanges,
    even: Option<EvenPlaces>,
    draws: &'a Draws<'a>,
}

impl StartPlaces<'_> {
    /// Where the middle of the `i`-th object starts, metres from the surface's middle. Its draws
    /// are at `path`; `half` are the half sides of the surface, and within `free` of the middle the
    /// object is between the walls.
    ///
    /// Places of a histogram and of the even sequence cover the whole surface: an object that would
    /// reach through a wall is moved up to it.
    pub(super) fn place(&self, i: usize, path: &str, half: [f64; 2], free: [f64; 2]) -> [f64; 2] {
        let at = match &self.even {
            Some(even) => even.place(i, self.start),
            None if self.start.positions.is_empty() => return self.anywhere(path, free),
            None => self.in_cell(path),
        };
        [0, 1].map(|axis| (at[axis] * half[axis]).clamp(-free[axis].max(0.0), free[axis].max(0.0)))
    }

    fn anywhere(&self, path: &str, [free_x, free_y]: [f64; 2]) -> [f64; 2] {
        let x = self.start.x.draw_field(self.draws, path, "x");
        let y = self.start.y.draw_field(self.draws, path, "y");
        [x * free_x, y * free_y]
    }

    /// A point of a cell drawn by its weight.
    fn in_cell(&self, path: &str) -> [f64; 2] {
        let rows = &self.start.positions;
        let (row, column) = self.draw_cell(path);
        // The first row is the upper one.
        let y = cell(&self.start.y, rows.len() - 1 - row, rows.len());
        let x = cell(&self.start.x, column, rows[row].len());
        [(x, "x"), (y, "y")].map(|(range, name)| range.draw_field(self.draws, path, name))
    }

    /// Row and column of a cell.
    fn draw_cell(&self, path: &str) -> (usize, usize) {
        let rows = &self.start.positions;
        let columns = rows[0].len();
        let weights: Vec<f64> = rows.concat();
        let sum = Range::new(0.0, weights.iter().sum());
        let place = weighted_place(&weights, sum.draw_field(self.draws, path, "cell"));
        (place / columns, place % columns)
    }
}

/// One of `of` equal parts of a range.
fn cell(range: &Range, i: usize, of: usize) -> Range {
    let [low, high] = [i, i + 1].map(|end| end as f64 / of as f64);
    let length = range.max - range.min;
    Range::new(range.min + low * length, range.min + high * length)
}

/// Points that cover the surface evenly, however many there are, contracted towards the middle.
///
/// # Method
/// The sequence R2 of [Roberts 2018], shifted by a random offset modulo 1 (Cranley and Patterson
/// 1976).
///
/// [Roberts 2018]: https://extremelearning.com.au/unreasonable-effectiveness-of-quasirandom-sequences/
struct EvenPlaces {
    /// 0: all in the middle; 1: all over the surface.
    spread: f64,
    offset: [f64; 2],
}

impl EvenPlaces {
    fn draw(spread: &Range, draws: &Draws) -> Self {
        let unit = Range::new(0.0, 1.0);
        Self {
            spread: spread.draw(draws, "start.spread"),
            offset: ["x", "y"].map(|name| unit.draw_field(draws, "start.offset", name)),
        }
    }

    /// Place of the `i`-th object, as a share of the surface's half sides.
    fn place(&self, i: usize, start: &DropRanges) -> [f64; 2] {
        [(0, start.x), (1, start.y)].map(|(axis, range)| {
            let share = (self.offset[axis] + i as f64 * EVEN_STEP[axis]).fract();
            let middle = range.middle().min;
            let even = range.min + share * (range.max - range.min);
            middle + self.spread * (even - middle)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: [f64; 2] = [0.3, 0.2];

    fn start_path(i: usize) -> String {
        format!("objects[{i}].start")
    }

    fn starts(start: &DropRanges, count: usize) -> Vec<[f64; 2]> {
        let draws = Draws::new(5, 1);
        let places = start.places(&draws);
        (0..count)
            .map(|i| places.place(i, &start_path(i), HALF, HALF))
            .collect()
    }

    fn spread(share: f64) -> DropRanges {
        DropRanges {
            spread: Some(Range::fixed(share)),
            ..DropRanges::default()
        }
    }

    /// Share of a 4 x 4 grid of cells that some place is in.
    fn covered(places: &[[f64; 2]]) -> usize {
        let mut cells: Vec<[usize; 2]> = places
            .iter()
            .map(|at| [0, 1].map(|axis| ((at[axis] / HALF[axis] + 1.0) * 2.0) as usize))
            .collect();
        cells.sort_unstable();
        cells.dedup();
        cells.len()
    }

    #[test]
    fn spread_leads_from_a_heap_to_an_even_cover() {
        assert!(starts(&spread(0.0), 9).iter().all(|at| *at == [0.0, 0.0]));
        // 16 random places are in 10 of 16 cells: 16 (1 - (15/16)^16).
        assert!(covered(&starts(&spread(1.0), 16)) >= 13);
        let [half, whole] = [0.5, 1.0].map(|share| starts(&spread(share), 7));
        for (a, b) in half.iter().zip(&whole) {
            assert!((0..2).all(|axis| (2.0 * a[axis] - b[axis]).abs() < 1e-12));
        }
    }

    #[test]
    fn one_more_object_moves_no_other() {
        assert_eq!(starts(&spread(0.7), 4), starts(&spread(0.7), 9)[..4]);
    }

    #[test]
    fn what_would_reach_through_a_wall_is_moved_up_to_it() {
        let draws = Draws::new(5, 1);
        let start = spread(1.0);
        let places = start.places(&draws);
        let along_walls = (0..64)
            .filter(|&i| places.place(i, &start_path(i), HALF, [0.15, 0.1])[0].abs() == 0.15);
        // Half of the width is nearer to a wall than the object's half.
        assert!((28..=36).contains(&along_walls.count()));
    }

    #[test]
    fn cells_are_drawn_by_their_weights() {
        let start = DropRanges {
            positions: vec![vec![3.0, 0.0, 0.0], vec![0.0, 0.0, 1.0]],
            ..DropRanges::default()
        };
        start.check_places().unwrap();
        let places = starts(&start, 400);
        let upper_left = |at: &&[f64; 2]| at[0] <= -0.1 && at[1] >= 0.0;
        let lower_right = |at: &&[f64; 2]| at[0] >= 0.1 && at[1] <= 0.0;
        let counts = [
            places.iter().filter(upper_left).count(),
            places.iter().filter(lower_right).count(),
        ];
        assert_eq!(counts.iter().sum::<usize>(), 400);
        // Binomial: standard deviation 8.7.
        assert!(counts[0].abs_diff(300) < 35, "{counts:?}");
    }

    #[test]
    fn impossible_places_are_told() {
        let told = |text: &str| {
            let start: DropRanges = toml::from_str(text).unwrap();
            start.check_places().unwrap_err().to_string()
        };
        for text in ["[[1, 2], [3]]", "[[0, 0]]", "[[1, -1]]", "[[]]"] {
            let reported = told(&format!("positions = {text}"));
            assert!(reported.starts_with("start.positions: [["), "{reported}");
        }
        assert_eq!(
            told("spread = 1.5"),
            "start.spread: 1.5, expected 0 to 1 (a share)"
        );
        let both = told("spread = 1\npositions = [[1]]");
        assert_eq!(
            both,
            "start.spread: given together with start.positions, expected one of them"
        );
    }
}
