//! Shapes with straight edges, row by row: where linear conditions on `(x, y, 1)` all hold.

use crate::geom::Vector3;

/// The `x` for which every `side . (x, y, 1)` is at least 0, as lowest and highest; reversed where there is none.
pub(super) fn span(sides: &[Vector3<f64>], y: f64) -> (f64, f64) {
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

/// Sides of the shape `0 <= u/w <= 1`, `0 <= v/w <= 1`, `w >= 0`, reaching further out by shares of it.
pub(super) fn sides(
    u: &Vector3<f64>,
    v: &Vector3<f64>,
    w: &Vector3<f64>,
    reach: [f64; 2],
) -> [Vector3<f64>; 5] {
    let [a, b] = reach;
    [
        u + w * a,
        w * (1.0 + a) - u,
        v + w * b,
        w * (1.0 + b) - v,
        *w,
    ]
}

/// The same side, `by` further out both along x and along y.
pub(super) fn grown(side: &Vector3<f64>, by: f64) -> Vector3<f64> {
    Vector3::new(side.x, side.y, side.z + by * (side.x.abs() + side.y.abs()))
}

/// Ranges have something in common.
pub(super) fn meet(a: &std::ops::Range<usize>, b: &std::ops::Range<usize>) -> bool {
    a.start < b.end && b.start < a.end
}

/// Whole numbers in `low..=high`, cut to `within`.
pub(super) fn whole(
    low: f64,
    high: f64,
    within: &std::ops::Range<usize>,
) -> std::ops::Range<usize> {
    // `as` saturates, so infinite ends are cut like all others.
    let start = (low.ceil().max(0.0) as usize).clamp(within.start, within.end);
    let end = if high >= 0.0 {
        (high.floor() as usize).saturating_add(1).min(within.end)
    } else {
        0
    };
    start..end.max(start)
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
        let shape = sides(&u, &v, &w, [0.0; 2]);
        let (low, high) = span(&shape, 7.0);
        assert!((low - 2.0).abs() < 1e-12 && (high - 12.0).abs() < 1e-12);
        assert_eq!(whole(low - 0.5, high - 0.5, &(0..100)), 2..12);
        let (low, high) = span(&shape, 12.5);
        assert!(whole(low, high, &(0..100)).is_empty());
    }

    #[test]
    fn nothing_is_whole_between_reversed_or_infinite_ends() {
        assert!(whole(f64::INFINITY, f64::NEG_INFINITY, &(0..9)).is_empty());
        assert_eq!(whole(f64::NEG_INFINITY, f64::INFINITY, &(2..9)), 2..9);
        assert!(whole(-5.0, -1.0, &(0..9)).is_empty());
    }
}
