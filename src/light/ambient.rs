//! Directions that represent a constant environment.

use crate::geom::Vector3;
use std::f64::consts::TAU;

/// Turn from one direction to the next: the golden angle spreads any number of points evenly over a
/// disk.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

/// `count` unit directions about `+z`, distributed as the cosine with it; the same ones every time.
///
/// A constant environment of radiance L gives irradiance `pi L / count` from each.
///
/// # Method
/// Sunflower spiral on the unit disk, lifted to the hemisphere (Malley).
pub(crate) fn ambient_directions(count: usize) -> Vec<Vector3<f64>> {
    (0..count).map(|i| sunflower_direction(i, count)).collect()
}

/// Seed `i` of a sunflower of `count`, lifted to the hemisphere.
fn sunflower_direction(i: usize, count: usize) -> Vector3<f64> {
    let r2 = (i as f64 + 0.5) / count as f64;
    let (sin, cos) = libm::sincos(TAU * GOLDEN_TURN * i as f64);
    let r = r2.sqrt();
    Vector3::new(r * cos, r * sin, (1.0 - r2).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_and_above_the_horizon() {
        assert!(
            ambient_directions(36)
                .iter()
                .all(|d| (d.norm() - 1.0).abs() < 1e-12 && d.z > 0.0)
        );
    }

    #[test]
    fn the_mean_cosine_is_two_thirds() {
        let dirs = ambient_directions(400);
        let mean = dirs.iter().sum::<Vector3<f64>>() / 400.0;
        assert!((mean.z - 2.0 / 3.0).abs() < 1e-3 && mean.xy().norm() < 1e-2);
    }

    #[test]
    fn none_are_none() {
        assert!(ambient_directions(0).is_empty());
    }
}
