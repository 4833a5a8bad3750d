//! The plastic of an object whose transmittance is known in some channels: what it is in the
//! others.

use super::lines::{PixelLines, opaque_pixels};
use crate::image::Image;
use crate::matte::film::tint;
use crate::pixel::Coverage;
use crate::quantile::median;

/// Pixels that are sampled.
const DYE_SAMPLES: usize = 400;
/// Standard deviation of a pixel's transmittance around flat plastic of another thickness, beside
/// its noise.
const SCATTER_SIGMA: f32 = 0.04;
/// Misfit by which a dye must be better than clear plastic; as in [`tint`], where less is known.
const DYE_HANDICAP: f32 = 0.4;
/// Weight of thickness: the misfit of plastic that is twice as see-through as it should be.
const THICKNESS_WEIGHT: f32 = 1.0;

/// Transmittance per channel of flat plastic with the dye, or none, that explains the determined
/// channels best: by the median over the clearer half of the object of how far a pixel is from that
/// plastic times any factor.
pub(super) fn fit(
    pixels: &Image<PixelLines>,
    inside: &Image<Coverage>,
    determined: [bool; 3],
) -> [f32; 3] {
    let samples = DyeSamples {
        pixels: clearer_half(pixels, inside, determined),
        determined,
    };
    let clear = [tint::CLEAR_TRANSMITTANCE; 3];
    let mut best = (samples.misfit(clear, 0.0), clear);
    for flat in tint::dyed() {
        let misfit = samples.misfit(flat, DYE_HANDICAP);
        if misfit < best.0 {
            best = (misfit, flat);
        }
    }
    best.1
}

/// Some pixels of the object that are at least as clear as its median one: plastic, if it has any.
fn clearer_half(
    pixels: &Image<PixelLines>,
    inside: &Image<Coverage>,
    determined: [bool; 3],
) -> Vec<PixelLines> {
    let values = opaque_pixels(pixels, inside).map(|p| clearness(p, determined));
    let Some(middle) = median(values, f32::total_cmp) else {
        return Vec::new();
    };
    let clear: Vec<&PixelLines> = opaque_pixels(pixels, inside)
        .filter(|p| clearness(p, determined) >= middle)
        .collect();
    let step = (clear.len() / DYE_SAMPLES).max(1);
    clear.into_iter().step_by(step).copied().collect()
}

/// Sum of the determined channels' transmittances.
fn clearness(pixel: &PixelLines, determined: [bool; 3]) -> f32 {
    channels(determined).map(|c| pixel.slope(c)).sum()
}

fn channels(determined: [bool; 3]) -> impl Iterator<Item = usize> {
    (0..3).filter(move |&c| determined[c])
}

/// The pixels that show a dye.
struct DyeSamples {
    pixels: Vec<PixelLines>,
    determined: [bool; 3],
}

impl DyeSamples {
    /// Median misfit of plastic in standard deviations squared, and what its thickness and a
    /// handicap add.
    fn misfit(&self, flat: [f32; 3], handicap: f32) -> f32 {
        let fits = self.pixels.iter().map(|pixel| self.explained(pixel, flat));
        let (misfits, factors): (Vec<f32>, Vec<f32>) = fits.unzip();
        let thickness = median(factors.into_iter(), f32::total_cmp).unwrap_or(1.0);
        let misfit = median(misfits.into_iter(), f32::total_cmp).unwrap_or(0.0);
        misfit + THICKNESS_WEIGHT * (thickness - 1.0).powi(2) + handicap
    }

    /// Times that a pixel is as see-through as flat plastic.
    #[inline]
    fn thickness_factor(&self, pixel: &PixelLines, flat: [f32; 3]) -> f32 {
        let (mut over, mut under) = (0.0, 0.0);
        for c in channels(self.determined) {
            over += weight(pixel, c) * pixel.slope(c) * flat[c];
            under += weight(pixel, c) * flat[c] * flat[c];
        }
        (over / under.max(f32::MIN_POSITIVE)).max(0.0)
    }

    /// Squared misfit of a pixel in standard deviations, and its factor of thickness.
    fn explained(&self, pixel: &PixelLines, flat: [f32; 3]) -> (f32, f32) {
        let factor = self.thickness_factor(pixel, flat);
        let misfit = channels(self.determined)
            .map(|c| weight(pixel, c) * (pixel.slope(c) - factor * flat[c]).powi(2))
            .sum();
        (misfit, factor)
    }
}

fn weight(pixel: &PixelLines, channel: usize) -> f32 {
    1.0 / (pixel.sigma(channel).powi(2) + SCATTER_SIGMA * SCATTER_SIGMA)
}
