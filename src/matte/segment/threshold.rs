//! Where to cut a picture of magnitudes in two.

use crate::image::Image;
use crate::pixel::Coverage;
use serde::{Deserialize, Serialize};

/// How a picture of magnitudes is binarised.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Threshold {
    /// The value that best separates the histogram into two groups (Otsu).
    Otsu,
    /// This many times the noise of the picture, see [`noise`].
    Noise(f32),
    /// This value.
    Value(f32),
}

impl Threshold {
    /// The value to cut at.
    pub(super) fn of(self, magnitudes: &Image<Coverage>) -> f32 {
        match self {
            Self::Otsu => otsu(magnitudes),
            Self::Noise(times) => times * noise(magnitudes),
            Self::Value(value) => value,
        }
    }
}

/// Bins of the histogram that Otsu's threshold is found in.
const BINS: usize = 256;

/// The value that maximises the variance between the two groups it makes.
///
/// # Method
/// [Otsu 1979], on 256 equal bins from 0 to the largest magnitude.
///
/// [Otsu 1979]: https://doi.org/10.1109/TSMC.1979.4310076
fn otsu(magnitudes: &Image<Coverage>) -> f32 {
    let largest = magnitudes.pixels().iter().map(|c| c.0).fold(0.0, f32::max);
    if largest <= 0.0 {
        return 0.0;
    }
    let mut histogram = [0u64; BINS];
    for c in magnitudes.pixels() {
        let bin = (c.0 / largest * BINS as f32) as usize;
        histogram[bin.min(BINS - 1)] += 1;
    }
    (best_split(&histogram) + 1) as f32 / BINS as f32 * largest
}

/// Last bin of the lower group.
fn best_split(histogram: &[u64; BINS]) -> usize {
    let moment = |(i, n): (usize, &u64)| i as u64 * n;
    let count: u64 = histogram.iter().sum();
    let total: u64 = histogram.iter().enumerate().map(moment).sum();
    let (mut below, mut sum, mut best) = (0, 0, (0, -1.0));
    for (bin, &n) in histogram.iter().enumerate() {
        below += n;
        sum += bin as u64 * n;
        let above = count - below;
        if below == 0 || above == 0 {
            continue;
        }
        let step = sum as f64 / below as f64 - (total - sum) as f64 / above as f64;
        let between = below as f64 * above as f64 * step * step;
        if between > best.1 {
            best = (bin, between);
        }
    }
    best.0
}

/// Share of the magnitudes that the noise is read from: an object may cover almost three quarters of the picture.
const QUIET: f64 = 0.25;
/// The magnitude below which a quarter of a normal variate of deviation 1 lies.
const QUIET_OF_NORMAL: f32 = 0.318_64;
/// Least noise: the rounding of an 8-bit picture, one step over the square root of 12.
const ROUNDING: f32 = 1.0 / 255.0 / 3.464;

/// Standard deviation of the noise in a band, robust against the object in the picture.
///
/// # Method
/// As the median absolute deviation, but from the lower quartile: `quartile / 0.3186` for normal noise.
pub(super) fn noise(magnitudes: &Image<Coverage>) -> f32 {
    let mut values: Vec<f32> = magnitudes.pixels().iter().map(|c| c.0).collect();
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

    #[test]
    fn otsu_cuts_between_two_groups() {
        let img = Image::from_fn(40, 10, |x, _| Coverage(if x < 30 { 0.1 } else { 0.8 }));
        let cut = Threshold::Otsu.of(&img);
        assert!(cut > 0.1 && cut <= 0.8, "{cut}");
    }

    #[test]
    fn otsu_of_nothing_is_nothing() {
        assert_eq!(Threshold::Otsu.of(&Image::new(4, 4)), 0.0);
        assert_eq!(Threshold::Otsu.of(&Image::new(0, 4)), 0.0);
    }

    #[test]
    fn noise_does_not_see_an_object() {
        let flat = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 1000) as f32 * 1e-5;
        let quiet = noise(&Image::from_fn(100, 100, |x, y| Coverage(flat(x, y))));
        let busy = noise(&Image::from_fn(100, 100, |x, y| Coverage(if x < 40 { 0.5 } else { flat(x, y) })));
        assert!(busy < 2.0 * quiet, "{busy} against {quiet}");
    }
}
