//! From the scene's units to those of the world, and back.

use super::{CARD, GRAVITY, MASS, median, typical_length};
use crate::geom::{Pose, UnitQuaternion, Vector3};
use crate::scene::{Scene, SettleOptions};
use nalgebra::Quaternion;
use rapier3d::prelude::{Pose as RapierPose, Rotation, Vector};

/// What a unit of the scene is in the world.
pub(super) struct Units {
    pub(super) length: f64,
    pub(super) mass: f64,
    pub(super) time: f64,
}

impl Units {
    /// Those that make the typical card of a scene 200 mm long and 30 g heavy, under a gravity of 9.81 m/s^2.
    pub(super) fn of(scene: &Scene, options: &SettleOptions) -> Self {
        let length = CARD / typical_length(scene);
        let gravity = Vector3::from(options.gravity).norm();
        // g = length / time^2.
        let time = (length * gravity / GRAVITY).sqrt();
        Self {
            length,
            mass: MASS / median(scene, |object| object.mass),
            time,
        }
    }

    pub(super) fn energy(&self) -> f64 {
        self.mass * self.length * self.length / (self.time * self.time)
    }

    pub(super) fn to_world(&self, pose: &Pose) -> RapierPose {
        let q = pose.rotation;
        let rotation = Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32);
        RapierPose::from_parts(
            vector(&(pose.translation.vector * self.length)),
            rotation.normalize(),
        )
    }

    pub(super) fn to_scene(&self, pose: &RapierPose) -> Pose {
        let (t, q) = (pose.translation, pose.rotation);
        let translation =
            Vector3::new(f64::from(t.x), f64::from(t.y), f64::from(t.z)) / self.length;
        let rotation = Quaternion::new(
            f64::from(q.w),
            f64::from(q.x),
            f64::from(q.y),
            f64::from(q.z),
        );
        Pose::from_parts(
            translation.into(),
            UnitQuaternion::from_quaternion(rotation),
        )
    }
}

pub(super) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}
