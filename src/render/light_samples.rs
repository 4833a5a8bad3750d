//! The sources of light, as a list of points and directions.

use crate::geom::{Point3, Vector3};
use crate::light;
use crate::pixel::{LinearRgb, Mix};
use crate::render::RenderOptions;
use crate::scene::{AreaLight, Shot};
use nalgebra::{Matrix3, Vector4};
use std::f64::consts::PI;

/// Pieces of the sky narrower than this cast shadows too sharp for the coarser lattice, radians.
const SMALL_WIDTH_RAD: f64 = 0.15;

/// Widest step in a penumbra, nodes of the finer lattice. At 2 no golden scene is more than 1 %
/// farther from Cycles than with all samples, at 4 one is 4 % farther.
const PENUMBRA_STEP_CELLS: f64 = 2.0;

/// Largest piece of a light, as a share of its height over the receiver.
const MAX_PIECE: f64 = 0.25;

/// A part of a plane that light falls on.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitPatch {
    /// Its middle.
    pub(super) center: Vector3<f64>,
    /// Unit normal on the visible side.
    pub(super) normal: Vector3<f64>,
    /// Metres from its middle to its far ends.
    pub(super) reach: f64,
    /// Metres from its middle to the farthest place whose light matters: more than its reach where
    /// several cards throw shadows on it.
    pub(super) spread: f64,
    /// Height of occluders above it, metres.
    pub(super) occluded: f64,
    /// Spacing of the finer lattice on it, metres; 0 if every sample is wanted.
    pub(super) cell: f64,
}

impl LitPatch {
    /// Samples along each side of a light, at most `most` for a square one.
    fn samples_along(&self, light: &AreaLight, most: usize) -> [usize; 2] {
        let [a, b] = light::side_lengths(light);
        let longer = a.max(b);
        let wanted = self.wanted_samples(light, longer);
        let wanted = [a, b].map(|side| wanted * side / longer);
        let most = light::samples_along(light, most);
        [0, 1].map(|k| (wanted[k].ceil() as usize).clamp(1, most[k]))
    }

    /// Samples along a side of a light of this length: enough for its size and for the width of the
    /// widest penumbra; all available ones if the surface hides a part of the light.
    fn wanted_samples(&self, light: &AreaLight, size: f64) -> f64 {
        if light::lowest_z(light) < 0.0 {
            return f64::INFINITY;
        }
        let way = light::frame(light).center.coords - self.center;
        let rise = self.normal.dot(&way);
        let pieces = size / (MAX_PIECE * rise.max(0.0));
        // For a light that faces the receiver; the lower it is, the longer its penumbrae.
        let slant = way.norm() / rise.max(0.0);
        let penumbra = slant * size * self.occluded / (rise - self.occluded).max(0.0);
        let steps = penumbra / (PENUMBRA_STEP_CELLS * self.cell);
        // `f64::max` ignores the NaN of 0 over 0, where nothing casts a shadow in any detail.
        pieces.max(steps).max(1.0)
    }
}

/// A point (`at.w = 1`) or a direction (`at.w = 0`) that light comes from, in homogeneous
/// coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSample {
    /// Where.
    pub(super) at: Vector4<f64>,
    /// Side of the square of light that it represents: metres, or radians for a direction.
    pub(super) width: f64,
    /// How it lights a receiver that sees it.
    pub(super) kind: LightSampleKind,
}

/// The kind of a light sample.
#[derive(Clone, Copy, Debug)]
pub(super) enum LightSampleKind {
    /// A piece of a light's face: unit normal and area.
    Face {
        /// Direction in which it emits.
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

/// Light samples of one colour.
#[derive(Clone, Debug)]
pub(super) struct LightGroup {
    /// Radiance of each.
    pub(super) radiance: LinearRgb,
    /// Its points or directions.
    pub(super) samples: Vec<LightSample>,
}

/// Everything that lights a receiver.
#[derive(Clone, Debug)]
pub(super) struct LightSamples {
    /// Light with sharp shadows: area lights, in their order, then small pieces of the map.
    pub(super) sharp: Vec<LightGroup>,
    /// The rest of the light from all around: the constant environment, then the other pieces of
    /// the map.
    pub(super) soft: Vec<LightGroup>,
}

impl LightSamples {
    /// The light on a receiver.
    pub(super) fn above(shot: &Shot, options: &RenderOptions, patch: &LitPatch) -> Self {
        let normal = &patch.normal;
        let faces = Self::faces_above(shot, options, patch);
        let shining = shot.environment.iter().filter(|map| map.strength != 0.0);
        let pieces =
            shining.flat_map(|map| light::sky_pieces(map, options.ambient_samples, normal));
        let ambient = LightGroup::constant(shot, options, normal);
        Self::from_parts(faces.into_iter(), ambient, pieces)
    }

    /// Only the area lights of a receiver.
    pub(super) fn faces_above(
        shot: &Shot,
        options: &RenderOptions,
        patch: &LitPatch,
    ) -> Vec<LightGroup> {
        let lights = shot.lights.iter();
        lights
            .map(|l| LightGroup::face_above(l, options.light_samples, patch))
            .collect()
    }

    /// The same by plain quadrature: whole lights, and the map in equal rectangles.
    pub(super) fn plain(
        shot: &Shot,
        options: &RenderOptions,
        normal: &Vector3<f64>,
    ) -> Vec<LightGroup> {
        let faces = shot
            .lights
            .iter()
            .map(|l| (l, light::samples_along(l, options.light_samples)))
            .map(|(l, counts)| LightGroup::area_light(l, light::nodes(l, counts)));
        let pieces = shot
            .environment
            .iter()
            .flat_map(|map| light::sky_cells(map, options.ambient_samples, normal));
        let ambient = LightGroup::constant(shot, options, normal);
        let Self { sharp, soft } = Self::from_parts(faces, ambient, pieces);
        sharp.into_iter().chain(soft).collect()
    }

    /// Leaves out black groups.
    fn from_parts(
        faces: impl Iterator<Item = LightGroup>,
        ambient: LightGroup,
        pieces: impl Iterator<Item = light::SkyPiece>,
    ) -> Self {
        let pieces = pieces.map(LightGroup::sky_piece);
        let (small, large): (Vec<_>, Vec<_>) = pieces.partition(LightGroup::is_small);
        let sharp = faces.chain(small);
        let soft = std::iter::once(ambient).chain(large);
        Self {
            sharp: sharp.filter(LightGroup::is_lit).collect(),
            soft: soft.filter(LightGroup::is_lit).collect(),
        }
    }

    /// Unobstructed irradiance of the sky.
    pub(super) fn open_sky(&self) -> LinearRgb {
        let all = self.sharp.iter().chain(&self.soft);
        all.fold(LinearRgb::BLACK, |sum, group| {
            sum.add_scaled(group.sky_share(), group.radiance)
        })
    }
}

impl LightGroup {
    /// The part of a light that is above a receiver's plane, scaled to the closed-form irradiance
    /// in the receiver's middle: the few nodes of a large nearby light add up to several times too
    /// much or too little.
    fn face_above(light: &AreaLight, count: usize, patch: &LitPatch) -> Self {
        let counts = patch.samples_along(light, count);
        let nodes = light::nodes_above(
            light,
            counts,
            Point3::from(patch.center),
            &patch.normal,
            patch.spread,
        );
        let group = Self::area_light(light, nodes);
        let factor = group.closed_form_ratio(light, patch);
        Self {
            radiance: group.radiance.scale(factor as f32),
            ..group
        }
    }

    /// Irradiance in a receiver's middle by its light in closed form over that by its samples; 1 if
    /// there is none, and if the light is nearer than the receiver's reach: no factor then holds for
    /// all of it.
    fn closed_form_ratio(&self, light: &AreaLight, patch: &LitPatch) -> f64 {
        let (frame, point) = (light::frame(light), &patch.center);
        let exact = light::unit_irradiance(light, Point3::from(*point), patch.normal);
        let sum = self.unit_irradiance(point, &patch.normal);
        let is_clear = frame.normal.dot(&(point - frame.center.coords)) > patch.reach;
        if is_clear && exact > 0.0 && sum > 0.0 {
            exact / sum
        } else {
            1.0
        }
    }

    /// Irradiance for unit radiance at a point with unit normal.
    pub(super) fn unit_irradiance(&self, point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        let samples = self.samples.iter();
        samples.map(|sample| sample.irradiance(point, normal)).sum()
    }

    fn area_light(light: &AreaLight, nodes: Vec<light::Node>) -> Self {
        let normal = light::frame(light).normal;
        let samples = nodes
            .into_iter()
            .map(|node| LightSample::on_face(node, normal));
        Self {
            radiance: light::radiance(light),
            samples: samples.collect(),
        }
    }

    /// The constant environment of a shot, from directions around a normal.
    fn constant(shot: &Shot, options: &RenderOptions, normal: &Vector3<f64>) -> Self {
        let count = options.ambient_samples;
        let world_from_hemisphere = hemisphere_frame(normal);
        let share = PI / count as f64;
        let samples = light::ambient_directions(count).into_iter().map(|d| {
            LightSample::in_sky(&(world_from_hemisphere * d), (share / d.z).sqrt(), share)
        });
        Self {
            radiance: shot.ambient,
            samples: samples.collect(),
        }
    }

    /// A piece of a map: a group of its own, since each has its own colour.
    fn sky_piece(piece: light::SkyPiece) -> Self {
        Self {
            radiance: piece.irradiance,
            samples: vec![LightSample::in_sky(&piece.direction, piece.width, 1.0)],
        }
    }

    /// Whether its samples belong to a sun or a distant lamp.
    fn is_small(&self) -> bool {
        self.samples.iter().all(|s| s.width < SMALL_WIDTH_RAD)
    }

    fn is_lit(&self) -> bool {
        self.radiance != LinearRgb::BLACK
    }

    fn sky_share(&self) -> f32 {
        self.samples.iter().map(LightSample::sky_share).sum::<f64>() as f32
    }
}

/// Axes of a frame whose `z` is `normal`.
fn hemisphere_frame(normal: &Vector3<f64>) -> Matrix3<f64> {
    // A world axis that is far from parallel to it.
    let oblique = if normal.x.abs() < 0.6 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let x = oblique.cross(normal).normalize();
    Matrix3::from_columns(&[x, normal.cross(&x), *normal])
}

impl LightSample {
    /// A node of a light's face.
    fn on_face(node: light::Node, normal: Vector3<f64>) -> Self {
        let area = node.area;
        Self {
            at: node.point.to_homogeneous(),
            width: area.sqrt(),
            kind: LightSampleKind::Face { normal, area },
        }
    }

    /// A part of the sky with this cosine times solid angle.
    fn in_sky(direction: &Vector3<f64>, width: f64, share: f64) -> Self {
        Self {
            at: direction.to_homogeneous(),
            width,
            kind: LightSampleKind::Sky { share },
        }
    }

    /// Cosine times solid angle of a piece of the sky.
    fn sky_share(&self) -> f64 {
        if let LightSampleKind::Sky { share } = self.kind {
            share
        } else {
            0.0
        }
    }

    /// Irradiance for unit radiance at a point with unit normal: cosines, distance and area; 0
    /// below a horizon.
    pub(super) fn irradiance(&self, point: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        match self.kind {
            LightSampleKind::Sky { share } => share,
            LightSampleKind::Face { normal: face, area } => {
                light::geometry_term(&(self.at.xyz() - point), &face, normal) * area
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::tilted_camera;
    use crate::quality::Quality;
    use crate::scene::LightShape;

    /// A disk of 10 W that faces the origin from straight above.
    fn disk(size: f64, height: f64) -> AreaLight {
        AreaLight {
            shape: LightShape::Ellipse,
            ..AreaLight::new([0.0, 0.0, height], [size; 2], 10.0)
        }
    }

    fn level_patch(occluded: f64, cell: f64) -> LitPatch {
        LitPatch {
            center: Vector3::zeros(),
            normal: Vector3::z(),
            reach: 0.1,
            spread: 0.1,
            occluded,
            cell,
        }
    }

    /// The light on a card at the origin with this normal; `reach` is the distance from its middle
    /// to its ends.
    fn face(light: AreaLight, quality: Quality, normal: Vector3<f64>, reach: f64) -> LightGroup {
        let shot = Shot::new(tilted_camera()).with_light(light);
        let options = RenderOptions::from(quality);
        let patch = LitPatch {
            normal,
            reach,
            spread: reach,
            ..level_patch(0.1, 0.0)
        };
        LightSamples::faces_above(&shot, &options, &patch).remove(0)
    }

    /// Scale factor of a light's nodes for a level card.
    fn factor(light: AreaLight, quality: Quality, reach: f64) -> f32 {
        let scaled = face(light, quality, Vector3::z(), reach).radiance;
        scaled.g / light::radiance(&light).g
    }

    #[test]
    fn a_light_of_any_size_is_as_bright_as_in_closed_form() {
        // With the last normal the plane cuts the light.
        let normals = [0.0, 0.1, 0.6].map(|tilt: f64| Vector3::new(0.0, tilt.sin(), tilt.cos()));
        for normal in normals {
            let exact = light::irradiance(&disk(10.0, 1.0), Point3::origin(), normal);
            for quality in Quality::ALL {
                let group = face(disk(10.0, 1.0), quality, normal, 0.1);
                let sum = group.unit_irradiance(&Vector3::zeros(), &normal);
                let ratio = f64::from(group.radiance.g / exact.g) * sum;
                assert!(
                    (ratio - 1.0).abs() < 1e-4,
                    "{quality:?} {normal:?}: {ratio}"
                );
            }
        }
        let straight = light::irradiance(&disk(10.0, 1.0), Point3::origin(), Vector3::z());
        assert!((f64::from(straight.g) / (10.0 / PI / 26.0) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn penumbrae_of_a_few_pixels_need_few_samples() {
        let samples = |size: f64, height: f64, occluded: f64| {
            level_patch(occluded, 0.002).samples_along(&disk(size, height), 3)[0]
        };
        // Penumbrae of 0, 0.3, 3 and 17 cells.
        let by_height = [0.0, 0.01, 0.1, 0.4].map(|occluded| samples(0.05, 1.0, occluded));
        assert_eq!(by_height, [1, 1, 2, 3]);
        let by_size = [0.2, 0.5, 5.0].map(|size| samples(size, 1.0, 0.0));
        assert_eq!(by_size, [1, 2, 3]);
        let [beside, below] = [0.1, -1.0].map(|height| samples(0.01, height, 0.1));
        assert_eq!([beside, below], [3, 3]);
    }

    #[test]
    fn a_low_light_has_long_penumbrae() {
        let low = AreaLight {
            position: [2.0, 0.0, 0.4],
            ..disk(0.06, 0.4)
        };
        let patch = level_patch(0.02, 0.00235);
        assert_eq!(patch.samples_along(&low, 3), [3; 2]);
        assert_eq!(patch.samples_along(&disk(0.06, 0.4), 3), [1; 2]);
    }

    #[test]
    fn a_small_light_is_as_bright_beside_the_middle_of_what_it_lights() {
        let light = disk(0.3, 0.8);
        for quality in Quality::ALL {
            let group = face(light, quality, Vector3::z(), 0.1);
            let beside = Vector3::new(0.1, 0.0, 0.0);
            let exact = light::irradiance(&light, Point3::from(beside), Vector3::z());
            let sum = group.unit_irradiance(&beside, &Vector3::z());
            let ratio = f64::from(group.radiance.g / exact.g) * sum;
            assert!((ratio - 1.0).abs() < 1e-3, "{quality:?}: {ratio}");
        }
    }

    #[test]
    fn lights_that_touch_stay_as_they_are() {
        for quality in Quality::ALL {
            assert_eq!(factor(disk(1.0, 0.01), quality, 0.1), 1.0, "{quality:?}");
        }
    }

    #[test]
    fn a_smaller_world_is_as_bright() {
        // A bottle, and one of 2 cm, under a light of the same relative size.
        let [whole, tenth] = [1.0, 0.1]
            .map(|scale| factor(disk(8.0 * scale, 0.8 * scale), Quality::Draft, 0.11 * scale));
        assert!((whole - 1.0).abs() > 0.05, "{whole}");
        assert!((tenth / whole - 1.0).abs() < 1e-5, "{tenth} {whole}");
    }
}
