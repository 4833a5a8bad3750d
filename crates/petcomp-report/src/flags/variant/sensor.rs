//! Effects of a sensor and of encoding: noise and codes.

use crate::matte::normal;
use petcomp::color::{decode_srgb8, encode_srgb8};
use petcomp::io::{self, Chroma};
use petcomp::{Image, LinearRgb};

/// The photo with noise of a standard deviation.
pub(super) fn noisy(photo: &Image<LinearRgb>, sigma: f32, seed: u64) -> Image<LinearRgb> {
    let mut draw = normal(seed);
    let mut noisy = photo.clone();
    for p in noisy.pixels_mut() {
        *p = p.map(|v| v + sigma * draw() as f32);
    }
    noisy
}

/// The photo after JPEG compression with a quality; none if it cannot be a JPEG.
pub(super) fn jpeg(photo: &Image<LinearRgb>, quality: u8) -> Option<Image<LinearRgb>> {
    let codes = io::through_jpeg(&photo.map(encode_srgb8), quality, Chroma::Full)?;
    Some(codes.map(decode_srgb8))
}
