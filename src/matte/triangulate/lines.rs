//! Straight lines through a pixel's values on several screens, one a channel: slope T, intercept F.

use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};

/// Sums for a straight line through points.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Line {
    count: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
}

impl Line {
    pub(super) fn add(&mut self, x: f32, y: f32) {
        self.count += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
    }

    /// Sum of the squared distances of x from its mean.
    fn spread(&self) -> f32 {
        (self.xx - self.x * self.x / self.count).max(0.0)
    }

    /// By how much a share that all x are off changes the slope, as a share of it.
    fn lever(&self) -> f32 {
        self.x / self.count / self.spread().sqrt().max(f32::MIN_POSITIVE)
    }

    fn slope(&self) -> f32 {
        (self.xy - self.x * self.y / self.count) / self.spread().max(f32::MIN_POSITIVE)
    }

    /// Mean of the values less a slope's part.
    fn intercept(&self, slope: f32) -> f32 {
        (self.y - slope * self.x) / self.count
    }
}

/// A pixel's lines, and the noise of its values.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pixel {
    pub(super) lines: [Line; 3],
    pub(super) noise: f32,
}

impl Pixel {
    /// Transmittance of a channel as its line has it.
    pub(super) fn slope(&self, channel: usize) -> f32 {
        self.lines[channel].slope()
    }

    /// Standard deviation of a channel's slope.
    pub(super) fn sigma(&self, channel: usize) -> f32 {
        (self.noise / self.lines[channel].spread().sqrt().max(f32::MIN_POSITIVE)).min(UNKNOWN)
    }
}

/// Standard deviation of a transmittance of which nothing is known.
const UNKNOWN: f32 = 1e3;
/// Standard deviation of a transmittance told from other channels around what it is.
const BORROWED: f32 = 0.06;

/// A pixel's film.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Solved {
    pub(super) transmittance: LinearRgb,
    pub(super) reflected: LinearRgb,
    /// Standard deviation of the transmittance that is told worst.
    pub(super) sigma: f32,
}

/// How the channels that the screens leave open follow from the others.
pub(super) struct Borrowed {
    determined: [bool; 3],
    /// Transmittance of each channel over the mean of the determined ones.
    ratio: [f32; 3],
}

impl Borrowed {
    /// The ratio of each open channel: that of `plastic`, the transmittance believed of it where it lies flat, and what
    /// little the screens differ in the channel says over the whole object, by their variances.
    pub(super) fn fit(
        pixels: &Image<Pixel>,
        inside: &Image<Coverage>,
        determined: [bool; 3],
        plastic: [f32; 3],
    ) -> Self {
        let mut borrowed = Self { determined, ratio: [1.0; 3] };
        let told = || (0..3).filter(|&c| determined[c]);
        let mean = told().map(|c| plastic[c]).sum::<f32>() / told().count().max(1) as f32;
        for channel in (0..3).filter(|&c| !determined[c]) {
            let belief = plastic[channel] / mean.max(f32::MIN_POSITIVE);
            let (measured, variance) = borrowed.measured(pixels, inside, channel);
            let trust = (BELIEF * belief).max(BELIEF_LEAST).powi(2);
            let ratio = (belief * variance + measured * trust) / (variance + trust);
            borrowed.ratio[channel] = ratio.clamp(0.0, 1.0 / LEAST_MEAN);
        }
        borrowed
    }

    /// The ratio of an open channel as its own lines have it, and its variance: noise, and plates that are a little off.
    fn measured(&self, pixels: &Image<Pixel>, inside: &Image<Coverage>, channel: usize) -> (f32, f32) {
        let (mut top, mut bottom, mut levers) = (0.0, f64::MIN_POSITIVE, Vec::new());
        for (pixel, _) in pixels.pixels().iter().zip(inside.pixels()).filter(|(_, inside)| inside.0 > 0.5) {
            let mean = self.mean(pixel);
            let weight = 1.0 / f64::from(pixel.sigma(channel)).powi(2);
            top += weight * f64::from(pixel.lines[channel].slope().clamp(-1.0, 2.0) * mean);
            bottom += weight * f64::from(mean * mean);
            levers.push(pixel.lines[channel].lever());
        }
        let ratio = (top / bottom) as f32;
        let off = PLATE_ERROR * median(levers.into_iter()).unwrap_or(UNKNOWN).min(UNKNOWN) * ratio.max(1.0);
        (ratio, (1.0 / bottom) as f32 + off * off)
    }

    /// Mean transmittance of the determined channels.
    fn mean(&self, pixel: &Pixel) -> f32 {
        let told = (0..3).filter(|&c| self.determined[c]);
        let (sum, count) =
            told.fold((0.0, 0.0), |(sum, count), c| (sum + pixel.lines[c].slope().clamp(0.0, 1.0), count + 1.0));
        sum / f32::max(count, 1.0)
    }

    /// The film of one pixel: what is measured, mixed with what the other channels say by the variances.
    pub(super) fn complete(&self, pixel: &Pixel) -> Solved {
        let mean = self.mean(pixel);
        let mut worst = 0.0_f32;
        let told: [f32; 3] = std::array::from_fn(|c| {
            let (slope, sigma) = (pixel.lines[c].slope(), pixel.sigma(c));
            if self.determined[c] {
                worst = worst.max(sigma);
                return slope.clamp(0.0, 1.0);
            }
            let (measured, borrowed) = (1.0 / (sigma * sigma), 1.0 / (BORROWED * BORROWED));
            worst = worst.max((measured + borrowed).sqrt().recip());
            ((slope * measured + self.ratio[c] * mean * borrowed) / (measured + borrowed)).clamp(0.0, 1.0)
        });
        let reflected = std::array::from_fn(|c| pixel.lines[c].intercept(told[c]).max(0.0));
        Solved { transmittance: told.into(), reflected: LinearRgb::from(reflected), sigma: worst }
    }
}

/// Standard deviation of the ratio of an open channel that is told from the dye: a share of it, and at least.
const BELIEF: f32 = 0.15;
const BELIEF_LEAST: f32 = 0.03;
/// Plates are so much off, as a share.
const PLATE_ERROR: f32 = 0.01;
/// Plastic passes in no channel more than the inverse of this times the mean of the others.
const LEAST_MEAN: f32 = 0.3;
/// Pixels that pass at least this share of what the clearest do are plastic that lies flat, or nearly.
const FLAT: f32 = 0.5;
/// The clearest: this share of the object passes more.
const CLEAREST: f64 = 0.05;

/// Transmittance per channel where the plastic lies flat: the median over what is not much darker than the clearest.
pub(super) fn flat(solved: &Image<Solved>, inside: &Image<Coverage>) -> LinearRgb {
    let mean = |t: LinearRgb| (t.r + t.g + t.b) / 3.0;
    let object =
        || solved.pixels().iter().zip(inside.pixels()).filter(|(_, c)| c.0 >= 0.99).map(|(p, _)| p.transmittance);
    let mut means: Vec<f32> = object().map(mean).collect();
    if means.is_empty() {
        return LinearRgb::WHITE;
    }
    let at = ((means.len() as f64 * (1.0 - CLEAREST)) as usize).min(means.len() - 1);
    let clearest = *means.select_nth_unstable_by(at, f32::total_cmp).1;
    let channel =
        |of: fn(LinearRgb) -> f32| median(object().filter(|t| mean(*t) >= FLAT * clearest).map(of)).unwrap_or(1.0);
    LinearRgb::new(channel(|t| t.r), channel(|t| t.g), channel(|t| t.b)).map(|t| t.clamp(0.001, 1.0))
}

pub(super) fn median(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut values: Vec<f32> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
