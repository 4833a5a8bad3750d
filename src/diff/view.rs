//! Visualised differences.

use super::bands::{RowSource, bands};
use super::{NamedChannels, is_same};
use crate::image::Image;
use crate::pixel::LinearRgb;

/// Factor by which [`triple`] magnifies differences.
const DIFFERENCE_GAIN: f32 = 16.0;
/// Light behind transparent pixels in [`triple`]: photographic middle grey, so that neither black
/// nor white disappears.
const MIDDLE_GREY: f32 = 0.18;

/// `|a - b| * scale` of every channel, including alpha: a difference in colour alone is
/// transparent. Infinite where only one of the two is not a number.
///
/// # Panics
/// When the sizes differ.
pub fn absolute_difference<P: NamedChannels>(
    a: &impl RowSource<P>,
    b: &impl RowSource<P>,
    scale: f32,
) -> Image<P> {
    let (width, height) = a.size();
    assert_eq!((width, height), b.size(), "images of different size");
    let mut pixels = Vec::with_capacity(width * height);
    for band in bands((width, height)) {
        let (a, b) = (a.read_rows(band.clone()), b.read_rows(band));
        pixels.extend_from_slice(a.zip_map(&b, |p, q| pixel_distance(p, &q, scale)).pixels());
    }
    Image::from_vec(width, height, pixels)
}

fn pixel_distance<P: NamedChannels>(mut a: P, b: &P, scale: f32) -> P {
    let values = bytemuck::cast_slice_mut::<P, f32>(std::slice::from_mut(&mut a));
    for (u, &v) in values.iter_mut().zip(channels(b)) {
        *u = distance(*u, v, f32::INFINITY) * scale;
    }
    a
}

/// Distance of two values; `strange` where only one of them is not a number.
fn distance(u: f32, v: f32, strange: f32) -> f32 {
    if is_same(u, v) {
        0.0
    } else if (u - v).is_nan() {
        strange
    } else {
        (u - v).abs()
    }
}

/// `expected | 16 times the difference | actual`, side by side in one picture.
///
/// Transparent pixels show middle grey. Differences in alpha are grey; where only one picture is
/// not a number, the difference is white. The sizes may differ: missing pixels are black.
pub fn triple<P: NamedChannels>(expected: &Image<P>, actual: &Image<P>) -> Image<LinearRgb> {
    let width = expected.width().max(actual.width());
    let height = expected.height().max(actual.height());
    Image::from_fn(3 * width, height, |x, y| {
        let [left, right] = [expected, actual].map(|image| pixel(image, x % width, y));
        match x / width {
            0 => shown_over_grey(left.as_ref()),
            1 => shown_difference(
                left.as_ref().map_or(&[], channels),
                right.as_ref().map_or(&[], channels),
            ),
            _ => shown_over_grey(right.as_ref()),
        }
    })
}

fn pixel<P: Copy>(image: &Image<P>, x: usize, y: usize) -> Option<P> {
    (x < image.width() && y < image.height()).then(|| image[(x, y)])
}

fn channels<P: NamedChannels>(pixel: &P) -> &[f32] {
    bytemuck::cast_slice(std::slice::from_ref(pixel))
}

/// A pixel over the backdrop; black where it is missing.
fn shown_over_grey<P: NamedChannels>(pixel: Option<&P>) -> LinearRgb {
    match *pixel.map_or(&[][..], channels) {
        [r, g, b, a] => LinearRgb::new(r, g, b) + LinearRgb::grey(MIDDLE_GREY * (1.0 - a)),
        [r, g, b] => LinearRgb::new(r, g, b),
        [v] => LinearRgb::grey(v),
        _ => LinearRgb::BLACK,
    }
}

/// The difference per colour channel; a missing pixel counts as zeros.
fn shown_difference(a: &[f32], b: &[f32]) -> LinearRgb {
    let [red, green, blue, alpha] =
        [0, 1, 2, 3].map(|c| magnified_error(channel_or_zero(a, c), channel_or_zero(b, c)));
    match a.len().max(b.len()) {
        0 => LinearRgb::BLACK,
        1 => LinearRgb::grey(red),
        _ => LinearRgb::new(red, green, blue) + LinearRgb::grey(alpha),
    }
}

fn channel_or_zero(values: &[f32], c: usize) -> f32 {
    values.get(c).copied().unwrap_or(0.0)
}

/// The magnified distance of two values; 1 where only one of them is not a number.
fn magnified_error(u: f32, v: f32) -> f32 {
    // The gain is a power of 2: multiplied by its inverse it is exactly 1.
    DIFFERENCE_GAIN * distance(u, v, 1.0 / DIFFERENCE_GAIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::{Coverage, PremulRgba};

    #[test]
    fn a_difference_is_absolute_and_scaled() {
        let [a, b] = [0.25, 0.5].map(|v| Image::filled(2, 1, Coverage(v)));
        let expected = Image::filled(2, 1, Coverage(0.5));
        assert_eq!(absolute_difference(&a, &b, 2.0), expected);
    }

    #[test]
    fn nan_against_a_number_is_an_infinite_difference_and_against_nan_none() {
        let [a, b] = [f32::NAN, 0.5].map(|v| Image::filled(1, 1, Coverage(v)));
        let difference =
            |a: &Image<Coverage>, b: &Image<Coverage>| absolute_difference(a, b, 2.0)[(0, 0)];
        assert_eq!(difference(&a, &b), Coverage(f32::INFINITY));
        assert_eq!(difference(&a, &a), Coverage(0.0));
    }

    #[test]
    fn three_pictures_stand_side_by_side() {
        let [a, b] = [0.25, 0.375].map(|v| Image::filled(2, 1, Coverage(v)));
        assert_eq!(
            triple(&a, &b).pixels(),
            [0.25, 0.25, 2.0, 2.0, 0.375, 0.375].map(LinearRgb::grey)
        );
    }

    #[test]
    fn a_difference_of_alpha_alone_is_seen() {
        let [a, b] =
            [0.5, 0.25].map(|alpha| Image::filled(1, 1, PremulRgba::new(0.0, 0.0, 0.0, alpha)));
        assert_eq!(triple(&a, &b)[(1, 0)], LinearRgb::grey(4.0));
    }

    #[test]
    fn nan_in_one_picture_is_white_and_in_both_black() {
        let [a, b] = [f32::NAN, 0.5].map(|v| Image::filled(1, 1, Coverage(v)));
        assert_eq!(triple(&a, &b)[(1, 0)], LinearRgb::WHITE);
        assert_eq!(triple(&a, &a)[(1, 0)], LinearRgb::BLACK);
    }

    #[test]
    fn pictures_of_different_size_are_shown_all_the_same() {
        let out = triple(
            &Image::filled(1, 2, Coverage(1.0)),
            &Image::filled(2, 1, Coverage(1.0)),
        );
        assert_eq!(out.size(), (6, 2));
        assert_eq!(
            (out[(0, 1)], out[(2, 1)]),
            (LinearRgb::WHITE, LinearRgb::grey(16.0))
        );
        assert!(triple(&Image::<Coverage>::new(0, 0), &Image::new(0, 0)).is_empty());
    }
}
