//! Paint that was left see-through: what reflects more than plastic, or alike everywhere, and yet
//! passes light.

use super::FilmInput;
use super::object::{share, side_px};
use super::tint::{MAX_SCATTERED, OBJECT_SAMPLES, TintSamples, thinned};
use super::uncertainty::{ColorUncertainty, OPAQUE_TRANSMITTANCE};
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::screen::other_channels;
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::quantile;

/// Reflected light over the screen's from which on an area is as bright as paint.
const PAINT_REFLECTION: f32 = 0.66;
/// Radius of the glints that are no area, as a share of the side of a square of the object's area:
/// wider ones are up to 0.03 of rendered bottles.
const GLINT_RADIUS: f64 = 0.015;
/// The same in small pictures, pixels.
const MIN_GLINT_RADIUS_PX: f64 = 1.0;
/// What of the see-through pixels reflects least and most, without outliers.
const REFLECTION_QUANTILES: [f64; 2] = [0.05, 0.95];
/// Difference between the two, over the screen's light, from which on something glints. Of 24
/// rendered bottles on two screens it is 0.36 and more, of matt paint 0.07 at most where it varies
/// by 30 %, 0.13 where by 50 %.
const MIN_GLINTS: f32 = 0.15;
/// Share of the object's interior that is see-through from which on it is compared: where dark
/// plastic glints, it counts as opaque.
const MIN_SEE_THROUGH: f64 = 0.5;

/// Less than any light: of what is not seen through.
pub(super) const NO_LIGHT: f32 = f32::NEG_INFINITY;

/// Light that a pixel of this transmittance reflects, in the channels that the screen has little
/// of; [`NO_LIGHT`] where it is opaque.
pub(super) fn reflected(pixel: LinearRgb, screen: LinearRgb, t: LinearRgb, key: usize) -> f32 {
    if t.channels()[key] <= OPAQUE_TRANSMITTANCE {
        return NO_LIGHT;
    }
    let (pixel, through) = (pixel.channels(), (t * screen).channels());
    let (a, b) = other_channels(std::array::from_fn(|c| pixel[c] - through[c]), key);
    0.5 * (a + b)
}

/// The share of the object that is an area as bright as paint, 0 where it is no more than glints
/// have; all of it where the pixels that show the plastic reflect more than it scatters.
///
/// `reflected` is what [`reflected`] gives of each pixel.
pub(super) fn see_through(
    reflected: &Image<f32>,
    samples: &TintSamples,
    object: FilmInput<'_>,
    interior: &Mask,
) -> f32 {
    let screen = object.screen.max_channel();
    if samples.median_of(reflected) > MAX_SCATTERED * screen {
        return 1.0;
    }
    let painted = reflected.map(|r| r > PAINT_REFLECTION * screen);
    if !painted.pixels().contains(&true) {
        return 0.0;
    }
    let painted = painted.zip_map(interior, |painted, inner| painted && inner);
    let areas = without_glints(&painted, object.inside);
    let share = share(areas.pixels().iter().copied(), object.inside);
    match share > ColorUncertainty::NEEDS_REVIEW.paint {
        true => share,
        false => 0.0,
    }
}

/// Whether what is see-through reflects alike everywhere: plastic glints, but paint of the screen's
/// hue, which looks as see-through, may be matt.
///
/// `screen` is its mean light.
pub(super) fn is_matt(reflected: &Image<f32>, screen: LinearRgb, interior: &Mask) -> bool {
    let pixels = reflected.pixels().iter().zip(interior.pixels());
    let inner: Vec<f32> = pixels
        .filter_map(|(light, inner)| inner.then_some(*light))
        .collect();
    let sampled: Vec<f32> = thinned(inner, OBJECT_SAMPLES).collect();
    let seen = sampled.iter().copied().filter(|light| *light != NO_LIGHT);
    let seen: Vec<f32> = seen.collect();
    if seen.is_empty() || (seen.len() as f64) < MIN_SEE_THROUGH * sampled.len() as f64 {
        return false;
    }
    let [least, most] = REFLECTION_QUANTILES
        .map(|share| quantile(seen.clone(), share, f32::total_cmp).unwrap_or_default());
    most - least < MIN_GLINTS * screen.max_channel()
}

/// The mask opened by the radius of glints.
fn without_glints(mask: &Mask, inside: &Image<Coverage>) -> Mask {
    let radius_px = (GLINT_RADIUS * f64::from(side_px(inside))).max(MIN_GLINT_RADIUS_PX);
    filter::dilate(&filter::erode(mask, radius_px), radius_px)
}
