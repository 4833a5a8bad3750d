//! Intersections and differences of regions.
//!
//! # Method
//! `i_overlay` is called directly: the older version within `geo` loses parts of outlines that
//! touch themselves (17 of 3 million outlines on a grid of 8 x 8 cells; this one loses none).

use geo::{Coord, LineString, MultiPolygon, Polygon};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::simplify::SimplifyShape;
use i_overlay::float::single::SingleFloatOverlay;

/// Closed, without a repeated last point.
type Contour = Vec<[f64; 2]>;

/// Everything that an outline winds around.
pub(crate) fn unwound(outline: &[Coord<f64>]) -> MultiPolygon<f64> {
    region(contour(outline).simplify_shape(FillRule::NonZero))
}

/// What an outline winds around within a convex polygon.
pub(crate) fn unwound_within(outline: &[Coord<f64>], within: &[Coord<f64>]) -> MultiPolygon<f64> {
    let (outline, within) = (contour(outline), contour(within));
    region(outline.overlay(&within, OverlayRule::Intersect, FillRule::NonZero))
}

pub(crate) fn intersection(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>) -> MultiPolygon<f64> {
    combined(a, b, OverlayRule::Intersect)
}

pub(crate) fn difference(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>) -> MultiPolygon<f64> {
    combined(a, b, OverlayRule::Difference)
}

fn combined(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>, rule: OverlayRule) -> MultiPolygon<f64> {
    region(contours(a).overlay(&contours(b), rule, FillRule::NonZero))
}

/// Holes run the other way round.
fn contours(region: &MultiPolygon<f64>) -> Vec<Contour> {
    region
        .iter()
        .flat_map(|part| std::iter::once(part.exterior()).chain(part.interiors()))
        .map(|ring| contour(&ring.0[..ring.0.len().saturating_sub(1)]))
        .collect()
}

fn contour(ring: &[Coord<f64>]) -> Contour {
    ring.iter().map(|c| [c.x, c.y]).collect()
}

/// The first contour of each part is its border, others are holes.
fn region(parts: Vec<Vec<Contour>>) -> MultiPolygon<f64> {
    parts.into_iter().map(part).collect()
}

fn part(contours: Vec<Contour>) -> Polygon<f64> {
    let mut rings = contours.into_iter().map(LineString::from);
    let border = rings.next().unwrap_or_else(LineString::empty);
    Polygon::new(border, rings.collect())
}
