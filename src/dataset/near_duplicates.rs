//! Images that look like others.

use crate::color::to_srgb8;
use crate::error::Result;
use crate::eval::{GroundTruth, iou, label_of, yolo_sheet};
use crate::filter::resize;
use crate::image::Image;
use crate::io;
use crate::pixel::{LinearRgb, Srgb8};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Two images that are nearly the same.
#[derive(Clone, Debug, PartialEq)]
pub struct NearDuplicate {
    /// The validation image.
    pub val: PathBuf,
    /// The training image that it is nearest to.
    pub train: PathBuf,
    /// Root mean square difference of their small copies, 8-bit grey values.
    pub codes: f64,
}

/// Images that differ by less than this, in 8-bit grey values, are near-duplicates: photos of an
/// untouched scene differ by noise, which the small copies average to below one code; an object of
/// 1 % of the picture and a tenth of full-scale contrast, moved, changes it by 3. Fainter ones do
/// not, so images whose label files show different contents are not duplicates, unless they differ
/// by less than saving one again costs.
pub const NEAR_DUPLICATE_RMS: f64 = 2.0;

/// Saving a picture again costs less than this, in 8-bit grey values: images nearer than that are
/// the same one, however two people have labelled it.
const SAVED_AGAIN_RMS: f64 = 0.3;

/// Nor does saving change any pixel of a thumbnail by more than this; a small object does.
const SAVED_AGAIN_MOST: u8 = 3;

/// Two boxes around the same thing have more than this IoU.
const MIN_OVERLAP: f64 = 0.5;

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

    /// Greatest difference of a pixel, 8-bit codes.
    fn greatest_error(&self, other: &Self) -> u8 {
        let pairs = self.0.iter().zip(&other.0);
        pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    /// Sum of squared differences where it is below a limit; most pairs are beyond it after a row.
    fn squared_error_below(&self, limit: u64, other: &Self) -> Option<u64> {
        let [width, _] = THUMBNAIL_PX;
        let mut rows = self.0.chunks(width).zip(other.0.chunks(width));
        rows.try_fold(0, |sum, (a, b)| {
            Some(sum + squared_error(a, b)).filter(|sum| *sum < limit)
        })
    }

    /// The squared errors of two that differ by less than `codes` are below this.
    fn squared_error_limit(&self, codes: f64) -> u64 {
        ((self.0.len() as f64 * codes * codes) as u64).saturating_add(1)
    }
}

/// What two images are compared by.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    pub(crate) thumbnail: Thumbnail,
    /// As returned by [`boxes_in`]; none also without a label file.
    pub(crate) boxes: Option<Vec<GroundTruth>>,
}

impl Look {
    fn read(image: &Path) -> Result<Self> {
        let labels = io::read_text(label_of(image)).ok();
        Ok(Self {
            thumbnail: Thumbnail::new(&io::read::<LinearRgb>(image)?),
            boxes: labels.and_then(|text| boxes_in(&text)),
        })
    }

    /// Whether it has a label file without rows.
    fn is_empty(&self) -> bool {
        self.boxes.as_ref().is_some_and(Vec::is_empty)
    }

    /// Index of the nearest image in a list among those that may show the same, the first in case
    /// of a tie, and its distance.
    fn nearest_within(&self, all: &[Self], codes: f64) -> Option<(usize, f64)> {
        let mut limit = self.thumbnail.squared_error_limit(codes);
        let mut nearest = None;
        for (i, other) in all.iter().enumerate() {
            let error = self.thumbnail.squared_error_below(limit, &other.thumbnail);
            if let Some(error) = error.filter(|&error| self.may_show_the_same(other, error)) {
                (nearest, limit) = (Some(i), error);
            }
        }
        let place = nearest?;
        let distance = self.thumbnail.codes_from(&all[place].thumbnail);
        Some((place, distance)).filter(|_| distance < codes)
    }

    /// Whether another image whose small copy has this squared error may show the same. Empty
    /// scenes of a place look the same but are not duplicates.
    fn may_show_the_same(&self, other: &Self, squared_error: u64) -> bool {
        let is_copy = squared_error < self.thumbnail.squared_error_limit(SAVED_AGAIN_RMS)
            && self.thumbnail.greatest_error(&other.thumbnail) <= SAVED_AGAIN_MOST;
        match [self.is_empty(), other.is_empty()] {
            [true, true] => false,
            [false, false] => is_copy || self.may_be_labelled_like(other),
            _ => is_copy,
        }
    }

    /// Whether the labels are alike, or those of one are unknown.
    fn may_be_labelled_like(&self, other: &Self) -> bool {
        match (&self.boxes, &other.boxes) {
            (Some(own), Some(others)) => are_alike(own, others),
            _ => true,
        }
    }
}

/// The boxes in the text of a label file, shares of the image; none if a row is bad.
pub(crate) fn boxes_in(text: &str) -> Option<Vec<GroundTruth>> {
    let sheet = yolo_sheet(text, "", [1, 1]).ok()?;
    Some(sheet.truth)
}

/// Whether each box matches one of the other image, and none of those is left.
fn are_alike(own: &[GroundTruth], others: &[GroundTruth]) -> bool {
    let mut left = others.to_vec();
    own.len() == others.len() && own.iter().all(|b| take_partner(b, &mut left))
}

/// Removes the box of the same class with the greatest overlap, and returns whether there is one.
fn take_partner(own: &GroundTruth, left: &mut Vec<GroundTruth>) -> bool {
    let overlaps = left.iter().map(|other| match other.class == own.class {
        true => iou(&own.bbox, &other.bbox),
        false => 0.0,
    });
    let best = overlaps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let partner = best.filter(|(_, overlap)| *overlap > MIN_OVERLAP);
    partner.map(|(i, _)| left.swap_remove(i)).is_some()
}

/// For each of `val` the nearest of `train` that may show the same, as indices into the lists, if
/// it is nearer than `codes`.
pub(crate) fn nearest(train: &[Look], val: &[Look], codes: f64) -> Vec<(usize, usize, f64)> {
    val.par_iter()
        .enumerate()
        .filter_map(|(i, own)| {
            let (j, distance) = own.nearest_within(train, codes)?;
            Some((i, j, distance))
        })
        .collect()
}

/// The images of `val` that are near-duplicates of one of `train`.
pub(crate) fn near_pairs(
    train: &[PathBuf],
    val: &[PathBuf],
    codes: f64,
) -> Result<Vec<NearDuplicate>> {
    let pairs = nearest(&looks(train)?, &looks(val)?, codes);
    let duplicates = pairs.into_iter().map(|(i, j, codes)| NearDuplicate {
        val: val[i].clone(),
        train: train[j].clone(),
        codes,
    });
    Ok(duplicates.collect())
}

fn looks(images: &[PathBuf]) -> Result<Vec<Look>> {
    images.par_iter().map(|image| Look::read(image)).collect()
}

fn grey_code(p: &Srgb8) -> u8 {
    ((u16::from(p.r) + 2 * u16::from(p.g) + u16::from(p.b)) / 4) as u8
}

#[inline]
fn squared_error(a: &[u8], b: &[u8]) -> u64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(shift: usize, noise: f32) -> Look {
        let of = |x: usize, y: usize| {
            let object = (100 + shift..140 + shift).contains(&x) && (80..120).contains(&y);
            let grain = ((x * 7919 + y * 104_729) % 97) as f32 / 97.0 - 0.5;
            LinearRgb::grey(if object { 0.5 } else { 0.2 } + noise * grain)
        };
        Look {
            thumbnail: Thumbnail::new(&Image::from_fn(320, 240, of)),
            boxes: None,
        }
    }

    fn codes_between(a: &Look, b: &Look) -> f64 {
        a.thumbnail.codes_from(&b.thumbnail)
    }

    fn labelled(labels: &str) -> Look {
        Look {
            boxes: boxes_in(labels),
            ..scene(0, 0.0)
        }
    }

    #[test]
    fn labels_are_alike_in_any_order_and_unknown_ones_are_like_any() {
        let [left, right, cap] = [
            "0 0.2 0.5 0.2 0.2",
            "0 0.25 0.5 0.2 0.2",
            "1 0.8 0.5 0.1 0.1",
        ];
        let own = labelled(&[left, right, cap].join("\n"));
        for (rows, alike) in [
            (vec!["1 0.81 0.5 0.1 0.1", right, left], true),
            (vec![left, right, "0 0.8 0.5 0.1 0.1"], false),
            (vec![left, right, "1 0.5 0.5 0.1 0.1"], false),
            (vec![left, right], false),
            (vec!["0 0.2"], true),
        ] {
            let other = labelled(&rows.join("\n"));
            assert_eq!(own.may_be_labelled_like(&other), alike, "{rows:?}");
            assert_eq!(other.may_be_labelled_like(&own), alike, "{rows:?}");
        }
    }

    /// A grey picture, a share of whose small copy is brighter by one code.
    fn brighter(share: f64, labels: &str) -> Look {
        let count = THUMBNAIL_PX[0] * THUMBNAIL_PX[1];
        let codes = (0..count).map(|i| 100 + u8::from((i as f64) < share * count as f64));
        Look {
            thumbnail: Thumbnail(codes.collect()),
            boxes: boxes_in(labels),
        }
    }

    const LEFT: &str = "0 0.2 0.5 0.2 0.2";
    const RIGHT: &str = "0 0.8 0.5 0.2 0.2";
    const UNKNOWN: &str = "0 0.2";

    #[test]
    fn a_farther_one_with_like_labels_is_nearest() {
        let (moved, farther) = (brighter(0.25, RIGHT), brighter(1.0, LEFT));
        let found = brighter(0.0, LEFT).nearest_within(&[moved, farther], f64::INFINITY);
        assert_eq!(found, Some((1, 1.0)));
    }

    #[test]
    fn a_picture_that_was_saved_again_is_the_same_whatever_its_labels_say() {
        // A quarter of a code and half a code.
        let (copy, noise) = (0.0625, 0.25);
        for (share, [own, other], same) in [
            (0.0, [LEFT, RIGHT], true),
            (copy, [LEFT, RIGHT], true),
            (noise, [LEFT, RIGHT], false),
            (noise, [LEFT, LEFT], true),
            (copy, [LEFT, ""], true),
            (noise, [LEFT, ""], false),
            (0.0, ["", ""], false),
            (copy, [UNKNOWN, ""], true),
            (noise, [UNKNOWN, ""], false),
            (noise, [UNKNOWN, LEFT], true),
        ] {
            let (own, other) = (brighter(0.0, own), brighter(share, other));
            for [a, b] in [[&own, &other], [&other, &own]] {
                let found = a.nearest_within(std::slice::from_ref(b), NEAR_DUPLICATE_RMS);
                assert_eq!(found.is_some(), same, "{share} {own:?} {other:?}");
            }
        }
    }

    #[test]
    fn noise_is_near_and_a_moved_object_is_not() {
        let scenes = [scene(0, 0.0), scene(0, 0.05), scene(60, 0.0)];
        assert!(codes_between(&scenes[0], &scenes[1]) < NEAR_DUPLICATE_RMS);
        assert!(codes_between(&scenes[0], &scenes[2]) > 3.0 * NEAR_DUPLICATE_RMS);
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
            let distances = others.iter().map(|other| codes_between(&own, other));
            let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            for codes in [0.0, 0.5, NEAR_DUPLICATE_RMS, f64::INFINITY] {
                let expected = nearest.filter(|(_, distance)| *distance < codes);
                assert_eq!(own.nearest_within(others, codes), expected);
            }
        }
    }
}
