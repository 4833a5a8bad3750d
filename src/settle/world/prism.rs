//! The shape of an object in the physics world: a box, or a convex prism.

use crate::geom::Vector3;
use crate::scene::{Object, doubled_area};
use rapier3d::prelude::{ColliderBuilder, Vector};

/// The colliders of an object, `half` and `length` in the world's units: a box, or the parts of a
/// prism; together of this `mass`.
///
/// # Method
/// The engine makes contacts with four corners of a face and not more, so a plate with more corners
/// would rest on a part of itself. A prism is therefore cut across into prisms of four corners,
/// which move as one body.
pub(super) fn colliders(
    object: &Object,
    half: &Vector3<f64>,
    length: f64,
    mass: f64,
) -> Vec<ColliderBuilder> {
    let ring = scaled(&object.outline, length);
    prism_parts(&ring, half.z, mass).unwrap_or_else(|| vec![cuboid(half).mass(mass as f32)])
}

fn cuboid(half: &Vector3<f64>) -> ColliderBuilder {
    ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32)
}

/// The parts of a prism; none where it has no area or one of its parts is too thin a shape.
fn prism_parts(ring: &[[f64; 2]], half_height: f64, mass: f64) -> Option<Vec<ColliderBuilder>> {
    let parts: Vec<ColliderBuilder> = quarters(ring)
        .iter()
        .map(|part| plate(part, half_height))
        .collect::<Option<_>>()?;
    let area = doubled_area(ring) / 2.0;
    let density = mass / (area * 2.0 * half_height);
    (area > 0.0).then(|| with_density(parts, density as f32))
}

fn with_density(parts: Vec<ColliderBuilder>, density: f32) -> Vec<ColliderBuilder> {
    let parts = parts.into_iter();
    parts.map(|part| part.density(density)).collect()
}

/// A convex ring cut across into rings of four corners, one of three at the end where they are odd;
/// none for an empty ring.
fn quarters(ring: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let n = ring.len();
    (0..n.saturating_sub(1) / 2)
        .map(|i| {
            // Side i to i + 1 against the side that mirrors it, as far as the two do not meet.
            let mut part = vec![ring[i], ring[i + 1], ring[n - 2 - i], ring[n - 1 - i]];
            part.dedup();
            part
        })
        .collect()
}

/// A plate of this outline; none where the engine finds it too thin a shape.
fn plate(ring: &[[f64; 2]], half_height: f64) -> Option<ColliderBuilder> {
    let rims = [half_height, -half_height].map(|z| ring_at(ring, z));
    ColliderBuilder::convex_hull(&rims.concat())
}

fn scaled(ring: &[[f64; 2]], by: f64) -> Vec<[f64; 2]> {
    ring.iter().map(|corner| corner.map(|x| x * by)).collect()
}

fn ring_at(ring: &[[f64; 2]], z: f64) -> Vec<Vector> {
    ring.iter()
        .map(|&[x, y]| Vector::new(x as f32, y as f32, z as f32))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(n: usize) -> Vec<[f64; 2]> {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        (0..n)
            .map(|i| [0.1 * libm::cos(angle(i)), 0.1 * libm::sin(angle(i))])
            .collect()
    }

    #[test]
    fn a_cut_ring_keeps_its_area_in_parts_of_four_corners() {
        for n in 3..=9 {
            let parts = quarters(&circle(n));
            assert!(
                parts
                    .iter()
                    .all(|part| (3..=4).contains(&part.len()) && 0.5 * doubled_area(part) > 0.0),
                "{n}: {parts:?}"
            );
            let sum: f64 = parts.iter().map(|part| 0.5 * doubled_area(part)).sum();
            assert!((sum - 0.5 * doubled_area(&circle(n))).abs() < 1e-15, "{n}");
        }
        assert!(quarters(&[]).is_empty());
    }
}
