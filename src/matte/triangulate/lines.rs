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

/// How the channels that the screens leave open follow from the others: a pixel is plastic in some share, and bare in some.
pub(super) struct Borrowed {
    determined: [bool; 3],
    /// Transmittance of the plastic where it lies flat.
    plastic: [f32; 3],
}

impl Borrowed {
    /// `plastic` is what is believed of flat plastic; in open channels it is scaled by what little the screens differ there,
    /// over the whole object, mixed by the variances.
    pub(super) fn fit(
        pixels: &Image<Pixel>,
        inside: &Image<Coverage>,
        determined: [bool; 3],
        plastic: [f32; 3],
    ) -> Self {
        let believed = Self {
            determined,
            plastic,
        };
        let scaled = |c: usize| {
            let (gain, variance) = believed.gain(pixels, inside, c);
            let trust = BELIEF * BELIEF;
            (plastic[c] * (variance + gain * trust) / (variance + trust)).clamp(0.0, 1.0)
        };
        Self {
            plastic: std::array::from_fn(|c| if determined[c] { plastic[c] } else { scaled(c) }),
            ..believed
        }
    }

    /// By what the plastic of an open channel must be multiplied by its own lines, and the variance of that: noise, and
    /// plates that are a little off.
    fn gain(&self, pixels: &Image<Pixel>, inside: &Image<Coverage>, channel: usize) -> (f32, f32) {
        let (mut top, mut bottom, mut levers) = (0.0, f64::MIN_POSITIVE, Vec::new());
        for (pixel, _) in pixels
            .pixels()
            .iter()
            .zip(inside.pixels())
            .filter(|(_, inside)| inside.0 > 0.5)
        {
            let (share, bare) = self.shares(pixel);
            let expected = f64::from(share * self.plastic[channel]);
            let weight = 1.0 / f64::from(pixel.sigma(channel)).powi(2);
            top += weight * f64::from(pixel.slope(channel).clamp(-1.0, 2.0) - bare) * expected;
            bottom += weight * expected * expected;
            levers.push(pixel.lines[channel].lever());
        }
        let gain = (top / bottom) as f32;
        let off = PLATE_ERROR
            * median(levers.into_iter()).unwrap_or(UNKNOWN).min(UNKNOWN)
            * gain.max(1.0);
        (gain, (1.0 / bottom) as f32 + off * off)
    }

    /// The share of flat plastic, and of nothing, that a pixel's determined channels are made of: least squares, with beliefs
    /// that hold where the channels do not tell them apart. No less than nothing is bare.
    fn shares(&self, pixel: &Pixel) -> (f32, f32) {
        let (mut pp, mut pb, mut bb) = (SHARE_SIGMA.powi(-2), 0.0, BARE_SIGMA.powi(-2));
        let (mut tp, mut tb) = (0.0, 0.0);
        for c in (0..3).filter(|&c| self.determined[c]) {
            let weight = 1.0 / (pixel.sigma(c).powi(2) + MODEL_SIGMA * MODEL_SIGMA);
            let (plastic, told) = (self.plastic[c], pixel.slope(c).clamp(0.0, 1.0));
            pp += weight * plastic * plastic;
            pb += weight * plastic;
            bb += weight;
            tp += weight * told * plastic;
            tb += weight * told;
        }
        let bare =
            ((pp * tb - pb * tp) / (pp * bb - pb * pb).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (((tp - pb * bare) / pp).max(0.0), bare)
    }

    /// The film of one pixel: what is measured, mixed with what the other channels say by the variances.
    pub(super) fn complete(&self, pixel: &Pixel) -> Solved {
        let (share, bare) = self.shares(pixel);
        let mut worst = 0.0_f32;
        let told: [f32; 3] = std::array::from_fn(|c| {
            let (slope, sigma) = (pixel.slope(c), pixel.sigma(c));
            if self.determined[c] {
                worst = worst.max(sigma);
                return slope.clamp(0.0, 1.0);
            }
            let (measured, borrowed) = (1.0 / (sigma * sigma), 1.0 / (BORROWED * BORROWED));
            worst = worst.max((measured + borrowed).sqrt().recip());
            ((slope * measured + (share * self.plastic[c] + bare) * borrowed)
                / (measured + borrowed))
                .clamp(0.0, 1.0)
        });
        let reflected = std::array::from_fn(|c| pixel.lines[c].intercept(told[c]).max(0.0));
        Solved {
            transmittance: told.into(),
            reflected: LinearRgb::from(reflected),
            sigma: worst,
        }
    }
}

/// Standard deviation of an open channel of the plastic that is told from its dye, as a share of it.
const BELIEF: f32 = 0.15;
/// Plates are so much off, as a share.
const PLATE_ERROR: f32 = 0.01;
/// What is believed of the two shares of a pixel before it is looked at, standard deviations around 0: plastic up to one
/// and a half times as clear as flat, and now and then a rim with screen beside it.
const SHARE_SIGMA: f32 = 1.5;
const BARE_SIGMA: f32 = 0.27;
/// Standard deviation of transmittances around any sum of plastic and nothing.
const MODEL_SIGMA: f32 = 0.015;
/// Pixels that pass at least this share of what the clearest do are plastic that lies flat, or nearly.
const FLAT: f32 = 0.5;
/// The clearest: this share of the object passes more.
const CLEAREST: f64 = 0.05;

/// Transmittance per channel where the plastic lies flat: the median over what is not much darker than the clearest.
pub(super) fn flat(solved: &Image<Solved>, inside: &Image<Coverage>) -> LinearRgb {
    let mean = |t: LinearRgb| (t.r + t.g + t.b) / 3.0;
    let object = || {
        solved
            .pixels()
            .iter()
            .zip(inside.pixels())
            .filter(|(_, c)| c.0 >= 0.99)
            .map(|(p, _)| p.transmittance)
    };
    let mut means: Vec<f32> = object().map(mean).collect();
    if means.is_empty() {
        return LinearRgb::WHITE;
    }
    let at = ((means.len() as f64 * (1.0 - CLEAREST)) as usize).min(means.len() - 1);
    let clearest = *means.select_nth_unstable_by(at, f32::total_cmp).1;
    let channel = |of: fn(LinearRgb) -> f32| {
        median(object().filter(|t| mean(*t) >= FLAT * clearest).map(of)).unwrap_or(1.0)
    };
    LinearRgb::new(channel(|t| t.r), channel(|t| t.g), channel(|t| t.b))
        .map(|t| t.clamp(0.001, 1.0))
}

pub(super) fn median(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut values: Vec<f32> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
