//! The object's pixels: its interior, bare screen within it, and what share of it some pixels are.

use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::Coverage;
use std::ops::RangeInclusive;

/// Coverage from which on a pixel is wholly inside: what 8 bits and a blur's rounding leave of 1.
pub(in crate::matte) const OPAQUE: f32 = 0.99;
/// Width of the object's rim, where bare screen shines in, as a share of the photo's longer side.
const RIM_WIDTH: f64 = 0.01;
/// The same in small photos, pixels.
const MIN_RIM_PX: f64 = 2.0;

/// The object without its rim; `longer_side` is that of the whole photo, pixels.
pub(super) fn interior(inside: &Image<Coverage>, longer_side: usize) -> Mask {
    let rim_px = (RIM_WIDTH * longer_side as f64).max(MIN_RIM_PX);
    filter::erode(&inside.map(|c| c.0 >= OPAQUE), rim_px)
}

/// How far a value is from the start of a range to its end, 0 to 1.
#[inline(always)]
pub(super) fn ramp(value: f32, range: &RangeInclusive<f32>) -> f32 {
    let (low, high) = (range.start(), range.end());
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

/// Area of the object, pixels.
fn area(inside: &Image<Coverage>) -> f64 {
    inside.pixels().iter().map(|c| f64::from(c.0)).sum()
}

/// Side of a square of the object's area, pixels.
pub(super) fn side_px(inside: &Image<Coverage>) -> f32 {
    area(inside).sqrt() as f32
}

/// The share of the object's area that a set of pixels has.
pub(super) fn share(set: impl Iterator<Item = bool>, inside: &Image<Coverage>) -> f32 {
    let object = area(inside);
    let covered = set.zip(inside.pixels()).filter(|(set, _)| *set);
    // 0 where the object's area is 0 or NaN.
    if object > 0.0 {
        (covered.map(|(_, c)| f64::from(c.0)).sum::<f64>() / object) as f32
    } else {
        0.0
    }
}
