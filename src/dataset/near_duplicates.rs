//! Images that look like others.

use crate::color::to_srgb8;
use crate::error::Result;
use crate::filter::resize;
use crate::image::Image;
use crate::io;
use crate::pixel::{LinearRgb, Srgb8};
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

/// Images that differ by less than this, in 8-bit grey values, are nearly the same: photos of a
/// scene that nobody touched differ by noise, which the small copies average to below one code; an
/// object of 1 % of the picture and a tenth of the full scale of contrast, moved, changes it by 3.
pub const NEAR_DUPLICATE_RMS: f64 = 2.0;

/// Sides of the small copies, pixels.
const THUMBNAIL_PX: [usize; 2] = [32, 24];

/// The small grey copy of a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Thumbnail(Vec<u8>);

impl Thumbnail {
    pub(crate) fn new(picture: &Image<LinearRgb>) -> Self {
        let [width, height] = THUMBNAIL_PX;
        let small = to_srgb8(&resize(picture, width, height));
        Self(small.pixels().iter().map(grey_code).collect())
    }

    /// Root mean square difference, 8-bit codes.
    fn codes_from(&self, other: &Self) -> f64 {
        (squared_error(&self.0, &other.0) as f64 / self.0.len().max(1) as f64).sqrt()
    }

    /// Sum of squared differences where it is below a limit; most pairs are beyond it after a row.
    fn squared_error_below(&self, limit: u64, other: &Self) -> Option<u64> {
        let [width, _] = THUMBNAIL_PX;
        let mut rows = self.0.chunks(width).zip(other.0.chunks(width));
        rows.try_fold(0, |sum, (a, b)| {
            Some(sum + squared_error(a, b)).filter(|sum| *sum < limit)
        })
    }

    /// The place of the nearest in a list, the first of those as near, and how far it is.
    fn nearest_within(&self, all: &[Self], codes: f64) -> Option<(usize, f64)> {
        let mut limit = ((self.0.len() as f64 * codes * codes) as u64).saturating_add(1);
        let mut nearest = None;
        for (i, other) in all.iter().enumerate() {
            if let Some(error) = self.squared_error_below(limit, other) {
                (nearest, limit) = (Some(i), error);
            }
        }
        let place = nearest?;
        Some((place, self.codes_from(&all[place]))).filter(|(_, distance)| *distance < codes)
    }
}

/// For each of `val` the nearest of `train`, as places in the lists, where it is nearer than
/// `codes`.
pub(crate) fn nearest(
    train: &[Thumbnail],
    val: &[Thumbnail],
    codes: f64,
) -> Vec<(usize, usize, f64)> {
    val.par_iter()
        .enumerate()
        .filter_map(|(i, own)| {
            let (j, distance) = own.nearest_within(train, codes)?;
            Some((i, j, distance))
        })
        .collect()
}

/// The images of `val` that are nearly the same as one of `train`.
pub(crate) fn near_pairs(
    train: &[PathBuf],
    val: &[PathBuf],
    codes: f64,
) -> Result<Vec<NearDuplicate>> {
    let pairs = nearest(&thumbnails(train)?, &thumbnails(val)?, codes);
    let duplicates = pairs.into_iter().map(|(i, j, codes)| NearDuplicate {
        val: val[i].clone(),
        train: train[j].clone(),
        codes,
    });
    Ok(duplicates.collect())
}

fn thumbnails(images: &[PathBuf]) -> Result<Vec<Thumbnail>> {
    images
        .par_iter()
        .map(|path| Ok(Thumbnail::new(&io::read::<LinearRgb>(path)?)))
        .collect()
}

fn grey_code(p: &Srgb8) -> u8 {
    ((u16::from(p.r) + 2 * u16::from(p.g) + u16::from(p.b)) / 4) as u8
}

#[inline]
fn squared_error(a: &[u8], b: &[u8]) -> u64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| squared_difference(*a, *b)).sum()
}

#[inline]
fn squared_difference(a: u8, b: u8) -> u64 {
    u64::from(a.abs_diff(b)).pow(2)
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

    #[test]
    fn the_nearest_is_that_of_comparing_all() {
        let own = scene(0, 0.0);
        let noises = [0.0, 0.3, 0.1, 0.2, 0.1];
        let all: Vec<_> = (0..5).map(|i| scene(i % 2 * 60, noises[i])).collect();
        for first in 0..all.len() {
            let others = &all[first..];
            let distances = others.iter().map(|other| own.codes_from(other)).enumerate();
            let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
            for codes in [0.0, 0.5, NEAR_DUPLICATE_RMS, f64::INFINITY] {
                let expected = nearest.filter(|(_, distance)| *distance < codes);
                assert_eq!(own.nearest_within(others, codes), expected);
            }
        }
    }
}
