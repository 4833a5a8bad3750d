//! How dropped objects come to rest: the options of the `settle` stage, which are part of a recipe.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::geom::{UnitQuaternion, Vector3};
use crate::scene::Object;
use crate::scene::bounds::{
    ATTEMPTS, CCD, ENERGY, GRAVITY, ITERATIONS, OVERLAP, ROUNDING, STEP, THINNEST, TIME_LIMIT, WORK,
};
use nalgebra::Quaternion;
use serde::{Deserialize, Serialize};

/// How dropped objects come to rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SettleOptions {
    /// Simulation or flat layout. Default: `fall`.
    pub mode: SettleMode,
    /// Gravity in the frame of the surface, m/s^2. Its strength only sets how long a fall takes,
    /// not where objects come to rest; its direction tilts the surface. Default: `[0, 0, -9.81]`.
    pub gravity: [f64; 3],
    /// Minimum thickness of a falling body, as a share of its longer side; thinner cards are drawn
    /// thin but fall as bodies of this thickness. Default: 0.01 (2 mm for 200 mm).
    pub thinnest: f64,
    /// Radius of the edges of a falling body, as a share of half its thickness, 0 (sharp) to 0.9:
    /// thick bodies with round edges do not stand on them. Default: 0.
    pub rounding: f64,
    /// Maximum accepted overlap of two bodies at rest, as a share of the typical card's longer
    /// side. Default: 0.0025 (0.5 mm for 200 mm).
    pub max_overlap: f64,
    /// Maximum rise of energy, potential and kinetic, between two steps, as a share of the drop's;
    /// more is [`SettleVerdict::Exploded`](crate::settle::SettleVerdict::Exploded). Default: 0.01.
    pub max_energy_rise: f64,
    /// Maximum duration of a fall from when the highest object can have landed, in seconds scaled
    /// as if the typical card were 200 mm long, 0.01 to 600. Default: 10.
    pub time_limit: f64,
    /// Maximum number of attempts, 1 to 100, each from other starting heights. Default: 8.
    pub attempts: u32,
    /// Shortest time step in the same seconds, 0.0001 to 0.0042: with longer ones half of the heaps
    /// fail. Steps are two or four times as long while low heaps creep. Default: 1/360.
    pub step: f64,
    /// Iterations of the contact solver in the shortest step, 1 to 100; longer ones have up to
    /// twice as many. Default: 4.
    pub iterations: u32,
    /// Continuous collision detection: times per step that a body may be stopped at a stationary
    /// object that it would pass through, 0 to 100. Default: 1.
    pub ccd: u32,
    /// Maximum work for one picture, over all attempts and redraws, before it is rejected: objects
    /// and pairs of nearby objects, summed over time steps, 1 to 1e12. Heaps of 30 take 0.2
    /// million, of 100 about 2 million, of 200 up to 40 million, of 300 up to 80 million; objects
    /// laid flat take less than one. Default: 100 million.
    pub most_work: u64,
}

/// How dropped objects find their places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SettleMode {
    /// They fall as rigid bodies.
    #[default]
    Fall,
    /// They are laid level in their order, each on top of the highest object below it; no physics.
    Flat,
}

impl Default for SettleOptions {
    fn default() -> Self {
        Self {
            mode: SettleMode::Fall,
            gravity: [0.0, 0.0, -9.81],
            thinnest: 0.01,
            rounding: 0.0,
            max_overlap: 0.0025,
            max_energy_rise: 0.01,
            time_limit: 10.0,
            attempts: 8,
            step: 1.0 / 360.0,
            iterations: 4,
            ccd: 1,
            most_work: 100_000_000,
        }
    }
}

impl SettleOptions {
    /// Half lengths of the box that falls in place of an object, along the axes of its card,
    /// metres.
    pub fn half_body(&self, object: &Object) -> Vector3<f64> {
        let [w, h] = object.size;
        Vector3::new(w, h, object.thickness.max(self.thinnest * w.max(h))) / 2.0
    }

    /// Radius of the edges of that box, metres; at most a quarter of its width and height.
    pub fn edge_radius(&self, object: &Object) -> f64 {
        let half = self.half_body(object);
        (self.rounding * half.z).min(half.x.min(half.y) / 2.0)
    }

    /// Fails on the first invalid option.
    pub fn check(&self) -> Result<()> {
        for (name, value, bounds) in self.bounded_values() {
            bounds.check(&format!("settle.{name}"), value)?;
        }
        self.check_gravity()
    }

    fn bounded_values(&self) -> [(&str, f64, Bounds); 10] {
        [
            ("thinnest", self.thinnest, THINNEST),
            ("rounding", self.rounding, ROUNDING),
            ("max_overlap", self.max_overlap, OVERLAP),
            ("max_energy_rise", self.max_energy_rise, ENERGY),
            ("time_limit", self.time_limit, TIME_LIMIT),
            ("step", self.step, STEP),
            ("attempts", self.attempts.into(), ATTEMPTS),
            ("iterations", self.iterations.into(), ITERATIONS),
            ("ccd", self.ccd.into(), CCD),
            ("most_work", self.most_work as f64, WORK),
        ]
    }

    fn check_gravity(&self) -> Result<()> {
        let [x, y, z] = self.gravity;
        let falls_down = z < 0.0 && self.gravity.iter().all(|g| g.is_finite());
        if !falls_down {
            return Err(Error::value(
                "settle.gravity",
                format!("{:?}, expected to point down", self.gravity),
            ));
        }
        GRAVITY.check("settle.gravity", libm::hypot(libm::hypot(x, y), z))
    }
}

/// The nearest rotation that leaves a card level, on the side that it is already closer to.
///
/// # Method
/// Every rotation is a rotation about the vertical followed by a tilt about a horizontal axis; the
/// quaternion of the former is the part (w, z) of the whole, normalised. A card that faces down is
/// first turned over about its own `x`.
pub(crate) fn level(rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let over = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    let faces_up = (rotation * Vector3::z()).z >= 0.0;
    let upright = if faces_up { *rotation } else { rotation * over };
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(upright.w, 0.0, 0.0, upright.k));
    if faces_up { turn } else { turn * over }
}

/// Half lengths of a rotated box along the world's axes.
pub(crate) fn half_extent(rotation: &UnitQuaternion<f64>, half: &Vector3<f64>) -> Vector3<f64> {
    rotation.to_rotation_matrix().matrix().abs() * half
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_of_a_turned_box_is_that_of_its_corners() {
        let (rotation, half) = (
            UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0),
            Vector3::new(0.1, 0.04, 0.003),
        );
        let mut most = Vector3::zeros();
        for corner in 0..8 {
            let sign = |bit: i32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let p = rotation * half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
            most = most.sup(&p);
        }
        assert!((half_extent(&rotation, &half) - most).norm() < 1e-15);
    }

    #[test]
    fn leveling_turns_the_normal_up_or_down_and_is_the_least_turn() {
        let seen = |angles: [f64; 3]| {
            let tilted = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
            let (normal, flat) = (tilted * Vector3::z(), level(&tilted));
            let expected = Vector3::z() * normal.z.signum();
            assert!((flat * Vector3::z() - expected).norm() < 1e-12);
            assert!((flat.angle_to(&tilted) - normal.angle(&expected)).abs() < 1e-7);
        };
        [
            [0.2, 0.1, 1.0],
            [3.0, 0.1, -2.0],
            [1.5, 0.0, 0.3],
            [-2.5, 0.4, 3.0],
        ]
        .into_iter()
        .for_each(seen);
    }

    #[test]
    fn options_that_cannot_be_right_are_told() {
        assert!(SettleOptions::default().check().is_ok());
        let reported = |spoil: &dyn Fn(&mut SettleOptions)| {
            let mut options = SettleOptions::default();
            spoil(&mut options);
            options.check().unwrap_err().to_string()
        };
        let why = "seconds; longer steps let cards pass through each other, shorter ones only take longer";
        for (step, number) in [
            (f64::NAN, "NaN"),
            (1e-300, "1e-300"),
            (1.0 / 64.0, "0.015625"),
        ] {
            assert_eq!(
                reported(&|o| o.step = step),
                format!("settle.step: {number}, expected 0.0001 to 0.0042 ({why})")
            );
        }
        for never in [0, 1_000_000] {
            let told = reported(&|o| o.attempts = never);
            assert!(told.starts_with("settle.attempts: "), "{never}");
        }
        let weightless = reported(&|o| o.gravity = [0.0, 0.0, -1e-300]);
        assert!(weightless.starts_with("settle.gravity: 1e-300, expected 0.01"));
        assert_eq!(
            reported(&|o| o.gravity = [0.0, 0.0, 9.81]),
            "settle.gravity: [0.0, 0.0, 9.81], expected to point down"
        );
    }
}
