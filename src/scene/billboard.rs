//! Cards as billboards: turned towards the camera as far as their bodies are thick.
//!
//! A card seen edge-on is a line. A crushed bottle that stands on edge is not: its contour is as
//! wide as it is thick.

use crate::geom::{Point3, Pose, Quad, UnitQuaternion, Vector3};
use nalgebra::Unit;

/// Sine of the angle to the line of sight up to which a card faces the camera.
const FACING_SINE: f64 = 1e-9;

/// The pose of a card, turned towards a viewer so that the card looks as wide as the contour of an
/// ellipsoid that is as long and wide as the card and `thickness` thick.
///
/// # Method
/// Seen from far away at an angle t to its normal, an ellipse of half width w with half thickness c
/// has a contour of half width sqrt((w cos t)^2 + (c sin t)^2), where w is the radius of the card's
/// ellipse in the direction of the tilt. The card turns about the axis of the tilt to the angle at
/// which its own w looks as long.
pub(super) fn facing(quad: &Quad, thickness: f64, eye: &Point3<f64>) -> Pose {
    let pose = quad.world_from_card;
    let sight = pose.inverse_transform_point(eye).coords.normalize();
    let across = libm::hypot(sight.x, sight.y);
    if across < FACING_SINE {
        return pose;
    }
    let [a, b] = quad.size.map(|side| side / 2.0);
    let radius = across / libm::hypot(sight.x / a, sight.y / b);
    let thinness = (0.5 * thickness / radius).min(1.0);
    let tilt = libm::acos(sight.z.abs().min(1.0));
    let tilt_of_contour = libm::acos(libm::hypot(sight.z, thinness * across).min(1.0));
    let normal = Vector3::z() * sight.z.signum();
    let axis = Unit::new_normalize(normal.cross(&sight));
    let turn = UnitQuaternion::from_axis_angle(&axis, tilt - tilt_of_contour);
    Pose::from_parts(pose.translation, pose.rotation * turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAR: f64 = 1e6;

    fn card(at: [f64; 3], angles: [f64; 3]) -> Quad {
        let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        Quad {
            world_from_card: Pose::from_parts(at.into(), rotation),
            size: [0.2, 0.1],
        }
    }

    /// Half width of a card's ellipse across a tilt about its x axis, as seen from above.
    fn seen_half_width(thickness: f64, tilt: f64) -> f64 {
        let tilted = card([0.0; 3], [tilt, 0.0, 0.0]);
        let turned = facing(&tilted, thickness, &Point3::new(0.0, 0.0, FAR));
        0.05 * (turned.rotation * Vector3::z()).z.abs()
    }

    #[test]
    fn a_card_looks_as_wide_as_its_ellipsoid() {
        for tilt in [0.0, 0.3, 1.0, 1.5, 2.0, 3.0, -0.7] {
            let (sin, cos) = libm::sincos(tilt);
            let contour = libm::hypot(0.05 * cos, 0.02 * sin);
            assert!(
                (seen_half_width(0.04, tilt) - contour).abs() < 1e-9,
                "{tilt}"
            );
            assert!((seen_half_width(0.0, tilt) - 0.05 * cos.abs()).abs() < 1e-9);
        }
        // As thick as it is wide, it looks alike from all sides.
        assert!((seen_half_width(0.1, 1.2) - 0.05).abs() < 1e-9);
    }

    #[test]
    fn a_card_turns_about_the_axis_of_its_tilt_and_keeps_its_side() {
        for angles in [[0.5, 0.8, 0.3], [2.5, -0.4, 2.0]] {
            let tilted = card([0.1, -0.2, 0.05], angles);
            let eye = Point3::new(0.3, 0.2, 1.0);
            let (pose, turned) = (tilted.world_from_card, facing(&tilted, 0.06, &eye));
            let sight = eye - Point3::from(pose.translation.vector);
            let [before, after] = [pose, turned].map(|pose| pose.rotation * Vector3::z());
            assert_eq!(turned.translation, pose.translation);
            assert!(before.cross(&after).dot(&sight).abs() < 1e-12);
            assert!(before.dot(&sight) * after.dot(&sight) > 0.0);
            assert!(after.dot(&sight).abs() > before.dot(&sight).abs());
        }
    }
}
