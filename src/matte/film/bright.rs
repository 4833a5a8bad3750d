//! Pixels that are not bare plastic: paint, and glints that hide what is behind them.

use super::object::{ramp, share, side_px};
use super::solve::Factor;
use super::{FilmInput, claimed};
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::screen::screen_shade;
use crate::pixel::{Coverage, LinearRgb};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Factor from which on a pixel has light of the screen's hue from elsewhere; flat plastic has 1.
const MIN_PAINT_FACTOR: f32 = 1.65;
/// Blur of the paint's mask, standard deviation in pixels.
const PAINT_BLUR_PX: f32 = 2.0;
/// Shares of the blurred mask between which a pixel turns opaque.
const PAINT_SHARE: RangeInclusive<f32> = 0.4..=0.7;

/// Makes opaque what is painted: in the screen's hue, or in colours that the plastic has not. Bare
/// screen that a wide mask lets in is not paint, nor is what a person says is see-through. Gives the
/// share of the object that has the screen's hue.
///
/// `photo` is the one that the transmittance is measured in.
pub(super) fn make_opaque(
    factors: &mut Image<Factor>,
    photo: &Image<LinearRgb>,
    object: FilmInput<'_>,
    interior: &Mask,
) -> f32 {
    let bright = brighter_than_screen(factors, photo, &object.plate.image);
    let painted = factors.zip_map(&bright, |f, bright| bright || f.coloured && !f.is_bare());
    if !painted.pixels().contains(&true) {
        return 0.0;
    }
    let mut paint = softened(&painted.zip_map(interior, |p, i| p && i));
    claimed::set_see_through(&mut paint, object.claims, 0.0);
    cover_with_paint(factors, &paint);
    let of_hue = paint
        .pixels()
        .iter()
        .zip(bright.pixels())
        .map(|(paint, bright)| *bright && *paint > 0.5);
    share(of_hue, object.inside)
}

fn cover_with_paint(factors: &mut Image<Factor>, paint: &Image<f32>) {
    for (factor, paint) in factors.pixels_mut().iter_mut().zip(paint.pixels()) {
        factor.value *= 1.0 - paint;
        factor.raise_sigma(*paint);
    }
}

/// The pixels that are brighter in the screen's hue than plastic in front of it can be.
fn brighter_than_screen(
    factors: &Image<Factor>,
    photo: &Image<LinearRgb>,
    plate: &Image<LinearRgb>,
) -> Mask {
    factors.zip3_map(photo, plate, |f, p, k| {
        f.unbounded > MIN_PAINT_FACTOR && screen_shade(p.into(), k.into()).is_none()
    })
}

/// How opaque the paint of a mask is, 0 to 1, without single pixels and with soft edges.
fn softened(painted: &Mask) -> Image<f32> {
    filter::gaussian_blur(&painted.to_coverage(), PAINT_BLUR_PX).map(|p| ramp(p.0, &PAINT_SHARE))
}

/// Scene-linear reflected light between which a glint goes from hiding nothing to hiding all that
/// lies behind.
const GLINT_LIGHT: RangeInclusive<f32> = 0.14..=0.96;
/// Reach of the surroundings that hidden pixels are filled from, standard deviation as a share of
/// the side of a square of the object's area.
const FILL_REACH: f32 = 0.01;
/// The same in small pictures, pixels.
const MIN_FILL_REACH_PX: f32 = 3.0;
/// Weight of surroundings, as a share of the window, that is enough.
const MIN_FILL_WEIGHT: f32 = 0.05;
/// Standard deviation of a factor that is only its surroundings': that of plastic around its
/// median.
const FILLED_SIGMA: f32 = 0.35;

/// Gives pixels under glints the factor of their surroundings, as far as they are hidden: clipped
/// ones wholly, others only more of it, since what reflects much is treated as paint by itself.
/// Gives the share of the object that is clipped.
pub(super) fn fill_glints(factors: &mut Image<Factor>, object: FilmInput<'_>) -> f32 {
    let inside = object.inside;
    let clipped = object.photo.zip_map(inside, |p, c| {
        c.0 > 0.0 && p.max_channel() >= object.clipped
    });
    let hidden = factors.zip_map(&clipped, |f, clipped| {
        if clipped {
            1.0
        } else {
            ramp(f.reflected, &GLINT_LIGHT)
        }
    });
    fill_hidden(factors, &hidden, &surroundings(factors, &hidden, inside));
    share(clipped.pixels().iter().copied(), inside)
}

/// Fills what is hidden from its surroundings, which are half the size.
fn fill_hidden(factors: &mut Image<Factor>, hidden: &Image<f32>, around: &Image<LinearRgb>) {
    factors.par_rows_mut().enumerate().for_each(|(y, row)| {
        for (x, (factor, &hidden)) in row.iter_mut().zip(hidden.row(y)).enumerate() {
            let around = around[(x / 2, y / 2)];
            if hidden > 0.0 && around.r > MIN_FILL_WEIGHT {
                fill(factor, hidden, around.g / around.r);
            }
        }
    });
}

/// Weight (`r`) and weighted factor (`g`) of what is not hidden around each pixel, at half the
/// size, which is enough for what is smooth. Both ride in one picture: one blur for both. Screen
/// that is brighter than through plastic has no weight: beside white bars it lies in holes.
fn surroundings(
    factors: &Image<Factor>,
    hidden: &Image<f32>,
    inside: &Image<Coverage>,
) -> Image<LinearRgb> {
    let weights = hidden.zip3_map(inside, factors, |hidden, c, f| match f.is_plastic() {
        true => (1.0 - hidden) * c.0,
        false => 0.0,
    });
    let weighted = weights.zip_map(factors, |w, f| LinearRgb::new(w, w * f.value, 0.0));
    let reach_px = (FILL_REACH * side_px(inside)).max(MIN_FILL_REACH_PX);
    filter::gaussian_blur(&filter::halve(&weighted), reach_px / 2.0)
}

#[inline]
fn fill(factor: &mut Factor, hidden: f32, around: f32) {
    let more = around - factor.value;
    factor.value += if hidden < 1.0 {
        hidden * more.max(0.0)
    } else {
        more
    };
    factor.raise_sigma(hidden * FILLED_SIGMA);
}
