//! Outlines of cards, projected into the picture and clipped to it.
//!
//! # Method
//! The outline is clipped in space, before the division by depth, against the pyramid of the picture (Sutherland and
//! Hodgman, "Reentrant Polygon Clipping", 1974), so a card that reaches behind the camera projects like any other. What
//! that leaves along the picture's edge, and loops of an outline that crosses itself, a boolean operation of `geo` then
//! resolves under the non-zero rule: whatever the outline winds around is inside.

use crate::camera::Camera;
use crate::geom::{Point2, Vector3};
use crate::label::BBox;
use crate::scene::Card;
use geo::bool_ops::FillRule;
use geo::{Area, BooleanOps, BoundingRect, Coord, LineString, MapCoords, MultiPolygon, Polygon};

/// Least distance from the camera that is projected, metres: closer than any lens focuses, far above rounding.
const NEAR: f64 = 1e-4;

/// Parts of an outline smaller than this are rounding, square pixels: `geo` snaps to a grid of 2^-30 of the extent, which
/// along the sides of a picture of 32,768 pixels makes slivers of a hundredth of this.
const SLIVER_PX: f64 = 1e-2;

/// The part of the picture that lies inside a card's outline; empty where the card is out of sight or edge-on.
pub(crate) fn region(card: &Card, camera: &Camera) -> MultiPolygon<f64> {
    let seen = clip_to_view(in_camera(card, camera), camera);
    let px: Vec<_> = seen.iter().map(|p| pixel(p, camera)).collect();
    if px.len() < 3 || px.iter().any(|p| !p.x.is_finite() || !p.y.is_finite()) {
        return MultiPolygon(Vec::new());
    }
    let outline = Polygon::new(LineString(px), Vec::new());
    let parts = outline.intersection_with_fill_rule(&picture(camera), FillRule::NonZero);
    let [w, h] = camera.image.map(f64::from);
    let inside = |c: Coord<f64>| Coord { x: c.x.clamp(0.0, w), y: c.y.clamp(0.0, h) };
    parts.into_iter().filter(|part| part.unsigned_area() > SLIVER_PX).map(|part| part.map_coords(inside)).collect()
}

/// What two outlines share, slivers left out.
pub(crate) fn overlap(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>) -> MultiPolygon<f64> {
    a.intersection(b).into_iter().filter(|part| part.unsigned_area() > SLIVER_PX).collect()
}

/// The outer rings of a region, each without a repeated last point.
pub(crate) fn rings(region: &MultiPolygon<f64>) -> Vec<Vec<Point2<f64>>> {
    let ring = |part: &Polygon<f64>| {
        let coords = &part.exterior().0;
        coords[..coords.len().saturating_sub(1)].iter().map(|c| Point2::new(c.x, c.y)).collect()
    };
    region.iter().map(ring).collect()
}

/// The smallest box around a region.
pub(crate) fn bounds(region: &MultiPolygon<f64>) -> BBox {
    let rect = region.bounding_rect();
    rect.map_or_else(BBox::default, |r| BBox { x0: r.min().x, y0: r.min().y, x1: r.max().x, y1: r.max().y })
}

fn in_camera(card: &Card, camera: &Camera) -> Vec<Vector3<f64>> {
    let point = |uv: &Point2<f64>| (camera.camera_from_world * card.quad.point(uv.x, uv.y)).coords;
    card.outline_uv.iter().map(point).collect()
}

fn clip_to_view(outline: Vec<Vector3<f64>>, camera: &Camera) -> Vec<Vector3<f64>> {
    let [w, h] = camera.image.map(f64::from);
    let (f, c) = (camera.focal_px, camera.principal_px);
    let far_enough = clip(outline, |p| p.z - NEAR);
    let right_of_left = clip(far_enough, |p| f.x * p.x + c.x * p.z);
    let left_of_right = clip(right_of_left, |p| (w - c.x) * p.z - f.x * p.x);
    let below_top = clip(left_of_right, |p| f.y * p.y + c.y * p.z);
    clip(below_top, |p| (h - c.y) * p.z - f.y * p.y)
}

/// The part of a polygon where a linear function of the position is not negative.
fn clip(polygon: Vec<Vector3<f64>>, side: impl Fn(&Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    let followers = polygon.iter().cycle().skip(1);
    for (a, b) in polygon.iter().zip(followers) {
        let (s, t) = (side(a), side(b));
        if s >= 0.0 {
            kept.push(*a);
        }
        if (s >= 0.0) != (t >= 0.0) {
            kept.push(a + (b - a) * (s / (s - t)));
        }
    }
    kept
}

fn pixel(p: &Vector3<f64>, camera: &Camera) -> Coord<f64> {
    let (f, c) = (camera.focal_px, camera.principal_px);
    Coord { x: p.x / p.z * f.x + c.x, y: p.y / p.z * f.y + c.y }
}

fn picture(camera: &Camera) -> Polygon<f64> {
    let [w, h] = camera.image.map(f64::from);
    let corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)];
    Polygon::new(LineString::from(corners.to_vec()), Vec::new())
}
