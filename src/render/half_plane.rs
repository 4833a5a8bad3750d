//! Convex shapes row by row: where linear conditions on `(x, y, 1)` all hold.

use crate::geom::Vector3;
use crate::render::ranges::integer_range;
use std::ops::Range;

/// The `x` for which every `side . (x, y, 1)` is at least 0, as lowest and highest; reversed if
/// there is none.
pub(super) fn row_span(sides: &[Vector3<f64>], y: f64) -> (f64, f64) {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for side in sides {
        let rest = side.y * y + side.z;
        if side.x > 0.0 {
            low = low.max(-rest / side.x);
        } else if side.x < 0.0 {
            high = high.min(-rest / side.x);
        } else if rest < 0.0 {
            return (f64::INFINITY, f64::NEG_INFINITY);
        }
    }
    (low, high)
}

/// Maximum number of sides of a [`ConvexShape`]: an octagon's, and two planes that clip it.
const MAX_SIDES: usize = 10;

/// A convex shape, prepared for queries by row.
#[derive(Clone, Debug)]
pub(super) struct ConvexShape {
    /// Lines `x = a y + b` on its left, then those on its right, then conditions `a y + b >= 0` on
    /// whole rows.
    lines: [[f64; 2]; MAX_SIDES],
    /// End index of each kind.
    ends: [u8; 3],
}

impl ConvexShape {
    /// The shape where all conditions on `(x, y, 1)` hold, at most [`MAX_SIDES`] of them.
    pub(super) fn new(sides: &[Vector3<f64>]) -> Self {
        let mut shape = Self {
            lines: [[0.0; 2]; MAX_SIDES],
            ends: [0; 3],
        };
        shape.add_lines(0, sides, |side| (side.x > 0.0).then(|| crossing(side)));
        shape.add_lines(1, sides, |side| (side.x < 0.0).then(|| crossing(side)));
        shape.add_lines(2, sides, |side| (side.x == 0.0).then_some([side.y, side.z]));
        shape
    }

    /// Adds the lines of one kind, after those of the kinds before.
    fn add_lines(
        &mut self,
        kind: usize,
        sides: &[Vector3<f64>],
        line: impl Fn(&Vector3<f64>) -> Option<[f64; 2]>,
    ) {
        let start = kind.checked_sub(1).map_or(0, |before| self.ends[before]);
        let free = &mut self.lines[usize::from(start)..];
        let lines = free.iter_mut().zip(sides.iter().filter_map(line));
        let count = lines.map(|(place, line)| *place = line).count();
        self.ends[kind] = start + count as u8;
    }

    /// Lines on its left, on its right, and conditions on whole rows.
    #[inline(always)]
    fn kinds(&self) -> [&[[f64; 2]]; 3] {
        let [right, left, level] = self.ends.map(usize::from);
        [
            &self.lines[..right],
            &self.lines[right..left],
            &self.lines[left..level],
        ]
    }

    /// The nodes of row `j` of a lattice inside it.
    pub(super) fn nodes(&self, j: usize, within: &Range<usize>) -> Range<usize> {
        let (low, high) = self.row_span(j as f64);
        integer_range(low, high, within)
    }

    /// Left and right ends of `N` rows from row `first` on; reversed for an empty row.
    pub(super) fn row_spans<const N: usize>(&self, first: f64) -> ([f64; N], [f64; N]) {
        let (mut lows, mut highs) = ([f64::NEG_INFINITY; N], [f64::INFINITY; N]);
        let at = |[a, b]: [f64; 2], k: usize| a * (first + k as f64) + b;
        let [rights, lefts, levels] = self.kinds();
        for &line in rights {
            for (k, low) in lows.iter_mut().enumerate() {
                *low = greater(at(line, k), *low);
            }
        }
        for &line in lefts {
            for (k, high) in highs.iter_mut().enumerate() {
                *high = -greater(-at(line, k), -*high);
            }
        }
        for &line in levels {
            for (k, high) in highs.iter_mut().enumerate() {
                *high = if at(line, k) < 0.0 {
                    f64::NEG_INFINITY
                } else {
                    *high
                };
            }
        }
        (lows, highs)
    }

    /// As the function [`row_span`].
    pub(super) fn row_span(&self, y: f64) -> (f64, f64) {
        let ([low], [high]) = self.row_spans(y);
        (low, high)
    }
}

/// Where the boundary of a condition crosses row `y`, as `a y + b`.
#[inline(always)]
fn crossing(side: &Vector3<f64>) -> [f64; 2] {
    [-side.y / side.x, -side.z / side.x]
}

#[inline(always)]
fn greater(x: f64, than: f64) -> f64 {
    if x > than { x } else { than }
}

/// The nodes of row `j` of a lattice inside all sides.
pub(super) fn nodes_inside(
    sides: &[Vector3<f64>],
    j: usize,
    within: &Range<usize>,
) -> Range<usize> {
    let (low, high) = row_span(sides, j as f64);
    integer_range(low, high, within)
}

/// Sides of the shape `0 <= u/w <= 1`, `0 <= v/w <= 1`, `w >= 0`, extended by shares of its size.
pub(super) fn quad_sides(
    u: &Vector3<f64>,
    v: &Vector3<f64>,
    w: &Vector3<f64>,
    [a, b]: [f64; 2],
) -> [Vector3<f64>; 5] {
    [
        u + w * a,
        w * (1.0 + a) - u,
        v + w * b,
        w * (1.0 + b) - v,
        *w,
    ]
}

/// The same side, moved outwards by `by` along both x and y.
pub(super) fn grown_side(side: &Vector3<f64>, by: f64) -> Vector3<f64> {
    Vector3::new(side.x, side.y, side.z + by * (side.x.abs() + side.y.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_has_its_rows() {
        let (u, v, w) = (
            Vector3::new(0.1, 0.0, -0.2),
            Vector3::new(0.0, 0.1, -0.2),
            Vector3::z(),
        );
        let shape = quad_sides(&u, &v, &w, [0.0; 2]);
        let (low, high) = row_span(&shape, 7.0);
        assert!((low - 2.0).abs() < 1e-12 && (high - 12.0).abs() < 1e-12);
        assert_eq!(integer_range(low - 0.5, high - 0.5, &(0..100)), 2..12);
        let (low, high) = row_span(&shape, 12.5);
        assert!(integer_range(low, high, &(0..100)).is_empty());
        let shape = ConvexShape::new(&shape);
        let (low, high) = shape.row_span(7.0);
        assert!((low - 2.0).abs() < 1e-12 && (high - 12.0).abs() < 1e-12);
        assert!(shape.nodes(13, &(0..100)).is_empty());
    }
}
