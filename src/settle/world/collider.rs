//! The shape of an object in the physics world: a box, or a convex prism.

use super::prism::Prism;
use crate::geom::Vector3;
use crate::scene::{Object, doubled_area};
use rapier3d::prelude::{ColliderBuilder, SharedShape};

/// The collider of an object with this `mass`, `half` and `length` in the world's units: a prism if
/// it has an outline, else a box.
pub(super) fn collider(
    object: &Object,
    half: &Vector3<f64>,
    length: f64,
    mass: f64,
) -> ColliderBuilder {
    let corners = object.outline.iter();
    let ring: Vec<_> = corners.map(|corner| corner.map(|x| x * length)).collect();
    let cuboid = || ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32);
    prism(&ring, half.z)
        .unwrap_or_else(cuboid)
        .mass(mass as f32)
}

/// None if the ring has no area or the engine considers the prism too thin.
fn prism(ring: &[[f64; 2]], half_height: f64) -> Option<ColliderBuilder> {
    let has_area = ring.len() > 2 && doubled_area(ring) > 0.0;
    let prism = has_area.then(|| Prism::new(ring, half_height))??;
    Some(ColliderBuilder::new(SharedShape::new(prism)))
}
