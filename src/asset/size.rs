//! The size of an outline, however it is turned.

use crate::geom::{Point2, Vector2, sides};

/// Length and width, longest first, of the rectangle of least area around a convex polygon; 0 for
/// no polygon.
///
/// # Method
/// One side of that rectangle lies on a side of the polygon (Freeman and Shapira 1975), so every
/// side is tried.
pub(crate) fn oriented_size(hull: &[Point2<f64>]) -> [f64; 2] {
    let boxes = sides(hull)
        .map(|[a, b]| b - a)
        .filter(|side| side.norm() > 0.0)
        .map(|side| size_along(hull, side.normalize()));
    let [a, b] = boxes
        .min_by(|p, q| (p[0] * p[1]).total_cmp(&(q[0] * q[1])))
        .unwrap_or_default();
    [a.max(b), a.min(b)]
}

/// Extents along a unit direction and across it.
fn size_along(hull: &[Point2<f64>], along: Vector2<f64>) -> [f64; 2] {
    let across = Vector2::new(-along.y, along.x);
    [along, across].map(|direction| extent(hull, direction))
}

fn extent(points: &[Point2<f64>], along: Vector2<f64>) -> f64 {
    let (low, high) = points
        .iter()
        .map(|p| p.coords.dot(&along))
        .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Point2;

    #[test]
    fn a_turned_rectangle_keeps_its_size() {
        let (along, across) = (Vector2::new(0.8, 0.6), Vector2::new(-0.6, 0.8));
        let corners = [(0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (0.0, 2.0)];
        let hull = corners.map(|(a, b)| Point2::from(along * a + across * b));
        let [length, width] = oriented_size(&hull);
        assert!((length - 5.0).abs() < 1e-12 && (width - 2.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_has_no_size() {
        assert_eq!(oriented_size(&[]), [0.0; 2]);
        assert_eq!(oriented_size(&[Point2::new(1.0, 2.0)]), [0.0; 2]);
    }
}
