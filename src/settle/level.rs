//! Rest without physics: level cards.
//!
//! A card that falls alone onto the bare surface comes to rest level below its start, with its
//! rotation about the vertical; that needs no simulation. The same closed form, with each card on
//! top of the highest one below it, is the `flat` mode.

use super::bodies::{current_pose, is_dropped, rectangle, solids};
use super::overlap::{Solid, falling_from_lowest, overlap_depth, past_walls};
use crate::allowance::Allowance;
use crate::error::Result;
use crate::geom::{Pose, UnitQuaternion};
use crate::scene::{Object, Scene, SettleOptions, level};

/// Where a card comes to rest if it falls alone onto the bare surface, clear of the walls and of
/// all objects at rest; none if it may touch anything.
pub(super) fn rest_alone(scene: &Scene, options: &SettleOptions, i: usize) -> Option<Pose> {
    let bodies = leveled_solids(scene, options);
    let falls_straight = options.gravity[..2] == [0.0; 2];
    let alone = falls_straight
        && !meets_standing(&bodies, i)
        && !is_past_walls(&bodies[i], scene.surface.size);
    alone.then(|| rest_on(&bodies[i], 0.0))
}

/// Whether a body can touch a stationary one.
fn meets_standing(bodies: &[Solid], i: usize) -> bool {
    let mut standing = bodies.iter().filter(|other| stands(other));
    standing.any(|other| can_touch(&bodies[i], other))
}

fn is_past_walls(solid: &Solid, surface: [f64; 2]) -> bool {
    past_walls(solid, surface).iter().any(|&past| past > 0.0)
}

/// The falling objects, in groups of separate columns: however they rotate in place, no card can
/// touch one of another group.
pub(super) fn columns(scene: &Scene, options: &SettleOptions) -> Vec<Vec<usize>> {
    let bodies = leveled_solids(scene, options);
    let mut columns: Vec<Vec<usize>> = Vec::new();
    for i in (0..bodies.len()).filter(|&i| bodies[i].falls) {
        columns = with_member(columns, i, |j| can_touch(&bodies[i], &bodies[j]));
    }
    columns.sort();
    columns
}

/// The columns with one more member; those that it can touch are joined into one.
fn with_member(
    columns: Vec<Vec<usize>>,
    i: usize,
    meets: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let (joined, mut apart): (Vec<_>, Vec<_>) = columns
        .into_iter()
        .partition(|column: &Vec<usize>| column.iter().any(|&j| meets(j)));
    let mut column: Vec<usize> = joined.into_iter().flatten().chain([i]).collect();
    column.sort_unstable();
    apart.push(column);
    apart
}

/// Whether two bodies can touch, seen from above, however they rotate in place.
fn can_touch(a: &Solid, b: &Solid) -> bool {
    (a.center() - b.center()).xy().norm() < a.half.norm() + b.half.norm()
}

/// Lays all falling objects level on the surface, in the order of their starting heights, each on
/// top of the highest one below it.
///
/// Cards that are already at rest count as the upright boxes around them. A card that reaches
/// through a wall is moved inside. Returns the poses of the objects that fall, in their order. The
/// work is one for each object plus one for each object already in place.
///
/// # Errors
/// [`Allowance::take`].
pub(super) fn flat(
    scene: &Scene,
    options: &SettleOptions,
    allowance: &Allowance,
) -> Result<Vec<Pose>> {
    let mut bodies = leveled_solids(scene, options);
    let mut lying = boxes_at_rest(&bodies);
    for i in falling_from_lowest(&bodies) {
        allowance.take(1 + lying.len() as u64)?;
        let solid = moved_inside(&bodies[i], scene.surface.size);
        bodies[i].world_from_body = rest_on(&solid, top_below(&solid, &lying));
        lying.push(bodies[i].clone());
    }
    let fallen = bodies.iter().filter(|solid| solid.falls);
    Ok(fallen.map(|solid| solid.world_from_body).collect())
}

/// The upright boxes around the objects at rest.
fn boxes_at_rest(bodies: &[Solid]) -> Vec<Solid> {
    let at_rest = bodies.iter().filter(|solid| stands(solid));
    at_rest.map(upright_box).collect()
}

fn stands(solid: &Solid) -> bool {
    !solid.falls && !solid.is_gone
}

/// Top of the highest body below one; 0 is the surface.
fn top_below(solid: &Solid, lying: &[Solid]) -> f64 {
    let below = lying.iter().filter(|other| footprints_meet(solid, other));
    below
        .map(|other| other.center().z + other.half.z)
        .fold(0.0, f64::max)
}

/// The bodies; falling ones are level where they start.
fn leveled_solids(scene: &Scene, options: &SettleOptions) -> Vec<Solid> {
    let poses: Vec<Option<Pose>> = scene.objects.iter().map(leveled_pose).collect();
    solids(scene, options, &poses)
}

fn leveled_pose(object: &Object) -> Option<Pose> {
    let mut pose = current_pose(object)?;
    if is_dropped(object) {
        pose.rotation = level(&pose.rotation);
    }
    Some(pose)
}

/// The pose with its underside at this height; for a card at rest, its own pose.
fn rest_on(solid: &Solid, bottom: f64) -> Pose {
    let mut pose = solid.world_from_body;
    if solid.falls {
        pose.translation.z = bottom + solid.half.z;
    }
    pose
}

fn moved_inside(solid: &Solid, surface: [f64; 2]) -> Solid {
    let mut moved = solid.clone();
    for (axis, past) in past_walls(solid, surface).into_iter().enumerate() {
        let at = &mut moved.world_from_body.translation.vector[axis];
        *at -= past.max(0.0).copysign(*at);
    }
    moved
}

fn upright_box(solid: &Solid) -> Solid {
    let mut upright = solid.clone();
    upright.half = solid.extent();
    upright.outline = rectangle(upright.half.x, upright.half.y);
    upright.edge_radius = 0.0;
    upright.world_from_body.rotation = UnitQuaternion::identity();
    upright
}

/// Whether two level bodies overlap as seen from above.
fn footprints_meet(a: &Solid, b: &Solid) -> bool {
    overlap_depth(&grounded(a), &grounded(b)) > 0.0
}

/// A body moved to the height of the surface.
fn grounded(solid: &Solid) -> Solid {
    let mut down = solid.clone();
    down.world_from_body.translation.z = 0.0;
    down
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Vector3;
    use crate::scene::Placement;
    use crate::settle::overlap::{deepest, touching_pairs};
    use crate::settle::tests::{dropped, falling};

    #[test]
    fn a_card_alone_rests_level_where_it_fell() {
        let scene = falling(&[([0.05, -0.02], 0.3)]);
        let pose = rest_alone(&scene, &SettleOptions::default(), 0).unwrap();
        let half = SettleOptions::default().half_body(&scene.objects[0]).z;
        assert!((pose.translation.vector - Vector3::new(0.05, -0.02, half)).norm() < 1e-15);
    }

    #[test]
    fn cards_that_may_touch_stand_in_one_column() {
        let columns =
            |starts: &[([f64; 2], f64)]| columns(&falling(starts), &SettleOptions::default());
        assert_eq!(columns(&[([0.0, 0.0], 0.1), ([0.1, 0.0], 0.3)]), [[0, 1]]);
        assert_eq!(
            columns(&[([-0.15, 0.0], 0.1), ([0.15, 0.0], 0.3)]),
            [[0], [1]]
        );
        assert_eq!(
            columns(&[([-0.15, 0.0], 0.1), ([0.15, 0.0], 0.3), ([0.0, 0.0], 0.5)]),
            [[0, 1, 2]]
        );
        assert!(columns(&[]).is_empty());
    }

    #[test]
    fn a_card_that_may_touch_a_wall_or_a_card_at_rest_is_not_alone() {
        let (mut scene, options) = (
            falling(&[([0.29, 0.0], 0.1), ([-0.1, 0.0], 0.1)]),
            SettleOptions::default(),
        );
        // Its middle is over the surface, but it would reach through a wall.
        assert!(
            rest_alone(&scene, &options, 0).is_none() && rest_alone(&scene, &options, 1).is_some()
        );
        let tilted = SettleOptions {
            gravity: [1.0, 0.0, -9.0],
            ..options
        };
        assert!(rest_alone(&scene, &tilted, 1).is_none());
        scene.objects[0].placement = Placement::At(Pose::translation(-0.2, 0.0, 0.01));
        assert!(rest_alone(&scene, &options, 1).is_none());
    }

    #[test]
    fn flat_cards_are_level_and_only_touch() {
        for k in 0..20 {
            let (scene, options) = (dropped(k, 15), SettleOptions::default());
            // 15 objects and 105 pairs.
            let allowance = Allowance::new(120);
            let poses = flat(&scene, &options, &allowance).unwrap();
            let poses: Vec<_> = poses.into_iter().map(Some).collect();
            let lying = solids(&scene, &options, &poses);
            assert!(allowance.is_spent());
            assert!(
                deepest(
                    &lying,
                    &touching_pairs(&lying, 0.0),
                    Some(scene.surface.size)
                ) < 1e-12
            );
            for (i, solid) in lying.iter().enumerate() {
                assert!(((solid.world_from_body * Vector3::z()).z.abs() - 1.0).abs() < 1e-12);
                let bottom = solid.center().z - solid.half.z;
                let holds =
                    |other: &Solid| (other.center().z + other.half.z - bottom).abs() < 1e-12;
                let held = lying
                    .iter()
                    .enumerate()
                    .any(|(j, o)| j != i && holds(o) && footprints_meet(solid, o));
                assert!(bottom.abs() < 1e-12 || held, "card {i} hangs at {bottom}");
            }
        }
    }
}
