//! The bodies that represent a scene's objects, and the lengths that a scene's tolerances are
//! relative to.

use super::overlap::Solid;
use crate::geom::Pose;
use crate::quantile::median;
use crate::scene::{Object, Placement, Scene, SettleOptions};

/// Gap below which bodies at rest touch, as a share of the typical card's longer side: 3 mm for 200
/// mm. They keep 0.4 mm apart; a body that the engine has put to sleep on its way to a support may
/// lack somewhat more.
const TOUCH_GAP_RATIO: f64 = 0.015;

pub(super) fn is_dropped(object: &Object) -> bool {
    matches!(object.placement, Placement::Drop { .. })
}

/// Median of the longer sides of the cards that fall, metres.
///
/// # Panics
/// When nothing falls.
pub fn typical_length(scene: &Scene) -> f64 {
    median_of_dropped(scene, |object| object.size[0].max(object.size[1]))
}

/// Median of a quantity of the objects that fall.
///
/// # Panics
/// When nothing falls.
pub(super) fn median_of_dropped(scene: &Scene, quantity: impl Fn(&Object) -> f64) -> f64 {
    let dropped = scene.objects.iter().filter(|object| is_dropped(object));
    median(dropped.map(quantity), f64::total_cmp).expect("something falls")
}

/// Gap below which bodies of a scene touch, metres.
pub(super) fn touch_distance(scene: &Scene) -> f64 {
    TOUCH_GAP_RATIO * typical_length(scene)
}

/// Maximum accepted overlap, metres.
pub(super) fn max_overlap(scene: &Scene, options: &SettleOptions) -> f64 {
    options.max_overlap * typical_length(scene)
}

/// The bodies at the end of a fall; those that fall in `start` count as dropped.
pub(super) fn solids_at_rest(start: &Scene, end: &Scene, options: &SettleOptions) -> Vec<Solid> {
    let poses: Vec<Option<Pose>> = end.objects.iter().map(current_pose).collect();
    solids(start, options, &poses)
}

/// Pose of an object, or the one that it falls from; none if it is gone.
pub(super) fn current_pose(object: &Object) -> Option<Pose> {
    match object.placement {
        Placement::Gone => None,
        Placement::At(pose) => Some(pose),
        Placement::Drop {
            above: [x, y],
            height,
            rotation,
        } => Some(Pose::from_parts([x, y, height].into(), rotation)),
    }
}

/// The bodies that represent the objects at these poses, one for each object.
pub(super) fn solids(scene: &Scene, options: &SettleOptions, poses: &[Option<Pose>]) -> Vec<Solid> {
    let posed = scene.objects.iter().zip(poses);
    posed
        .map(|(object, pose)| solid_for(object, *pose, options))
        .collect()
}

fn solid_for(object: &Object, pose: Option<Pose>, options: &SettleOptions) -> Solid {
    Solid {
        world_from_body: pose.unwrap_or_else(Pose::identity),
        half: options.half_body(object),
        outline: core_outline(object, options),
        edge_radius: options.edge_radius(object),
        falls: pose.is_some() && is_dropped(object),
        is_gone: pose.is_none(),
    }
}

/// Corners of the base of an object's core, counter-clockwise: its outline, or the rectangle of its
/// card, scaled so that the body with its rounded edges is as long and wide as the card.
pub(super) fn core_outline(object: &Object, options: &SettleOptions) -> Vec<[f64; 2]> {
    let (half, radius) = (options.half_body(object), options.edge_radius(object));
    let scale = [half.x, half.y].map(|half| 1.0 - radius / half);
    let corners = if object.outline.is_empty() {
        &rectangle(half.x, half.y)
    } else {
        &object.outline
    };
    let scaled = corners.iter().map(|[x, y]| [x * scale[0], y * scale[1]]);
    scaled.collect()
}

/// Corners of a rectangle with these half lengths, counter-clockwise.
pub(super) fn rectangle(x: f64, y: f64) -> Vec<[f64; 2]> {
    vec![[-x, -y], [x, -y], [x, y], [-x, y]]
}
