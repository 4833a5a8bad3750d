//! Contacts of bodies at rest: with each other, with the floor and with the walls.

use super::overlap::{Solid, Touch};
use crate::geom::Vector3;
use nalgebra::Vector2;

/// Direction cosine up to which `x` is oblique enough to a direction to span the plane across it.
const MAX_HELPER_COSINE: f64 = 0.6;

/// A point at which a body is pushed.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    /// The body, as its index.
    pub(super) body: usize,
    /// The body that pushes back; none for the floor or a wall.
    pub(super) by: Option<usize>,
    /// Position, metres.
    pub(super) point: Vector3<f64>,
    /// Unit vector in the direction of the push.
    pub(super) normal: Vector3<f64>,
    /// Whether there is friction: everywhere except at walls.
    pub(super) rough: bool,
}

/// All contacts of bodies that fell: of the pairs that touch, and with the floor and, if they are
/// `invisible`, the walls over the edges of a surface. Bodies nearer than `reach` (metres) touch.
pub(super) fn contacts(
    solids: &[Solid],
    touching: &[Touch],
    invisible: Option<[f64; 2]>,
    reach: f64,
) -> Vec<Contact> {
    let fell = (0..solids.len()).filter(|&i| solids[i].falls);
    let with_room = invisible.into_iter().flat_map(|surface| {
        let fell = fell.clone();
        fell.flat_map(move |i| room_contacts(i, &solids[i], surface, reach))
    });
    let with_bodies = touching
        .iter()
        .flat_map(|touch| pair_contacts(solids, touch, reach));
    with_room.chain(with_bodies).collect()
}

/// The floor and the walls over a surface: normals into the room, and their distances along them.
fn room_planes(surface: [f64; 2]) -> [(Vector3<f64>, f64); 5] {
    let [x, y] = surface.map(|side| side / 2.0);
    [
        (Vector3::z(), 0.0),
        (Vector3::x(), -x),
        (-Vector3::x(), -x),
        (Vector3::y(), -y),
        (-Vector3::y(), -y),
    ]
}

/// Contacts with the floor and the walls.
fn room_contacts(body: usize, solid: &Solid, surface: [f64; 2], reach: f64) -> Vec<Contact> {
    room_planes(surface)
        .into_iter()
        .flat_map(|(normal, distance)| {
            let touching = solid
                .corners()
                .filter(move |corner| corner.dot(&normal) - distance < solid.edge_radius + reach);
            touching.map(move |corner| Contact {
                body,
                by: None,
                point: corner - normal * solid.edge_radius,
                normal,
                rough: normal.z > 0.0,
            })
        })
        .collect()
}

/// Contacts of two bodies; the higher one is pushed.
fn pair_contacts(solids: &[Solid], touch: &Touch, reach: f64) -> Vec<Contact> {
    let [body, by] = touch.pair;
    let points = shared_points(&solids[body], &solids[by], &touch.towards, reach);
    points
        .into_iter()
        .map(|point| Contact {
            body,
            by: Some(by),
            point,
            normal: -touch.towards,
            rough: true,
        })
        .collect()
}

/// Corners of the intersection of the facing faces, edges or corners of two bodies, halfway between
/// the bodies; `towards` is the direction from the first to the second.
fn shared_points(a: &Solid, b: &Solid, towards: &Vector3<f64>, reach: f64) -> Vec<Vector3<f64>> {
    let near_a = NearestCorners::new(a, towards, reach);
    let near_b = NearestCorners::new(b, &-towards, reach);
    let height = (near_a.height - near_b.height) / 2.0;
    let (u, v) = perpendicular_axes(towards);
    let shared = shared_corners(&near_a.ring(&u, &v), &near_b.ring(&u, &v), reach);
    shared
        .into_iter()
        .map(|p| u * p.x + v * p.y + towards * height)
        .collect()
}

/// Two unit vectors perpendicular to another one and to each other.
pub(super) fn perpendicular_axes(direction: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if direction.x.abs() < MAX_HELPER_COSINE {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = helper.cross(direction).normalize();
    (u, direction.cross(&u))
}

/// The corners of a body that are farthest in a direction.
struct NearestCorners {
    /// Their distance in that direction.
    height: f64,
    corners: Vec<Vector3<f64>>,
}

impl NearestCorners {
    /// Those of a body, within `reach`.
    fn new(solid: &Solid, towards: &Vector3<f64>, reach: f64) -> Self {
        let heights = solid.corners().map(|corner| corner.dot(towards));
        let height = heights.fold(f64::NEG_INFINITY, f64::max);
        Self {
            height: height + solid.edge_radius,
            corners: solid
                .corners()
                .filter(|corner| corner.dot(towards) > height - reach)
                .collect(),
        }
    }

    /// Their convex hull in the plane of two axes.
    fn ring(&self, u: &Vector3<f64>, v: &Vector3<f64>) -> Vec<Vector2<f64>> {
        convex_hull(self.corners.iter().map(|p| [p.dot(u), p.dot(v)].into()))
    }
}

/// Twice the area of a triangle, above 0 where it turns left.
fn turn(a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

/// The convex hull of some points, counter-clockwise; two points or one if they have no area.
///
/// # Method
/// Andrew 1979: the lower and the upper chain of the points in order of x.
fn convex_hull(points: impl Iterator<Item = Vector2<f64>>) -> Vec<Vector2<f64>> {
    let mut points: Vec<Vector2<f64>> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let lower = hull_chain(points.iter());
    [lower, hull_chain(points.iter().rev())].concat()
}

/// The chain of a hull along sorted points, without its last point, where the other chain begins.
fn hull_chain<'a>(points: impl Iterator<Item = &'a Vector2<f64>>) -> Vec<Vector2<f64>> {
    let mut chain: Vec<Vector2<f64>> = Vec::new();
    for p in points {
        while let [.., a, b] = chain[..]
            && turn(&a, &b, p) <= 0.0
        {
            chain.pop();
        }
        chain.push(*p);
    }
    chain.pop();
    chain
}

/// Corners of the intersection of two convex rings, each widened by `reach`.
fn shared_corners(a: &[Vector2<f64>], b: &[Vector2<f64>], reach: f64) -> Vec<Vector2<f64>> {
    let of_a = a.iter().filter(|p| is_near(p, b, reach));
    let of_b = b.iter().filter(|p| is_near(p, a, reach));
    let corners = of_a.chain(of_b).copied();
    corners.chain(crossings(a, b)).collect()
}

/// Where the sides of two rings cross.
fn crossings(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> impl Iterator<Item = Vector2<f64>> {
    sides(a).flat_map(move |s| sides(b).filter_map(move |t| crossing(s, t)))
}

/// The sides of a ring: a single one for two points, none for one.
fn sides(ring: &[Vector2<f64>]) -> impl Iterator<Item = [Vector2<f64>; 2]> {
    let count = match ring.len() {
        0 | 1 => 0,
        2 => 1,
        n => n,
    };
    (0..count).map(|i| [ring[i], ring[(i + 1) % ring.len()]])
}

/// Whether a point lies in a ring.
fn is_inside(p: &Vector2<f64>, ring: &[Vector2<f64>]) -> bool {
    ring.len() > 2 && sides(ring).all(|[a, b]| turn(&a, &b, p) >= 0.0)
}

/// Whether a point is in a ring, or outside by at most `reach`.
fn is_near(p: &Vector2<f64>, ring: &[Vector2<f64>], reach: f64) -> bool {
    is_inside(p, ring)
        || sides(ring).any(|side| distance_to_side(p, side) <= reach)
        || ring.iter().any(|corner| (corner - p).norm() <= reach)
}

fn distance_to_side(p: &Vector2<f64>, [a, b]: [Vector2<f64>; 2]) -> f64 {
    let along = (b - a).dot(&(p - a)) / (b - a).norm_squared();
    (a + (b - a) * along.clamp(0.0, 1.0) - p).norm()
}

/// Where two sides cross.
fn crossing([a, b]: [Vector2<f64>; 2], [c, d]: [Vector2<f64>; 2]) -> Option<Vector2<f64>> {
    let (from, to) = (turn(&c, &d, &a), turn(&c, &d, &b));
    let (first, second) = (turn(&a, &b, &c), turn(&a, &b, &d));
    (from * to < 0.0 && first * second < 0.0).then(|| a + (b - a) * (from / (from - to)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Pose, UnitQuaternion};
    use crate::settle::bodies::rectangle;
    use crate::settle::overlap::touching_pairs;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    const ROOM: [f64; 2] = [1.0, 1.0];
    const REACH: f64 = 0.001;

    fn plate(at: [f64; 3], angles: [f64; 3]) -> Solid {
        let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        let half = Vector3::new(0.1, 0.04, 0.0025);
        let outline = rectangle(half.x, half.y);
        Solid {
            world_from_body: Pose::from_parts(at.into(), rotation),
            half,
            outline,
            edge_radius: 0.0,
            falls: true,
            is_gone: false,
        }
    }

    fn all(solids: &[Solid]) -> Vec<Contact> {
        contacts(solids, &touching_pairs(solids, REACH), Some(ROOM), REACH)
    }

    /// Contacts of two plates with each other, the second over the first.
    fn between(lower: Solid, upper: Solid) -> Vec<Contact> {
        all(&[lower, upper])
            .into_iter()
            .filter(|contact| contact.by.is_some())
            .collect()
    }

    /// Least and greatest x and y of contacts.
    fn spread(contacts: &[Contact]) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let along = contacts.iter().map(|contact| contact.point[axis]);
            along.fold([f64::INFINITY, -f64::INFINITY], |[l, h], v| {
                [l.min(v), h.max(v)]
            })
        })
    }

    fn is_near(found: [[f64; 2]; 2], expected: [[f64; 2]; 2]) -> bool {
        found
            .iter()
            .flatten()
            .zip(expected.iter().flatten())
            .all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_plate_on_the_floor_touches_it_with_four_corners() {
        let found = all(&[plate([0.0, 0.0, 0.0027], [0.0; 3])]);
        assert!(
            found.len() == 4
                && found
                    .iter()
                    .all(|c| c.normal == Vector3::z() && c.rough && c.by.is_none())
        );
        let beside = all(&[plate([0.4, 0.0, 0.1], [0.0; 3])]);
        assert!(beside.len() == 4 && beside.iter().all(|c| c.normal == -Vector3::x() && !c.rough));
    }

    #[test]
    fn plates_across_each_other_share_the_square_in_the_middle() {
        let crossed = between(
            plate([0.0; 3], [0.0; 3]),
            plate([0.0, 0.0, 0.0054], [0.0, 0.0, FRAC_PI_2]),
        );
        assert!(is_near(spread(&crossed), [[-0.04, 0.04]; 2]), "{crossed:?}");
        // The second is pushed up, by the first.
        assert!(
            crossed
                .iter()
                .all(|c| c.body == 1 && c.by == Some(0) && (c.normal - Vector3::z()).norm() < 1e-9)
        );
        assert!(crossed.iter().all(|c| (c.point.z - 0.0027).abs() < 1e-9));
    }

    #[test]
    fn an_edge_on_a_face_touches_along_a_line() {
        let upright = plate([0.0, 0.01, 0.0427], [FRAC_PI_2, 0.0, 0.0]);
        assert!(is_near(
            spread(&between(plate([0.0; 3], [0.0; 3]), upright)),
            [[-0.1, 0.1], [0.0075, 0.0125]]
        ));
        let height = 0.04 * libm::sin(FRAC_PI_4) + 0.0025 * libm::cos(FRAC_PI_4) + 0.0027;
        let tilted = between(
            plate([0.0; 3], [0.0; 3]),
            plate([0.0, 0.0, height], [FRAC_PI_4, 0.0, 0.0]),
        );
        let [x, y] = spread(&tilted);
        assert!(
            is_near([x, [0.0; 2]], [[-0.1, 0.1], [0.0; 2]]) && (y[1] - y[0]).abs() < 1e-9,
            "{tilted:?}"
        );
    }

    #[test]
    fn crossed_edges_touch_in_one_point() {
        // Edge along x, under an edge along y.
        let top = 0.04 * libm::sin(FRAC_PI_4) + 0.0025 * libm::cos(FRAC_PI_4);
        let lower = plate([0.0; 3], [FRAC_PI_4, 0.0, 0.0]);
        let upper = plate([0.0, 0.0, 2.0 * top + 0.0004], [FRAC_PI_4, 0.0, FRAC_PI_2]);
        let found = between(lower, upper);
        let [x, y] = spread(&found);
        assert!(
            !found.is_empty() && x[1] - x[0] < 1e-9 && y[1] - y[0] < 1e-9,
            "{found:?}"
        );
        assert!(found.iter().all(|c| (c.point.z - top - 0.0002).abs() < 1e-9 && (c.normal.z - 1.0).abs() < 1e-9));
    }

    #[test]
    fn what_is_farther_than_the_reach_does_not_touch() {
        assert!(
            between(
                plate([0.0; 3], [0.0; 3]),
                plate([0.0, 0.0, 0.0061], [0.0; 3])
            )
            .is_empty()
        );
        let [a, b] = [
            plate([0.0; 3], [0.0; 3]),
            plate([0.0, 0.0, 0.0054], [0.0; 3]),
        ]
        .map(|p| Solid { falls: false, ..p });
        assert!(all(&[a, b]).is_empty());
    }

    #[test]
    fn a_hull_goes_round_once_and_leaves_out_what_is_inside() {
        let of = |points: &[[f64; 2]]| convex_hull(points.iter().map(|&p| p.into())).len();
        assert_eq!(
            of(&[
                [0.0, 0.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [0.0, 1.0],
                [0.5, 0.5],
                [0.5, 0.0]
            ]),
            4
        );
        assert_eq!(
            (of(&[[0.0, 0.0], [1.0, 1.0]]), of(&[[0.0, 0.0]]), of(&[])),
            (2, 1, 0)
        );
        assert_eq!(of(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), 2);
    }
}
