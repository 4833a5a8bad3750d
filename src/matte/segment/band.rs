//! Bands of a Laplacian pyramid, in units of their noise.

use crate::filter;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use serde::{Deserialize, Serialize};

/// What the pyramid is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tone {
    /// Each channel by itself: sees a red cap on a blue screen of the same grey.
    #[default]
    Channels,
    /// One grey picture, as the paper has it, with these weights of red, green and blue.
    Grey([f32; 3]),
}

/// The first and the last band of a photo, at the photo's size and in units of noise.
pub(super) struct Bands {
    /// What is finer than about 2 pixels.
    pub(super) first: Image<Coverage>,
    /// What is about `2^levels` pixels wide.
    pub(super) last: Image<Coverage>,
}

impl Bands {
    /// Splits a photo.
    pub(super) fn of(photo: &Image<LinearRgb>, tone: Tone, levels: usize) -> Self {
        let pictures = match tone {
            Tone::Channels => {
                vec![root(photo, [1.0, 0.0, 0.0]), root(photo, [0.0, 1.0, 0.0]), root(photo, [0.0, 0.0, 1.0])]
            }
            Tone::Grey(weights) => vec![root(photo, weights)],
        };
        let bands: Vec<_> = pictures.into_iter().map(|picture| channel_bands(picture, levels)).collect();
        let (first, last): (Vec<_>, Vec<_>) = bands.into_iter().unzip();
        Self { first: length(first), last: length(last) }
    }
}

/// Weighted mean of the square roots of the channels.
///
/// The square root makes the shot noise of a sensor the same everywhere (the transform of Anscombe without its offset)
/// and is near to what a display-encoded picture holds. Equal weights keep a blue screen from going black, which
/// luminance would do.
pub(super) fn root(photo: &Image<LinearRgb>, weights: [f32; 3]) -> Image<Coverage> {
    let sum: f32 = weights.iter().sum();
    let [r, g, b] = weights.map(|w| w / sum);
    photo.map(|p| {
        let root = p.map(|v| v.max(0.0).sqrt());
        Coverage(r * root.r + g * root.g + b * root.b)
    })
}

/// Magnitudes of the first and last band of one picture, in units of noise.
fn channel_bands(picture: Image<Coverage>, levels: usize) -> (Image<Coverage>, Image<Coverage>) {
    let mut sizes = Vec::new();
    let mut smooth = picture;
    let (mut first, mut last) = (Image::default(), Image::default());
    for level in 1..=levels {
        let coarse = filter::reduce(&smooth);
        let expanded = filter::expand(&coarse, smooth.width(), smooth.height());
        let band = || smooth.zip_map(&expanded, |a, b| Coverage((a.0 - b.0).abs()));
        if level == 1 {
            first = in_noise_units(band());
        }
        if level == levels {
            last = spread(&in_noise_units(band()));
        }
        sizes.push(smooth.size());
        smooth = coarse;
    }
    let finer = sizes.iter().rev().skip(1);
    (first, finer.fold(last, |picture, &(w, h)| filter::expand(&picture, w, h)))
}

/// The largest of the 3 x 3 values around each pixel: a band passes through 0 on the very edge that it tells of.
fn spread(band: &Image<Coverage>) -> Image<Coverage> {
    Image::from_fn(band.width(), band.height(), |x, y| largest_around(band, x, y, 1))
}

/// The largest value at most `reach` columns and rows away.
pub(super) fn largest_around(band: &Image<Coverage>, x: usize, y: usize, reach: usize) -> Coverage {
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(band.width());
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(band.height());
    let values = rows.flat_map(|v| &band.row(v)[columns.clone()]);
    Coverage(values.fold(0.0, |largest, c| c.0.max(largest)))
}

/// Root of the sum of squares.
fn length(bands: Vec<Image<Coverage>>) -> Image<Coverage> {
    let squares = bands.into_iter().map(|band| band.map(|c| Coverage(c.0 * c.0)));
    let sum = squares.reduce(|a, b| a.zip_map(&b, |a, b| Coverage(a.0 + b.0)));
    sum.unwrap_or_default().map(|c| Coverage(c.0.sqrt()))
}

/// Width of the frame along the border that shows the background, as a share of the longer side.
const FRAME: f64 = 1.0 / 24.0;
/// Share of the frame that the noise is read from: an object may cover almost three quarters of it.
const QUIET: f64 = 0.25;
/// The magnitude below which a quarter of a normal variate of deviation 1 lies.
const QUIET_OF_NORMAL: f32 = 0.318_64;
/// Least noise: the rounding of an 8-bit picture, one step over the square root of 12.
const ROUNDING: f32 = 1.0 / 255.0 / 3.464;

fn in_noise_units(magnitudes: Image<Coverage>) -> Image<Coverage> {
    let noise = noise(&magnitudes);
    magnitudes.map(|c| Coverage(c.0 / noise))
}

/// Standard deviation of a band on the background, robust against an object that reaches into the frame.
///
/// # Method
/// As the median absolute deviation, but from the lower quartile and along the border of the picture, where an object
/// is not: `quartile / 0.3186` for normal noise.
fn noise(magnitudes: &Image<Coverage>) -> f32 {
    let (w, h) = magnitudes.size();
    let frame = ((w.max(h) as f64 * FRAME) as usize).max(1);
    let on_frame = |x: usize, y: usize| x < frame || y < frame || x + frame >= w || y + frame >= h;
    let rows = magnitudes.rows().enumerate();
    let pixels = rows.flat_map(|(y, row)| row.iter().enumerate().filter(move |(x, _)| on_frame(*x, y)));
    let mut values: Vec<f32> = pixels.map(|(_, c)| c.0).collect();
    let rank = (values.len() as f64 * QUIET) as usize;
    if rank >= values.len() {
        return ROUNDING;
    }
    let (_, quartile, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (*quartile / QUIET_OF_NORMAL).max(ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Normal numbers, as the sum of 12 uniform ones.
    fn normal(rng: &mut rand_chacha::ChaCha8Rng) -> f32 {
        (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0
    }

    fn noisy(size: usize, sigma: f32) -> Image<Coverage> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        Image::from_vec(size, size, (0..size * size).map(|_| Coverage((sigma * normal(&mut rng)).abs())).collect())
    }

    #[test]
    fn noise_is_the_standard_deviation_of_normal_noise() {
        let measured = noise(&noisy(200, 0.02));
        assert!((measured / 0.02 - 1.0).abs() < 0.05, "{measured}");
    }

    #[test]
    fn noise_does_not_see_an_object_even_at_two_borders() {
        let quiet = noisy(200, 0.02);
        let busy = Image::from_fn(200, 200, |x, y| if x < 90 || y < 50 { Coverage(0.5) } else { quiet[(x, y)] });
        // Two thirds of the frame are covered: the lower quartile is then the 0.76 quantile of the noise, 3.7 times its own.
        assert!(noise(&busy) < 4.0 * noise(&quiet));
    }

    #[test]
    fn a_constant_has_no_bands() {
        let bands = Bands::of(&Image::filled(40, 33, LinearRgb::new(0.2, 0.7, 0.1)), Tone::Channels, 4);
        assert!(bands.first.pixels().iter().chain(bands.last.pixels()).all(|c| c.0 < 0.01));
    }

    #[test]
    fn channels_see_what_grey_does_not() {
        let photo = Image::from_fn(64, 64, |x, _| {
            if x < 32 { LinearRgb::new(0.25, 0.04, 0.0) } else { LinearRgb::new(0.04, 0.25, 0.0) }
        });
        let seen = |tone| Bands::of(&photo, tone, 4).first[(32, 32)].0;
        assert!(seen(Tone::Grey([1.0; 3])) < 0.01 && seen(Tone::Channels) > 50.0);
    }
}
