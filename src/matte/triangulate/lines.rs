//! Straight lines through a pixel's values on several screens, one a channel: slope T, intercept F.

use crate::image::Image;
use crate::matte::film::OPAQUE;
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::{median, quantile};

/// Sums for a straight line through points, about the x of the first: x that hardly differ would
/// cancel in others.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ScreenLine {
    first_x: f32,
    count: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
}

impl ScreenLine {
    pub(super) fn add(&mut self, x: f32, y: f32) {
        if self.count == 0.0 {
            self.first_x = x;
        }
        let x = x - self.first_x;
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

    fn mean_x(&self) -> f32 {
        self.first_x + self.x / self.count
    }

    /// By how much a share that all x are off changes the slope, as a share of it.
    fn lever(&self) -> f32 {
        self.mean_x() / self.spread().sqrt().max(f32::MIN_POSITIVE)
    }

    fn slope(&self) -> f32 {
        (self.xy - self.x * self.y / self.count) / self.spread().max(f32::MIN_POSITIVE)
    }

    /// Mean of the values less a slope's part.
    fn intercept(&self, slope: f32) -> f32 {
        self.y / self.count - slope * self.mean_x()
    }
}

/// A pixel's lines, and the noise of its values.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelLines {
    pub(super) lines: [ScreenLine; 3],
    pub(super) noise: f32,
}

impl PixelLines {
    /// Transmittance of a channel as its line has it.
    pub(super) fn slope(&self, channel: usize) -> f32 {
        self.lines[channel].slope()
    }

    /// The same of a channel that may be open, without what noise alone can give.
    fn bounded_slope(&self, channel: usize) -> f32 {
        self.slope(channel).clamp(-1.0, 2.0)
    }

    /// Standard deviation of a channel's slope.
    pub(super) fn sigma(&self, channel: usize) -> f32 {
        (self.noise / self.lines[channel].spread().sqrt().max(f32::MIN_POSITIVE)).min(UNKNOWN_SIGMA)
    }
}

/// Standard deviation of an unknown transmittance or gain.
const UNKNOWN_SIGMA: f32 = 1e3;
/// Standard deviation of a transmittance inferred from other channels around what it is.
const INFERRED_SIGMA: f32 = 0.06;
/// Standard deviation of an open channel of the plastic that is inferred from its dye, as a share
/// of it.
const DYE_SIGMA: f32 = 0.15;
/// Relative error of plates in a channel that both screens have little of: light of one screen that
/// the object reflects, JPEG's colours. In 6 photos of bottles on a display, in soft light, the
/// slopes of red on green and blue were off by 0.22 of themselves, at a lever of 3.7.
const PLATE_ERROR: f32 = 0.05;
/// Prior of a pixel's share of flat plastic, standard deviation around 0: plastic up to one and a
/// half times as clear as flat.
const SHARE_SIGMA: f32 = 1.5;
/// Prior of a pixel's bare share, standard deviation around 0: occasionally a rim with screen
/// beside it.
const BARE_SIGMA: f32 = 0.27;
/// Standard deviation of transmittances around any sum of plastic and nothing.
const MODEL_SIGMA: f32 = 0.015;
/// Pixels that pass at least this share of what the clearest do are plastic that lies flat, or
/// nearly.
const MIN_FLAT_SHARE: f32 = 0.5;
/// The clearest: this share of the object passes more. Tips, single walls and screen beside the
/// object pass several times what dark plastic does.
const CLEAREST_SHARE: f64 = 0.25;

/// A pixel's film.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PixelFilm {
    pub(super) transmittance: LinearRgb,
    pub(super) reflected: LinearRgb,
    /// Standard deviation of the least certain channel of the transmittance.
    pub(super) sigma: f32,
}

impl PixelFilm {
    /// From the transmittance of each channel and its standard deviation.
    #[inline]
    fn new(pixel: &PixelLines, channels: [(f32, f32); 3]) -> Self {
        let transmittance = channels.map(|(t, _)| t);
        let reflected: [f32; 3] =
            std::array::from_fn(|c| pixel.lines[c].intercept(transmittance[c]).max(0.0));
        Self {
            transmittance: transmittance.into(),
            reflected: reflected.into(),
            sigma: channels
                .iter()
                .fold(0.0, |worst, (_, sigma)| worst.max(*sigma)),
        }
    }

    /// The film in front of a screen.
    pub(super) fn over(&self, screen: LinearRgb) -> LinearRgb {
        self.reflected + self.transmittance * screen
    }
}

/// Plastic where it lies flat.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatPlastic {
    /// Its transmittance.
    pub(super) transmittance: [f32; 3],
    /// How far that of other plastic may differ which lets as much through in the determined
    /// channels.
    pub(super) spread: [f32; 3],
}

/// How the channels that the screens leave open follow from the others: a pixel is plastic in some
/// share, and bare in some.
pub(super) struct Inferred {
    determined: [bool; 3],
    plastic: FlatPlastic,
}

impl Inferred {
    /// `plastic` is the prior of flat plastic; in open channels it is scaled by what little the
    /// screens differ there, over the whole object, mixed by the variances.
    pub(super) fn fit(
        pixels: &Image<PixelLines>,
        inside: &Image<Coverage>,
        determined: [bool; 3],
        plastic: FlatPlastic,
    ) -> Self {
        let prior = Self {
            determined,
            plastic,
        };
        let scaled = [0, 1, 2].map(|c| prior.scaled_channel(pixels, inside, c));
        let plastic = FlatPlastic {
            transmittance: scaled.map(|(transmittance, _)| transmittance),
            spread: scaled.map(|(_, spread)| spread),
        };
        Self { plastic, ..prior }
    }

    /// How far flat plastic may be off in its least certain channel, since other plastic explains
    /// the object as well.
    pub(super) fn largest_spread(&self) -> f32 {
        self.plastic.spread.into_iter().fold(0.0, f32::max)
    }

    /// Flat plastic in a channel, scaled where that is open, and what is left of its spread.
    fn scaled_channel(
        &self,
        pixels: &Image<PixelLines>,
        inside: &Image<Coverage>,
        channel: usize,
    ) -> (f32, f32) {
        let plastic = self.plastic.transmittance[channel];
        if self.determined[channel] {
            return (plastic, 0.0);
        }
        let gain = self.gain(pixels, inside, channel);
        (
            scaled_plastic(plastic, gain),
            self.plastic.spread[channel] * kept_prior(gain.1),
        )
    }

    /// By what the plastic of an open channel must be multiplied by its own lines, and the variance
    /// of that: noise, and plates that are a little off.
    fn gain(
        &self,
        pixels: &Image<PixelLines>,
        inside: &Image<Coverage>,
        channel: usize,
    ) -> (f32, f32) {
        let (mut top, mut bottom, mut levers) = (0.0, 0.0_f64, Vec::new());
        for pixel in covered_pixels(pixels, inside) {
            let (measured, expected) = self.measured_and_expected(pixel, channel);
            let weight = 1.0 / f64::from(pixel.sigma(channel)).powi(2);
            top += weight * measured * expected;
            bottom += weight * expected * expected;
            levers.push(pixel.lines[channel].lever());
        }
        // Where no plastic lets light through, nothing is measured, and the prior holds.
        let bottom = bottom.max(f64::from(UNKNOWN_SIGMA).powi(-2));
        let gain = (top / bottom) as f32;
        let off = PLATE_ERROR * median_lever(levers) * gain.max(1.0);
        (gain, (1.0 / bottom) as f32 + off * off)
    }

    /// The part of an open channel's transmittance that is plastic, by its own line and by the
    /// other channels.
    #[inline]
    fn measured_and_expected(&self, pixel: &PixelLines, channel: usize) -> (f64, f64) {
        let (share, bare) = self.shares(pixel);
        let measured = pixel.bounded_slope(channel) - bare;
        (
            f64::from(measured),
            f64::from(share * self.plastic.transmittance[channel]),
        )
    }

    /// The share of flat plastic, and of nothing, that a pixel's determined channels are made of:
    /// least squares, with priors that hold where the channels do not separate them. No less
    /// than nothing is bare.
    fn shares(&self, pixel: &PixelLines) -> (f32, f32) {
        let mut sums = ShareSums::prior();
        for c in (0..3).filter(|&c| self.determined[c]) {
            let weight = 1.0 / (pixel.sigma(c).powi(2) + MODEL_SIGMA * MODEL_SIGMA);
            let plastic = self.plastic.transmittance[c];
            sums.add(weight, plastic, pixel.slope(c).clamp(0.0, 1.0));
        }
        sums.shares()
    }

    /// The film of one pixel: what is measured, mixed with what follows from the other channels by
    /// the variances.
    pub(super) fn complete(&self, pixel: &PixelLines) -> PixelFilm {
        let (share, bare) = self.shares(pixel);
        let channels = [0, 1, 2].map(|c| {
            let sigma = pixel.sigma(c);
            if self.determined[c] {
                (pixel.slope(c).clamp(0.0, 1.0), sigma)
            } else {
                let inferred = share * self.plastic.transmittance[c] + bare;
                let measured = (pixel.bounded_slope(c), sigma);
                mixed(measured, inferred, share * self.plastic.spread[c])
            }
        });
        PixelFilm::new(pixel, channels)
    }
}

/// Weighted sums of the products of flat plastic (p), nothing (b) and the measured transmittance
/// (t) of some channels.
struct ShareSums {
    pp: f32,
    pb: f32,
    bb: f32,
    tp: f32,
    tb: f32,
}

impl ShareSums {
    /// What is known before any channel.
    #[inline]
    fn prior() -> Self {
        Self {
            pp: SHARE_SIGMA.powi(-2),
            pb: 0.0,
            bb: BARE_SIGMA.powi(-2),
            tp: 0.0,
            tb: 0.0,
        }
    }

    #[inline]
    fn add(&mut self, weight: f32, plastic: f32, measured: f32) {
        self.pp += weight * plastic * plastic;
        self.pb += weight * plastic;
        self.bb += weight;
        self.tp += weight * measured * plastic;
        self.tb += weight * measured;
    }

    /// The shares of flat plastic and of nothing.
    #[inline]
    fn shares(&self) -> (f32, f32) {
        let Self { pp, pb, bb, tp, tb } = self;
        let bare =
            ((pp * tb - pb * tp) / (pp * bb - pb * pb).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        (((tp - pb * bare) / pp).max(0.0), bare)
    }
}

/// Transmittance of the plastic in an open channel, between its dye's and what the lines give, by
/// the variances.
fn scaled_plastic(plastic: f32, (gain, variance): (f32, f32)) -> f32 {
    let dye = DYE_SIGMA * DYE_SIGMA;
    (plastic * (variance + gain * dye) / (variance + dye)).clamp(0.0, 1.0)
}

/// The share that the dye keeps in the plastic of an open channel whose lines have a variance.
fn kept_prior(variance: f32) -> f32 {
    let dye = DYE_SIGMA * DYE_SIGMA;
    1.0 - dye / (variance + dye)
}

fn median_lever(levers: Vec<f32>) -> f32 {
    median(levers.into_iter(), f32::total_cmp)
        .unwrap_or(UNKNOWN_SIGMA)
        .min(UNKNOWN_SIGMA)
}

/// A measured transmittance and one inferred from other channels, mixed by their variances, and the
/// deviation of that, with the part of it by which the inferred one may be off.
#[inline(always)]
fn mixed((slope, sigma): (f32, f32), inferred: f32, off: f32) -> (f32, f32) {
    let (measured, prior) = (
        1.0 / (sigma * sigma),
        1.0 / (INFERRED_SIGMA * INFERRED_SIGMA),
    );
    let value = (slope * measured + inferred * prior) / (measured + prior);
    let deviation = (measured + prior).sqrt().recip() + off * prior / (measured + prior);
    (value.clamp(0.0, 1.0), deviation)
}

/// The pixels that lie more inside than outside.
pub(super) fn covered_pixels<'a, P: Copy>(
    pixels: &'a Image<P>,
    inside: &'a Image<Coverage>,
) -> impl Iterator<Item = &'a P> {
    let pixels = pixels.pixels().iter().zip(inside.pixels());
    pixels.filter_map(|(p, c)| (c.0 > 0.5).then_some(p))
}

/// The pixels that are wholly inside.
pub(super) fn opaque_pixels<'a, P: Copy>(
    pixels: &'a Image<P>,
    inside: &'a Image<Coverage>,
) -> impl Iterator<Item = &'a P> {
    let pixels = pixels.pixels().iter().zip(inside.pixels());
    pixels.filter_map(|(p, c)| (c.0 >= OPAQUE).then_some(p))
}

/// Transmittance per channel where the plastic lies flat: the median over what is not much darker
/// than the clearest.
pub(super) fn flat_transmittance(solved: &Image<PixelFilm>, inside: &Image<Coverage>) -> LinearRgb {
    let mut object: Vec<LinearRgb> = opaque_pixels(solved, inside)
        .map(|p| p.transmittance)
        .collect();
    let Some(clearest) = clearest(&object) else {
        return LinearRgb::WHITE;
    };
    object.retain(|t| t.mean() >= MIN_FLAT_SHARE * clearest);
    median_color(&object).map(|t| t.clamp(0.001, 1.0))
}

/// Channel by channel; white of none.
fn median_color(colors: &[LinearRgb]) -> LinearRgb {
    let medians = [0, 1, 2].map(|c: usize| {
        let values = colors.iter().map(|color| color.channels()[c]);
        median(values, f32::total_cmp).unwrap_or(1.0)
    });
    medians.into()
}

/// Mean transmittance of the clearest pixels; none without pixels.
fn clearest(object: &[LinearRgb]) -> Option<f32> {
    let means = object.iter().copied().map(LinearRgb::mean).collect();
    quantile(means, 1.0 - CLEAREST_SHARE, f32::total_cmp)
}
