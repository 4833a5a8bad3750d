//! Depth of field: what is rendered out of focus is as soft as a thin lens would make it.
//!
//! # Method
//! Every deep sample spreads over its circle of confusion, a disc whose radius depends on its own
//! depth (Potmesil and Chakravarty, "A lens and aperture camera model for synthetic image
//! generation", 1981), object by object: the coverage of a partly hidden object is known from its
//! samples, and its colour in the hidden part is taken from its visible part nearby. Where the
//! objects in a pixel are equally far out of focus, their soft light simply adds up, as with any
//! blur; otherwise the nearer ones hide the others behind them by their soft coverage. Cards and
//! shadows beyond the border spread into the picture, too: they are rendered as far as circles
//! reach.
//!
//! The plate is a photo and has its own depth of field: only the shadows on it are blurred.

mod disc;

use crate::camera::{Camera, RadialDistortion};
use crate::composite::part::pixels_of;
use crate::deep::{DeepImage, DeepSample, less};
use crate::geom::{Plane, Point2};
use crate::image::Image;
use crate::pixel::{Depth, LinearRgb, Mix, ObjectId};
use crate::render::{RenderOptions, render_beyond};
use crate::scene::{Card, Shot, ThinLens};
use crate::work::{self, Kind};
use disc::{Disc, Discs};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// Radii of the objects in a pixel that differ by less count as equal; those that differ by more
/// than three times as much count as entirely different, pixels.
const SAME_RADIUS_PX: f64 = 0.25;
/// Coverage below this counts as none: a fortieth of an 8-bit code.
const LEAST_ALPHA: f32 = 1e-4;
/// Visible share of an object's coverage above which its colour is known in a pixel.
const KNOWN_SHARE: f32 = 0.05;
/// Weight of the surface's shadow where the surface is hidden.
const HIDDEN_WEIGHT: f32 = 0.01;

/// The deep picture of a shot as its lens sees it; none if that is sharp everywhere.
///
/// Coverage becomes soft together with the light: labels are made from the picture before
/// defocusing.
pub(super) fn defocus(deep: &DeepImage, shot: &Shot, options: &RenderOptions) -> Option<DeepImage> {
    let focus = Focus::new(shot, shot.thin_lens?);
    let surface = SoftSurface::new(&focus, [deep.width(), deep.height()]);
    let reach = focus.reach_of(&shot.cards).max(surface.discs.reach());
    let beyond = (reach > 0).then(|| render_beyond(shot, reach, options));
    let mut objects = Objects::new();
    add_samples(&mut objects, deep, 0);
    if let Some(beyond) = &beyond {
        add_samples(&mut objects, beyond, reach);
    }
    let shadows = Shadows::new(deep, beyond.as_ref().unwrap_or(deep), reach);
    Some(focus.of(surface.shadow(&shadows), objects))
}

/// A lens in front of a shot's camera.
struct Focus<'a> {
    lens: ThinLens,
    camera: &'a Camera,
    distortion: RadialDistortion,
}

/// The samples of every object, in the picture and around it.
type Objects = BTreeMap<ObjectId, Vec<PlacedSample>>;

/// A deep sample, its position, what it hides per channel, and how much of it is visible.
struct PlacedSample {
    /// Column and row, which may be beyond the picture's border.
    at: [isize; 2],
    sample: DeepSample,
    hidden: LinearRgb,
    /// Its `visible`, tinted by the transmittance of what is nearer.
    seen: LinearRgb,
}

/// Sums over the samples of an object whose circles of confusion reach a pixel.
#[derive(Clone, Copy, Default)]
struct SoftPixel {
    alpha: f32,
    visible: f32,
    alpha_depth: f32,
    light: LinearRgb,
    hidden: LinearRgb,
    seen: LinearRgb,
}

/// An object out of focus, in the part of the picture that it reaches.
struct SoftObject {
    object: ObjectId,
    columns: Range<usize>,
    rows: Range<usize>,
    pixels: Vec<SoftPixel>,
    /// Distance to the farthest pixel that a circle of confusion of the picture reaches, pixels.
    reach: isize,
}

/// How far out of focus the surface is.
struct SoftSurface {
    /// Radius of its circle of confusion in each pixel of the picture.
    radii_px: Image<f64>,
    discs: Discs,
}

/// The surface in the picture and in a margin around it.
struct Shadows {
    /// Pixels on every side.
    margin: usize,
    /// Factors on the plate.
    factors: Image<LinearRgb>,
    /// How visible the surface is; never quite 0.
    seen: Image<f32>,
}

/// An out-of-focus object in a pixel.
struct SoftSample<'a> {
    of: &'a SoftObject,
    depth: f32,
    pixel: SoftPixel,
}

impl<'a> Focus<'a> {
    fn new(shot: &'a Shot, lens: ThinLens) -> Self {
        Self {
            lens,
            camera: &shot.camera,
            distortion: shot.distortion(),
        }
    }

    /// Distance beyond the border from which cards spread into the picture, pixels.
    fn reach_of(&self, cards: &[Card]) -> usize {
        let corners = cards.iter().flat_map(|card| card.quad.corners());
        let depths = corners.map(|corner| (self.camera.camera_from_world * corner).z);
        Discs::of_radii(depths.map(|depth| self.radius_px(depth as f32))).reach()
    }

    /// The objects out of focus, over an out-of-focus shadow.
    fn of(&self, shadow: Image<LinearRgb>, objects: Objects) -> DeepImage {
        work::add(Kind::Filters, 1);
        let is_tinted = objects.values().flatten().any(PlacedSample::is_tinted);
        let (width, height) = shadow.size();
        let soft = self.soft_objects(objects, [width, height]);
        let pixels: Vec<_> = (0..width * height)
            .into_par_iter()
            .map(|i| self.pixel(&soft, [i % width, i / width]))
            .collect();
        let tints = if is_tinted {
            pixels.iter().flatten().map(|(_, tint)| *tint).collect()
        } else {
            Vec::new()
        };
        let samples = pixels
            .into_iter()
            .map(|pixel| pixel.into_iter().map(|(sample, _)| sample).collect());
        DeepImage::from_pixels(shadow, samples).with_tints(tints)
    }

    fn radius_px(&self, depth: f32) -> f64 {
        self.lens
            .blur_radius_px(f64::from(depth), self.camera.focal_px.x)
    }

    /// Every object, each spread separately.
    fn soft_objects(&self, objects: Objects, size: [usize; 2]) -> Vec<SoftObject> {
        let depths = objects.values().flatten().map(|s| s.sample.depth.0);
        let discs = Discs::of_radii(depths.map(|depth| self.radius_px(depth)));
        objects
            .into_par_iter()
            .map(|(object, samples)| self.soft_object(object, &samples, &discs, size))
            .collect()
    }

    fn soft_object(
        &self,
        object: ObjectId,
        samples: &[PlacedSample],
        discs: &Discs,
        size: [usize; 2],
    ) -> SoftObject {
        let [columns, rows] = [0, 1].map(|axis| {
            let places = samples.iter().map(|placed| placed.at[axis]);
            around(places, discs.reach(), size[axis])
        });
        let mut soft = SoftObject {
            object,
            pixels: vec![SoftPixel::default(); columns.len() * rows.len()],
            columns,
            rows,
            reach: discs.reach() as isize,
        };
        for sample in samples {
            let radius = self.radius_px(sample.sample.depth.0);
            soft.spread(sample, discs.of_radius(radius));
        }
        soft
    }

    /// The samples of a pixel, front to back, with what each object hides per channel.
    fn pixel(&self, objects: &[SoftObject], at: [usize; 2]) -> Vec<(DeepSample, LinearRgb)> {
        let mut seen: Vec<_> = objects.iter().filter_map(|soft| soft.at(at)).collect();
        seen.sort_by(|a, b| {
            let by_id = a.of.object.cmp(&b.of.object);
            a.depth.total_cmp(&b.depth).then(by_id)
        });
        let apart = self.share_apart(&seen);
        let mut through = LinearRgb::WHITE;
        let samples = seen.iter();
        samples
            .map(|s| s.mixed_behind(&mut through, at, apart))
            .collect()
    }

    /// 0 for objects that are equally far out of focus, 1 for those that differ entirely.
    fn share_apart(&self, seen: &[SoftSample<'_>]) -> f32 {
        let radii = seen.iter().map(|s| self.radius_px(s.depth));
        let low = radii.clone().fold(f64::INFINITY, f64::min);
        let high = radii.fold(0.0, f64::max);
        let beyond = (high - low) / SAME_RADIUS_PX - 1.0;
        (0.5 * beyond).clamp(0.0, 1.0) as f32
    }

    /// Radius of the circle of confusion of the surface at a pixel; 0 where the surface is not
    /// visible.
    fn surface_radius_px(&self, x: usize, y: usize) -> f64 {
        let px = Point2::new(x as f64 + 0.5, y as f64 + 0.5);
        let ray = self.camera.ray(self.distortion.undistort(px));
        let depth = Plane::surface().intersect(&ray);
        depth.map_or(0.0, |depth| self.radius_px(depth as f32))
    }
}

impl SoftSurface {
    fn new(focus: &Focus<'_>, [width, height]: [usize; 2]) -> Self {
        let radii_px = Image::from_fn(width, height, |x, y| focus.surface_radius_px(x, y));
        Self {
            discs: Discs::of_radii(radii_px.pixels().iter().copied()),
            radii_px,
        }
    }

    /// The shadows on it, each pixel as soft as the surface is there.
    fn shadow(&self, shadows: &Shadows) -> Image<LinearRgb> {
        let (width, height) = self.radii_px.size();
        let Some([columns, rows]) = shadows.near(self.discs.reach(), [width, height]) else {
            return Image::filled(width, height, LinearRgb::WHITE);
        };
        Image::from_fn(width, height, |x, y| {
            if columns.contains(&x) && rows.contains(&y) {
                shadows.mean([x, y], self.discs.of_radius(self.radii_px[(x, y)]))
            } else {
                LinearRgb::WHITE
            }
        })
    }
}

impl Shadows {
    /// From a picture, and one with a margin around it for the margin; without a margin, the
    /// picture itself.
    fn new(deep: &DeepImage, wide: &DeepImage, margin: usize) -> Self {
        let inside = [deep.width(), deep.height()].map(|side| margin..margin + side);
        let place = |x: usize, y: usize| {
            if inside[0].contains(&x) && inside[1].contains(&y) {
                (deep, x - margin, y - margin)
            } else {
                (wide, x, y)
            }
        };
        let (width, height) = (wide.width(), wide.height());
        Self {
            margin,
            factors: Image::from_fn(width, height, |x, y| {
                let (deep, x, y) = place(x, y);
                deep.shadow()[(x, y)]
            }),
            seen: Image::from_fn(width, height, |x, y| {
                let (deep, x, y) = place(x, y);
                deep.flat(x, y).transmittance().mean() + HIDDEN_WEIGHT
            }),
        }
    }

    /// Columns and rows of a picture of `size` that contain shadows or are closer to them than
    /// `reach`; none without shadows.
    fn near(&self, reach: usize, size: [usize; 2]) -> Option<[Range<usize>; 2]> {
        let factors = self.factors.pixels().iter().enumerate();
        let dark = factors.filter(|(_, factor)| **factor != LinearRgb::WHITE);
        let width = self.factors.width();
        let places: Vec<_> = dark.map(|(i, _)| [i % width, i / width]).collect();
        let range = |axis: usize| {
            let columns = places.iter().map(|at| at[axis] as isize);
            let in_picture = columns.map(|column| column - self.margin as isize);
            around(in_picture, reach, size[axis])
        };
        (!places.is_empty()).then(|| [0, 1].map(range))
    }

    /// The mean factor on the plate over a disc around a pixel of the picture, weighted by the
    /// visibility of the surface. The margin contains the whole disc.
    fn mean(&self, at: [usize; 2], disc: &Disc) -> LinearRgb {
        let [x, y] = at.map(|i| i + self.margin);
        let (mut sum, mut total) = (LinearRgb::BLACK, 0.0);
        for (dx, dy, weight) in disc.taps() {
            let tap = (x.wrapping_add_signed(*dx), y.wrapping_add_signed(*dy));
            let weight = weight * self.seen[tap];
            sum = sum.add_scaled(weight, self.factors[tap]);
            total += weight;
        }
        sum.scale(1.0 / total)
    }
}

/// Adds the samples of a picture, or for a picture with a margin around it, only those in the
/// margin.
fn add_samples(objects: &mut Objects, deep: &DeepImage, margin: usize) {
    let inside = [deep.width(), deep.height()].map(|side| margin..side - margin);
    let is_inside = |x: usize, y: usize| inside[0].contains(&x) && inside[1].contains(&y);
    for (x, y) in pixels_of(deep).filter(|&(x, y)| margin == 0 || !is_inside(x, y)) {
        let mut passed = LinearRgb::WHITE;
        for (sample, hidden) in deep.hiding(x, y) {
            let placed = PlacedSample {
                at: [x, y].map(|i| i as isize - margin as isize),
                sample: *sample,
                hidden,
                seen: hue_of(passed).scale(sample.visible),
            };
            passed = less(passed, hidden);
            objects.entry(sample.object).or_default().push(placed);
        }
    }
}

/// Columns (or rows) of a picture of `size` that are closer to the given ones than `reach`.
fn around(columns: impl Iterator<Item = isize> + Clone, reach: usize, size: usize) -> Range<usize> {
    let (low, high) = (columns.clone().min(), columns.max());
    let within = |column: isize| column.clamp(0, size as isize) as usize;
    let [low, high] = [low.unwrap_or(0), high.map_or(0, |last| last + 1)];
    within(low - reach as isize)..within(high + reach as isize)
}

impl PlacedSample {
    fn is_tinted(&self) -> bool {
        self.hidden != LinearRgb::grey(self.hidden.g)
    }
}

impl SoftObject {
    /// Adds a sample to every pixel of its disc.
    fn spread(&mut self, placed: &PlacedSample, disc: &Disc) {
        for (dx, dy, weight) in disc.taps() {
            if let Some(i) = self.index([placed.at[0] + dx, placed.at[1] + dy]) {
                self.pixels[i].add(placed, *weight);
            }
        }
    }

    fn index(&self, [x, y]: [isize; 2]) -> Option<usize> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        let inside = self.columns.contains(&x) && self.rows.contains(&y);
        inside.then(|| (y - self.rows.start) * self.columns.len() + x - self.columns.start)
    }

    /// Its sample in a pixel, if any.
    fn at(&self, [x, y]: [usize; 2]) -> Option<SoftSample<'_>> {
        let pixel = self.pixels[self.index([x as isize, y as isize])?];
        (pixel.alpha > LEAST_ALPHA).then(|| SoftSample {
            of: self,
            depth: pixel.alpha_depth / pixel.alpha,
            pixel,
        })
    }

    /// Its visible part around a pixel, weighted towards the pixel: as much as nearer objects that
    /// are out of focus let through.
    fn around(&self, [x, y]: [usize; 2]) -> SoftPixel {
        let side = -self.reach..=self.reach;
        let mut sum = SoftPixel::default();
        for (dx, dy) in side
            .clone()
            .flat_map(|dy| side.clone().map(move |dx| (dx, dy)))
        {
            if let Some(i) = self.index([x as isize + dx, y as isize + dy]) {
                let nearness = 1.0 / (1 + dx * dx + dy * dy) as f32;
                sum.add_seen(&self.pixels[i], nearness * nearness);
            }
        }
        sum
    }
}

impl SoftPixel {
    #[inline]
    fn add(&mut self, placed: &PlacedSample, weight: f32) {
        let PlacedSample { sample, .. } = placed;
        self.alpha += weight * sample.alpha;
        self.visible += weight * sample.visible;
        self.alpha_depth += weight * sample.alpha * sample.depth.0;
        self.light = self.light.add_scaled(weight, sample.light);
        self.hidden = self.hidden.add_scaled(weight, placed.hidden);
        self.seen = self.seen.add_scaled(weight, placed.seen);
    }

    /// Adds the visible part of another pixel of the same object.
    fn add_seen(&mut self, other: &Self, weight: f32) {
        self.visible += weight * other.visible;
        self.light = self.light.add_scaled(weight, other.light);
        self.hidden = self.hidden.add_scaled(weight, other.hidden);
        self.seen = self.seen.add_scaled(weight, other.seen);
    }
}

/// The light and occlusion of an object in a pixel.
struct PixelEffect {
    light: LinearRgb,
    hidden: LinearRgb,
}

impl SoftSample<'_> {
    /// The sample behind objects with transmittance `through`, which becomes the transmittance of
    /// both.
    ///
    /// `apart` blends from the sum of the visible parts, 0, to a soft object behind soft ones, 1.
    fn mixed_behind(
        &self,
        through: &mut LinearRgb,
        at: [usize; 2],
        apart: f32,
    ) -> (DeepSample, LinearRgb) {
        let SoftPixel { light, hidden, .. } = self.pixel;
        if apart == 0.0 {
            return self.sample(PixelEffect { light, hidden }, self.pixel.visible);
        }
        let behind = self.behind(through, at);
        let seen = self.pixel.visible * (1.0 - apart) + behind.hidden.mean() * apart;
        let both = PixelEffect {
            light: light.mixed(behind.light, apart),
            hidden: hidden.mixed(behind.hidden, apart),
        };
        self.sample(both, seen)
    }

    /// Its effect behind objects with this transmittance.
    fn behind(&self, through: &mut LinearRgb, at: [usize; 2]) -> PixelEffect {
        if through.r.max(through.g).max(through.b) < LEAST_ALPHA {
            return PixelEffect {
                light: LinearRgb::BLACK,
                hidden: LinearRgb::BLACK,
            };
        }
        let alone = self.alone(at);
        let opacity = alone.hidden.map(|o| o.min(1.0));
        let effect = PixelEffect {
            light: alone.light * *through,
            hidden: opacity * *through,
        };
        *through = *through * opacity.map(|o| 1.0 - o);
        effect
    }

    /// Its effect if nothing hid it.
    fn alone(&self, at: [usize; 2]) -> PixelEffect {
        let known = self.pixel.visible > KNOWN_SHARE * self.pixel.alpha;
        let seen = if known {
            self.pixel
        } else {
            self.of.around(at)
        };
        if seen.visible <= 0.0 {
            return PixelEffect {
                light: LinearRgb::BLACK,
                hidden: LinearRgb::grey(self.pixel.alpha),
            };
        }
        // Per channel: tinted film in front has tinted the visible part.
        let least = KNOWN_SHARE * seen.visible;
        let whole = seen.seen.map(|share| self.pixel.alpha / share.max(least));
        PixelEffect {
            light: seen.light * whole,
            hidden: seen.hidden * whole,
        }
    }

    fn sample(&self, effect: PixelEffect, visible: f32) -> (DeepSample, LinearRgb) {
        let alpha = self.pixel.alpha.min(1.0);
        let sample = DeepSample {
            object: self.of.object,
            depth: Depth(self.depth),
            light: effect.light,
            alpha,
            visible: visible.min(alpha),
        };
        (sample, effect.hidden)
    }
}

/// A colour scaled to a mean of 1; white for one that is practically black.
fn hue_of(color: LinearRgb) -> LinearRgb {
    match color.mean() {
        bright if bright > LEAST_ALPHA => color.scale(1.0 / bright),
        _ => LinearRgb::WHITE,
    }
}

#[cfg(test)]
mod tests;
