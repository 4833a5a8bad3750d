//! Where light comes from, as a list of points and directions.

use crate::geom::Vector3;
use crate::light;
use crate::pixel::LinearRgb;
use crate::render::RenderOptions;
use crate::scene::Shot;
use nalgebra::{Matrix3, Vector4};

/// A point (`at.w = 1`) or a direction (`at.w = 0`) that light comes from, in homogeneous coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Where.
    pub(super) at: Vector4<f64>,
    /// What it does to a receiver that sees it.
    pub(super) kind: Kind,
}

/// How a source lights a receiver.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// A piece of a light's face: unit normal and area.
    Face {
        /// Which way it shines.
        normal: Vector3<f64>,
        /// Square metres.
        area: f64,
    },
    /// A share of the hemisphere: cosine times solid angle.
    Sky {
        /// Steradians times cosine.
        share: f64,
    },
}

/// Sources of one colour.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    /// Radiance of each.
    pub(super) radiance: LinearRgb,
    /// Its points or directions.
    pub(super) sources: Vec<Source>,
}

/// The lamps that light a receiver with this unit normal: area lights in their order, then the environment.
pub(super) fn lamps(shot: &Shot, options: &RenderOptions, normal: &Vector3<f64>) -> Vec<Lamp> {
    let RenderOptions { light_samples, ambient_samples, .. } = *options;
    let faces = shot.lights.iter().map(|l| {
        let face = light::frame(l).normal;
        let source =
            |n: light::Node| Source { at: n.point.to_homogeneous(), kind: Kind::Face { normal: face, area: n.area } };
        Lamp { radiance: light::radiance(l), sources: light::nodes(l, light_samples).into_iter().map(source).collect() }
    });
    let world_from_hemisphere = hemisphere(normal);
    let share = std::f64::consts::PI / ambient_samples as f64;
    let sky = light::ambient_directions(ambient_samples).into_iter();
    let sky = sky.map(|d| Source { at: (world_from_hemisphere * d).to_homogeneous(), kind: Kind::Sky { share } });
    let ambient = Lamp { radiance: shot.ambient, sources: sky.collect() };
    faces.chain([ambient]).filter(|lamp| lamp.radiance != LinearRgb::BLACK).collect()
}

/// Axes of a frame whose `z` is `normal`.
fn hemisphere(normal: &Vector3<f64>) -> Matrix3<f64> {
    let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let x = helper.cross(normal).normalize();
    Matrix3::from_columns(&[x, normal.cross(&x), *normal])
}

impl Source {
    /// Cosines, distance and area at a point with unit normal: irradiance by unit radiance; 0 below a horizon.
    pub(super) fn irradiance(&self, point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        match self.kind {
            Kind::Sky { share } => share,
            Kind::Face { normal: face, area } => {
                let to = self.at.xyz() - point;
                let r2 = to.norm_squared();
                let cosines = normal.dot(&to).max(0.0) * (-face.dot(&to)).max(0.0);
                if r2 > 0.0 { cosines / (r2 * r2) * area } else { 0.0 }
            }
        }
    }
}
