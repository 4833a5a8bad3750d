//! Bands of a Laplacian pyramid, in units of their noise.

use crate::error::Result;
use crate::filter;
use crate::image::Image;
use crate::matte::arrays::dot;
use crate::matte::check::check_value;
use crate::matte::prepared::square_root;
use crate::pixel::LinearRgb;
use crate::quantile::{median, quantile};
use serde::{Deserialize, Serialize};
use std::iter;

/// What the pyramid is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LumaMode {
    /// Each channel by itself: sees a red cap on a blue screen of the same grey.
    #[default]
    Channels,
    /// One grey picture, as the paper has it, with these weights of red, green and blue.
    Grey([f32; 3]),
}

impl LumaMode {
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) (`tone.grey`) for weights that cannot be right.
    pub(super) fn check(self) -> Result<()> {
        let Self::Grey(weights) = self else {
            return Ok(());
        };
        check_value(are_weights(weights), "tone.grey", || {
            format!("{weights:?}, expected weights of 0 to 1e6, not all 0")
        })
    }

    /// The weights of red, green and blue in each picture.
    fn weights(self) -> Vec<[f32; 3]> {
        match self {
            Self::Channels => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Grey(weights) => vec![weights],
        }
    }
}

fn are_weights(weights: [f32; 3]) -> bool {
    weights.iter().all(|w| (0.0..=1e6).contains(w)) && weights != [0.0; 3]
}

/// The bands of a photo, in units of noise.
pub(super) struct Bands {
    /// What is finer than about 2 pixels, of the photo's size.
    pub(super) finest: Image<f32>,
    /// The other bands, each of its own size, from the second one.
    coarser: Vec<Image<f32>>,
}

impl Bands {
    /// Splits a photo into `count` bands.
    pub(super) fn new(photo: &Image<LinearRgb>, luma: LumaMode, count: usize) -> Self {
        let mut channels: Vec<_> = luma
            .weights()
            .into_iter()
            .map(|weights| band_magnitudes(luma_root(photo, weights), count).into_iter())
            .collect();
        let mut bands = (0..count)
            .map(|_| in_units_of_noise(channels.iter_mut().filter_map(Iterator::next).collect()));
        Self {
            finest: bands.next().unwrap_or_default(),
            coarser: bands.map(|band| filter::largest_around(&band, 1)).collect(),
        }
    }

    /// What is about `2^level` pixels wide, brought to the photo's size; `level` is 2 or more.
    ///
    /// Each pixel holds the largest of the 3 x 3 values around it: a band passes through 0 on the
    /// very edge that it shows.
    pub(super) fn at_full_size(&self, level: usize) -> Image<f32> {
        let (finer, band) = (&self.coarser[..level - 2], self.coarser[level - 2].clone());
        let finer = iter::once(&self.finest).chain(finer).rev();
        finer.fold(band, |picture, finer| {
            filter::expand(&picture, finer.width(), finer.height())
        })
    }
}

/// Weighted mean of the square roots of the channels.
///
/// The square root makes the shot noise of a sensor the same everywhere (the transform of Anscombe
/// without its offset) and is near to what a display-encoded picture holds. Equal weights keep a
/// blue screen from going black, which luminance would do.
pub(super) fn luma_root(photo: &Image<LinearRgb>, weights: [f32; 3]) -> Image<f32> {
    let sum: f32 = weights.iter().sum();
    let shares = weights.map(|w| w / sum);
    photo.map(|p| dot(shares, square_root(p).channels()))
}

/// Magnitudes of the bands of one picture, each of its own size.
fn band_magnitudes(picture: Image<f32>, count: usize) -> Vec<Image<f32>> {
    let mut smooth = picture;
    let mut bands = Vec::with_capacity(count);
    for _ in 0..count {
        let coarse = filter::reduce(&smooth);
        let expanded = filter::expand(&coarse, smooth.width(), smooth.height());
        bands.push(smooth.zip_map(&expanded, |a, b| (a - b).abs()));
        smooth = coarse;
    }
    bands
}

/// The bands of some channels as one, in units of noise: root of the sum of squares.
///
/// No channel counts as less noisy than half their median: square roots have the same shot noise in
/// all of them, and one that seems to have none is clipped.
fn in_units_of_noise(bands: Vec<Image<f32>>) -> Image<f32> {
    let noises: Vec<f32> = bands.iter().map(noise_sigma).collect();
    let typical = median(noises.iter().copied(), f32::total_cmp).unwrap_or(ROUNDING_SIGMA);
    let least = 0.5 * typical;
    let squares = bands
        .iter()
        .zip(&noises)
        .map(|(band, noise)| squared_in_units(band, noise.max(least)));
    squares
        .reduce(|a, b| a.zip_map(&b, |a, b| a + b))
        .unwrap_or_default()
        .map(f32::sqrt)
}

fn squared_in_units(band: &Image<f32>, noise: f32) -> Image<f32> {
    let unit = 1.0 / noise;
    band.map(|v| (v * unit) * (v * unit))
}

/// Width of the frame along the border that shows the background, as a share of the longer side.
const FRAME_WIDTH: f64 = 1.0 / 24.0;
/// Share of the frame that the noise is read from: an object may cover almost three quarters of it.
const QUIET_SHARE: f64 = 0.25;
/// The magnitude below which a quarter of a normal variate of deviation 1 lies.
const QUARTILE_OF_NORMAL: f32 = 0.318_64;
/// Least noise: the rounding of an 8-bit picture, one step over the square root of 12.
const ROUNDING_SIGMA: f32 = 1.0 / 255.0 / 3.464;

/// Standard deviation of a band on the background, robust against an object that reaches into the
/// frame.
///
/// # Method
/// As the median absolute deviation, but from the lower quartile and along the border of the
/// picture, where an object is not: `quartile / 0.3186` for normal noise.
fn noise_sigma(magnitudes: &Image<f32>) -> f32 {
    let quartile = quantile(frame_values(magnitudes), QUIET_SHARE, f32::total_cmp);
    quartile.map_or(ROUNDING_SIGMA, |quartile| {
        (quartile / QUARTILE_OF_NORMAL).max(ROUNDING_SIGMA)
    })
}

/// The values in a frame along the border.
fn frame_values(image: &Image<f32>) -> Vec<f32> {
    let (w, h) = image.size();
    let frame = ((w.max(h) as f64 * FRAME_WIDTH) as usize).max(1);
    let mut values = Vec::new();
    for (y, row) in image.rows().enumerate() {
        if y < frame || y + frame >= h {
            values.extend_from_slice(row);
        } else {
            push_ends(&mut values, row, frame);
        }
    }
    values
}

/// Adds the first and the last `count` values of a row, each once.
fn push_ends(values: &mut Vec<f32>, row: &[f32], count: usize) {
    let left = count.min(row.len());
    let right = row.len().saturating_sub(count).max(left);
    values.extend_from_slice(&row[..left]);
    values.extend_from_slice(&row[right..]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// Normal numbers, as the sum of 12 uniform ones.
    fn normal(rng: &mut rand_chacha::ChaCha8Rng) -> f32 {
        (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0
    }

    fn noisy(size: usize, sigma: f32) -> Image<f32> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        Image::from_vec(
            size,
            size,
            (0..size * size)
                .map(|_| (sigma * normal(&mut rng)).abs())
                .collect(),
        )
    }

    #[test]
    fn noise_is_the_standard_deviation_of_normal_noise() {
        let measured = noise_sigma(&noisy(200, 0.02));
        assert!((measured / 0.02 - 1.0).abs() < 0.05, "{measured}");
    }

    #[test]
    fn noise_does_not_see_an_object_even_at_two_borders() {
        let quiet = noisy(200, 0.02);
        let busy = Image::from_fn(
            200,
            200,
            |x, y| {
                if x < 90 || y < 50 { 0.5 } else { quiet[(x, y)] }
            },
        );
        // Two thirds of the frame are covered: the lower quartile is then the 0.76 quantile of the
        // noise, 3.7 times its own.
        assert!(noise_sigma(&busy) < 4.0 * noise_sigma(&quiet));
    }

    #[test]
    fn a_constant_has_no_bands() {
        let bands = Bands::new(
            &Image::filled(40, 33, LinearRgb::new(0.2, 0.7, 0.1)),
            LumaMode::Channels,
            4,
        );
        assert!(
            bands
                .finest
                .pixels()
                .iter()
                .chain(bands.at_full_size(4).pixels())
                .all(|v| *v < 0.01)
        );
    }

    #[test]
    fn channels_see_what_grey_does_not() {
        let photo = Image::from_fn(64, 64, |x, _| {
            if x < 32 {
                LinearRgb::new(0.25, 0.04, 0.0)
            } else {
                LinearRgb::new(0.04, 0.25, 0.0)
            }
        });
        let seen = |luma| Bands::new(&photo, luma, 4).finest[(32, 32)];
        assert!(seen(LumaMode::Grey([1.0; 3])) < 0.01 && seen(LumaMode::Channels) > 50.0);
    }
}
