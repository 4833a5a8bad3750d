//! The shape of an object in the physics world: a box, or a convex prism.

use super::prism::Prism;
use crate::geom::doubled_area;
use crate::scene::{Object, SettleOptions};
use crate::settle::bodies::core_outline;
use rapier3d::prelude::{ColliderBuilder, SharedShape};

/// The collider of an object with this `mass`, where a metre is `length` long, both in the world's
/// units: a prism if it has an outline or rounded edges, else a box.
pub(super) fn collider(
    object: &Object,
    options: &SettleOptions,
    length: f64,
    mass: f64,
) -> ColliderBuilder {
    let half = options.half_body(object) * length;
    let cuboid = || ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32);
    let is_box = object.outline.is_empty() && options.rounding == 0.0;
    let prism = (!is_box).then(|| prism(object, options, length)).flatten();
    prism.unwrap_or_else(cuboid).mass(mass as f32)
}

/// None if the outline has no area or the engine considers the prism too thin.
fn prism(object: &Object, options: &SettleOptions, length: f64) -> Option<ColliderBuilder> {
    let ring: Vec<_> = core_outline(object, options)
        .into_iter()
        .map(|corner| corner.map(|x| x * length))
        .collect();
    let has_area = ring.len() > 2 && doubled_area(&ring) > 0.0;
    let radius = options.edge_radius(object) * length;
    let half_height = options.half_body(object).z * length - radius;
    let prism = has_area.then(|| Prism::new(&ring, half_height, radius))??;
    Some(ColliderBuilder::new(SharedShape::new(prism)))
}
