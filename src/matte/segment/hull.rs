//! The convex hull of a set of pixels.

use crate::geom::Point2;
use crate::image::Mask;
use crate::matte::outline::points_of;
use geo::{Area, ConvexHull, Distance, Euclidean, LineString, MultiPoint, Point, Polygon};

/// Convex hull of the object whose edges these pixels are, in order, clockwise as seen; empty where
/// there is no area.
///
/// It goes through the pixels' centres: an edge marks the pixel on either side of it, so that the
/// outer one's centre is nearer to the edge than its outer corner. Where a pixel lies on the border
/// of the picture, so does the hull.
pub(super) fn convex_hull(edges: &Mask) -> Vec<Point2<f64>> {
    let (w, h) = edges.size();
    let points =
        row_ends(edges).map(|(x, y)| Point::new(center_or_border(x, w), center_or_border(y, h)));
    let hull = points.collect::<MultiPoint>().convex_hull();
    if hull.unsigned_area() <= 0.0 {
        return Vec::new();
    }
    // geo goes counter-clockwise with y up, which is clockwise as seen, and repeats the first
    // point.
    let (ring, _) = hull.into_inner();
    points_of(ring.0.get(1..).unwrap_or_default())
}

/// The first and the last pixel of every row that has any.
fn row_ends(set: &Mask) -> impl Iterator<Item = (usize, usize)> {
    set.rows()
        .enumerate()
        .flat_map(|(y, row)| set_ends(row).into_iter().flatten().map(move |x| (x, y)))
}

/// The first and the last set pixel of a row.
fn set_ends(row: &[bool]) -> Option<[usize; 2]> {
    let mut pixels = row.iter();
    Some([pixels.clone().position(|p| *p)?, pixels.rposition(|p| *p)?])
}

fn center_or_border(i: usize, len: usize) -> f64 {
    match i {
        0 => 0.0,
        _ if i + 1 == len => len as f64,
        _ => i as f64 + 0.5,
    }
}

/// Left, top, right and bottom of a polygon; infinite where it has no corner.
pub(in crate::matte) fn sides(polygon: &[Point2<f64>]) -> [f64; 4] {
    let unbounded = [f64::INFINITY, f64::INFINITY, -f64::INFINITY, -f64::INFINITY];
    polygon
        .iter()
        .fold(unbounded, |[left, top, right, bottom], p| {
            [left.min(p.x), top.min(p.y), right.max(p.x), bottom.max(p.y)]
        })
}

/// The largest distance from a point of one convex polygon to the other (Hausdorff): how far an
/// outline moved, in any direction.
pub(super) fn farthest(a: &[Point2<f64>], b: &[Point2<f64>]) -> f64 {
    growth(a, b).max(growth(b, a))
}

/// By how much one convex polygon goes beyond another; 0 where it does not, and its box's longer
/// side where the other has no corner.
pub(super) fn growth(from: &[Point2<f64>], to: &[Point2<f64>]) -> f64 {
    if from.is_empty() {
        let [left, top, right, bottom] = sides(to);
        return (right - left).max(bottom - top).max(0.0);
    }
    let ring: LineString = from.iter().map(|p| (p.x, p.y)).collect();
    let from = Polygon::new(ring, Vec::new());
    to.iter()
        .map(|p| Euclidean.distance(&Point::new(p.x, p.y), &from))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    #[test]
    fn the_hull_goes_through_centres_and_clockwise() {
        let set = Image::from_fn(8, 8, |x, y| {
            matches!((x, y), (2, 1) | (5, 1) | (2, 4) | (5, 4) | (3, 2))
        });
        let mut hull = convex_hull(&set);
        let start = hull
            .iter()
            .position(|p| *p == Point2::new(2.5, 1.5))
            .unwrap();
        hull.rotate_left(start);
        assert_eq!(
            hull,
            [[2.5, 1.5], [5.5, 1.5], [5.5, 4.5], [2.5, 4.5]].map(Point2::from)
        );
    }

    #[test]
    fn the_hull_reaches_a_border_that_the_object_reaches() {
        let hull = convex_hull(&Image::filled(8, 6, true));
        let mut corners: Vec<_> = hull.iter().map(|p| (p.x as i32, p.y as i32)).collect();
        corners.sort_unstable();
        assert_eq!(corners, [(0, 0), (0, 6), (8, 0), (8, 6)]);
    }

    #[test]
    fn straight_polygons_are_as_far_apart_as_their_sides() {
        let square =
            |x: f64, w: f64| [[x, 1.0], [x + w, 1.0], [x + w, 5.0], [x, 5.0]].map(Point2::from);
        assert_eq!(sides(&square(2.0, 3.0)), [2.0, 1.0, 5.0, 5.0]);
        assert_eq!(farthest(&square(2.0, 3.0), &square(1.0, 7.0)), 3.0);
    }

    #[test]
    fn a_bump_on_a_slanted_side_counts_although_the_box_stays() {
        let (sin, cos) = 40_f64.to_radians().sin_cos();
        let turned = |corners: &[[f64; 2]]| -> Vec<_> {
            let turn = |[x, y]: &[f64; 2]| Point2::new(cos * x - sin * y, sin * x + cos * y);
            corners.iter().map(turn).collect()
        };
        let card = turned(&[
            [-150.0, -60.0],
            [150.0, -60.0],
            [150.0, 60.0],
            [-150.0, 60.0],
        ]);
        let bumpy = turned(&[
            [-150.0, -60.0],
            [0.0, -70.0],
            [150.0, -60.0],
            [150.0, 60.0],
            [-150.0, 60.0],
        ]);
        assert_eq!(sides(&card), sides(&bumpy));
        for apart in [farthest(&card, &bumpy), farthest(&bumpy, &card)] {
            assert!((apart - 10.0).abs() < 1e-9, "{apart}");
        }
    }

    #[test]
    fn all_of_a_polygon_lies_beyond_nothing() {
        let tall = [[2.0, 1.0], [5.0, 1.0], [5.0, 8.0], [2.0, 8.0]].map(Point2::from);
        let inner = [[2.0, 1.0], [5.0, 1.0], [5.0, 6.0], [2.0, 6.0]].map(Point2::from);
        let beyond = [growth(&[], &tall), growth(&inner, &tall), growth(&[], &[])];
        assert_eq!(beyond, [7.0, 2.0, 0.0]);
    }

    #[test]
    fn what_has_no_area_has_no_hull() {
        assert!(convex_hull(&Image::filled(4, 4, false)).is_empty());
        assert!(convex_hull(&Image::from_fn(9, 9, |x, y| x == y && x > 2)).is_empty());
    }
}
