//! Pixels that are no bare plastic: paint, and glints that hide what is seen through.

use super::solve::Factor;
use super::tint::OPAQUE;
use crate::filter;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Flat plastic passes 1; so many times that is the screen's hue from elsewhere.
const PAINTED: f32 = 1.65;
/// Rim of the object where a pixel may be that bright, as a share of the longer side: bare screen shines in.
const RIM: f64 = 0.01;

/// Width of that rim in a photo of so many pixels.
pub(super) fn rim_px(longer_side: usize) -> f64 {
    (RIM * longer_side as f64).max(2.0)
}

/// Blur of the paint's mask, standard deviation in pixels, and the shares of it between which a pixel turns opaque.
const BLUR_PX: f32 = 2.0;
const TURNS: [f32; 2] = [0.4, 0.7];

/// Bare screen is its plate in some shade: so far from that, as a share of the plate's strongest channel, it may be.
const SCREEN: f32 = 0.06;

/// Makes opaque what is painted: in the screen's hue, or in colours that the plastic has not. Bare screen that a wide mask
/// lets in is not paint. Gives the share of the object that has the screen's hue.
///
/// `longer_side` is that of the whole photo, pixels.
pub(super) fn make_opaque(
    factors: &mut Image<Factor>,
    photo: &Image<LinearRgb>,
    plate: &Image<LinearRgb>,
    inside: &Image<Coverage>,
    longer_side: usize,
) -> f32 {
    let bright = factors.zip3_map(photo, plate, |f, p, k| {
        f.raw > PAINTED && !is_screen(p.into(), k.into())
    });
    let painted = factors.zip_map(&bright, |f, bright| f.coloured || bright);
    if !painted.pixels().iter().any(|p| *p) {
        return 0.0;
    }
    let interior = filter::erode(&inside.map(|c| c.0 >= OPAQUE), rim_px(longer_side));
    let painted = painted.zip_map(&interior, |p, i| p && i).to_coverage();
    let painted = filter::gaussian_blur(&painted, BLUR_PX);
    let paint = painted.map(|p| ((p.0 - TURNS[0]) / (TURNS[1] - TURNS[0])).clamp(0.0, 1.0));
    for (factor, paint) in factors.pixels_mut().iter_mut().zip(paint.pixels()) {
        factor.value *= 1.0 - paint;
        factor.sigma = factor.sigma.max(*paint);
    }
    let of_hue = paint
        .pixels()
        .iter()
        .zip(bright.pixels())
        .map(|(paint, bright)| *bright && *paint > 0.5);
    share(of_hue, inside)
}

/// A pixel is the screen in some shade.
pub(super) fn is_screen(pixel: [f32; 3], screen: [f32; 3]) -> bool {
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let shade = dot(pixel, screen) / dot(screen, screen).max(f32::MIN_POSITIVE);
    let strongest = screen.into_iter().fold(0.0, f32::max);
    (0..3).all(|c| (pixel[c] - shade * screen[c]).abs() <= SCREEN * strongest)
}

/// Scene-linear reflected light from which on to which a glint hides what is seen through.
const GLINT: RangeInclusive<f32> = 0.14..=0.96;
/// Reach of the surroundings that hidden pixels are filled from, standard deviation as a share of the side of a square of
/// the object's area, and least, pixels.
const FILL: f32 = 0.01;
const FILL_PX: f32 = 3.0;
/// Weight of surroundings, as a share of the window, that is enough.
const ENOUGH: f32 = 0.05;

/// Gives pixels under glints the factor of their surroundings, as far as they are hidden: clipped ones wholly, others
/// only more of it, since what reflects much is taken for paint by itself. Gives the share of the object that is clipped.
pub(super) fn fill_glints(
    factors: &mut Image<Factor>,
    photo: &Image<LinearRgb>,
    inside: &Image<Coverage>,
    clipped_at: f32,
) -> f32 {
    let clipped = photo.zip_map(inside, |p, c| {
        c.0 > 0.0 && p.r.max(p.g).max(p.b) >= clipped_at
    });
    let hidden = factors.zip_map(
        &clipped,
        |f, clipped| if clipped { 1.0 } else { hides(f.reflected) },
    );
    // Weight and weighted factor ride in one picture: one blur for both.
    let told = hidden.zip_map(inside, |hidden, c| (1.0 - hidden) * c.0);
    let weighted = told.zip_map(factors, |w, f| LinearRgb::new(w, w * f.value, 0.0));
    let side = inside
        .pixels()
        .iter()
        .map(|c| f64::from(c.0))
        .sum::<f64>()
        .sqrt() as f32;
    // Half the size is enough for what is smooth.
    let around = filter::gaussian_blur(&filter::halve(&weighted), (FILL * side).max(FILL_PX) / 2.0);
    factors.par_rows_mut().enumerate().for_each(|(y, row)| {
        for (x, (factor, &hidden)) in row.iter_mut().zip(hidden.row(y)).enumerate() {
            let around = around[(x / 2, y / 2)];
            if hidden > 0.0 && around.r > ENOUGH {
                fill(factor, hidden, around.g / around.r);
            }
        }
    });
    share(clipped.pixels().iter().copied(), inside)
}

fn fill(factor: &mut Factor, hidden: f32, around: f32) {
    let more = around - factor.value;
    factor.value += if hidden < 1.0 {
        hidden * more.max(0.0)
    } else {
        more
    };
    factor.sigma = factor.sigma.max(hidden * FILLED_SIGMA);
}

/// How much of what is seen through so much reflected light hides.
fn hides(reflected: f32) -> f32 {
    ((reflected - GLINT.start()) / (GLINT.end() - GLINT.start())).clamp(0.0, 1.0)
}

/// Standard deviation of a factor that is only its surroundings': that of plastic around its median.
const FILLED_SIGMA: f32 = 0.35;

/// The share of the object that a set of pixels has.
pub(super) fn share(set: impl Iterator<Item = bool>, inside: &Image<Coverage>) -> f32 {
    let object: f64 = inside.pixels().iter().map(|c| f64::from(c.0)).sum();
    let chosen: f64 = set
        .zip(inside.pixels())
        .filter(|(set, _)| *set)
        .map(|(_, c)| f64::from(c.0))
        .sum();
    if object > 0.0 {
        (chosen / object) as f32
    } else {
        0.0
    }
}
