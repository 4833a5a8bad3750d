//! Arithmetic on a few numbers: the channels of a colour, the sides of a box.

use crate::pixel::LinearRgb;

/// Sum of the products of three channels.
#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The largest of three channels; not less than 0.
#[inline]
pub(super) fn largest(channels: [f32; 3]) -> f32 {
    channels.into_iter().fold(0.0, f32::max)
}

/// Which of three values is the largest; of equal ones the first.
#[inline]
pub(super) fn index_of_largest<T: PartialOrd>(values: [T; 3]) -> usize {
    (1..3).fold(0, |best, c| if values[c] > values[best] { c } else { best })
}

/// The largest distance between two numbers at the same place.
pub(super) fn largest_difference<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    let pairs = a.into_iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// How far two colours differ, channel by channel.
#[inline]
pub(super) fn differences(a: LinearRgb, b: LinearRgb) -> [f32; 3] {
    channel_pairs(a, b).map(|(a, b)| (a - b).abs())
}

/// The channels of two colours, in pairs.
#[inline]
pub(super) fn channel_pairs(a: LinearRgb, b: LinearRgb) -> [(f32, f32); 3] {
    [(a.r, b.r), (a.g, b.g), (a.b, b.b)]
}
