//! Simplifies borders to fewer corners.
//!
//! # Method
//! Corners are dropped one at a time, the cheapest first (as Visvalingam and Whyatt, "Line
//! generalisation by repeated elimination of points", 1993, with a distance instead of their area):
//! the cost is the distance from the new line to the farthest corner of the original border that it
//! skips, so no point of that border is ever farther from the new one than the tolerance. A corner
//! stays if the triangle of it and its two neighbours contains another corner, its sides included,
//! or if its ring has only three corners left. A line that crossed the new one would have to end in
//! that triangle or cross one of the two lines that it replaces: so rings that did not cross never
//! do, none turns over, none vanishes, and what is in a hole stays there. (`docs/design.md`
//! explains what `geo`, which simplifies one polygon at a time, makes of the same rings.)

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// A closed line, without a repeated last point.
pub(super) type Ring = Vec<[f64; 2]>;

/// Rings with as few corners as the tolerance allows, pixels. Corners have whole coordinates of at
/// least 0.
pub(super) fn simplified(rings: Vec<Ring>, tolerance_px: f64) -> Vec<Ring> {
    if tolerance_px <= 0.0 {
        return rings;
    }
    let mut corners = CornerLinks::new(&rings);
    let mut open = corners.candidates();
    while let Some(Reverse(candidate)) = open.pop() {
        let is_outdated = !corners.is_current(candidate);
        if is_outdated || candidate.cost() > tolerance_px || !corners.may_drop(candidate.corner) {
            continue;
        }
        let neighbours = corners.drop(candidate.corner);
        open.extend(neighbours.map(|at| Reverse(corners.candidate(at))));
    }
    corners.rings()
}

/// A corner and the cost of dropping it, cheapest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CornerCandidate {
    /// A cost is not negative, so the order of its bits is its own order.
    cost_bits: u64,
    corner: usize,
}

impl CornerCandidate {
    fn cost(self) -> f64 {
        f64::from_bits(self.cost_bits)
    }
}

/// All corners of all rings, and which of them are left.
struct CornerLinks {
    positions: Ring,
    kept: Vec<bool>,
    /// The remaining corners before and after each.
    before: Vec<usize>,
    after: Vec<usize>,
    /// The ring of each corner.
    ring_of: Vec<usize>,
    rings: Vec<RingSpan>,
    /// Corners by their row.
    rows: Vec<Vec<usize>>,
}

/// The corners of a ring: the first index, the original number, and the number left.
struct RingSpan {
    first: usize,
    length: usize,
    left: usize,
}

impl RingSpan {
    fn new(first: usize, length: usize) -> Self {
        Self {
            first,
            length,
            left: length,
        }
    }

    /// All original corners.
    fn corners(&self) -> Range<usize> {
        self.first..self.first + self.length
    }

    /// The next original corner.
    fn follower(&self, at: usize) -> usize {
        self.first + (at + 1 - self.first) % self.length
    }

    fn leader(&self, at: usize) -> usize {
        self.first + (at + self.length - 1 - self.first) % self.length
    }
}

impl CornerLinks {
    fn new(rings: &[Ring]) -> Self {
        let positions = rings.concat();
        let mut links = Self {
            kept: vec![true; positions.len()],
            before: Vec::with_capacity(positions.len()),
            after: Vec::with_capacity(positions.len()),
            ring_of: Vec::with_capacity(positions.len()),
            rings: Vec::with_capacity(rings.len()),
            rows: by_row(&positions),
            positions,
        };
        for ring in rings {
            links.append(ring.len());
        }
        links
    }

    /// Links the corners of the next ring.
    fn append(&mut self, length: usize) {
        let span = RingSpan::new(self.ring_of.len(), length);
        for at in span.corners() {
            self.before.push(span.leader(at));
            self.after.push(span.follower(at));
            self.ring_of.push(self.rings.len());
        }
        self.rings.push(span);
    }

    /// All corners; those of equal cost are in the order of the rings.
    fn candidates(&self) -> BinaryHeap<Reverse<CornerCandidate>> {
        let corners = 0..self.positions.len();
        corners.map(|at| Reverse(self.candidate(at))).collect()
    }

    /// Whether its corner is left and still has the same cost.
    fn is_current(&self, candidate: CornerCandidate) -> bool {
        self.kept[candidate.corner] && self.candidate(candidate.corner) == candidate
    }

    fn candidate(&self, corner: usize) -> CornerCandidate {
        CornerCandidate {
            cost_bits: self.cost(corner).to_bits(),
            corner,
        }
    }

    /// Distance of the farthest original corner between the neighbours of a corner from the line
    /// between those.
    fn cost(&self, at: usize) -> f64 {
        let (a, b) = (self.before[at], self.after[at]);
        let line = [self.positions[a], self.positions[b]];
        let ring = &self.rings[self.ring_of[at]];
        let (mut passed, mut farthest) = (ring.follower(a), 0.0);
        while passed != b {
            farthest = f64::max(farthest, distance(self.positions[passed], line));
            passed = ring.follower(passed);
        }
        farthest
    }

    /// Whether the line between its neighbours crosses nothing.
    fn may_drop(&self, at: usize) -> bool {
        if self.rings[self.ring_of[at]].left <= 3 {
            return false;
        }
        let own = [self.before[at], at, self.after[at]];
        let triangle = own.map(|i| self.positions[i]);
        let mut near = self.corners_near(triangle);
        !near.any(|i| self.is_held(i, triangle) && !own.contains(&i))
    }

    /// Whether a corner is left and is in the triangle.
    fn is_held(&self, i: usize, triangle: [[f64; 2]; 3]) -> bool {
        self.kept[i] && triangle_holds(triangle, self.positions[i])
    }

    /// The corners within the bounds of a triangle.
    fn corners_near(&self, triangle: [[f64; 2]; 3]) -> impl Iterator<Item = usize> {
        let [left, right] = extent(triangle.map(|c| c[0]));
        let [top, bottom] = extent(triangle.map(|c| c[1]));
        let in_rows = self.rows[top as usize..=bottom as usize].iter().flatten();
        in_rows
            .copied()
            .filter(move |i| (left..=right).contains(&self.positions[*i][0]))
    }

    /// Drops a corner and returns its neighbours.
    fn drop(&mut self, at: usize) -> [usize; 2] {
        let (a, b) = (self.before[at], self.after[at]);
        (self.after[a], self.before[b], self.kept[at]) = (b, a, false);
        self.rings[self.ring_of[at]].left -= 1;
        [a, b]
    }

    fn rings(&self) -> Vec<Ring> {
        self.rings.iter().map(|ring| self.kept_ring(ring)).collect()
    }

    fn kept_ring(&self, ring: &RingSpan) -> Ring {
        let kept = ring.corners().filter(|i| self.kept[*i]);
        kept.map(|i| self.positions[i]).collect()
    }
}

fn by_row(positions: &[[f64; 2]]) -> Vec<Vec<usize>> {
    let mut rows = vec![Vec::new(); last_row(positions) + 1];
    for (i, position) in positions.iter().enumerate() {
        rows[position[1] as usize].push(i);
    }
    rows
}

fn last_row(positions: &[[f64; 2]]) -> usize {
    let rows = positions.iter().map(|c| c[1] as usize);
    rows.max().unwrap_or(0)
}

/// Minimum and maximum of coordinates of at least 0.
fn extent(values: [f64; 3]) -> [f64; 2] {
    [
        values.into_iter().fold(f64::INFINITY, f64::min),
        values.into_iter().fold(0.0, f64::max),
    ]
}

/// Twice the signed area of a triangle: exact for integers.
fn doubled_triangle_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let (u, v) = (difference(b, a), difference(c, a));
    u[0] * v[1] - u[1] * v[0]
}

/// Whether a point within a triangle's bounds is in it or on its sides.
fn triangle_holds([a, b, c]: [[f64; 2]; 3], p: [f64; 2]) -> bool {
    let turns = [
        doubled_triangle_area(a, b, p),
        doubled_triangle_area(b, c, p),
        doubled_triangle_area(c, a, p),
    ];
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}

/// Distance from a point to the line between two.
fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, from) = (difference(b, a), difference(p, a));
    let share = share_along(from, along);
    libm::hypot(from[0] - share * along[0], from[1] - share * along[1])
}

fn share_along(from: [f64; 2], along: [f64; 2]) -> f64 {
    (dot(from, along) / dot(along, along)).clamp(0.0, 1.0)
}

#[inline]
fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

#[inline]
fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_staircase_becomes_a_slope() {
        let steps = (0..20).flat_map(|i| {
            [
                [f64::from(i), f64::from(i)],
                [f64::from(i + 1), f64::from(i)],
            ]
        });
        let stairs: Ring = steps.chain([[20.0, 20.0], [0.0, 20.0]]).collect();
        let slope = simplified(vec![stairs.clone()], 1.0);
        assert!(slope[0].len() <= 5, "{slope:?}");
        let kept = |tolerance: f64| simplified(vec![stairs.clone()], tolerance).concat();
        assert_eq!(
            [kept(0.0), kept(0.1)],
            [stairs.clone(), stairs.clone()],
            "steps are 0.7 deep"
        );
    }

    #[test]
    fn a_hole_stays_inside_and_keeps_three_corners() {
        let square = |low: f64, high: f64| vec![[low, low], [high, low], [high, high], [low, high]];
        let mut hole = square(4.0, 6.0);
        hole.reverse();
        let rings = simplified(vec![square(0.0, 10.0), hole], 100.0);
        assert_eq!(
            [rings[0].len(), rings[1].len()],
            [4, 3],
            "a triangle would cut through the hole: {rings:?}"
        );
    }

    #[test]
    fn rings_that_touch_in_a_corner_keep_it() {
        let square = |low: f64, high: f64| vec![[low, low], [high, low], [high, high], [low, high]];
        let rings = simplified(vec![square(0.0, 3.0), square(3.0, 6.0)], 100.0);
        assert!(
            rings.iter().all(|ring| ring.contains(&[3.0, 3.0])),
            "{rings:?}"
        );
        assert!(simplified(vec![], 1.0).is_empty());
    }
}
