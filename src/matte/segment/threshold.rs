//! Where to cut a picture of magnitudes in two.

use crate::image::Image;
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
    /// The value to cut a band at, in units of noise.
    pub(super) fn of(self, band: &Image<f32>) -> f32 {
        match self {
            Self::Otsu => otsu(band),
            Self::Noise(times) => times,
        }
    }
}

/// Bins of the histogram that Otsu's threshold is found in.
const BINS: usize = 256;

/// The value that maximises the variance between the two groups it makes; the largest one where all is noise.
///
/// # Method
/// [Otsu 1979], on 256 equal bins of the *logarithm*, from the noise (1) to the largest magnitude. Edges of clear
/// plastic and highlights differ by a factor of a hundred; on a linear scale the threshold falls between those two
/// instead of between edges and background.
///
/// [Otsu 1979]: https://doi.org/10.1109/TSMC.1979.4310076
fn otsu(band: &Image<f32>) -> f32 {
    let largest = band.pixels().iter().copied().fold(0.0, f32::max);
    let span = libm::logf(largest.max(1.0));
    if span <= 0.0 {
        return largest;
    }
    let mut histogram = [0u64; BINS];
    for c in band.pixels() {
        let bin = (libm::logf(c.max(1.0)) / span * BINS as f32) as usize;
        histogram[bin.min(BINS - 1)] += 1;
    }
    libm::expf((best_split(&histogram) + 1) as f32 / BINS as f32 * span)
}

/// Last bin of the lower group.
fn best_split(histogram: &[u64; BINS]) -> usize {
    let count: u64 = histogram.iter().sum();
    let total: u64 = histogram
        .iter()
        .zip(0..)
        .map(|(n, bin): (_, u64)| n * bin)
        .sum();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn otsu_cuts_between_two_groups() {
        let img = Image::from_fn(40, 10, |x, _| if x < 30 { 2.0 } else { 80.0 });
        let cut = Threshold::Otsu.of(&img);
        assert!(cut > 2.0 && cut < 80.0, "{cut}");
    }

    #[test]
    fn highlights_do_not_hide_faint_edges() {
        let img = Image::from_fn(100, 10, |x, _| {
            [2.0, 20.0, 900.0][usize::from(x >= 70) + usize::from(x >= 95)]
        });
        let cut = Threshold::Otsu.of(&img);
        assert!(cut > 2.0 && cut < 20.0, "{cut}");
    }

    #[test]
    fn nothing_is_above_the_cut_of_noise() {
        for level in [0.0, 0.5, 1.0] {
            assert!(Threshold::Otsu.of(&Image::filled(4, 4, level)) >= level);
        }
        assert_eq!(Threshold::Otsu.of(&Image::new(0, 4)), 0.0);
    }
}
