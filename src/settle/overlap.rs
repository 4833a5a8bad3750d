//! Do boxes overlap, and how deep? In `f64`, independent of the physics engine, to judge its result.

use crate::geom::{Pose, Vector3};
use crate::scene::half_extent;

/// A box in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    /// Its pose; the box is centred in its own frame.
    pub(super) world_from_body: Pose,
    /// Half lengths, metres.
    pub(super) half: Vector3<f64>,
    /// Whether it was dropped; the others stand where their author put them.
    pub(super) falls: bool,
}

impl Solid {
    pub(super) fn center(&self) -> Vector3<f64> {
        self.world_from_body.translation.vector
    }

    fn axes(&self) -> [Vector3<f64>; 3] {
        let r = self.world_from_body.rotation.to_rotation_matrix();
        [0, 1, 2].map(|i| r.matrix().column(i).into())
    }

    /// Half lengths of the upright box around it.
    pub(super) fn extent(&self) -> Vector3<f64> {
        half_extent(&self.world_from_body.rotation, &self.half)
    }

    /// Half length of its shadow on a unit direction.
    fn reach(&self, axes: &[Vector3<f64>; 3], direction: &Vector3<f64>) -> f64 {
        (0..3).map(|i| self.half[i] * direction.dot(&axes[i]).abs()).sum()
    }
}

/// Ids (index + 1) of dropped boxes whose centre is not over the surface, below it, or not finite.
pub(super) fn outside(solids: &[Solid], surface: [f64; 2]) -> Vec<usize> {
    let inside = |c: Vector3<f64>| c.x.abs() <= surface[0] / 2.0 && c.y.abs() <= surface[1] / 2.0 && c.z >= 0.0;
    let ids = solids.iter().enumerate().filter(|(_, s)| s.falls && !inside(s.center()));
    ids.map(|(i, _)| i + 1).collect()
}

/// Deepest overlap of a dropped box with any other, with the floor `z = 0` or with the walls over the surface's edges,
/// metres; 0 when nothing overlaps.
pub(super) fn deepest(solids: &[Solid], surface: [f64; 2]) -> f64 {
    let falling = solids.iter().filter(|s| s.falls);
    let edges = falling.map(|s| depth_in_room(s, surface)).fold(0.0, f64::max);
    let pairs = (1..solids.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let pairs = pairs.filter(|&(i, j)| solids[i].falls || solids[j].falls);
    pairs.map(|(i, j)| depth(&solids[i], &solids[j])).fold(edges, f64::max)
}

/// How far a box reaches through the floor or a wall, whichever is most; 0 inside.
fn depth_in_room(solid: &Solid, surface: [f64; 2]) -> f64 {
    let below = solid.extent().z - solid.center().z;
    past_walls(solid, surface).into_iter().fold(below.max(0.0), f64::max)
}

/// How far a box reaches beyond the walls along x and along y; negative inside.
pub(super) fn past_walls(solid: &Solid, surface: [f64; 2]) -> [f64; 2] {
    let (center, extent) = (solid.center(), solid.extent());
    [0, 1].map(|axis| center[axis].abs() + extent[axis] - surface[axis] / 2.0)
}

/// Shortest way to move one box out of another, metres; 0 when they are apart.
///
/// # Method
/// Separating axes: two boxes are apart if and only if their shadows are, on one of 15 directions: the faces' normals
/// and the cross products of their edges ([Gottschalk, Lin and Manocha 1996]). The least overlap of
/// shadows is the depth.
///
/// [Gottschalk, Lin and Manocha 1996]: https://doi.org/10.1145/237170.237244
pub(super) fn depth(a: &Solid, b: &Solid) -> f64 {
    let apart = b.center() - a.center();
    if apart.norm() >= a.half.norm() + b.half.norm() {
        return 0.0;
    }
    let (of_a, of_b) = (a.axes(), b.axes());
    let edges = (0..9).map(|k| of_a[k / 3].cross(&of_b[k % 3]));
    // Nearly parallel edges: their direction is noise, and the faces' normals decide.
    let edges = edges.filter_map(|d| d.try_normalize(1e-6));
    let directions = of_a.iter().chain(&of_b).copied().chain(edges);
    let shared = |d: Vector3<f64>| a.reach(&of_a, &d) + b.reach(&of_b, &d) - apart.dot(&d).abs();
    directions.map(shared).fold(f64::INFINITY, f64::min).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Point3, UnitQuaternion};
    use crate::scene::Draws;

    fn solid(x: f64, y: f64, z: f64, angles: [f64; 3], half: [f64; 3]) -> Solid {
        let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        let world_from_body = Pose::from_parts(Vector3::new(x, y, z).into(), rotation);
        Solid { world_from_body, half: half.into(), falls: true }
    }

    #[test]
    fn level_boxes_overlap_by_the_difference_of_their_heights() {
        let half = [0.1, 0.04, 0.003];
        let (a, b) = (solid(0.0, 0.0, 0.003, [0.0; 3], half), solid(0.02, 0.01, 0.0085, [0.0, 0.0, 0.4], half));
        assert!((depth(&a, &b) - 0.0005).abs() < 1e-15);
        let above = solid(0.02, 0.01, 0.0091, [0.0, 0.0, 0.4], half);
        assert_eq!(depth(&a, &above), 0.0);
    }

    #[test]
    fn crossed_edges_part_boxes_that_no_face_parts() {
        let half = [1.0, 1.0, 1.0];
        let quarter = std::f64::consts::FRAC_PI_4;
        // Edge along x, at height sqrt 2, under an edge along y.
        let under = solid(0.0, 0.0, 0.0, [quarter, 0.0, 0.0], half);
        let over = |gap: f64| solid(0.0, 0.0, 2.0 * 2.0_f64.sqrt() + gap, [0.0, quarter, 0.0], half);
        assert_eq!(depth(&under, &over(1e-3)), 0.0);
        assert!((depth(&under, &over(-1e-3)) - 1e-3).abs() < 1e-12);
    }

    /// Brute force: does any point of a fine grid in `a` lie in `b`?
    fn shares_a_point(a: &Solid, b: &Solid) -> bool {
        let n = 24;
        let at = |i: i32, half: f64| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
        (0..=n).any(|i| {
            (0..=n).any(|j| {
                (0..=n).any(|k| {
                    let local = Point3::new(at(i, a.half.x), at(j, a.half.y), at(k, a.half.z));
                    let p = b.world_from_body.inverse_transform_point(&(a.world_from_body * local)).coords;
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
            let a = solid(0.0, 0.0, 0.0, [3.0 * u("a"), 3.0 * u("b"), 3.0 * u("c")], [1.0, 0.5, 0.2]);
            let b = solid(u("x"), u("y"), u("z"), [3.0 * u("d"), 3.0 * u("e"), 3.0 * u("f")], [0.8, 0.4, 0.1]);
            let depth = depth(&a, &b);
            let shared = shares_a_point(&a, &b) || shares_a_point(&b, &a);
            // A shared point proves an overlap; a deep overlap (twice the grid's step) must share a point.
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
        let d = depth(&a, &b);
        assert!(d > 0.0);
        let up = a.axes()[2];
        let moved = |k: f64| Solid {
            world_from_body: Pose::translation(up.x * k, up.y * k, up.z * k) * b.world_from_body,
            ..b
        };
        assert!(depth(&a, &moved(0.1)) == 0.0 && depth(&a, &moved(-d / 2.0)) >= d / 2.0);
    }

    #[test]
    fn floor_and_walls_count() {
        let half = [0.1, 0.04, 0.003];
        assert!((deepest(&[solid(0.0, 0.0, 0.002, [0.0; 3], half)], [0.4, 0.3]) - 0.001).abs() < 1e-15);
        assert!((deepest(&[solid(0.11, 0.0, 0.1, [0.0; 3], half)], [0.4, 0.3]) - 0.01).abs() < 1e-15);
        assert_eq!(deepest(&[solid(0.1, 0.0, 0.003, [0.0; 3], half)], [0.4, 0.3]), 0.0);
    }

    #[test]
    fn what_is_not_a_number_is_outside() {
        let lost = solid(f64::NAN, 0.0, 0.1, [0.0; 3], [0.1; 3]);
        let gone = solid(0.0, 9.0, 0.1, [0.0; 3], [0.1; 3]);
        assert_eq!(outside(&[gone, solid(0.0, 0.0, 0.1, [0.0; 3], [0.1; 3]), lost], [0.4, 0.3]), [1, 3]);
    }
}
