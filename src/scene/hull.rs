//! The corners of the convex prism that falls in place of a cut-out: few, so that contacts are
//! cheap and calm.

use crate::geom::Point2;

/// Most corners of a prism: those of an octagon lose little of a bottle's hull.
pub(super) const MAX_CORNERS: usize = 8;
/// Twice the area of a corner's triangle below which it is straight, as a share of the card's area.
const MIN_CORNER_AREA_RATIO: f64 = 1e-6;

/// Corners of a convex outline in texture coordinates (right and down, 0 to 1) as those of a prism
/// on a card of this size, counter-clockwise with y up, metres; empty where the outline has no
/// area.
///
/// # Method
/// The corner whose loss takes the least area goes first, until [`MAX_CORNERS`] are left
/// (Visvalingam and Whyatt 1993); what is left lies inside the outline, so a prism never touches
/// what its outline does not.
pub(super) fn prism_outline(outline_uv: &[Point2<f64>], size: [f64; 2]) -> Vec<[f64; 2]> {
    let mut ring: Vec<[f64; 2]> = outline_uv.iter().map(|p| on_card(p, size)).collect();
    if doubled_area(&ring) < 0.0 {
        ring.reverse();
    }
    remove_least_corners(&mut ring, MIN_CORNER_AREA_RATIO * size[0] * size[1]);
    if ring.len() < 3 { Vec::new() } else { ring }
}

/// Removes corners until [`MAX_CORNERS`] are left, and those of up to this area.
fn remove_least_corners(ring: &mut Vec<[f64; 2]>, straight_area: f64) {
    while let Some((least, area)) = least_corner(ring) {
        if ring.len() <= MAX_CORNERS && area > straight_area {
            break;
        }
        ring.remove(least);
    }
}

/// A point of the texture in the plane of its card, metres.
fn on_card(p: &Point2<f64>, [w, h]: [f64; 2]) -> [f64; 2] {
    [
        (p.x.clamp(0.0, 1.0) - 0.5) * w,
        (0.5 - p.y.clamp(0.0, 1.0)) * h,
    ]
}

/// The corner whose triangle with its neighbours is least, and twice the area of that.
fn least_corner(ring: &[[f64; 2]]) -> Option<(usize, f64)> {
    (0..ring.len())
        .map(|i| (i, doubled_corner_area(ring, i)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Twice the area of the triangle of a corner and its neighbours; above 0 where the ring turns
/// left.
pub(super) fn doubled_corner_area(ring: &[[f64; 2]], i: usize) -> f64 {
    let [a, b, c] = with_neighbours(ring, i);
    (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
}

/// A corner between the one before and the one after it.
fn with_neighbours(ring: &[[f64; 2]], i: usize) -> [[f64; 2]; 3] {
    [i + ring.len() - 1, i, i + 1].map(|i| ring[i % ring.len()])
}

/// Twice the area of a ring; above 0 where it turns left.
pub(crate) fn doubled_area(ring: &[[f64; 2]]) -> f64 {
    edges(ring).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

fn edges(ring: &[[f64; 2]]) -> impl Iterator<Item = (&[f64; 2], &[f64; 2])> {
    ring.iter().zip(ring.iter().cycle().skip(1))
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
    fn an_octagon_in_an_ellipse_keeps_nine_tenths_of_its_area() {
        let area = doubled_area(&prism_outline(&circle(40, true), [0.2, 0.08])) / 2.0;
        let whole = std::f64::consts::PI * 0.1 * 0.04;
        // A regular octagon has 2 sqrt 2 / pi of its circle.
        assert!((0.85..=0.901).contains(&(area / whole)), "{}", area / whole);
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
