//! Conversion from the scene's units to those of the world, and back.

use super::{CARD_LENGTH_M, CARD_MASS_KG, GRAVITY_M_PER_S2};
use crate::geom::{Pose, UnitQuaternion, Vector3};
use crate::scene::{Scene, SettleOptions};
use crate::settle::bodies::{median_of_dropped, typical_length};
use nalgebra::Quaternion;
use rapier3d::prelude::{Pose as RapierPose, Rotation, Vector};

/// The scene's units, in those of the world.
pub(super) struct WorldUnits {
    pub(super) length: f64,
    pub(super) mass: f64,
    pub(super) time: f64,
}

impl WorldUnits {
    /// Units in which the typical card of a scene has a length of 200 mm and a mass of 30 g, under
    /// a gravity of 9.81 m/s^2.
    pub(super) fn new(scene: &Scene, options: &SettleOptions) -> Self {
        let length = CARD_LENGTH_M / typical_length(scene);
        let gravity = Vector3::from(options.gravity).norm();
        // g = length / time^2.
        let time = (length * gravity / GRAVITY_M_PER_S2).sqrt();
        Self {
            length,
            mass: CARD_MASS_KG / median_of_dropped(scene, |object| object.mass),
            time,
        }
    }

    pub(super) fn energy(&self) -> f64 {
        self.mass * self.length * self.length / (self.time * self.time)
    }

    pub(super) fn to_world(&self, pose: &Pose) -> RapierPose {
        let translation = glam_vector(&(pose.translation.vector * self.length));
        RapierPose::from_parts(translation, glam_rotation(&pose.rotation))
    }

    pub(super) fn to_scene(&self, pose: &RapierPose) -> Pose {
        let translation = nalgebra_vector(pose.translation) / self.length;
        Pose::from_parts(translation.into(), nalgebra_rotation(pose.rotation))
    }
}

pub(super) fn glam_vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

fn nalgebra_vector(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn glam_rotation(q: &UnitQuaternion<f64>) -> Rotation {
    Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32).normalize()
}

fn nalgebra_rotation(q: Rotation) -> UnitQuaternion<f64> {
    let [x, y, z, w] = [q.x, q.y, q.z, q.w].map(f64::from);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}
