//! Outlines of cards, projected into the picture and clipped to it.
//!
//! # Method
//! The outline is clipped in space, before the division by depth, against the pyramid of the
//! picture (Sutherland and Hodgman, "Reentrant Polygon Clipping", 1974), so a card that extends
//! behind the camera projects like any other. A boolean operation with the non-zero rule then
//! resolves what that leaves along the picture's edge, and loops of an outline that crosses itself:
//! whatever the outline winds around is inside.
//!
//! If the lens bends straight lines, the pyramid is that of everything that it lets into the
//! picture, and the sides of the outline are cut into short ones before the lens bends them. What a
//! barrel cannot show, beyond its fold, is outside what it shows.

use crate::camera::{Camera, RadialDistortion};
use crate::geom::{BBox, Point2, Vector3, sides};
use crate::label::boolean::{intersection, unwound, unwound_within};
use crate::scene::Card;
use geo::{Area, BoundingRect, Coord, MapCoords, MultiPolygon, Polygon, Rect};

/// Minimum distance from the camera for projection, metres: closer than any lens focuses, far above
/// rounding errors.
const NEAR_PLANE_M: f64 = 1e-4;

/// Parts of an outline smaller than this are rounding errors, square pixels: `i_overlay` snaps to a
/// grid of 2^-30 of the extent, which along the sides of a picture of 32,768 pixels makes slivers
/// of a hundredth of this.
pub(crate) const SLIVER_AREA_PX2: f64 = 1e-2;

/// Length of the sides that a lens bends, pixels: over this length, a line that k1 = 0.1 bends is
/// straight to a hundredth of a pixel.
const BENT_SIDE_PX: f64 = 8.0;
/// Maximum number of pieces of a side, which may be arbitrarily long outside the picture.
const MAX_PIECES: f64 = 4096.0;

/// The part of the picture inside a card's outline; empty if the card is out of sight or edge-on.
pub(crate) fn region(card: &Card, camera: &Camera, lens: &RadialDistortion) -> MultiPolygon<f64> {
    let px = projected(card, camera, lens);
    if !has_area(&px) {
        return MultiPolygon(Vec::new());
    }
    let parts = unwound_within(&px, &picture_corners(camera));
    without_slivers(parts)
        .map(|part| part.map_coords(|c| clamp_to_picture(c, camera)))
        .collect()
}

/// Everything inside a card's outline, including beyond the picture's edges; empty if the card is
/// behind the camera or edge-on.
pub(crate) fn whole(card: &Card, camera: &Camera, lens: &RadialDistortion) -> MultiPolygon<f64> {
    let in_front = clip_to_front(in_camera(card, camera));
    let px = shown(&in_front, camera, lens);
    if !has_area(&px) {
        return MultiPolygon(Vec::new());
    }
    without_slivers(unwound(&px)).collect()
}

/// The region inside polygons that do not cross; slits of no width lead to holes.
pub(crate) fn inside(polygons: &[Vec<Point2<f64>>]) -> MultiPolygon<f64> {
    let coords = |ring: &Vec<Point2<f64>>| -> Vec<_> {
        ring.iter().map(|p| Coord { x: p.x, y: p.y }).collect()
    };
    polygons.iter().flat_map(|p| unwound(&coords(p))).collect()
}

/// The outline of the part in view, pixels.
fn projected(card: &Card, camera: &Camera, lens: &RadialDistortion) -> Vec<Coord<f64>> {
    let bounds = lens.undistorted_bounds();
    let seen = clip_to_view(in_camera(card, camera), camera, bounds);
    shown(&seen, camera, lens)
}

/// The picture positions of a ring of points in front of the camera.
fn shown(ring: &[Vector3<f64>], camera: &Camera, lens: &RadialDistortion) -> Vec<Coord<f64>> {
    let px = ring.iter().map(|p| to_pixel(p, camera)).collect();
    if lens.is_none() {
        return px;
    }
    bent(&px, lens)
}

/// A ring of pinhole positions as a lens shows it.
fn bent(ring: &[Coord<f64>], lens: &RadialDistortion) -> Vec<Coord<f64>> {
    sides(ring)
        .flat_map(|[a, b]| points_along(a, b))
        .map(|p| {
            let seen = lens.distort(Point2::new(p.x, p.y));
            Coord {
                x: seen.x,
                y: seen.y,
            }
        })
        .collect()
}

/// The start of a side, and the points that cut it into short ones.
fn points_along(a: Coord<f64>, b: Coord<f64>) -> impl Iterator<Item = Coord<f64>> {
    let side = b - a;
    let pieces = (libm::hypot(side.x, side.y) / BENT_SIDE_PX)
        .ceil()
        .clamp(1.0, MAX_PIECES);
    (0..pieces as u32).map(move |i| a + side * (f64::from(i) / pieces))
}

fn has_area(px: &[Coord<f64>]) -> bool {
    px.len() >= 3 && px.iter().all(|p| p.x.is_finite() && p.y.is_finite())
}

fn clamp_to_picture(c: Coord<f64>, camera: &Camera) -> Coord<f64> {
    let [w, h] = camera.image.map(f64::from);
    Coord {
        x: c.x.clamp(0.0, w),
        y: c.y.clamp(0.0, h),
    }
}

/// The intersection of two outlines, without slivers.
pub(crate) fn overlap(a: &MultiPolygon<f64>, b: &MultiPolygon<f64>) -> MultiPolygon<f64> {
    without_slivers(intersection(a, b)).collect()
}

fn without_slivers(region: MultiPolygon<f64>) -> impl Iterator<Item = Polygon<f64>> {
    region
        .into_iter()
        .filter(|part| part.unsigned_area() > SLIVER_AREA_PX2)
}

/// The outer rings of a region, each without a repeated last point.
pub(crate) fn rings(region: &MultiPolygon<f64>) -> Vec<Vec<Point2<f64>>> {
    region.iter().map(outer_ring).collect()
}

fn outer_ring(part: &Polygon<f64>) -> Vec<Point2<f64>> {
    let coords = &part.exterior().0;
    let open = coords.iter().take(coords.len().saturating_sub(1));
    open.map(|c| Point2::new(c.x, c.y)).collect()
}

/// The smallest box around a region.
pub(crate) fn bounds(region: &MultiPolygon<f64>) -> BBox {
    region.bounding_rect().map(bbox_of).unwrap_or_default()
}

fn bbox_of(rect: Rect<f64>) -> BBox {
    let (min, max) = (rect.min(), rect.max());
    BBox {
        x0: min.x,
        y0: min.y,
        x1: max.x,
        y1: max.y,
    }
}

fn in_camera(card: &Card, camera: &Camera) -> Vec<Vector3<f64>> {
    card.outline(&camera.center())
        .into_iter()
        .map(|point| (camera.camera_from_world * point).coords)
        .collect()
}

/// The part of an outline that is visible between two positions of the pinhole's picture.
fn clip_to_view(
    outline: Vec<Vector3<f64>>,
    camera: &Camera,
    [low, high]: [Point2<f64>; 2],
) -> Vec<Vector3<f64>> {
    let (f, c) = (camera.focal_px, camera.principal_px);
    let far_enough = clip_to_front(outline);
    let right_of_left = clip_to_half_space(far_enough, |p| f.x * p.x + (c.x - low.x) * p.z);
    let left_of_right = clip_to_half_space(right_of_left, |p| (high.x - c.x) * p.z - f.x * p.x);
    let below_top = clip_to_half_space(left_of_right, |p| f.y * p.y + (c.y - low.y) * p.z);
    clip_to_half_space(below_top, |p| (high.y - c.y) * p.z - f.y * p.y)
}

/// The part that is far enough in front of the camera.
fn clip_to_front(outline: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    clip_to_half_space(outline, |p| p.z - NEAR_PLANE_M)
}

/// The part of a polygon where a linear function of the position is not negative.
fn clip_to_half_space(
    polygon: Vec<Vector3<f64>>,
    side: impl Fn(&Vector3<f64>) -> f64,
) -> Vec<Vector3<f64>> {
    let mut kept = Vec::with_capacity(polygon.len() + 2);
    for [a, b] in sides(&polygon) {
        let (s, t) = (side(&a), side(&b));
        if s >= 0.0 {
            kept.push(a);
        }
        if (s >= 0.0) != (t >= 0.0) {
            kept.push(a + (b - a) * (s / (s - t)));
        }
    }
    kept
}

fn to_pixel(p: &Vector3<f64>, camera: &Camera) -> Coord<f64> {
    let (f, c) = (camera.focal_px, camera.principal_px);
    Coord {
        x: p.x / p.z * f.x + c.x,
        y: p.y / p.z * f.y + c.y,
    }
}

fn picture_corners(camera: &Camera) -> [Coord<f64>; 4] {
    let [w, h] = camera.image.map(f64::from);
    [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(Coord::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Pose, Quad};
    use crate::image::Image;
    use crate::pixel::{ObjectId, PremulRgba};
    use geo::Contains;
    use proptest::prelude::*;

    /// Outlines have their corners on a grid of this many cells per side, so that they often touch,
    /// cross themselves, run back along themselves, and share edges.
    const GRID: u32 = 8;

    /// Pixels per cell; a card fills the picture.
    const CELL: f64 = 5.0;

    const SIDE: f64 = CELL * GRID as f64;

    fn camera() -> Camera {
        Camera::looking_down(1.0, SIDE, [SIDE as u32; 2])
    }

    /// The part of the picture inside an outline on the grid.
    fn on_grid(corners: &[[u32; 2]]) -> MultiPolygon<f64> {
        region(
            &card_on_grid(corners),
            &camera(),
            &RadialDistortion::new(&camera(), 0.0),
        )
    }

    fn card_on_grid(corners: &[[u32; 2]]) -> Card {
        let uv = |&[x, y]: &[u32; 2]| {
            Point2::new(
                f64::from(x) / f64::from(GRID),
                f64::from(y) / f64::from(GRID),
            )
        };
        let quad = Quad {
            world_from_card: Pose::identity(),
            size: [1.0; 2],
        };
        let texture = Image::filled(1, 1, PremulRgba::default());
        Card {
            outline_uv: corners.iter().map(uv).collect(),
            ..Card::new(ObjectId(1), quad, texture)
        }
    }

    /// How many times an outline winds around a point, by crossings of the line to its right.
    fn winding(corners: &[[u32; 2]], p: Point2<f64>) -> i32 {
        let px = |&[x, y]: &[u32; 2]| Point2::new(CELL * f64::from(x), CELL * f64::from(y));
        sides(corners).fold(0, |n, [a, b]| {
            let (a, b) = (px(&a), px(&b));
            let is_right = (p.y - a.y) * (b.x - a.x) / (b.y - a.y) + a.x > p.x;
            match (a.y <= p.y, b.y <= p.y) {
                (true, false) if is_right => n + 1,
                (false, true) if is_right => n - 1,
                _ => n,
            }
        })
    }

    /// Points between pixel centres, away from every line through two points of the grid by more
    /// than rounding errors.
    fn points() -> impl Iterator<Item = Point2<f64>> {
        let along = |i: u32| f64::from(i) + 0.514_285_7;
        (0..SIDE as u32).flat_map(move |y| {
            (0..SIDE as u32).map(move |x| Point2::new(along(x), along(y) + 0.003_1))
        })
    }

    fn outline() -> impl Strategy<Value = Vec<[u32; 2]>> {
        prop::collection::vec(prop::array::uniform2(0..=GRID), 3..10)
    }

    fn holds(region: &MultiPolygon<f64>, p: Point2<f64>) -> bool {
        region.contains(&geo::Point::new(p.x, p.y))
    }

    #[test]
    fn parts_that_meet_in_a_corner_are_all_there() {
        let corners = [
            [2, 0],
            [5, 2],
            [5, 3],
            [5, 4],
            [6, 6],
            [4, 0],
            [0, 3],
            [7, 3],
        ];
        let found = on_grid(&corners);
        for p in points() {
            assert_eq!(holds(&found, p), winding(&corners, p) != 0, "{p:?}");
        }
    }

    proptest! {
        #[test]
        fn whatever_an_outline_winds_around_is_inside(corners in outline()) {
            let found = on_grid(&corners);
            let mut count = 0.0;
            for p in points() {
                let is_inside = winding(&corners, p) != 0;
                prop_assert_eq!(holds(&found, p), is_inside, "{:?}", p);
                count += f64::from(u8::from(is_inside));
            }
            // A raster of one point per pixel is off by less than half a pixel for each pixel of
            // border.
            let border = 2.0 * SIDE * corners.len() as f64;
            prop_assert!((found.unsigned_area() - count).abs() <= 0.5 * border);
            // All of it is in the picture.
            let all = whole(&card_on_grid(&corners), &camera(), &RadialDistortion::new(&camera(), 0.0));
            prop_assert!((all.unsigned_area() - found.unsigned_area()).abs() < 0.1);
        }

        #[test]
        fn an_overlap_is_what_both_outlines_hold(a in outline(), b in outline()) {
            let (ra, rb) = (on_grid(&a), on_grid(&b));
            let shared = overlap(&ra, &rb);
            for p in points() {
                prop_assert_eq!(holds(&shared, p), winding(&a, p) != 0 && winding(&b, p) != 0, "{:?}", p);
            }
            // The grid that `i_overlay` snaps to moves corners by less than 1e-7 pixels here.
            prop_assert!((overlap(&rb, &ra).unsigned_area() - shared.unsigned_area()).abs() < 1e-4);
            prop_assert!((overlap(&ra, &ra).unsigned_area() - ra.unsigned_area()).abs() < 1e-4);
        }
    }

    #[test]
    fn what_a_barrel_cannot_show_is_not_mirrored_into_the_picture() {
        // From a quarter of a focal length to the right of the middle to beyond the fold at 1.29.
        let card = card_on_grid(&[[6, 4], [22, 4], [22, 5], [6, 5]]);
        let lens = RadialDistortion::new(&camera(), -0.2);
        let all = whole(&card, &camera(), &lens);
        let b = bounds(&all);
        // (0.25, 0.125) at 0.984375 of its radius, 2.25 at two thirds.
        assert!((b.x0 - 29.84375).abs() < 1e-6, "{b:?}");
        assert!((b.x1 - 80.0).abs() < 1e-6, "{b:?}");
        let inside = region(&card, &camera(), &lens).unsigned_area();
        // Of areas integrated along the card.
        let outside = 1.0 - inside / all.unsigned_area();
        assert!((outside - 0.7506).abs() < 0.003, "{outside}");
    }

    #[test]
    fn outlines_that_touch_in_an_edge_or_a_corner_share_nothing() {
        let square = |x: u32, y: u32| on_grid(&[[x, y], [x + 2, y], [x + 2, y + 2], [x, y + 2]]);
        let middle = square(3, 3);
        for (x, y) in [
            (1, 3),
            (5, 3),
            (3, 1),
            (3, 5),
            (1, 1),
            (5, 5),
            (1, 2),
            (5, 4),
        ] {
            assert_eq!(
                overlap(&middle, &square(x, y)).unsigned_area(),
                0.0,
                "{x} {y}"
            );
        }
        assert_eq!(overlap(&middle, &square(4, 4)).unsigned_area(), CELL * CELL);
    }
}
