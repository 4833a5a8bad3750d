//! The threshold of a picture of magnitudes.

use crate::image::{Image, Mask};
use serde::{Deserialize, Serialize};

/// How a band is binarised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Threshold {
    /// The value that best separates the histogram of the logarithms into two groups (Otsu).
    #[default]
    Otsu,
    /// This many times the noise.
    Noise(f32),
}

impl Threshold {
    /// Where a band is above its threshold.
    pub(super) fn binarised(self, band: &Image<f32>) -> Mask {
        let threshold = self.of_band(band);
        band.map(|v| v > threshold)
    }

    /// The threshold of a band, in units of noise.
    pub(super) fn of_band(self, band: &Image<f32>) -> f32 {
        match self {
            Self::Otsu => otsu(band),
            Self::Noise(times) => times,
        }
    }
}

/// Bins of the histogram that Otsu's threshold is found in.
const HISTOGRAM_BINS: usize = 256;

/// The value that maximises the variance between the two groups it makes; the largest one where all
/// is noise.
///
/// # Method
/// [Otsu 1979], on 256 equal bins of the *logarithm*, from the noise (1) to the largest magnitude.
/// Edges of clear plastic and highlights differ by a factor of a hundred; on a linear scale the
/// threshold falls between those two instead of between edges and background.
///
/// [Otsu 1979]: https://doi.org/10.1109/TSMC.1979.4310076
fn otsu(band: &Image<f32>) -> f32 {
    let largest = band.pixels().iter().copied().fold(0.0, f32::max);
    let span = libm::logf(largest.max(1.0));
    if span <= 0.0 {
        return largest;
    }
    let split = best_split(&log_histogram(band, span));
    libm::expf((split + 1) as f32 / HISTOGRAM_BINS as f32 * span)
}

/// How many values have a logarithm in each bin of the span from 0.
fn log_histogram(band: &Image<f32>, span: f32) -> [u64; HISTOGRAM_BINS] {
    let mut histogram = [0; HISTOGRAM_BINS];
    for v in band.pixels() {
        histogram[log_bin(*v, span)] += 1;
    }
    histogram
}

#[inline]
fn log_bin(value: f32, span: f32) -> usize {
    let bin = (libm::logf(value.max(1.0)) / span * HISTOGRAM_BINS as f32) as usize;
    bin.min(HISTOGRAM_BINS - 1)
}

/// Last bin of the lower group.
fn best_split(histogram: &[u64; HISTOGRAM_BINS]) -> usize {
    let count: u64 = histogram.iter().sum();
    let total: u64 = (0..).zip(histogram).map(|(bin, n)| bin * n).sum();
    let (mut below, mut sum) = (0, 0);
    let (mut best_bin, mut most) = (0, -1.0);
    for (bin, &n) in histogram.iter().enumerate() {
        below += n;
        sum += bin as u64 * n;
        let between = variance_between([below, count - below], [sum, total - sum]);
        if between > most {
            (best_bin, most) = (bin, between);
        }
    }
    best_bin
}

/// Variance between two groups with these counts and sums, times the square of the total count;
/// negative where a group is empty.
fn variance_between(counts: [u64; 2], sums: [u64; 2]) -> f64 {
    if counts.contains(&0) {
        return -1.0;
    }
    let [below, above] = counts.map(|n| n as f64);
    let step = sums[0] as f64 / below - sums[1] as f64 / above;
    below * above * step * step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn otsu_cuts_between_two_groups() {
        let img = Image::from_fn(40, 10, |x, _| if x < 30 { 2.0 } else { 80.0 });
        let cut = Threshold::Otsu.of_band(&img);
        assert!(cut > 2.0 && cut < 80.0, "{cut}");
    }

    #[test]
    fn highlights_do_not_hide_faint_edges() {
        let img = Image::from_fn(100, 10, |x, _| {
            [2.0, 20.0, 900.0][usize::from(x >= 70) + usize::from(x >= 95)]
        });
        let cut = Threshold::Otsu.of_band(&img);
        assert!(cut > 2.0 && cut < 20.0, "{cut}");
    }

    #[test]
    fn nothing_is_above_the_cut_of_noise() {
        for level in [0.0, 0.5, 1.0] {
            assert!(Threshold::Otsu.of_band(&Image::filled(4, 4, level)) >= level);
        }
        assert_eq!(Threshold::Otsu.of_band(&Image::new(0, 4)), 0.0);
    }
}
