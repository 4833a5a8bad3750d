//! Images that look like others.

use crate::color::to_srgb8;
use crate::error::Result;
use crate::filter::resize;
use crate::image::Image;
use crate::io;
use crate::pixel::LinearRgb;
use rayon::prelude::*;
use std::path::PathBuf;

/// Two images that are nearly the same.
#[derive(Clone, Debug, PartialEq)]
pub struct NearDuplicate {
    /// The one for validation.
    pub val: PathBuf,
    /// The one for training that it is nearest to.
    pub train: PathBuf,
    /// Root mean square difference of their small copies, 8-bit grey values.
    pub codes: f64,
}

/// Images that differ by less than this, in 8-bit grey values, are nearly the same: photos of a scene that nobody
/// touched differ by noise, which the small copies average to below one code; an object of 1 % of the picture and a tenth
/// of the full scale of contrast, moved, changes it by 3.
pub const NEAR_DUPLICATE_RMS: f64 = 2.0;

/// Sides of the small copies, pixels.
const THUMBNAIL_PX: [usize; 2] = [32, 24];

/// The small grey copy of a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Thumbnail(Vec<u8>);

impl Thumbnail {
    pub(crate) fn new(picture: &Image<LinearRgb>) -> Self {
        let grey =
            |[r, g, b]: [u8; 3]| ((u16::from(r) + 2 * u16::from(g) + u16::from(b)) / 4) as u8;
        Self(
            to_srgb8(&resize(picture, THUMBNAIL_PX[0], THUMBNAIL_PX[1]))
                .pixels()
                .iter()
                .map(|p| grey([p.r, p.g, p.b]))
                .collect(),
        )
    }

    /// Root mean square difference, 8-bit codes.
    fn codes_from(&self, other: &Self) -> f64 {
        let square = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b)).pow(2);
        let sum: u64 = self.0.iter().zip(&other.0).map(square).sum();
        (sum as f64 / self.0.len().max(1) as f64).sqrt()
    }
}

/// For each of `val` the nearest of `train`, as places in the lists, where it is nearer than `codes`.
pub(crate) fn nearest(
    train: &[Thumbnail],
    val: &[Thumbnail],
    codes: f64,
) -> Vec<(usize, usize, f64)> {
    let nearest = |(i, own): (usize, &Thumbnail)| {
        let all = train
            .iter()
            .enumerate()
            .map(|(j, other)| (j, own.codes_from(other)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
            .filter(|(_, d)| *d < codes)
            .map(|(j, d)| (i, j, d))
    };
    val.par_iter().enumerate().filter_map(nearest).collect()
}

/// The images of `val` that are nearly the same as one of `train`.
pub(crate) fn near_pairs(
    train: &[PathBuf],
    val: &[PathBuf],
    codes: f64,
) -> Result<Vec<NearDuplicate>> {
    let small = |images: &[PathBuf]| -> Result<Vec<Thumbnail>> {
        images
            .par_iter()
            .map(|path| Ok(Thumbnail::new(&io::read::<LinearRgb>(path)?)))
            .collect()
    };
    let pair = |(i, j, codes): (usize, usize, f64)| NearDuplicate {
        val: val[i].clone(),
        train: train[j].clone(),
        codes,
    };
    Ok(nearest(&small(train)?, &small(val)?, codes)
        .into_iter()
        .map(pair)
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(shift: usize, noise: f32) -> Thumbnail {
        let of = |x: usize, y: usize| {
            let object = (100 + shift..140 + shift).contains(&x) && (80..120).contains(&y);
            let grain = ((x * 7919 + y * 104_729) % 97) as f32 / 97.0 - 0.5;
            LinearRgb::grey(if object { 0.5 } else { 0.2 } + noise * grain)
        };
        Thumbnail::new(&Image::from_fn(320, 240, of))
    }

    #[test]
    fn noise_is_near_and_a_moved_object_is_not() {
        let scenes = [scene(0, 0.0), scene(0, 0.05), scene(60, 0.0)];
        assert!(scenes[0].codes_from(&scenes[1]) < NEAR_DUPLICATE_RMS);
        assert!(scenes[0].codes_from(&scenes[2]) > 3.0 * NEAR_DUPLICATE_RMS);
        assert_eq!(
            nearest(&scenes[..1], &scenes[1..], NEAR_DUPLICATE_RMS).len(),
            1
        );
    }
}
