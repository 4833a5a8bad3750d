//! The border of a mask as polygons, along the edges of its pixels.
//!
//! # Method
//! Every side of a pixel inside that has a pixel outside beyond it is an edge, directed so that the
//! inside is on its right; edges chain into rings, and where two pixels touch only at a corner the
//! chain turns right, so that each ring encloses pixels joined by their sides. Corners are then
//! dropped as far as a tolerance allows, for all rings together (`simplify.rs`). Formats support
//! neither holes nor several parts: a hole is joined to what is left of it, and a part to the
//! previous one, by a slit of no width, as in triangulation (Eberly, "Triangulation by Ear
//! Clipping", 2002). Without a tolerance the area, by the shoelace formula, stays that of the mask.

use super::simplify::{Ring, simplified};
use crate::geom::{BBox, Point2, doubled_area, sides};
use crate::label::RleMask;

/// Steps to the right, down, left and up: each a right turn from the one before.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// The parts of a mask, joined by the sides of their pixels: one closed polygon each, clockwise in
/// the picture, holes joined by slits. Together they cover what the mask covers.
///
/// Corners that the tolerance makes unnecessary are dropped: no point of the border is then farther
/// than `tolerance_px` from the polygons, and no side crosses another. 0 keeps all corners; parts
/// and holes are kept at any tolerance.
pub fn polygons(mask: &RleMask, tolerance_px: f64) -> Vec<Vec<Point2<f64>>> {
    as_polygons(simplified(Grid::new(mask).rings(), tolerance_px))
}

/// [`polygons`] with all corners, and with a tolerance: the mask is traced once for both.
pub(super) fn exact_and_simplified(
    mask: &RleMask,
    tolerance_px: f64,
) -> [Vec<Vec<Point2<f64>>>; 2] {
    let rings = Grid::new(mask).rings();
    [rings.clone(), simplified(rings, tolerance_px)].map(as_polygons)
}

/// The whole mask as one closed polygon, parts and holes joined by slits, simplified as
/// [`polygons`] are; without points for an empty mask.
pub fn polygon(mask: &RleMask, tolerance_px: f64) -> Vec<Point2<f64>> {
    let rings = simplified(Grid::new(mask).rings(), tolerance_px);
    let mut parts = joined_parts(rings).into_iter();
    let first = parts.next().unwrap_or_default();
    points(parts.fold(first, join_part))
}

fn as_polygons(rings: Vec<Ring>) -> Vec<Vec<Point2<f64>>> {
    joined_parts(rings).into_iter().map(points).collect()
}

fn points(ring: Ring) -> Vec<Point2<f64>> {
    ring.into_iter().map(Point2::from).collect()
}

fn joined_parts(rings: Vec<Ring>) -> Vec<Ring> {
    let (mut parts, mut holes): (Vec<_>, Vec<_>) =
        rings.into_iter().partition(|r| doubled_area(r) > 0.0);
    // So what is left of a hole is joined before it.
    holes.sort_by(|a, b| left_to_right(&leftmost(a).1, &leftmost(b).1));
    for hole in holes {
        join_hole(&mut parts, hole);
    }
    parts
}

/// Which edges of pixels are border, around the mask's bounds.
struct Grid {
    left: i64,
    top: i64,
    columns: i64,
    rows: i64,
    /// For each corner of a pixel, one bit for each of [`STEPS`] that leaves it along the border.
    leaving: Vec<u8>,
}

impl Grid {
    fn new(mask: &RleMask) -> Self {
        let mut grid = Self::around(mask.bounds());
        for (x, y) in mask.pixels() {
            grid.add_pixel(x, y);
        }
        grid
    }

    /// Without a border.
    fn around(b: BBox) -> Self {
        let [left, top, right, bottom] = [b.x0, b.y0, b.x1, b.y1].map(|v| v as i64);
        let (columns, rows) = (right - left + 1, bottom - top + 1);
        Self {
            left,
            top,
            columns,
            rows,
            leaving: vec![0; (columns * rows) as usize],
        }
    }

    /// The four sides of a pixel, clockwise.
    fn add_pixel(&mut self, x: u32, y: u32) {
        let corners = pixel_corners(x.into(), y.into());
        for (direction, corner) in corners.into_iter().enumerate() {
            self.add_side(corner, direction);
        }
    }

    /// A side of a pixel, leaving `at` in direction `d`: it is border unless the pixel beyond it
    /// has taken the opposite side.
    fn add_side(&mut self, at: [i64; 2], d: usize) {
        let end = self.index(step(at, d));
        let opposite = 1 << ((d + 2) % 4);
        if self.leaving[end] & opposite != 0 {
            self.leaving[end] &= !opposite;
        } else {
            let start = self.index(at);
            self.leaving[start] |= 1 << d;
        }
    }

    fn index(&self, [x, y]: [i64; 2]) -> usize {
        ((y - self.top) * self.columns + x - self.left) as usize
    }

    fn rings(mut self) -> Vec<Ring> {
        let mut rings = Vec::new();
        for i in 0..self.columns * self.rows {
            let at = self.corner(i);
            // Every ring has an edge that goes right.
            while self.leaving[self.index(at)] & 1 != 0 {
                rings.push(self.walk_ring(at));
            }
        }
        rings
    }

    #[inline]
    fn corner(&self, i: i64) -> [i64; 2] {
        [self.left + i % self.columns, self.top + i / self.columns]
    }

    /// Removes an edge of the border.
    #[inline]
    fn take_edge(&mut self, at: [i64; 2], d: usize) {
        let start = self.index(at);
        self.leaving[start] &= !(1 << d);
    }

    /// Removes and returns the ring that leaves `start` to the right; corners where it goes
    /// straight on are left out.
    fn walk_ring(&mut self, start: [i64; 2]) -> Ring {
        let mut ring = Vec::new();
        let (mut at, mut d, mut came) = (start, 0, usize::MAX);
        loop {
            if d != came {
                ring.push(at.map(|v| v as f64));
            }
            self.take_edge(at, d);
            (at, came) = (step(at, d), d);
            // Another ring may pass through the same corner; this one comes back from below in
            // order to turn right.
            let is_closed = at == start && d == 3;
            match self.next_direction(at, d).filter(|_| !is_closed) {
                Some(next) => d = next,
                None => return ring,
            }
        }
    }

    /// The direction in which the border continues from a corner that it came to in direction `d`:
    /// right, straight on or left.
    fn next_direction(&self, at: [i64; 2], d: usize) -> Option<usize> {
        let leaving = self.leaving[self.index(at)];
        [1, 0, 3]
            .map(|turn| (d + turn) % 4)
            .into_iter()
            .find(|d| leaving & 1 << d != 0)
    }
}

/// Clockwise.
#[inline]
fn pixel_corners(x: i64, y: i64) -> [[i64; 2]; 4] {
    [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]]
}

fn step([x, y]: [i64; 2], d: usize) -> [i64; 2] {
    [x + STEPS[d][0], y + STEPS[d][1]]
}

/// From left to right, then from above.
fn left_to_right(a: &[f64; 2], b: &[f64; 2]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

/// The index in the ring and the position of the upper one of its leftmost corners.
fn leftmost(ring: &Ring) -> (usize, [f64; 2]) {
    ring.iter()
        .copied()
        .enumerate()
        .min_by(|a, b| left_to_right(&a.1, &b.1))
        .unwrap_or_default()
}

/// Joins a hole to the ring whose border is nearest on its left.
fn join_hole(parts: &mut [Ring], hole: Ring) {
    let (first, leftmost) = leftmost(&hole);
    let Some(border) = next_border_to_the_left(parts, leftmost) else {
        return;
    };
    let from = [border.x, leftmost[1]];
    let around = hole.iter().cycle().skip(first).take(hole.len() + 1);
    let slit: Ring = std::iter::once(from)
        .chain(around.copied())
        .chain([from])
        .collect();
    let part = &mut parts[border.part];
    part.splice(border.corner + 1..border.corner + 1, slit);
    part.dedup();
}

/// Where the row through a point crosses an edge that has the inside on its right.
struct BorderCrossing {
    x: f64,
    part: usize,
    /// The corner that the edge begins at.
    corner: usize,
}

fn next_border_to_the_left(parts: &[Ring], from: [f64; 2]) -> Option<BorderCrossing> {
    let mut nearest: Option<BorderCrossing> = None;
    for (part, ring) in parts.iter().enumerate() {
        for (corner, [a, b]) in sides(ring).enumerate() {
            let Some(x) = crossing_to_the_left(from, a, b) else {
                continue;
            };
            if nearest.as_ref().is_none_or(|n| n.x < x) {
                nearest = Some(BorderCrossing { x, part, corner });
            }
        }
    }
    nearest
}

/// The crossing with an edge that goes up, which has the inside on its right.
#[inline]
fn crossing_to_the_left([x, y]: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Option<f64> {
    let goes_up = b[1] <= y && y < a[1];
    let crossing = a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]);
    (goes_up && crossing < x).then_some(crossing)
}

/// Joins a part at the corner that is nearest to its first corner.
fn join_part(mut whole: Ring, part: Ring) -> Ring {
    let Some(&first) = part.first() else {
        return whole;
    };
    if let Some(i) = nearest_corner(&whole, first) {
        let slit: Ring = part.iter().copied().chain([first, whole[i]]).collect();
        whole.splice(i + 1..i + 1, slit);
    }
    whole
}

fn nearest_corner(ring: &Ring, to: [f64; 2]) -> Option<usize> {
    (0..ring.len())
        .min_by(|&i, &k| squared_distance(ring[i], to).total_cmp(&squared_distance(ring[k], to)))
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How many times a ring winds around the middle of a pixel.
    fn winding(ring: &[Point2<f64>], x: u32, y: u32) -> i32 {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        // Edges along the axes and slits along rows or, between parts, slanted: the crossing with
        // the row decides.
        sides(ring).fold(0, |n, [a, b]| {
            let at = a.x + (y - a.y) * (b.x - a.x) / (b.y - a.y);
            match (a.y <= y, b.y <= y) {
                (true, false) if at < x => n - 1,
                (false, true) if at < x => n + 1,
                _ => n,
            }
        })
    }

    proptest! {
        #[test]
        fn polygons_wind_once_around_the_pixels_inside_and_never_around_the_others(
            bits in prop::collection::vec(prop::bool::weighted(0.6), 12 * 9)
        ) {
            let mask = RleMask::from_fn([12, 9], |x, y| bits[(x * 9 + y) as usize]);
            let (parts, whole) = (polygons(&mask, 0.0), polygon(&mask, 0.0));
            let doubled = 2.0 * mask.area() as f64;
            prop_assert_eq!(parts.iter().map(|ring| doubled_area(ring)).sum::<f64>(), doubled);
            prop_assert_eq!(doubled_area(&whole), doubled);
            for (x, y) in (0..12).flat_map(|x| (0..9).map(move |y| (x, y))) {
                let inside = i32::from(bits[(x * 9 + y) as usize]);
                prop_assert_eq!(parts.iter().map(|ring| winding(ring, x, y)).sum::<i32>(), inside);
                prop_assert_eq!(winding(&whole, x, y), inside);
            }
        }
    }

    /// Whether two lines cross in a point that is not an end of either.
    fn cross(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> bool {
        let side = |p: [[f64; 2]; 2], q: [f64; 2]| {
            (p[1][0] - p[0][0]) * (q[1] - p[0][1]) - (p[1][1] - p[0][1]) * (q[0] - p[0][0])
        };
        side(a, b[0]) * side(a, b[1]) < 0.0 && side(b, a[0]) * side(b, a[1]) < 0.0
    }

    fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
        let [a, b, p] = [a, b, p].map(Point2::from);
        let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (a + (b - a) * share - p).norm()
    }

    proptest! {
        #[test]
        fn fewer_corners_keep_parts_and_holes_and_cross_nothing(
            bits in prop::collection::vec(prop::bool::weighted(0.6), 12 * 9), tolerance in 0.0..3.0_f64
        ) {
            let mask = RleMask::from_fn([12, 9], |x, y| bits[(x * 9 + y) as usize]);
            let rings = Grid::new(&mask).rings();
            let fewer = simplified(rings.clone(), tolerance);
            prop_assert_eq!(rings.len(), fewer.len());
            for (ring, fewer) in rings.iter().zip(&fewer) {
                prop_assert!(fewer.len() >= 3 && doubled_area(ring) * doubled_area(fewer) > 0.0);
                let off = |p: &[f64; 2]| sides(fewer).map(|s| distance(*p, s)).fold(f64::INFINITY, f64::min);
                prop_assert!(ring.iter().all(|p| off(p) <= tolerance + 1e-9));
            }
            let all: Vec<_> = fewer.iter().flat_map(|ring| sides(ring)).collect();
            prop_assert!(all.iter().enumerate().all(|(i, a)| all[..i].iter().all(|b| !cross(*a, *b))));
            let whole = polygon(&mask, tolerance);
            let sum: f64 = fewer.iter().map(|ring| doubled_area(ring)).sum();
            prop_assert!((doubled_area(&whole) - sum).abs() < 1e-9, "slits have no area");
            let parts = polygons(&mask, tolerance);
            let both = [polygons(&mask, 0.0), parts.clone()];
            prop_assert_eq!(exact_and_simplified(&mask, tolerance), both);
            for (x, y) in (0..12).flat_map(|x| (0..9).map(move |y| (x, y))) {
                let windings: i32 = parts.iter().map(|ring| winding(ring, x, y)).sum();
                prop_assert!([0, 1].contains(&windings) && winding(&whole, x, y) == windings);
            }
        }
    }

    #[test]
    fn a_rectangle_has_four_corners() {
        let mask = RleMask::from_fn([8, 8], |x, y| (2..5).contains(&x) && (3..7).contains(&y));
        let corners = [[2.0, 3.0], [5.0, 3.0], [5.0, 7.0], [2.0, 7.0]].map(Point2::from);
        assert_eq!(polygons(&mask, 0.0), [corners.to_vec()]);
    }

    #[test]
    fn an_empty_mask_has_no_polygon() {
        let none = RleMask::from_fn([5, 5], |_, _| false);
        assert!(polygons(&none, 1.0).is_empty() && polygon(&none, 1.0).is_empty());
        assert!(polygons(&RleMask::default(), 0.0).is_empty());
    }
}
