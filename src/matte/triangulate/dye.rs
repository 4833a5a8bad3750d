//! The plastic of an object whose transmittance is known in some channels: what it is in the
//! others.

use super::lines::{FlatPlastic, PixelLines, opaque_pixels};
use crate::image::Image;
use crate::matte::film::tint::{self, DYE_HANDICAP, THICKNESS_WEIGHT};
use crate::pixel::Coverage;
use crate::quantile::median;
use std::iter;

/// Pixels that are sampled.
const DYE_SAMPLES: usize = 400;
/// Standard deviation of a pixel's transmittance around flat plastic of another thickness, beside
/// its noise.
const SCATTER_SIGMA: f32 = 0.04;
/// From this difference of what they let through on, two dyes are not amounts of one.
const MIN_SPREAD: f32 = 0.2;

/// Flat plastic with the dye, or none, that explains the determined channels best: by the median
/// over the clearer half of the object of how far a pixel is from that plastic times any factor.
pub(super) fn fit(
    pixels: &Image<PixelLines>,
    inside: &Image<Coverage>,
    determined: [bool; 3],
) -> FlatPlastic {
    let samples = DyeSamples {
        pixels: clearer_half(pixels, inside, determined),
        determined,
    };
    let clear = samples.tried([tint::CLEAR_TRANSMITTANCE; 3], 0.0);
    let dyed = tint::dyed().map(|flat| samples.tried(flat, DYE_HANDICAP));
    let tried: Vec<TriedDye> = iter::once(clear).chain(dyed).collect();
    let better = |a: &&TriedDye, b: &&TriedDye| a.total().total_cmp(&b.total());
    let best = tried.iter().min_by(better).unwrap_or(&clear);
    FlatPlastic {
        transmittance: best.flat,
        spread: best.spread(&tried),
    }
}

/// A dye, and how it explains the object.
#[derive(Clone, Copy)]
struct TriedDye {
    flat: [f32; 3],
    /// Median misfit of plastic of any thickness in standard deviations squared.
    misfit: f32,
    /// Times that the object is as see-through as flat plastic.
    thickness: f32,
    handicap: f32,
}

impl TriedDye {
    /// Misfit, and what its thickness and a handicap add.
    fn total(&self) -> f32 {
        self.misfit + THICKNESS_WEIGHT * (self.thickness - 1.0).powi(2) + self.handicap
    }

    /// How far dyes that explain the object as well in another thickness differ from flat plastic
    /// of this one: brown plastic of one wall and green of two let as much green and blue through.
    fn spread(&self, tried: &[Self]) -> [f32; 3] {
        let misfits = tried.iter().map(|dye| dye.misfit);
        let least = misfits.fold(f32::INFINITY, f32::min);
        let alike = tried
            .iter()
            .filter(|dye| dye.misfit <= least + DYE_HANDICAP);
        let off = alike.fold([0.0_f32; 3], |off, dye| {
            [0, 1, 2].map(|c| off[c].max((dye.seen(c) - self.seen(c)).abs()))
        });
        off.map(|off| {
            if off < MIN_SPREAD {
                0.0
            } else {
                off / self.thickness
            }
        })
    }

    /// What the object lets through in a channel.
    fn seen(&self, channel: usize) -> f32 {
        (self.thickness * self.flat[channel]).min(1.0)
    }
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
    fn tried(&self, flat: [f32; 3], handicap: f32) -> TriedDye {
        let fits = self.pixels.iter().map(|pixel| self.explained(pixel, flat));
        let (misfits, factors): (Vec<f32>, Vec<f32>) = fits.unzip();
        TriedDye {
            flat,
            misfit: median(misfits.into_iter(), f32::total_cmp).unwrap_or(0.0),
            thickness: median(factors.into_iter(), f32::total_cmp).unwrap_or(1.0),
            handicap,
        }
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
