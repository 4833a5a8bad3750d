//! The definition, sample by sample: slow and obviously correct.

use crate::asset::Texture;
use crate::camera::RadialDistortion;
use crate::deep::{DeepImage, DeepSample};
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{Depth, Film, LinearRgb, Mix, ObjectId};
use crate::render::RenderOptions;
use crate::render::card_texel::card_texel;
use crate::render::grade::channel_mean;
use crate::render::interreflection::Bounces;
use crate::render::light_samples::{LightGroup, LightSample, LightSamples};
use crate::render::pixel_filter::filter_quantiles;
use crate::render::retouch::retouched_fully;
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane, is_on_texture, visible_planes};
use crate::scene::{Card, Shot};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Renders a shot without approximations: every sub-sample of every pixel sends a ray to every
/// light sample.
///
/// Textures are read at full size, colours are graded after interpolation, and `cell_px` is not
/// used. Takes minutes where [`render`](super::render) takes milliseconds; its error against the
/// definition falls as the numbers in `options` grow.
pub fn render_reference(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let options = options.clamped();
    let shot = &*retouched_fully(shot, &options);
    let world = ReferenceWorld::new(shot, &options);
    let (lists, shadow) = world.render_pixels(&filter_quantiles(options.subsamples));
    let tints = if world.tinted {
        lists.iter().flatten().map(|sample| sample.hidden).collect()
    } else {
        Vec::new()
    };
    let shadow = Image::from_vec(world.view.width, world.view.height, shadow);
    let deep = deep_image(shadow, lists).with_tints(tints);
    Bounces::new(shot)
        .brighten(deep)
        .held_out(shot.holdout.as_deref())
}

fn deep_image(shadow: Image<LinearRgb>, lists: Vec<Vec<ReferenceSample>>) -> DeepImage {
    let samples = lists
        .into_iter()
        .map(|list| list.into_iter().map(|sample| sample.deep).collect());
    DeepImage::from_pixels(shadow, samples)
}

/// A deep sample and what it hides, per channel.
struct ReferenceSample {
    deep: DeepSample,
    hidden: LinearRgb,
}

impl ReferenceSample {
    fn new(object: ObjectId, depth: f64) -> Self {
        let deep = DeepSample {
            object,
            depth: Depth(depth as f32),
            ..DeepSample::default()
        };
        Self {
            deep,
            hidden: LinearRgb::BLACK,
        }
    }

    /// Adds what film covers, and what it hides of the light that passes to it.
    fn add_film(&mut self, weight: f32, film: &Film, through: LinearRgb) {
        self.deep.alpha += weight * channel_mean(film.opacity);
        self.hidden = self.hidden.add_scaled(weight, through * film.opacity);
    }

    /// Sets its visible part to what it hides.
    fn finish(&mut self) {
        self.deep.visible = channel_mean(self.hidden);
    }
}

/// A card with everything that rays need.
struct ReferenceCard<'a> {
    card: &'a Card,
    plane: ScenePlane,
    projected: Option<ProjectedPlane>,
    lights: Vec<LightGroup>,
}

struct ReferenceWorld<'a> {
    shot: &'a Shot,
    view: CameraView,
    lens: RadialDistortion,
    cards: Vec<ReferenceCard<'a>>,
    surface: Option<ProjectedPlane>,
    surface_lights: Vec<LightGroup>,
    tinted: bool,
}

/// Intersection of a camera ray with a card.
struct CardHit {
    uv: [f64; 2],
    depth: f64,
    normal: Vector3<f64>,
}

/// Irradiance without and with occluders.
#[derive(Default)]
struct PointIrradiance {
    open: LinearRgb,
    shadowed: LinearRgb,
}

impl<'a> ReferenceWorld<'a> {
    fn new(shot: &'a Shot, options: &RenderOptions) -> Self {
        let view = CameraView::from_camera(&shot.camera);
        let cards: Vec<_> = visible_planes(shot)
            .into_iter()
            .map(|(card, plane)| ReferenceCard::new(card, plane, &view, (shot, options)))
            .collect();
        let surface = ScenePlane::shadow_catcher(shot.catcher);
        Self {
            shot,
            view,
            lens: shot.distortion(),
            surface: ProjectedPlane::from_above(&surface, &view),
            surface_lights: LightSamples::plain(shot, options, &Vector3::z()),
            tinted: cards.iter().any(ReferenceCard::is_film),
            cards,
        }
    }

    /// Samples of every pixel, and the factors on the plate.
    fn render_pixels(&self, offsets: &[f64]) -> (Vec<Vec<ReferenceSample>>, Vec<LinearRgb>) {
        let (width, height) = (self.view.width, self.view.height);
        (0..width * height)
            .into_par_iter()
            .map(|i| {
                let (column, row) = (i % width, i / width);
                self.render_pixel(column as f64 + 0.5, row as f64 + 0.5, offsets)
            })
            .unzip()
    }

    /// Samples of one pixel and the factor on its plate.
    fn render_pixel(&self, x: f64, y: f64, offsets: &[f64]) -> (Vec<ReferenceSample>, LinearRgb) {
        let [ideal_x, ideal_y] = self.ideal_px([x, y]);
        let order = self.depth_order(ideal_x, ideal_y);
        let mut samples = self.empty_samples(&order);
        let weight = 1.0 / (offsets.len() * offsets.len()) as f32;
        let mut shadow = ShadowRatio::default();
        for oy in offsets {
            for ox in offsets {
                let at = self.ideal_px([x + ox, y + oy]);
                let through = self.trace_cards(at, &order, weight, &mut samples);
                shadow.add(through.scale(weight), &self.surface_light(at));
            }
        }
        samples.retain(|sample| sample.deep.alpha > 0.0);
        samples.iter_mut().for_each(ReferenceSample::finish);
        (samples, shadow.ratio())
    }

    /// Maps a position in the picture to where the camera without its lens sees the same.
    fn ideal_px(&self, px: [f64; 2]) -> [f64; 2] {
        self.lens.undistort(px.into()).into()
    }

    /// The cards that are not edge-on, with their depths at a pixel's centre, the nearest first.
    fn depth_order(&self, x: f64, y: f64) -> Vec<(usize, f64)> {
        let mut order: Vec<_> = (0..self.cards.len())
            .filter_map(|k| Some((k, self.cards[k].depth_at(x, y)?)))
            .collect();
        order.sort_by(|a, b| {
            a.1.total_cmp(&b.1)
                .then(self.cards[a.0].card.id.cmp(&self.cards[b.0].card.id))
        });
        order
    }

    fn empty_samples(&self, order: &[(usize, f64)]) -> Vec<ReferenceSample> {
        order
            .iter()
            .map(|&(k, depth)| ReferenceSample::new(self.cards[k].card.id, depth))
            .collect()
    }

    /// Adds the cards along one ray, front to back; returns the transmittance of all of them.
    fn trace_cards(
        &self,
        [x, y]: [f64; 2],
        order: &[(usize, f64)],
        weight: f32,
        samples: &mut [ReferenceSample],
    ) -> LinearRgb {
        let mut through = LinearRgb::WHITE;
        let lit_weight = weight * self.shot.exposure / PI;
        for (&(k, _), sample) in order.iter().zip(samples) {
            let Some(hit) = self.cards[k].intersect_px(x, y) else {
                continue;
            };
            let film = self.cards[k].texel(hit.uv, &self.view.eye);
            sample.add_film(weight, &film, through);
            let light = through * film.color * self.light_on(k, [x, y], &hit);
            sample.deep.light = sample.deep.light.add_scaled(lit_weight, light);
            through = through * film.transmittance();
        }
        through
    }

    /// Irradiance of a card where a camera ray meets it.
    fn light_on(&self, k: usize, [x, y]: [f64; 2], hit: &CardHit) -> LinearRgb {
        let point = self.view.point_at(x, y, hit.depth);
        let light = self.irradiance(&point, &hit.normal, &self.cards[k].lights, Some(k));
        let factor = self.shot.light_factor_at(&point);
        light.shadowed.scale(factor)
    }

    /// Irradiance of the surface where a camera ray meets it; none outside it.
    fn surface_light(&self, [x, y]: [f64; 2]) -> PointIrradiance {
        let hit = self.surface.as_ref().and_then(|s| s.intersect_px(x, y));
        hit.map_or_else(PointIrradiance::default, |(_, depth)| {
            let point = self.view.point_at(x, y, depth);
            self.irradiance(&point, &Vector3::z(), &self.surface_lights, None)
        })
    }

    fn irradiance(
        &self,
        p: &Vector3<f64>,
        n: &Vector3<f64>,
        lights: &[LightGroup],
        own: Option<usize>,
    ) -> PointIrradiance {
        let mut sum = PointIrradiance::default();
        for group in lights {
            for sample in &group.samples {
                let e = sample.irradiance(p, n) as f32;
                sum.open = sum.open.add_scaled(e, group.radiance);
                let passes = self.transmittance(p, sample, own);
                sum.shadowed = sum.shadowed.add_scaled(e, passes * group.radiance);
            }
        }
        sum
    }

    /// Share of a sample's light that reaches a point.
    fn transmittance(
        &self,
        p: &Vector3<f64>,
        sample: &LightSample,
        own: Option<usize>,
    ) -> LinearRgb {
        if own.is_some() && self.surface_blocks(p, sample) {
            return LinearRgb::BLACK;
        }
        let cards = self.cards.iter().enumerate();
        let others = cards.filter(|&(k, _)| Some(k) != own);
        others.fold(LinearRgb::WHITE, |through, (_, card)| {
            card.passes(p, sample)
                .map_or(through, |passes| through * passes)
        })
    }

    fn surface_blocks(&self, p: &Vector3<f64>, sample: &LightSample) -> bool {
        let way = sample.at.xyz() - p * sample.at.w;
        let foot = p - way * (p.z / way.z);
        let [w, h] = self.shot.catcher.map(|s| 0.5 * s);
        sample.at.z.max(way.z) < 0.0 && foot.x.abs() <= w && foot.y.abs() <= h
    }
}

/// Texture coordinates where the line from a point to a light sample crosses a plane.
fn crossing_uv(plane: &ScenePlane, p: &Vector3<f64>, sample: &LightSample) -> Option<[f64; 2]> {
    let way = sample.at.xyz() - p * sample.at.w;
    let s = plane.normal.dot(&(plane.center - p)) / plane.normal.dot(&way);
    let uv = plane.texture_coordinates(&(p + way * s));
    let end = if sample.at.w > 0.0 {
        1.0
    } else {
        f64::INFINITY
    };
    (s > 0.0 && s < end && is_on_texture(uv)).then_some(uv)
}

impl<'a> ReferenceCard<'a> {
    fn new(
        card: &'a Card,
        plane: ScenePlane,
        view: &CameraView,
        (shot, options): (&Shot, &RenderOptions),
    ) -> Self {
        let projected = ProjectedPlane::new(&plane, view);
        let normal = projected.as_ref().map(|projected| projected.normal);
        Self {
            card,
            plane,
            projected,
            lights: normal.map_or(Vec::new(), |n| LightSamples::plain(shot, options, &n)),
        }
    }

    fn is_film(&self) -> bool {
        self.card.texture.is_film() || self.card.back.as_ref().is_some_and(Texture::is_film)
    }

    /// Depth of its plane at a picture position; the maximum if it is behind the camera.
    fn depth_at(&self, x: f64, y: f64) -> Option<f64> {
        let projected = self.projected.as_ref()?;
        Some(projected.depth_at(&Vector3::new(x, y, 1.0)))
    }

    fn intersect_px(&self, x: f64, y: f64) -> Option<CardHit> {
        let projected = self.projected.as_ref()?;
        let (uv, depth) = projected.intersect_px(x, y)?;
        Some(CardHit {
            uv,
            depth,
            normal: projected.normal,
        })
    }

    /// Share of a sample's light that it transmits to a point; none if it is not in the way.
    fn passes(&self, p: &Vector3<f64>, sample: &LightSample) -> Option<LinearRgb> {
        let uv = crossing_uv(&self.plane, p, sample)?;
        Some(self.texel(uv, p).transmittance())
    }

    fn texel(&self, uv: [f64; 2], from: &Vector3<f64>) -> Film {
        card_texel(self.card, &self.plane, uv, from)
    }
}

/// A ratio of averages, per channel; 1 if there is nothing to average.
#[derive(Default)]
struct ShadowRatio {
    open: LinearRgb,
    shadowed: LinearRgb,
    outside: LinearRgb,
    weight: LinearRgb,
}

impl ShadowRatio {
    /// Adds the light at the surface, with the transmittance to it as weight; without light, the
    /// plate is unchanged.
    fn add(&mut self, weight: LinearRgb, light: &PointIrradiance) {
        if light.open == LinearRgb::BLACK {
            self.outside = self.outside + weight;
        }
        self.weight = self.weight + weight;
        self.open = self.open + weight * light.open;
        self.shadowed = self.shadowed + weight * light.shadowed;
    }

    fn ratio(&self) -> LinearRgb {
        let [shadowed, open, outside, weight] =
            [self.shadowed, self.open, self.outside, self.weight].map(<[f32; 3]>::from);
        let [r, g, b] = [0, 1, 2].map(|c: usize| {
            let lit = open[c] > 0.0 && shadowed[c] != open[c];
            if lit {
                1.0 + share_inside(outside[c], weight[c]) * (shadowed[c] / open[c] - 1.0)
            } else {
                1.0
            }
        });
        LinearRgb::new(r, g, b)
    }
}

/// Share of a weight that is not outside; 0 for no weight.
fn share_inside(outside: f32, weight: f32) -> f32 {
    if weight > 0.0 {
        1.0 - outside / weight
    } else {
        0.0
    }
}
