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
    }
}
