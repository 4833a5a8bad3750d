//! Borders with fewer corners.
//!
//! # Method
//! Corners are dropped one at a time, first the one that costs least (as Visvalingam and Whyatt, "Line generalisation by
//! repeated elimination of points", 1993, with a distance in place of their area): the cost is the distance from the new
//! line to the farthest corner of the first border that it passes over, so that no point of that border is ever farther from
//! the new one than the tolerance. A corner stays while the triangle of it and its two neighbours holds another corner,
//! its sides included, or its ring has three corners left. A line that crossed the new one would have to end in that
//! triangle or cross one of the two lines that it replaces: so rings that did not cross never do, none turns over, none vanishes,
//! and what lies in a hole stays there. (`geo` simplifies one polygon of several at a time, and by area.)

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A closed line, without a repeated last point.
pub(super) type Ring = Vec<[f64; 2]>;

/// Rings with as few corners as the tolerance allows, pixels. Corners have whole coordinates of at least 0.
pub(super) fn simplified(rings: Vec<Ring>, tolerance_px: f64) -> Vec<Ring> {
    if tolerance_px <= 0.0 {
        return rings;
    }
    let mut border = Border::of(&rings);
    // A cost is not negative, and then its bits are in its order; what costs the same goes in the order of the border.
    let mut open: BinaryHeap<_> = (0..border.corners.len())
        .map(|at| Reverse((border.cost(at).to_bits(), at)))
        .collect();
    while let Some(Reverse((cost, at))) = open.pop() {
        let is_old = !border.kept[at] || border.cost(at).to_bits() != cost;
        if is_old || f64::from_bits(cost) > tolerance_px || !border.may_drop(at) {
            continue;
        }
        let beside = border.drop(at);
        open.extend(beside.map(|at| Reverse((border.cost(at).to_bits(), at))));
    }
    border.rings()
}

/// All corners of all rings, and which are left.
struct Border {
    corners: Ring,
    kept: Vec<bool>,
    /// The corners before and after each, of those that are left.
    before: Vec<usize>,
    after: Vec<usize>,
    /// First corner of each corner's ring, and of each ring how many it had; at the first corner, how many are left.
    first: Vec<usize>,
    length: Vec<usize>,
    left: Vec<usize>,
    /// Corners by the row that they are in.
    rows: Vec<Vec<usize>>,
}

impl Border {
    fn of(rings: &[Ring]) -> Self {
        let corners = rings.concat();
        let count = corners.len();
        let bottom = corners.iter().map(|c| c[1] as usize).max().unwrap_or(0);
        let mut rows = vec![Vec::new(); bottom + 1];
        corners
            .iter()
            .enumerate()
            .for_each(|(i, c)| rows[c[1] as usize].push(i));
        let (mut before, mut after, mut first, mut length) = (vec![], vec![], vec![], vec![]);
        for ring in rings {
            let (start, n) = (first.len(), ring.len());
            before.extend((0..n).map(|i| start + (i + n - 1) % n));
            after.extend((0..n).map(|i| start + (i + 1) % n));
            first.extend(std::iter::repeat_n(start, n));
            length.extend(std::iter::repeat_n(n, n));
        }
        Self {
            corners,
            kept: vec![true; count],
            before,
            after,
            first,
            left: length.clone(),
            length,
            rows,
        }
    }

    /// The farthest corner of the first border, between the neighbours of a corner, from the line between those.
    fn cost(&self, at: usize) -> f64 {
        let (a, b) = (self.before[at], self.after[at]);
        let (first, length) = (self.first[at], self.length[at]);
        let follower = |i: &usize| Some(first + (i + 1 - first) % length);
        let between = std::iter::successors(follower(&a), follower).take_while(|i| *i != b);
        between
            .map(|i| distance(self.corners[i], [self.corners[a], self.corners[b]]))
            .fold(0.0, f64::max)
    }

    /// Whether the line between its neighbours crosses nothing.
    fn may_drop(&self, at: usize) -> bool {
        let own = [self.before[at], at, self.after[at]];
        let triangle = own.map(|i| self.corners[i]);
        let span = |axis: usize| {
            triangle
                .iter()
                .fold([f64::INFINITY, 0.0_f64], |[low, high], c| {
                    [low.min(c[axis]), high.max(c[axis])]
                })
        };
        let [[left, right], [top, bottom]] = [span(0), span(1)];
        let near = self.rows[top as usize..=bottom as usize].iter().flatten();
        let mut near = near.filter(|i| (left..=right).contains(&self.corners[**i][0]));
        self.left[self.first[at]] > 3
            && near.all(|i| !self.kept[*i] || own.contains(i) || !holds(triangle, self.corners[*i]))
    }

    /// Drops a corner and tells those beside it.
    fn drop(&mut self, at: usize) -> [usize; 2] {
        let (a, b) = (self.before[at], self.after[at]);
        (self.after[a], self.before[b], self.kept[at]) = (b, a, false);
        self.left[self.first[at]] -= 1;
        [a, b]
    }

    fn rings(&self) -> Vec<Ring> {
        let starts = (0..self.corners.len()).filter(|i| self.first[*i] == *i);
        let ring = |start: usize| {
            (start..start + self.length[start])
                .filter(|i| self.kept[*i])
                .map(|i| self.corners[i])
                .collect()
        };
        starts.map(ring).collect()
    }
}

/// Twice the signed area of a triangle: exact for whole numbers.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether a point within a triangle's bounds lies in it or on its sides.
fn holds([a, b, c]: [[f64; 2]; 3], p: [f64; 2]) -> bool {
    let turns = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}

/// From a point to a line between two.
fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, from) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length2 = along[0] * along[0] + along[1] * along[1];
    let share = ((from[0] * along[0] + from[1] * along[1]) / length2).clamp(0.0, 1.0);
    libm::hypot(from[0] - share * along[0], from[1] - share * along[1])
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
