//! The border of a mask as polygons, along the edges of its pixels.
//!
//! # Method
//! Every side of a pixel inside that has a pixel outside beyond it is an edge, directed so that the inside lies to its
//! right; edges chain into rings, and where two pixels touch only at a corner the chain turns right, so that each ring
//! encloses pixels joined by their sides. Formats know neither holes nor several parts: a hole is joined to what lies
//! left of it, and a part to the one before it, by a slit of no width, as triangulations do (Eberly, "Triangulation by
//! Ear Clipping", 2002). The area, by the shoelace formula, stays that of the mask.

use crate::geom::Point2;
use crate::label::Mask;

/// A closed line through corners of pixels, without a repeated last point.
type Ring = Vec<[i64; 2]>;

/// Steps to the right, down, left and up: each a right turn from the one before.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// The parts of a mask, joined by the sides of their pixels: one closed polygon each, clockwise in the picture, holes
/// joined by slits. Together they cover what the mask covers.
pub fn polygons(mask: &Mask) -> Vec<Vec<Point2<f64>>> {
    parts(mask).into_iter().map(points).collect()
}

/// The whole mask as one closed polygon, parts and holes joined by slits; without points for an empty mask.
pub fn polygon(mask: &Mask) -> Vec<Point2<f64>> {
    let mut parts = parts(mask).into_iter();
    let first = parts.next().unwrap_or_default();
    points(parts.fold(first, join))
}

fn points(ring: Ring) -> Vec<Point2<f64>> {
    ring.into_iter().map(|[x, y]| Point2::new(x as f64, y as f64)).collect()
}

fn parts(mask: &Mask) -> Vec<Ring> {
    let (mut parts, mut holes): (Vec<_>, Vec<_>) = Grid::new(mask).rings().into_iter().partition(|r| area2(r) > 0);
    // What lies left of a hole is then joined before it.
    holes.sort_by_key(|hole| leftmost(hole).1);
    holes.into_iter().for_each(|hole| cut_to(&mut parts, hole));
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
    fn new(mask: &Mask) -> Self {
        let b = mask.bounds();
        let [left, top, right, bottom] = [b.x0, b.y0, b.x1, b.y1].map(|v| v as i64);
        let (columns, rows) = (right - left + 1, bottom - top + 1);
        let mut grid = Self { left, top, columns, rows, leaving: vec![0; (columns * rows) as usize] };
        for (x, y) in mask.pixels() {
            let (x, y) = (i64::from(x), i64::from(y));
            [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]].into_iter().zip(0..4).for_each(|(at, d)| grid.meet(at, d));
        }
        grid
    }

    /// A side of a pixel, leaving `at` in direction `d`: border, unless the pixel beyond it has taken the way back.
    fn meet(&mut self, at: [i64; 2], d: usize) {
        let end = self.index(step(at, d));
        let back = 1 << ((d + 2) % 4);
        if self.leaving[end] & back != 0 {
            self.leaving[end] &= !back;
        } else {
            let start = self.index(at);
            self.leaving[start] |= 1 << d;
        }
    }

    fn index(&self, [x, y]: [i64; 2]) -> usize {
        ((y - self.top) * self.columns + x - self.left) as usize
    }

    fn rings(mut self) -> Vec<Ring> {
        let columns = self.columns;
        let mut rings = Vec::new();
        for i in 0..columns * self.rows {
            let at = [self.left + i % columns, self.top + i / columns];
            // Every ring has an edge to the right.
            while self.leaving[self.index(at)] & 1 != 0 {
                rings.push(self.walk(at));
            }
        }
        rings
    }

    /// Takes the ring that leaves `start` to the right; corners where it goes straight on are left out.
    fn walk(&mut self, start: [i64; 2]) -> Ring {
        let mut ring = Vec::new();
        let (mut at, mut d, mut came) = (start, 0, usize::MAX);
        loop {
            if d != came {
                ring.push(at);
            }
            let here = self.index(at);
            self.leaving[here] &= !(1 << d);
            (at, came) = (step(at, d), d);
            // Another ring may pass through the same corner: this one comes back from below, to turn right.
            let leaving = if at == start && d == 3 { 0 } else { self.leaving[self.index(at)] };
            match [1, 0, 3].map(|turn| (d + turn) % 4).into_iter().find(|&d| leaving & 1 << d != 0) {
                Some(next) => d = next,
                None => return ring,
            }
        }
    }
}

fn step([x, y]: [i64; 2], d: usize) -> [i64; 2] {
    [x + STEPS[d][0], y + STEPS[d][1]]
}

/// Twice the area; negative for a hole.
fn area2(ring: &Ring) -> i64 {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum()
}

/// The place in the ring and the position of its upper one of the leftmost corners.
fn leftmost(ring: &Ring) -> (usize, [i64; 2]) {
    ring.iter().copied().enumerate().min_by_key(|&(_, corner)| corner).unwrap_or_default()
}

/// Joins a hole to the ring whose border is next to its left.
fn cut_to(parts: &mut [Ring], hole: Ring) {
    let (first, [x, y]) = leftmost(&hole);
    let mut nearest: Option<(i64, usize, usize)> = None;
    for (p, part) in parts.iter().enumerate() {
        for (i, (a, b)) in part.iter().zip(part.iter().cycle().skip(1)).enumerate() {
            // Edges that go up have the inside to their right.
            let is_left = a[0] == b[0] && a[0] < x && b[1] <= y && y < a[1];
            if is_left && nearest.is_none_or(|(at, ..)| at < a[0]) {
                nearest = Some((a[0], p, i));
            }
        }
    }
    if let Some((at, p, i)) = nearest {
        let around = hole.iter().cycle().skip(first).take(hole.len() + 1).copied();
        let slit: Ring = std::iter::once([at, y]).chain(around).chain([[at, y]]).collect();
        parts[p].splice(i + 1..i + 1, slit);
        parts[p].dedup();
    }
}

/// Joins a part to the corner that is nearest to its first.
fn join(mut whole: Ring, part: Ring) -> Ring {
    let Some(&first) = part.first() else { return whole };
    let distance = |a: &[i64; 2]| (a[0] - first[0]).pow(2) + (a[1] - first[1]).pow(2);
    if let Some(i) = (0..whole.len()).min_by_key(|&i| distance(&whole[i])) {
        let slit: Ring = part.iter().copied().chain([first, whole[i]]).collect();
        whole.splice(i + 1..i + 1, slit);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn area(ring: &[Point2<f64>]) -> f64 {
        0.5 * ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>()
    }

    /// Times that a ring winds around the middle of a pixel.
    fn winding(ring: &[Point2<f64>], x: u32, y: u32) -> i32 {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let edges = ring.iter().zip(ring.iter().cycle().skip(1));
        // Edges along the axes and slits along rows or, between parts, slanted: the crossing with the row decides.
        edges.fold(0, |n, (a, b)| {
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
            let mask = Mask::from_fn([12, 9], |x, y| bits[(x * 9 + y) as usize]);
            let (parts, whole) = (polygons(&mask), polygon(&mask));
            prop_assert_eq!(parts.iter().map(|ring| area(ring)).sum::<f64>(), mask.area() as f64);
            prop_assert_eq!(area(&whole), mask.area() as f64);
            for (x, y) in (0..12).flat_map(|x| (0..9).map(move |y| (x, y))) {
                let inside = i32::from(bits[(x * 9 + y) as usize]);
                prop_assert_eq!(parts.iter().map(|ring| winding(ring, x, y)).sum::<i32>(), inside);
                prop_assert_eq!(winding(&whole, x, y), inside);
            }
        }
    }

    #[test]
    fn a_rectangle_has_four_corners() {
        let mask = Mask::from_fn([8, 8], |x, y| (2..5).contains(&x) && (3..7).contains(&y));
        let corners = [[2.0, 3.0], [5.0, 3.0], [5.0, 7.0], [2.0, 7.0]].map(Point2::from);
        assert_eq!(polygons(&mask), [corners.to_vec()]);
    }

    #[test]
    fn an_empty_mask_has_no_polygon() {
        let none = Mask::from_fn([5, 5], |_, _| false);
        assert!(polygons(&none).is_empty() && polygon(&none).is_empty() && polygons(&Mask::default()).is_empty());
    }
}
