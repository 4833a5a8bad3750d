//! The plastic of an object whose transmittance is known in some channels: what it is in the others.

use super::lines::{Pixel, median};
use crate::image::Image;
use crate::matte::film::tint;
use crate::pixel::Coverage;

/// Pixels that are asked.
const ASKED: usize = 400;
/// Standard deviation of a pixel's transmittance around flat plastic of another thickness, beside its noise.
const SCATTER: f32 = 0.04;
/// Misfit by which a dye must be better than clear plastic; as in [`tint`], where less is known.
const DYED: f32 = 0.4;
/// Weight of thickness: misfit that plastic twice as see-through as it should be counts for.
const THICKNESS: f32 = 1.0;

/// Transmittance per channel of flat plastic with the dye, or none, that explains the determined channels best: by the
/// median over the clearer half of the object of how far a pixel is from that plastic times any factor.
pub(super) fn told(
    pixels: &Image<Pixel>,
    inside: &Image<Coverage>,
    determined: [bool; 3],
) -> [f32; 3] {
    let asked = clearer(pixels, inside, determined);
    let judged = |flat: [f32; 3], handicap: f32| {
        let fits: Vec<(f32, f32)> = asked
            .iter()
            .map(|pixel| explained(pixel, flat, determined))
            .collect();
        let thickness = median(fits.iter().map(|fit| fit.1)).unwrap_or(1.0);
        let misfit = median(fits.iter().map(|fit| fit.0)).unwrap_or(0.0);
        (
            misfit + THICKNESS * (thickness - 1.0).powi(2) + handicap,
            flat,
        )
    };
    let clear = judged([tint::CLEAR; 3], 0.0);
    let dyed = tint::dyed().map(|flat| judged(flat, DYED));
    dyed.fold(
        clear,
        |best, next| if next.0 < best.0 { next } else { best },
    )
    .1
}

/// Some pixels of the object that are at least as clear as its median one: plastic, if it has any.
fn clearer(pixels: &Image<Pixel>, inside: &Image<Coverage>, determined: [bool; 3]) -> Vec<Pixel> {
    let mean = |p: &Pixel| {
        (0..3)
            .filter(|&c| determined[c])
            .map(|c| p.slope(c))
            .sum::<f32>()
    };
    let object = || {
        pixels
            .pixels()
            .iter()
            .zip(inside.pixels())
            .filter(|(_, c)| c.0 >= tint::OPAQUE)
            .map(|(p, _)| p)
    };
    let Some(middle) = median(object().map(mean)) else {
        return Vec::new();
    };
    let clear: Vec<&Pixel> = object().filter(|p| mean(p) >= middle).collect();
    clear
        .iter()
        .step_by((clear.len() / ASKED).max(1))
        .map(|p| **p)
        .collect()
}

/// Squared misfit of a pixel in standard deviations, and its factor of thickness.
fn explained(pixel: &Pixel, flat: [f32; 3], determined: [bool; 3]) -> (f32, f32) {
    let channels = || (0..3).filter(|&c| determined[c]);
    let weight = |c: usize| 1.0 / (pixel.sigma(c).powi(2) + SCATTER * SCATTER);
    let over: f32 = channels()
        .map(|c| weight(c) * pixel.slope(c) * flat[c])
        .sum();
    let under: f32 = channels().map(|c| weight(c) * flat[c] * flat[c]).sum();
    let factor = (over / under.max(f32::MIN_POSITIVE)).max(0.0);
    let misfit = channels()
        .map(|c| weight(c) * (pixel.slope(c) - factor * flat[c]).powi(2))
        .sum();
    (misfit, factor)
}
