//! Where light comes from, as a list of points and directions.

use crate::geom::Vector3;
use crate::light;
use crate::pixel::{LinearRgb, Mix};
use crate::render::RenderOptions;
use crate::scene::{AreaLight, Shot};
use nalgebra::{Matrix3, Vector4};
use std::f64::consts::PI;

/// A point (`at.w = 1`) or a direction (`at.w = 0`) that light comes from, in homogeneous coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSample {
    /// Where.
    pub(super) at: Vector4<f64>,
    /// Side of the square of light that it stands for: metres, or radians of a direction.
    pub(super) width: f64,
    /// What it does to a receiver that sees it.
    pub(super) kind: SampleKind,
}

/// How a source lights a receiver.
#[derive(Clone, Copy, Debug)]
pub(super) enum SampleKind {
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
pub(super) struct LightGroup {
    /// Radiance of each.
    pub(super) radiance: LinearRgb,
    /// Its points or directions.
    pub(super) sources: Vec<LightSample>,
}

/// All that lights a receiver.
#[derive(Clone, Debug)]
pub(super) struct LightSamples {
    /// Area lights, in their order.
    pub(super) faces: Vec<LightGroup>,
    /// What is all around: the constant environment, then the pieces of the map.
    pub(super) sky: Vec<LightGroup>,
}

impl LightSamples {
    /// What lights a receiver with this unit normal, in the plane through `point`.
    pub(super) fn of(
        shot: &Shot,
        options: &RenderOptions,
        point: &Vector3<f64>,
        normal: &Vector3<f64>,
    ) -> Self {
        let above =
            |l: &AreaLight| light::nodes_above(l, options.light_samples, (*point).into(), normal);
        let faces = shot.lights.iter().map(|l| face(l, above(l))).collect();
        let ambient = ambient(shot.ambient, options.ambient_samples, normal);
        let shining = shot.environment.iter().filter(|map| map.strength != 0.0);
        let map =
            shining.flat_map(|map| pieces(light::sky_pieces(map, options.ambient_samples, normal)));
        Self::from_parts(faces, ambient, map)
    }

    /// The same for a quadrature without cleverness: the map in even rectangles.
    pub(super) fn plain(
        shot: &Shot,
        options: &RenderOptions,
        normal: &Vector3<f64>,
    ) -> Vec<LightGroup> {
        let faces = shot
            .lights
            .iter()
            .map(|l| face(l, light::nodes(l, options.light_samples)))
            .collect();
        let ambient = ambient(shot.ambient, options.ambient_samples, normal);
        let map = shot
            .environment
            .iter()
            .flat_map(|map| pieces(light::sky_cells(map, options.ambient_samples, normal)));
        let Self { faces, sky } = Self::from_parts(faces, ambient, map);
        faces.into_iter().chain(sky).collect()
    }

    fn from_parts(
        faces: Vec<LightGroup>,
        ambient: LightGroup,
        map: impl Iterator<Item = LightGroup>,
    ) -> Self {
        let sky = std::iter::once(ambient).chain(map).collect();
        let lit = |lamps: Vec<LightGroup>| {
            lamps
                .into_iter()
                .filter(|lamp| lamp.radiance != LinearRgb::BLACK)
                .collect()
        };
        Self {
            faces: lit(faces),
            sky: lit(sky),
        }
    }

    /// Irradiance of the sky where nothing is in its way.
    pub(super) fn open_sky(&self) -> LinearRgb {
        let shares =
            |lamp: &LightGroup| lamp.sources.iter().map(LightSample::share).sum::<f64>() as f32;
        self.sky.iter().fold(LinearRgb::BLACK, |sum, lamp| {
            sum.add_scaled(shares(lamp), lamp.radiance)
        })
    }
}

fn face(light: &AreaLight, nodes: Vec<light::Node>) -> LightGroup {
    let normal = light::frame(light).normal;
    let source = |n: light::Node| LightSample {
        at: n.point.to_homogeneous(),
        width: n.area.sqrt(),
        kind: SampleKind::Face {
            normal,
            area: n.area,
        },
    };
    LightGroup {
        radiance: light::radiance(light),
        sources: nodes.into_iter().map(source).collect(),
    }
}

fn ambient(radiance: LinearRgb, count: usize, normal: &Vector3<f64>) -> LightGroup {
    let world_from_hemisphere = hemisphere(normal);
    let share = PI / count as f64;
    let source = |d: Vector3<f64>| LightSample {
        at: (world_from_hemisphere * d).to_homogeneous(),
        width: (share / d.z).sqrt(),
        kind: SampleKind::Sky { share },
    };
    LightGroup {
        radiance,
        sources: light::ambient_directions(count)
            .into_iter()
            .map(source)
            .collect(),
    }
}

/// The pieces of a map that a receiver sees: a lamp each, since each has a colour of its own.
fn pieces(pieces: Vec<light::SkyPiece>) -> impl Iterator<Item = LightGroup> {
    let lamp = |piece: light::SkyPiece| LightGroup {
        radiance: piece.irradiance,
        sources: vec![LightSample {
            at: piece.direction.to_homogeneous(),
            width: piece.width,
            kind: SampleKind::Sky { share: 1.0 },
        }],
    };
    pieces.into_iter().map(lamp)
}

/// Axes of a frame whose `z` is `normal`.
fn hemisphere(normal: &Vector3<f64>) -> Matrix3<f64> {
    let helper = if normal.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let x = helper.cross(normal).normalize();
    Matrix3::from_columns(&[x, normal.cross(&x), *normal])
}

impl LightSample {
    /// Cosine times solid angle of a piece of the sky.
    fn share(&self) -> f64 {
        if let SampleKind::Sky { share } = self.kind {
            share
        } else {
            0.0
        }
    }

    /// Cosines, distance and area at a point with unit normal: irradiance by unit radiance; 0 below a horizon.
    pub(super) fn irradiance(&self, point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        match self.kind {
            SampleKind::Sky { share } => share,
            SampleKind::Face { normal: face, area } => {
                let to = self.at.xyz() - point;
                let r2 = to.norm_squared();
                let cosines = normal.dot(&to).max(0.0) * (-face.dot(&to)).max(0.0);
                if r2 > 0.0 {
                    cosines / (r2 * r2) * area
                } else {
                    0.0
                }
            }
        }
    }
}
