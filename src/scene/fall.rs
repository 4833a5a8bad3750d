//! How dropped objects come to rest: the options of the `settle` stage, which a recipe carries.

use crate::error::{Error, Result};
use crate::geom::{UnitQuaternion, Vector3};
use crate::scene::Object;
use serde::{Deserialize, Serialize};

/// How dropped objects come to rest.
///
/// Gravity is not among them: it only sets how fast a film of the fall would run, not where things come to lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SettleOptions {
    /// How. Default: `fall`.
    pub mode: SettleMode,
    /// Coefficient of friction everywhere. Default: 0.5.
    pub friction: f64,
    /// Share of the speed that a bounce gives back, 0 to 1. Default: 0.
    pub restitution: f64,
    /// Least thickness of a falling body, as a share of its longer side; thinner cards are drawn thin but fall as
    /// bodies of this thickness. Default: 0.01 (2 mm for 200 mm).
    pub thinnest: f64,
    /// Deepest overlap of two bodies at rest that is accepted, as a share of the typical card's longer side.
    /// Default: 0.0025 (0.5 mm for 200 mm).
    pub max_overlap: f64,
    /// Longest fall, seconds of a world in which the typical card is 200 mm long. Default: 30.
    pub time_limit: f64,
    /// Tries before giving up; each starts from a higher stack. Default: 4.
    pub attempts: u32,
    /// Time step in the same seconds. Default: 1/480.
    pub step: f64,
    /// Iterations of the contact solver in each step. Default: 4.
    pub iterations: u32,
}

/// How dropped objects find their places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SettleMode {
    /// They fall as rigid bodies.
    #[default]
    Fall,
    /// They are laid level in their order, each on top of the highest it meets; no physics.
    Flat,
}

impl Default for SettleOptions {
    fn default() -> Self {
        Self {
            mode: SettleMode::Fall,
            friction: 0.5,
            restitution: 0.0,
            thinnest: 0.01,
            max_overlap: 0.0025,
            time_limit: 30.0,
            attempts: 4,
            step: 1.0 / 480.0,
            iterations: 4,
        }
    }
}

impl SettleOptions {
    /// Half lengths of the box that falls in place of an object, along the axes of its card, metres.
    pub fn half_body(&self, object: &Object) -> Vector3<f64> {
        let [w, h] = object.size;
        Vector3::new(w, h, object.thickness.max(self.thinnest * w.max(h))) / 2.0
    }

    /// Fails on the first option that cannot be right.
    pub fn check(&self) -> Result<()> {
        let positive = |name: &str, x: f64| {
            let at = format!("settle.{name}");
            if x > 0.0 && x.is_finite() { Ok(()) } else { Err(Error::value(at, format!("{x}, expected above 0"))) }
        };
        positive("thinnest", self.thinnest)?;
        positive("max_overlap", self.max_overlap)?;
        positive("time_limit", self.time_limit)?;
        positive("step", self.step)?;
        positive("attempts", self.attempts.into())?;
        positive("iterations", self.iterations.into())?;
        if !(self.friction >= 0.0 && self.friction.is_finite()) {
            return Err(Error::value("settle.friction", format!("{}, expected at least 0", self.friction)));
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(Error::value("settle.restitution", format!("{}, expected 0 to 1", self.restitution)));
        }
        Ok(())
    }
}

/// Half lengths along the world's axes of a turned box.
pub(crate) fn half_extent(rotation: &UnitQuaternion<f64>, half: &Vector3<f64>) -> Vector3<f64> {
    rotation.to_rotation_matrix().matrix().abs() * half
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_of_a_turned_box_is_that_of_its_corners() {
        let (rotation, half) = (UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0), Vector3::new(0.1, 0.04, 0.003));
        let mut most = Vector3::zeros();
        for corner in 0..8 {
            let sign = |bit: i32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let p = rotation * half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
            most = most.sup(&p);
        }
        assert!((half_extent(&rotation, &half) - most).norm() < 1e-15);
    }

    #[test]
    fn options_that_cannot_be_right_are_told() {
        assert!(SettleOptions::default().check().is_ok());
        let wrong = SettleOptions { friction: f64::NAN, ..Default::default() };
        assert_eq!(wrong.check().unwrap_err().to_string(), "settle.friction: NaN, expected at least 0");
    }
}
