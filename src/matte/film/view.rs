//! From what a screen under the object shows to what the line of sight lets through.
//!
//! A screen is seen through the object *and* lit through it: `T = V * S`, V the share of the line
//! of sight, S the share of the light that still reaches the screen there. Where the plastic lies
//! flat most of that light comes the way the sight goes, and some from the sides, below the object:
//! `S = k V + a (1 - V)`. What makes T vary around that depends on where it is. At the rim the wall
//! turns away and blocks the sight as it blocks the light. Deep inside it lies flat: what dims the
//! screen there is mostly shadow, light that the folds above sent elsewhere, and the sight goes on;
//! only what lets hardly anything through is a label or a fold.

use super::object::{ramp, side_px};
use crate::filter;
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};
use std::ops::RangeInclusive;

/// Of the light that would reach the screen below flat plastic, what comes in from the sides (a):
/// all that dark plastic leaves. By the composites of 6 bottles on a display in soft light, on two
/// painted screens.
const SIDE_LIGHT: f32 = 0.28;
/// What comes through it, over V (k): clear plastic has a V of 0.772 where its T is 0.56.
const THROUGH_LIGHT: f32 = 0.856;

// The numbers below are a least absolute fit over 48 rendered photos of 24 bottles, halfway between
// that for T as film() finds it and that for the true T. The powers are those of a free fit,
// rounded.

/// At the rim V falls with u, T over that of flat plastic, like this times `u^(5/4)`.
const RIM_GAIN: f32 = 0.77;
/// Deep inside it is that of flat plastic, and turns to nothing around this u, with its third
/// power.
const OPAQUE_RATIO: f32 = 0.45;
/// Depth below the outline where both weigh the same, with its power 5/2, as a share of the side of
/// a square of the object's area.
const RIM_DEPTH: f32 = 0.05;
/// Blur of T, standard deviation as a share of that side: finer than that are only grains of light
/// on the screen.
const GRAIN_SIZE: f32 = 0.0025;
/// No plastic passes more than this many times what flat plastic does.
const MAX_RATIO: f32 = 1.3;
/// From the first transmittance on to the second a pixel turns to bare screen.
const BARE_TRANSMITTANCE: RangeInclusive<f32> = 0.9..=0.97;

/// View transmittance from the measured one, channel by channel, of plastic that where it lies flat
/// measures `flat`.
///
/// `transmittance` is that of the object alone, wherever `inside` is not 0; elsewhere it is
/// ignored.
pub(in crate::matte) fn view(
    transmittance: &Image<LinearRgb>,
    flat: LinearRgb,
    inside: &Image<Coverage>,
) -> Image<LinearRgb> {
    let side = side_px(inside);
    let depths = filter::depth(&inside.map(|c| c.0 >= 0.5));
    let smooth = filter::gaussian_blur(&weighted(transmittance, inside), GRAIN_SIZE * side);
    smooth.zip3_map(&depths, transmittance, |smooth, depth, t| {
        let inner = flatness(depth / side.max(f32::MIN_POSITIVE));
        pixel_view(unweighted(smooth), flat, t, inner)
    })
}

/// Transmittance times coverage, with the coverage.
fn weighted(transmittance: &Image<LinearRgb>, inside: &Image<Coverage>) -> Image<PremulRgba> {
    transmittance.zip_map(inside, |t, c| t.opaque().masked(c))
}

#[inline(always)]
fn unweighted(p: PremulRgba) -> LinearRgb {
    p.color().scale(p.a.max(f32::MIN_POSITIVE).recip())
}

#[inline(always)]
fn pixel_view(smooth: LinearRgb, flat: LinearRgb, t: LinearRgb, inner: f32) -> LinearRgb {
    // Outside the object there is nothing to smooth.
    if smooth == LinearRgb::BLACK {
        return smooth;
    }
    LinearRgb::new(
        channel_view(smooth.r, flat.r, t.r, inner),
        channel_view(smooth.g, flat.g, t.g, inner),
        channel_view(smooth.b, flat.b, t.b, inner),
    )
}

/// View transmittance of one channel: `smooth` is its T without grain, `flat` that of flat plastic,
/// `t` its own T.
#[inline(always)]
fn channel_view(smooth: f32, flat: f32, t: f32, inner: f32) -> f32 {
    let plastic = plastic_view(smooth, flat, inner);
    let bare = ramp(t, &BARE_TRANSMITTANCE);
    plastic + bare * (1.0 - plastic)
}

#[inline(always)]
fn plastic_view(smooth: f32, flat: f32, inner: f32) -> f32 {
    let relative = relative_view(smooth / flat.max(f32::MIN_POSITIVE), inner);
    (flat_view(flat) * relative).clamp(0.0, 1.0)
}

/// V of flat plastic: the root of `T = V (k V + a (1 - V))`.
fn flat_view(t: f32) -> f32 {
    let (a, square) = (SIDE_LIGHT, THROUGH_LIGHT - SIDE_LIGHT);
    ((a * a + 4.0 * square * t).sqrt() - a) / (2.0 * square)
}

/// How far plastic so deep below the outline counts as flat, 0 to 1.
fn flatness(depth: f32) -> f32 {
    let ratio = depth / RIM_DEPTH;
    let power = (ratio * ratio * ratio.sqrt()).min(f32::MAX);
    power / (1.0 + power)
}

/// V over that of flat plastic, by T over that of flat plastic.
fn relative_view(u: f32, inner: f32) -> f32 {
    let u = u.clamp(0.0, MAX_RATIO);
    let rim = RIM_GAIN * u * u.sqrt().sqrt();
    rim + inner * (deep_view(u) - rim)
}

/// The same deep inside the object.
#[inline]
fn deep_view(u: f32) -> f32 {
    cube(u) * (1.0 + cube(OPAQUE_RATIO)) / (cube(u) + cube(OPAQUE_RATIO))
}

#[inline(always)]
fn cube(x: f32) -> f32 {
    x * x * x
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (90, 60);

    fn slab() -> Image<Coverage> {
        let slab = Image::from_fn(SIZE.0, SIZE.1, |x, y| {
            (10..80).contains(&x) && (10..50).contains(&y)
        });
        slab.to_coverage()
    }

    /// V in the middle of a slab, and at its rim.
    fn seen(t: LinearRgb, flat: LinearRgb) -> [LinearRgb; 2] {
        let view = view(&Image::filled(SIZE.0, SIZE.1, t), flat, &slab());
        [view[(45, 30)], view[(45, 10)]]
    }

    #[test]
    fn flat_plastic_is_seen_through_by_less_the_more_light_comes_from_the_sides() {
        let flat = LinearRgb::new(0.56, 0.3, 0.03);
        let [middle, _] = seen(flat, flat);
        let [clear, dyed, dark] = middle.channels();
        assert!((clear - 0.77).abs() < 0.02, "{middle:?}");
        assert!((dyed - 0.51).abs() < 0.03, "{middle:?}");
        assert!((dark - 0.09).abs() < 0.03, "{middle:?}");
    }

    #[test]
    fn flat_view_solves_its_equation() {
        for v in [0.0, 0.05, 0.3, 0.77, 1.0] {
            let t = v * (THROUGH_LIGHT * v + SIDE_LIGHT * (1.0 - v));
            assert!((flat_view(t) - v).abs() < 1e-5);
        }
    }

    #[test]
    fn a_dim_place_is_shadow_deep_inside_and_plastic_at_the_rim() {
        let [middle, rim] = seen(LinearRgb::grey(0.35), LinearRgb::grey(0.56));
        assert!(middle.g > 0.55 && rim.g < 0.4, "{middle:?} {rim:?}");
    }

    #[test]
    fn opaque_stays_opaque_and_bare_screen_bare() {
        let flat = LinearRgb::grey(0.55);
        assert_eq!(seen(LinearRgb::BLACK, flat), [LinearRgb::BLACK; 2]);
        assert_eq!(seen(LinearRgb::WHITE, flat), [LinearRgb::WHITE; 2]);
    }

    #[test]
    fn more_is_never_seen_through_less() {
        for inner in [0.0, 0.3, 1.0] {
            let at = |i: u8| relative_view(f32::from(i) / 100.0, inner);
            assert!((1..=150).all(|i| at(i) >= at(i - 1)));
        }
    }

    #[test]
    fn an_empty_object_is_no_trouble() {
        let nothing = Image::filled(4, 3, Coverage(0.0));
        let view = view(
            &Image::filled(4, 3, LinearRgb::grey(0.5)),
            LinearRgb::grey(0.5),
            &nothing,
        );
        assert!(view.pixels().iter().all(|v| v.is_finite()));
    }
}
