//! Overlap of bodies and its depth, in `f64` and independent of the physics engine, to judge the
//! engine's result.

use crate::geom::{Pose, Vector3, sides};
use crate::scene::half_extent;

/// Sine of the angle up to which edges count as parallel: their normal would be noise, and other
/// directions decide.
const PARALLEL_SINE: f64 = 1e-6;
/// Maximum number of steps towards the nearest points of two cores: after so many, the gap of round
/// bodies is known to a hundredth of their radius.
const APPROACH_STEPS: usize = 40;
/// Length of such a step, as a share of the way to the farthest corner, below which it is the last.
const MIN_APPROACH: f64 = 1e-9;

/// A body in the world: a convex prism along its own `z`, the core, and all that is near it.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    /// Its pose; the box around its card is centred in its own frame.
    pub(super) world_from_body: Pose,
    /// Half lengths of that box, metres.
    pub(super) half: Vector3<f64>,
    /// Corners of its core's base, counter-clockwise; for a sharp box, those of the box.
    pub(super) outline: Vec<[f64; 2]>,
    /// Radius of its edges: how far it reaches beyond its core, metres.
    pub(super) edge_radius: f64,
    /// Whether it was dropped; other bodies are stationary.
    pub(super) falls: bool,
    /// Whether it went over the rim: it is in no place and touches nothing.
    pub(super) is_gone: bool,
}

impl Solid {
    pub(super) fn center(&self) -> Vector3<f64> {
        self.world_from_body.translation.vector
    }

    pub(super) fn axes(&self) -> [Vector3<f64>; 3] {
        let r = self.world_from_body.rotation.to_rotation_matrix();
        [0, 1, 2].map(|i| r.matrix().column(i).into())
    }

    /// All corners of its core, in the world.
    pub(super) fn corners(&self) -> impl Iterator<Item = Vector3<f64>> {
        let [x, y, z] = self.axes();
        let up = z * self.core_half_height();
        self.outline.iter().flat_map(move |&[a, b]| {
            let middle = self.center() + x * a + y * b;
            [middle + up, middle - up]
        })
    }

    /// The corner of its core that is farthest in a direction.
    fn farthest_corner(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let along = |corner: &Vector3<f64>| corner.dot(direction);
        self.corners()
            .max_by(|a, b| along(a).total_cmp(&along(b)))
            .expect("a base has corners")
    }

    fn core_half_height(&self) -> f64 {
        self.half.z - self.edge_radius
    }

    /// Half lengths of the axis-aligned box around the box of its card.
    pub(super) fn extent(&self) -> Vector3<f64> {
        half_extent(&self.world_from_body.rotation, &self.half)
    }

    /// Height of the top of that box, metres.
    pub(super) fn top(&self) -> f64 {
        self.center().z + self.extent().z
    }

    /// Its projection onto a direction, as an interval.
    fn projection(&self, axes: &[Vector3<f64>; 3], direction: &Vector3<f64>) -> [f64; 2] {
        let [x, y, z] = axes.map(|axis| axis.dot(direction));
        let at = self.center().dot(direction);
        let [low, high] = self.base_range(x, y);
        let beyond_base = self.core_half_height() * z.abs() + self.edge_radius;
        [at + low - beyond_base, at + high + beyond_base]
    }

    /// Least and greatest `a * x + b * y` of the corners of its base.
    #[inline]
    fn base_range(&self, x: f64, y: f64) -> [f64; 2] {
        let along = self.outline.iter().map(|[a, b]| a * x + b * y);
        along.fold([f64::INFINITY, -f64::INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    }

    /// Unit directions of the edges of its base in the world; parallel opposite sides count once.
    fn base_edges(&self, axes: &[Vector3<f64>; 3]) -> Vec<Vector3<f64>> {
        let mut edges: Vec<Vector3<f64>> = Vec::with_capacity(self.outline.len() + 1);
        for side in self.base_sides(axes) {
            if edges.iter().all(|edge| are_oblique(edge, &side)) {
                edges.push(side);
            }
        }
        edges
    }

    /// Unit directions of the sides of its base, in order.
    fn base_sides(&self, axes: &[Vector3<f64>; 3]) -> impl Iterator<Item = Vector3<f64>> {
        sides(&self.outline)
            .map(|[a, b]| (axes[0] * (b[0] - a[0]) + axes[1] * (b[1] - a[1])).normalize())
    }
}

/// Indices of the bodies that fall, from the lowest to the highest.
pub(super) fn falling_from_lowest(solids: &[Solid]) -> Vec<usize> {
    let mut order = from_lowest(solids);
    order.retain(|&i| solids[i].falls);
    order
}

/// Indices of all bodies, from the lowest to the highest.
pub(super) fn from_lowest(solids: &[Solid]) -> Vec<usize> {
    ascending_by(solids.len(), |i| solids[i].center().z)
}

/// The indices up to `count` in ascending order of `key`; equal ones stay in order.
pub(super) fn ascending_by(count: usize, key: impl Fn(usize) -> f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
    order
}

/// Whether two unit directions are neither parallel nor opposite.
fn are_oblique(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    a.cross(b).norm() > PARALLEL_SINE
}

/// Ids (index + 1) of dropped bodies whose centre is beyond these distances along x and y, below
/// the surface, or not finite.
pub(super) fn escaped_ids(solids: &[Solid], limits: [f64; 2]) -> Vec<usize> {
    let numbered = solids.iter().enumerate();
    numbered
        .filter(|(_, solid)| solid.falls && !is_inside(&solid.center(), limits))
        .map(|(i, _)| i + 1)
        .collect()
}

fn is_inside(center: &Vector3<f64>, limits: [f64; 2]) -> bool {
    center.x.abs() <= limits[0] && center.y.abs() <= limits[1] && center.z >= 0.0
}

/// Two bodies that are close to each other, at least one of which was dropped.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Their indices, the higher one first.
    pub(super) pair: [usize; 2],
    /// Gap between them, metres; negative if they overlap.
    pub(super) gap: f64,
    /// Unit vector from the first to the second along which the gap is measured.
    pub(super) towards: Vector3<f64>,
}

/// All pairs of bodies with a gap below `reach`, metres.
pub(super) fn touching_pairs(solids: &[Solid], reach: f64) -> Vec<Touch> {
    let pairs = (1..solids.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
    pairs
        .filter(|&[i, j]| can_touch(&solids[i], &solids[j]))
        .filter_map(|pair| Touch::between(solids, pair, reach))
        .collect()
}

fn can_touch(a: &Solid, b: &Solid) -> bool {
    (a.falls || b.falls) && !a.is_gone && !b.is_gone
}

impl Touch {
    /// The touch of two bodies, if their gap is below `reach`.
    fn between(solids: &[Solid], pair: [usize; 2], reach: f64) -> Option<Self> {
        let [a, b] = pair.map(|i| &solids[i]);
        let (gap, towards) = separation(a, b, reach)?;
        Some(Self { pair, gap, towards })
    }
}

/// Deepest overlap of a dropped body with any other, and with the floor `z = 0` and, if they are
/// `invisible`, the walls over the edges of a surface, metres; 0 if nothing overlaps.
pub(super) fn deepest(solids: &[Solid], touching: &[Touch], invisible: Option<[f64; 2]>) -> f64 {
    let in_room = invisible.map_or(0.0, |surface| deepest_in_room(solids, surface));
    touching
        .iter()
        .map(|touch| -touch.gap)
        .fold(in_room, f64::max)
}

fn deepest_in_room(solids: &[Solid], surface: [f64; 2]) -> f64 {
    let falling = solids.iter().filter(|solid| solid.falls);
    falling
        .map(|solid| depth_in_room(solid, surface))
        .fold(0.0, f64::max)
}

/// How far a body reaches through the floor or a wall, whichever is more; 0 inside.
fn depth_in_room(solid: &Solid, surface: [f64; 2]) -> f64 {
    let axes = solid.axes();
    let [bottom, _] = solid.projection(&axes, &Vector3::z());
    let along_x = solid.projection(&axes, &Vector3::x());
    let along_y = solid.projection(&axes, &Vector3::y());
    (-bottom)
        .max(0.0)
        .max(past_wall(along_x, surface[0]))
        .max(past_wall(along_y, surface[1]))
}

/// How far an interval reaches beyond walls this far apart; negative inside.
fn past_wall([low, high]: [f64; 2], length: f64) -> f64 {
    high.max(-low) - length / 2.0
}

/// How far the box of a card reaches beyond the walls along x and along y; negative inside.
pub(super) fn past_walls(solid: &Solid, surface: [f64; 2]) -> [f64; 2] {
    let (center, extent) = (solid.center(), solid.extent());
    [0, 1].map(|axis| center[axis].abs() + extent[axis] - surface[axis] / 2.0)
}

/// Shortest distance by which one body must move to leave another, metres; 0 if they are apart.
pub(super) fn overlap_depth(a: &Solid, b: &Solid) -> f64 {
    separation(a, b, 0.0).map_or(0.0, |(gap, _)| -gap)
}

/// Gap between two bodies, metres, negative if they overlap, and the unit direction from the first
/// to the second along which it is measured; none if the gap is `reach` or more.
///
/// # Method
/// Separating axes: two convex bodies are apart if and only if their projections are, along one of
/// these directions: the faces' normals and the cross products of their edges ([Gottschalk, Lin and
/// Manocha 1996]; 15 for two boxes). The greatest gap between projections is used as that of the
/// bodies: it is the depth of an overlap, and a lower bound of a distance. Round bodies may also be
/// apart along the direction between the nearest points of their cores.
///
/// [Gottschalk, Lin and Manocha 1996]: https://doi.org/10.1145/237170.237244
fn separation(a: &Solid, b: &Solid, reach: f64) -> Option<(f64, Vector3<f64>)> {
    if are_spheres_apart(a, b, reach) {
        return None;
    }
    let (of_a, of_b) = (PrismDirections::new(a), PrismDirections::new(b));
    let mut widest = (f64::NEG_INFINITY, Vector3::z());
    let directions = of_a.separating(&of_b).chain(of_a.approaching(&of_b));
    for direction in directions {
        widest = wider_gap(widest, of_a.gaps_to(&of_b, &direction), direction);
        if widest.0 >= reach {
            return None;
        }
    }
    Some(widest)
}

/// Whether the bounding spheres of two cards' boxes are apart by `reach` or more.
fn are_spheres_apart(a: &Solid, b: &Solid, reach: f64) -> bool {
    let apart = b.center() - a.center();
    apart.norm() >= a.half.norm() + b.half.norm() + reach
}

/// The widest gap so far, or one of those ahead and behind along a direction.
#[inline]
fn wider_gap(
    widest: (f64, Vector3<f64>),
    [ahead, behind]: [f64; 2],
    direction: Vector3<f64>,
) -> (f64, Vector3<f64>) {
    if ahead.max(behind) > widest.0 {
        if ahead > behind {
            (ahead, direction)
        } else {
            (behind, -direction)
        }
    } else {
        widest
    }
}

/// Edge directions of a prism in the world.
struct PrismDirections<'a> {
    solid: &'a Solid,
    axes: [Vector3<f64>; 3],
    /// Those of the base, then that of the height.
    edges: Vec<Vector3<f64>>,
}

impl<'a> PrismDirections<'a> {
    fn new(solid: &'a Solid) -> Self {
        let axes = solid.axes();
        let mut edges = solid.base_edges(&axes);
        edges.push(axes[2]);
        Self { solid, axes, edges }
    }

    /// Gaps to another prism ahead of and behind this one in a direction; negative if they overlap.
    #[inline]
    fn gaps_to(&self, other: &Self, direction: &Vector3<f64>) -> [f64; 2] {
        let [low, high] = self.solid.projection(&self.axes, direction);
        let [other_low, other_high] = other.solid.projection(&other.axes, direction);
        [other_low - high, low - other_high]
    }

    fn up(&self) -> Vector3<f64> {
        self.axes[2]
    }

    fn side_normals(&self) -> impl Iterator<Item = Vector3<f64>> {
        let base = &self.edges[..self.edges.len() - 1];
        base.iter().map(|edge| edge.cross(&self.up()))
    }

    /// The directions along which two prisms can be apart: normals of faces, then normals of pairs
    /// of edges.
    fn separating(&self, other: &Self) -> impl Iterator<Item = Vector3<f64>> {
        let faces = [self.up(), other.up()]
            .into_iter()
            .chain(self.side_normals())
            .chain(other.side_normals());
        faces.chain(self.edge_normals(other))
    }

    /// If either body is round, directions ever closer to that between the nearest points of their
    /// cores.
    ///
    /// # Method
    /// [Gilbert 1966]: a point of the difference of both cores moves towards the corner of it that
    /// is farthest back, until no other point of the way is closer to the origin.
    ///
    /// [Gilbert 1966]: https://doi.org/10.1137/0304007
    fn approaching(&self, other: &Self) -> impl Iterator<Item = Vector3<f64>> {
        let (from, to) = (self.solid, other.solid);
        let nearer = |way: &Vector3<f64>| {
            let back = way - (to.farthest_corner(&-way) - from.farthest_corner(way));
            let share = way.dot(&back) / back.norm_squared();
            (share > MIN_APPROACH).then(|| way - back * share.min(1.0))
        };
        let is_round = from.edge_radius + to.edge_radius > 0.0;
        let start = is_round.then(|| to.center() - from.center());
        std::iter::successors(start, nearer)
            .take(APPROACH_STEPS)
            .filter_map(|way| way.try_normalize(f64::EPSILON))
    }

    /// Normals of an edge of each of two prisms, for pairs that are not parallel.
    fn edge_normals(&self, other: &Self) -> impl Iterator<Item = Vector3<f64>> {
        let edges = self.edges.iter();
        let crossed = edges.flat_map(|a| other.edges.iter().map(move |b| a.cross(b)));
        crossed.filter_map(|normal| normal.try_normalize(PARALLEL_SINE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Point3, UnitQuaternion};
    use crate::scene::Draws;
    use crate::settle::bodies::rectangle;

    fn solid(x: f64, y: f64, z: f64, angles: [f64; 3], half: [f64; 3]) -> Solid {
        let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        let world_from_body = Pose::from_parts(Vector3::new(x, y, z).into(), rotation);
        let [x, y, _] = half;
        let outline = vec![[-x, -y], [x, -y], [x, y], [-x, y]];
        Solid {
            world_from_body,
            half: half.into(),
            outline,
            edge_radius: 0.0,
            falls: true,
            is_gone: false,
        }
    }

    #[test]
    fn level_boxes_overlap_by_the_difference_of_their_heights() {
        let half = [0.1, 0.04, 0.003];
        let (a, b) = (
            solid(0.0, 0.0, 0.003, [0.0; 3], half),
            solid(0.02, 0.01, 0.0085, [0.0, 0.0, 0.4], half),
        );
        assert!((overlap_depth(&a, &b) - 0.0005).abs() < 1e-15);
        let above = solid(0.02, 0.01, 0.0091, [0.0, 0.0, 0.4], half);
        assert_eq!(overlap_depth(&a, &above), 0.0);
    }

    #[test]
    fn crossed_edges_part_boxes_that_no_face_parts() {
        let half = [1.0, 1.0, 1.0];
        let quarter = std::f64::consts::FRAC_PI_4;
        // Edge along x, at height sqrt 2, under an edge along y.
        let under = solid(0.0, 0.0, 0.0, [quarter, 0.0, 0.0], half);
        let over = |gap: f64| {
            solid(
                0.0,
                0.0,
                2.0 * 2.0_f64.sqrt() + gap,
                [0.0, quarter, 0.0],
                half,
            )
        };
        assert_eq!(overlap_depth(&under, &over(1e-3)), 0.0);
        assert!((overlap_depth(&under, &over(-1e-3)) - 1e-3).abs() < 1e-12);
    }

    /// Brute force: does any point of a fine grid in `a` lie in `b`?
    fn shares_a_point(a: &Solid, b: &Solid) -> bool {
        let n = 24;
        let at = |i: i32, half: f64| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
        (0..=n).any(|i| {
            (0..=n).any(|j| {
                (0..=n).any(|k| {
                    let local = Point3::new(at(i, a.half.x), at(j, a.half.y), at(k, a.half.z));
                    let p = b
                        .world_from_body
                        .inverse_transform_point(&(a.world_from_body * local))
                        .coords;
                    (0..3).all(|axis| p[axis].abs() <= b.half[axis])
                })
            })
        })
    }

    #[test]
    fn the_test_agrees_with_brute_force() {
        let mut found = [0; 2];
        for case in 0..400 {
            let draws = Draws::new(1, case);
            let u = |name: &str| 2.0 * draws.unit(name) - 1.0;
            let a = solid(
                0.0,
                0.0,
                0.0,
                [3.0 * u("a"), 3.0 * u("b"), 3.0 * u("c")],
                [1.0, 0.5, 0.2],
            );
            let b = solid(
                u("x"),
                u("y"),
                u("z"),
                [3.0 * u("d"), 3.0 * u("e"), 3.0 * u("f")],
                [0.8, 0.4, 0.1],
            );
            let depth = overlap_depth(&a, &b);
            let shared = shares_a_point(&a, &b) || shares_a_point(&b, &a);
            // A shared point proves an overlap; a deep overlap (twice the grid's step) must share a
            // point.
            assert!(!shared || depth > 0.0, "case {case}");
            assert!(shared || depth < 2.0 * 2.0 / 24.0, "case {case}: {depth}");
            found[usize::from(shared)] += 1;
        }
        assert!(found.iter().all(|n| *n > 50), "{found:?}");
    }

    #[test]
    fn moving_out_by_the_depth_parts_boxes() {
        let a = solid(0.0, 0.0, 0.0, [0.1, 0.2, 0.3], [0.1, 0.05, 0.01]);
        let b = solid(0.03, 0.01, 0.012, [-0.2, 0.1, 1.0], [0.1, 0.05, 0.01]);
        let d = overlap_depth(&a, &b);
        assert!(d > 0.0);
        let up = a.axes()[2];
        let moved = |k: f64| Solid {
            world_from_body: Pose::translation(up.x * k, up.y * k, up.z * k) * b.world_from_body,
            ..b.clone()
        };
        assert!(
            overlap_depth(&a, &moved(0.1)) == 0.0 && overlap_depth(&a, &moved(-d / 2.0)) >= d / 2.0
        );
    }

    /// Closed form: how far a corner of a triangle reaches into a box depends on its slope.
    #[test]
    fn a_prism_is_as_wide_as_its_outline_and_not_as_its_card() {
        let triangle = |x: f64| Solid {
            outline: vec![[-0.1, -0.04], [0.1, -0.04], [-0.1, 0.04]],
            ..solid(x, 0.0, 0.0, [0.0; 3], [0.1, 0.04, 0.003])
        };
        let card = solid(0.0, 0.0, 0.0, [0.0; 3], [0.1, 0.04, 0.003]);
        let post = |x: f64, y: f64| solid(x, y, 0.0, [0.0; 3], [0.01, 0.01, 0.003]);
        assert!(overlap_depth(&card, &post(0.1, 0.04)) > 0.0);
        assert_eq!(overlap_depth(&triangle(0.0), &post(0.1, 0.04)), 0.0);
        assert_eq!(overlap_depth(&triangle(0.0), &post(0.02, 0.02)), 0.0);
        // The slanted side is x / 0.2 + y / 0.08 = 0; the post's corner (x - 0.01, y - 0.01) lies
        // behind it.
        let behind = |x: f64, y: f64| {
            -((x - 0.01) / 0.2 + (y - 0.01) / 0.08) / (1.0_f64 / 0.2).hypot(1.0 / 0.08)
        };
        assert!(
            (overlap_depth(&triangle(0.0), &post(0.01, 0.009)) - behind(0.01, 0.009)).abs() < 1e-12
        );
        // Through the left wall by 0.05, with its vertical side.
        assert!((deepest(&[triangle(-0.15)], &[], Some([0.4, 0.3])) - 0.05).abs() < 1e-12);
    }

    #[test]
    fn round_bodies_are_apart_where_their_edges_are() {
        let radius = 0.018;
        let round = |x: f64, y: f64, z: f64, angles: [f64; 3]| Solid {
            outline: rectangle(0.1 - radius, 0.04 - radius),
            edge_radius: radius,
            ..solid(x, y, z, angles, [0.1, 0.04, 0.02])
        };
        let level = round(0.0, 0.0, 0.0, [0.0; 3]);
        // Corner against corner, both cores' projections this far apart along x and along y.
        let depth = |gap: f64| {
            let [x, y] = [0.1, 0.04].map(|half| 2.0 * (half - radius) + gap);
            overlap_depth(&level, &round(x, y, 0.0, [0.0; 3]))
        };
        assert_eq!(depth(1.45 * radius), 0.0);
        let expected = 2.0 * radius - 1.3 * radius * 2.0_f64.sqrt();
        assert!((depth(1.3 * radius) - expected).abs() < 0.01 * radius);
        // A corner against a long side, and the floor under a body that stands on a long side.
        let turned = |x: f64| overlap_depth(&level, &round(x, 0.0, 0.0, [0.0, 0.0, 0.6]));
        assert!(turned(0.15) > 0.0 && turned(0.2) == 0.0);
        let upright = round(0.0, 0.0, 0.039, [std::f64::consts::FRAC_PI_2, 0.0, 0.0]);
        assert!((deepest(&[upright], &[], Some([0.4, 0.3])) - 0.001).abs() < 1e-12);
    }

    #[test]
    fn floor_and_walls_count() {
        let half = [0.1, 0.04, 0.003];
        assert!(
            (deepest(
                &[solid(0.0, 0.0, 0.002, [0.0; 3], half)],
                &[],
                Some([0.4, 0.3])
            ) - 0.001)
                .abs()
                < 1e-15
        );
        assert!(
            (deepest(
                &[solid(0.11, 0.0, 0.1, [0.0; 3], half)],
                &[],
                Some([0.4, 0.3])
            ) - 0.01)
                .abs()
                < 1e-15
        );
        assert_eq!(
            deepest(
                &[solid(0.1, 0.0, 0.003, [0.0; 3], half)],
                &[],
                Some([0.4, 0.3])
            ),
            0.0
        );
    }

    #[test]
    fn what_is_not_a_number_is_outside() {
        let lost = solid(f64::NAN, 0.0, 0.1, [0.0; 3], [0.1; 3]);
        let gone = solid(0.0, 9.0, 0.1, [0.0; 3], [0.1; 3]);
        assert_eq!(
            escaped_ids(
                &[gone, solid(0.0, 0.0, 0.1, [0.0; 3], [0.1; 3]), lost],
                [0.2, 0.15]
            ),
            [1, 3]
        );
    }
}
