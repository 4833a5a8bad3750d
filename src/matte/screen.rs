//! The colour of the screen, from the part that the object leaves free.

use super::arrays::{dot, index_of_largest, largest};
use super::check::refused;
use super::prepared::longer_side;
use crate::error::Result;
use crate::filter;
use crate::image::{Image, Mask};
use crate::pixel::{Coverage, LinearRgb};

/// Width of the zone around the object that is left out, as a share of the longer side: contact
/// shadows and spill.
const SCREEN_MARGIN: f64 = 0.02;

/// Mean scene-linear colour of a photo outside a mask and a margin around it (2 % of the longer
/// side).
///
/// Where the margin leaves nothing, only the mask is excluded.
///
/// # Errors
/// [`Error::Photo`](crate::Error::Photo) when the mask leaves no background.
/// # Panics
/// When the sizes differ.
pub fn screen_color(photo: &Image<LinearRgb>, mask: &Image<Coverage>) -> Result<LinearRgb> {
    let far = mean(photo, &screen_pixels(mask));
    far.or_else(|| mean(photo, &background(mask, 0.0)))
        .ok_or_else(|| refused("the object leaves no background to take the screen colour from"))
}

/// The pixels outside a mask and a margin around it.
pub(super) fn screen_pixels(mask: &Image<Coverage>) -> Mask {
    background(mask, SCREEN_MARGIN)
}

fn background(mask: &Image<Coverage>, margin: f64) -> Mask {
    let margin_px = margin * longer_side(mask) as f64;
    filter::dilate(&mask.map(|c| c.0 > 0.0), margin_px).complement()
}

fn mean(photo: &Image<LinearRgb>, set: &Mask) -> Option<LinearRgb> {
    assert_eq!(photo.size(), set.size(), "photo and mask differ in size");
    mean_color(photo.pixels_in(set))
}

/// Mean of colours; none where there are none. Sums in double precision and in the order of the
/// pixels: the same at any thread count.
pub(crate) fn mean_color(pixels: impl Iterator<Item = LinearRgb>) -> Option<LinearRgb> {
    let (sum, count) = pixels.fold(([0.0_f64; 3], 0_u64), |([r, g, b], count), p| {
        let sum = [r + f64::from(p.r), g + f64::from(p.g), b + f64::from(p.b)];
        (sum, count + 1)
    });
    (count > 0).then(|| sum.map(|s| (s / count as f64) as f32).into())
}

/// Least share by which the screen's largest channel must exceed the mean of the two others to be
/// keyed: a painted screen has 0.6 and more, a white board in the light of a lamp up to 0.15.
const MIN_KEYABLE_EXCESS: f32 = 0.3;

/// The screen has enough colour to distinguish it from what is in front of it.
pub(super) fn is_keyable(screen: LinearRgb) -> bool {
    let mut channels = screen.channels();
    channels.sort_by(f32::total_cmp);
    channels[2] > 0.0 && excess_share(channels) >= MIN_KEYABLE_EXCESS
}

/// By how much the largest channel exceeds the mean of the others, as a share of it.
fn excess_share([low, mid, high]: [f32; 3]) -> f32 {
    (high - 0.5 * (low + mid)) / high
}

/// Bare screen is its plate in some shade: so far from that, as a share of the plate's strongest
/// channel, it may be.
const MAX_SCREEN_DEVIATION: f32 = 0.06;

/// How bright a pixel that is the screen in some shade is, 1 as its plate; none for one that is not.
pub(super) fn screen_shade(pixel: [f32; 3], screen: [f32; 3]) -> Option<f32> {
    shade_within(MAX_SCREEN_DEVIATION, pixel, screen)
}

/// The same for a pixel that differs from its shade by at most a share of the screen's strongest
/// channel.
pub(super) fn shade_within(deviation: f32, pixel: [f32; 3], screen: [f32; 3]) -> Option<f32> {
    let shade = dot(pixel, screen) / dot(screen, screen).max(f32::MIN_POSITIVE);
    let strongest = largest(screen);
    let is_screen = (0..3).all(|c| (pixel[c] - shade * screen[c]).abs() <= deviation * strongest);
    is_screen.then_some(shade)
}

/// The two channels beside one, in order.
#[inline(always)]
pub(super) fn other_channels(c: [f32; 3], channel: usize) -> (f32, f32) {
    [(c[1], c[2]), (c[0], c[2]), (c[0], c[1])][channel]
}

/// Which channel of a colour is the largest; of equal ones the first.
pub(super) fn strongest_channel(color: LinearRgb) -> usize {
    index_of_largest(color.channels())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.05, 0.4, 0.1);

    fn disc(size: usize, radius: usize) -> Image<Coverage> {
        let half = size / 2;
        let disc = Image::from_fn(size, size, |x, y| {
            x.abs_diff(half).pow(2) + y.abs_diff(half).pow(2) <= radius * radius
        });
        disc.to_coverage()
    }

    #[test]
    fn the_object_and_what_is_near_it_are_left_out() {
        let mask = disc(200, 50);
        let spill = filter::dilate(&mask.map(|c| c.0 > 0.0), 3.0);
        let photo = spill.map(|near| if near { LinearRgb::WHITE } else { GREEN });
        let found = screen_color(&photo, &mask).unwrap();
        assert!((found.g - GREEN.g).abs() < 1e-6 && (found.r - GREEN.r).abs() < 1e-6);
    }

    #[test]
    fn a_thin_rim_of_background_is_enough() {
        let mask = Image::from_fn(100, 100, |x, _| Coverage(if x == 0 { 0.0 } else { 1.0 }));
        let photo = mask.map(|c| if c.0 > 0.0 { LinearRgb::WHITE } else { GREEN });
        assert_eq!(screen_color(&photo, &mask).unwrap(), GREEN);
    }

    #[test]
    fn no_background_is_an_error() {
        let full = Image::filled(40, 40, Coverage(1.0));
        assert!(screen_color(&Image::filled(40, 40, GREEN), &full).is_err());
    }
}
