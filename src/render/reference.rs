//! The definition, sample by sample: slow and obviously right.

use crate::asset::Texture;
use crate::deep::{DeepImage, DeepSample};
use crate::filter::sample_bilinear;
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::{Depth, Film, LinearRgb, Mix};
use crate::render::RenderOptions;
use crate::render::light_samples::{LightGroup, LightSample, LightSamples, SampleKind};
use crate::render::pixel_filter::quantiles;
use crate::render::texture::{graded_opacity, mean};
use crate::render::view::{CameraView, ProjectedPlane, ScenePlane, sheets};
use crate::scene::{Card, Shot};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Renders a shot without any shortcut: every sub-sample of every pixel sends a ray to every light sample.
///
/// Textures are read at full size, colours are graded after interpolation, `cell_px` is not used. Takes minutes where
/// [`render`](super::render) takes milliseconds; its error against the definition falls with the numbers in `options`.
pub fn render_reference(shot: &Shot, options: &RenderOptions) -> DeepImage {
    let options = options.clamped();
    let world = ReferenceWorld::of(shot, &options);
    let offsets = quantiles(options.subsamples);
    let (width, height) = (world.view.width, world.view.height);
    let pixel =
        |i: usize| world.pixel((i % width) as f64 + 0.5, (i / width) as f64 + 0.5, &offsets);
    let (lists, shadow): (Vec<Vec<(DeepSample, LinearRgb)>>, Vec<_>) =
        (0..width * height).into_par_iter().map(pixel).unzip();
    let tints = lists
        .iter()
        .flatten()
        .filter(|_| world.tinted)
        .map(|(_, tint)| *tint)
        .collect();
    let samples = lists
        .into_iter()
        .map(|list| list.into_iter().map(|(sample, _)| sample).collect());
    DeepImage::from_pixels(Image::from_vec(width, height, shadow), samples).with_tints(tints)
}

/// A card with everything that a ray asks of it.
struct ReferenceCard<'a> {
    card: &'a Card,
    sheet: ScenePlane,
    seen: Option<ProjectedPlane>,
    lamps: Vec<LightGroup>,
}

struct ReferenceWorld<'a> {
    shot: &'a Shot,
    view: CameraView,
    cards: Vec<ReferenceCard<'a>>,
    surface: Option<ProjectedPlane>,
    surface_lamps: Vec<LightGroup>,
    tinted: bool,
}

impl<'a> ReferenceWorld<'a> {
    fn of(shot: &'a Shot, options: &RenderOptions) -> Self {
        let view = CameraView::of(&shot.camera);
        let lit = |normal: &Vector3<f64>| LightSamples::plain(shot, options, normal);
        let facing = |(card, sheet): (&'a Card, ScenePlane)| {
            let seen = ProjectedPlane::of(&sheet, &view);
            let lamps = seen.as_ref().map_or(Vec::new(), |s| lit(&s.normal));
            ReferenceCard {
                card,
                sheet,
                seen,
                lamps,
            }
        };
        let surface = ProjectedPlane::of(&ScenePlane::surface(shot.catcher), &view)
            .filter(|s| s.normal.z > 0.0);
        let cards: Vec<_> = sheets(shot).into_iter().map(facing).collect();
        let is_film = |f: &ReferenceCard<'_>| {
            f.card.texture.is_film() || f.card.back.as_ref().is_some_and(Texture::is_film)
        };
        let tinted = cards.iter().any(is_film);
        Self {
            shot,
            view,
            cards,
            surface,
            surface_lamps: lit(&Vector3::z()),
            tinted,
        }
    }

    /// Samples of one pixel and the factor on its plate.
    fn pixel(&self, x: f64, y: f64, offsets: &[f64]) -> (Vec<(DeepSample, LinearRgb)>, LinearRgb) {
        let mut order: Vec<_> = (0..self.cards.len())
            .filter_map(|k| Some((k, self.depth(k, x, y)?)))
            .collect();
        order.sort_by(|a, b| {
            a.1.total_cmp(&b.1)
                .then(self.cards[a.0].card.id.cmp(&self.cards[b.0].card.id))
        });
        let mut samples: Vec<_> = order
            .iter()
            .map(|&(k, depth)| self.empty_sample(k, depth))
            .collect();
        let weight = 1.0 / (offsets.len() * offsets.len()) as f32;
        let mut shadow = ShadowRatio::default();
        for oy in offsets {
            for ox in offsets {
                let through = self.walk(x + ox, y + oy, &order, weight, &mut samples);
                self.shade_surface(x + ox, y + oy, through.scale(weight), &mut shadow);
            }
        }
        samples.retain(|(s, _)| s.alpha > 0.0);
        samples
            .iter_mut()
            .for_each(|(s, hidden)| s.visible = mean(*hidden));
        (samples, shadow.value())
    }

    fn empty_sample(&self, k: usize, depth: f64) -> (DeepSample, LinearRgb) {
        let sample = DeepSample {
            object: self.cards[k].card.id,
            depth: Depth(depth as f32),
            ..DeepSample::default()
        };
        (sample, LinearRgb::BLACK)
    }

    /// Depth of a card's plane at a pixel position; as far as can be where it is behind the eye.
    fn depth(&self, k: usize, x: f64, y: f64) -> Option<f64> {
        let seen = self.cards[k].seen.as_ref()?;
        let w = seen.w.dot(&Vector3::new(x, y, 1.0));
        Some(if w > 0.0 {
            seen.height / w
        } else {
            f64::from(f32::MAX)
        })
    }

    /// Adds what the cards do along one ray, front to back; returns what passes through all of them.
    fn walk(
        &self,
        x: f64,
        y: f64,
        order: &[(usize, f64)],
        weight: f32,
        samples: &mut [(DeepSample, LinearRgb)],
    ) -> LinearRgb {
        let mut through = LinearRgb::WHITE;
        for (&(k, _), (sample, hidden)) in order.iter().zip(samples) {
            let facing = &self.cards[k];
            let Some((seen, (uv, depth))) =
                facing.seen.as_ref().and_then(|s| Some((s, s.hit(x, y)?)))
            else {
                continue;
            };
            let film = facing.texel(uv, &self.view.eye);
            sample.alpha += weight * mean(film.opacity);
            *hidden = hidden.add_scaled(weight, through * film.opacity);
            let point = self.view.eye + self.view.ray * Vector3::new(x, y, 1.0) * depth;
            let e = self
                .irradiance(&point, &seen.normal, &facing.lamps, Some(k))
                .1;
            let light = through * film.color * e;
            sample.light = sample
                .light
                .add_scaled(weight * self.shot.exposure / PI, light);
            through = through * film.transmittance();
        }
        through
    }

    fn shade_surface(&self, x: f64, y: f64, weight: LinearRgb, shadow: &mut ShadowRatio) {
        let hit = self.surface.as_ref().and_then(|s| s.hit(x, y));
        let (open, shadowed) = match hit {
            None => (LinearRgb::BLACK, LinearRgb::BLACK),
            Some((_, depth)) => {
                let point = self.view.eye + self.view.ray * Vector3::new(x, y, 1.0) * depth;
                self.irradiance(&point, &Vector3::z(), &self.surface_lamps, None)
            }
        };
        if hit.is_none() || open == LinearRgb::BLACK {
            shadow.outside = shadow.outside + weight;
        }
        shadow.weight = shadow.weight + weight;
        shadow.open = shadow.open + weight * open;
        shadow.shadowed = shadow.shadowed + weight * shadowed;
    }

    /// Irradiance without and with the other cards in the way.
    fn irradiance(
        &self,
        p: &Vector3<f64>,
        n: &Vector3<f64>,
        lamps: &[LightGroup],
        own: Option<usize>,
    ) -> (LinearRgb, LinearRgb) {
        let (mut open, mut shadowed) = (LinearRgb::BLACK, LinearRgb::BLACK);
        for lamp in lamps {
            for source in &lamp.sources {
                let e = source.irradiance(p, n) as f32;
                open = open.add_scaled(e, lamp.radiance);
                shadowed = shadowed.add_scaled(e, self.passes(p, source, own) * lamp.radiance);
            }
        }
        (open, shadowed)
    }

    /// Share of a source's light that reaches a point.
    fn passes(&self, p: &Vector3<f64>, source: &LightSample, own: Option<usize>) -> LinearRgb {
        if own.is_some()
            && matches!(source.kind, SampleKind::Sky { .. })
            && self.surface_blocks(p, &source.at.xyz())
        {
            return LinearRgb::BLACK;
        }
        let others = self
            .cards
            .iter()
            .enumerate()
            .filter(|&(k, _)| Some(k) != own);
        others.fold(LinearRgb::WHITE, |through, (_, facing)| {
            match crossing(&facing.sheet, p, source) {
                Some(uv) => through * facing.texel(uv, p).transmittance(),
                None => through,
            }
        })
    }

    fn surface_blocks(&self, p: &Vector3<f64>, direction: &Vector3<f64>) -> bool {
        let foot = p - direction * (p.z / direction.z);
        let [w, h] = self.shot.catcher.map(|s| 0.5 * s);
        direction.z < 0.0 && foot.x.abs() <= w && foot.y.abs() <= h
    }
}

/// Texture coordinates where the way from a point to a source crosses a sheet.
fn crossing(sheet: &ScenePlane, p: &Vector3<f64>, source: &LightSample) -> Option<[f64; 2]> {
    let way = source.at.xyz() - p * source.at.w;
    let s = sheet.normal.dot(&(sheet.center - p)) / sheet.normal.dot(&way);
    let local = p + way * s - sheet.center;
    let uv = [
        local.dot(&sheet.x) / sheet.size[0] + 0.5,
        0.5 - local.dot(&sheet.y) / sheet.size[1],
    ];
    let end = if source.at.w > 0.0 {
        1.0
    } else {
        f64::INFINITY
    };
    (s > 0.0 && s < end && uv.iter().all(|c| (0.0..=1.0).contains(c))).then_some(uv)
}

impl ReferenceCard<'_> {
    fn texel(&self, uv: [f64; 2], from: &Vector3<f64>) -> Film {
        texel(self.card, &self.sheet, uv, from)
    }
}

/// What a card shows to whoever looks at it from a point: full detail, what lies outside counts as nothing.
pub(super) fn texel(
    card: &Card,
    sheet: &ScenePlane,
    [u, v]: [f64; 2],
    from: &Vector3<f64>,
) -> Film {
    let from_behind = sheet.normal.dot(&(from - sheet.center)) < 0.0;
    let (texture, u) = match &card.back {
        Some(back) if from_behind => (back, 1.0 - u),
        _ => (&card.texture, u),
    };
    let (width, height) = texture.size();
    let (x, y) = (u * width as f64, v * height as f64);
    let film = match texture {
        Texture::Rgba(pyramid) => sample_bilinear(pyramid.base(), x, y).into(),
        Texture::Film(pyramid) => sample_bilinear(pyramid.base(), x, y),
    };
    let grade = &card.grade;
    let color = crate::color::shift_hsv(film.color, grade.hue_deg, grade.saturation, grade.value);
    Film {
        color,
        opacity: graded_opacity(film.opacity, grade),
    }
}

/// A ratio of averages, per channel; 1 where there is nothing to average.
#[derive(Default)]
struct ShadowRatio {
    open: LinearRgb,
    shadowed: LinearRgb,
    outside: LinearRgb,
    weight: LinearRgb,
}

impl ShadowRatio {
    fn value(&self) -> LinearRgb {
        let of = |c: LinearRgb| <[f32; 3]>::from(c);
        let (shadowed, open, outside, weight) = (
            of(self.shadowed),
            of(self.open),
            of(self.outside),
            of(self.weight),
        );
        let channel = |c: usize| {
            let share = if weight[c] > 0.0 {
                1.0 - outside[c] / weight[c]
            } else {
                0.0
            };
            let lit = open[c] > 0.0 && shadowed[c] != open[c];
            if lit {
                1.0 + share * (shadowed[c] / open[c] - 1.0)
            } else {
                1.0
            }
        };
        LinearRgb::new(channel(0), channel(1), channel(2))
    }
}
