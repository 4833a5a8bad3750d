//! Shapes with straight edges, row by row: where linear conditions on `(x, y, 1)` all hold.

use crate::geom::Vector3;
use crate::render::ranges::integer_range;
use std::ops::Range;

/// The `x` for which every `side . (x, y, 1)` is at least 0, as lowest and highest; reversed where
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

/// A convex shape, ready to be asked for its rows.
#[derive(Clone, Debug)]
pub(super) struct ConvexShape {
    /// Lines `x = a y + b` that it lies to the right of, then those that it lies to the left of,
    /// then conditions `a y + b >= 0` on whole rows.
    lines: Vec<[f64; 2]>,
    /// Where the second and the third of these begin.
    starts: [usize; 2],
}

impl ConvexShape {
    /// Where all conditions on `(x, y, 1)` hold.
    pub(super) fn new(sides: &[Vector3<f64>]) -> Self {
        let bounding = |sign: f64| {
            let facing = sides.iter().filter(move |side| sign * side.x > 0.0);
            facing.map(|side| [-side.y / side.x, -side.z / side.x])
        };
        let level = sides.iter().filter(|side| side.x == 0.0);
        let left = bounding(1.0).count();
        Self {
            lines: bounding(1.0)
                .chain(bounding(-1.0))
                .chain(level.map(|side| [side.y, side.z]))
                .collect(),
            starts: [left, left + bounding(-1.0).count()],
        }
    }

    /// The nodes of row `j` of a lattice inside of it.
    pub(super) fn nodes(&self, j: usize, within: &Range<usize>) -> Range<usize> {
        let (low, high) = self.row_span(j as f64);
        integer_range(low, high, within)
    }

    /// As the function [`row_span`].
    pub(super) fn row_span(&self, y: f64) -> (f64, f64) {
        let at = |[a, b]: &[f64; 2]| a * y + b;
        let [right, level] = self.starts;
        if self.lines[level..].iter().any(|line| at(line) < 0.0) {
            return (f64::INFINITY, f64::NEG_INFINITY);
        }
        let lows = self.lines[..right].iter().map(at);
        let highs = self.lines[right..level].iter().map(at);
        (
            lows.fold(f64::NEG_INFINITY, |m, x| if x > m { x } else { m }),
            highs.fold(f64::INFINITY, |m, x| if x < m { x } else { m }),
        )
    }
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

/// Sides of the shape `0 <= u/w <= 1`, `0 <= v/w <= 1`, `w >= 0`, reaching further out by shares of
/// it.
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

/// The same side, `by` further out both along x and along y.
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
