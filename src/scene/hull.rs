//! Corners of the convex prism that falls in place of a cut-out: few, so that contacts are cheap
//! and stable.

use crate::geom::{Point2, doubled_area};

/// Maximum number of corners of a prism. A hexagon has 0.95 to 1 times the area of a bottle's hull;
/// falls of octagons take 1.6 times as long.
pub(super) const MAX_CORNERS: usize = 6;
/// Twice the area of a corner's triangle below which the corner counts as straight, as a share of
/// the card's area.
const MIN_CORNER_AREA_RATIO: f64 = 1e-6;

/// Converts a convex outline in texture coordinates (right and down, 0 to 1) to the corners of a
/// prism on a card of this size, counter-clockwise with y up, metres; empty if the outline has no
/// area.
///
/// # Method
/// Removes whatever changes the area least until [`MAX_CORNERS`] are left: a corner (Visvalingam
/// and Whyatt 1993), or a side, whose neighbours are then extended to where they meet. If the
/// result is larger than the outline, it is shrunk to the outline's area.
pub(super) fn prism_outline(outline_uv: &[Point2<f64>], size: [f64; 2]) -> Vec<[f64; 2]> {
    let mut ring: Vec<[f64; 2]> = outline_uv.iter().map(|p| on_card(p, size)).collect();
    if doubled_area(&ring) < 0.0 {
        ring.reverse();
    }
    let area = doubled_area(&ring);
    simplify(&mut ring, size);
    if ring.len() < 3 {
        return Vec::new();
    }
    shrink_to(&mut ring, area);
    ring
}

/// Removes corners and sides until [`MAX_CORNERS`] are left, and negligible ones even then.
fn simplify(ring: &mut Vec<[f64; 2]>, size: [f64; 2]) {
    let negligible = MIN_CORNER_AREA_RATIO * size[0] * size[1];
    while let Some(cut) = least_cut(ring, size) {
        if ring.len() <= MAX_CORNERS && cut.doubled_area > negligible {
            break;
        }
        cut.apply(ring);
    }
}

/// A way to remove one corner.
struct Cut {
    /// The corner to remove; if a side is removed, its first corner.
    corner: usize,
    /// Where the neighbours of a side meet.
    meeting: Option<[f64; 2]>,
    /// Twice the area that is lost or gained.
    doubled_area: f64,
}

impl Cut {
    fn apply(&self, ring: &mut Vec<[f64; 2]>) {
        if let Some(meeting) = self.meeting {
            let next = (self.corner + 1) % ring.len();
            ring[next] = meeting;
        }
        ring.remove(self.corner);
    }

    fn of_corner(ring: &[[f64; 2]], corner: usize) -> Self {
        Self {
            corner,
            meeting: None,
            doubled_area: doubled_corner_area(ring, corner),
        }
    }

    /// Cut of the side from a corner to the next one; none if its neighbours do not meet on the
    /// card.
    fn of_side(ring: &[[f64; 2]], corner: usize, size: [f64; 2]) -> Option<Self> {
        let [a, b, c, d] = [ring.len() - 1, 0, 1, 2].map(|k| ring[(corner + k) % ring.len()]);
        let meeting = meeting_point([a, b], [d, c]).filter(|p| is_on_card(*p, size))?;
        Some(Self {
            corner,
            meeting: Some(meeting),
            doubled_area: doubled_area(&[b, meeting, c]),
        })
    }
}

/// The cut that changes the area least; none if there are no corners.
fn least_cut(ring: &[[f64; 2]], size: [f64; 2]) -> Option<Cut> {
    let corners = (0..ring.len()).map(|i| Cut::of_corner(ring, i));
    let sides = (0..ring.len()).filter_map(|i| Cut::of_side(ring, i, size));
    corners
        .chain(sides)
        .min_by(|a, b| a.doubled_area.total_cmp(&b.doubled_area))
}

/// Where two lines meet beyond their second points.
fn meeting_point([a, b]: [[f64; 2]; 2], [d, c]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let [along, back, between] = [(a, b), (d, c), (b, c)].map(|(p, q)| [q[0] - p[0], q[1] - p[1]]);
    let turn = cross(along, back);
    let share = cross(between, back) / turn;
    (turn < 0.0 && share > 0.0).then(|| [0, 1].map(|i| b[i] + share * along[i]))
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn is_on_card([x, y]: [f64; 2], [w, h]: [f64; 2]) -> bool {
    x.abs() <= w / 2.0 && y.abs() <= h / 2.0
}

/// Shrinks a ring about the mean of its corners until twice its area is no more than this.
fn shrink_to(ring: &mut [[f64; 2]], doubled: f64) {
    let factor = (doubled / doubled_area(ring)).sqrt().min(1.0);
    let sum = ring
        .iter()
        .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    let center = sum.map(|s| s / ring.len() as f64);
    for corner in ring {
        *corner = [0, 1].map(|i| center[i] + factor * (corner[i] - center[i]));
    }
}

/// A point of the texture in the plane of its card, metres.
fn on_card(p: &Point2<f64>, [w, h]: [f64; 2]) -> [f64; 2] {
    [
        (p.x.clamp(0.0, 1.0) - 0.5) * w,
        (0.5 - p.y.clamp(0.0, 1.0)) * h,
    ]
}

/// Twice the area of the triangle of a corner and its neighbours; above 0 where the ring turns
/// left.
pub(super) fn doubled_corner_area(ring: &[[f64; 2]], i: usize) -> f64 {
    let [a, b, c] = [i + ring.len() - 1, i, i + 1].map(|i| ring[i % ring.len()]);
    cross([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: usize, clockwise: bool) -> Vec<Point2<f64>> {
        let angle = |i: usize| {
            std::f64::consts::TAU * i as f64 / n as f64 * if clockwise { 1.0 } else { -1.0 }
        };
        (0..n)
            .map(|i| {
                Point2::new(
                    0.5 + 0.5 * libm::cos(angle(i)),
                    0.5 + 0.5 * libm::sin(angle(i)),
                )
            })
            .collect()
    }

    #[test]
    fn a_prism_turns_left_at_each_of_its_few_corners() {
        for outline in [circle(40, true), circle(40, false), circle(5, true)] {
            let ring = prism_outline(&outline, [0.2, 0.08]);
            assert_eq!(ring.len(), outline.len().min(MAX_CORNERS));
            assert!(
                (0..ring.len()).all(|i| doubled_corner_area(&ring, i) > 0.0),
                "{ring:?}"
            );
        }
    }

    #[test]
    fn a_hexagon_around_an_ellipse_keeps_its_area() {
        let area =
            |outline: &[Point2<f64>]| doubled_area(&prism_outline(outline, [0.2, 0.08])) / 2.0;
        let whole = std::f64::consts::PI * 0.1 * 0.04;
        let share = area(&circle(40, true)) / whole;
        assert!((0.98..=1.0).contains(&share), "{share}");
    }

    #[test]
    fn short_sides_go_and_the_area_stays() {
        let p = |x: f64, y: f64| Point2::new(x, y);
        // A square without its corners.
        let outline = [
            p(0.05, 0.0),
            p(0.95, 0.0),
            p(1.0, 0.05),
            p(1.0, 0.95),
            p(0.95, 1.0),
            p(0.05, 1.0),
            p(0.0, 0.95),
            p(0.0, 0.05),
        ];
        let ring = prism_outline(&outline, [1.0, 1.0]);
        assert_eq!(ring.len(), MAX_CORNERS);
        assert!(
            (doubled_area(&ring) / 2.0 - 0.995).abs() < 1e-12,
            "{ring:?}"
        );
        assert!(ring.iter().all(|corner| is_on_card(*corner, [1.0, 1.0])));
    }

    #[test]
    fn straight_and_doubled_corners_go_and_no_area_is_no_prism() {
        let p = |x: f64, y: f64| Point2::new(x, y);
        let square = [
            p(0.0, 0.0),
            p(0.5, 0.0),
            p(1.0, 0.0),
            p(1.0, 1.0),
            p(1.0, 1.0),
            p(0.0, 1.0),
        ];
        assert_eq!(prism_outline(&square, [2.0, 2.0]).len(), 4);
        assert!(prism_outline(&[], [1.0, 1.0]).is_empty());
        assert!(prism_outline(&[p(0.0, 0.0), p(0.5, 0.5), p(1.0, 1.0)], [1.0, 1.0]).is_empty());
    }
}
