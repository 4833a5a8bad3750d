//! The light on screen and object.

use super::scaled;
use crate::matte::truth::Known;
use petcomp::Image;
use petcomp::filter;
use petcomp::{Coverage, LinearRgb};

/// Light that falls off by a share along a direction, as that of a lamp to the side does.
pub(super) fn fallen_off(photo: &Image<LinearRgb>, direction: f64, share: f64) -> Image<LinearRgb> {
    let (w, h) = photo.size();
    let (sin, cos) = libm::sincos(direction);
    let reach = 0.5 * (cos.abs() * w as f64 + sin.abs() * h as f64);
    scaled(photo, |x, y| {
        let along = 0.5 + 0.5 * (cos * (x - 0.5 * w as f64) + sin * (y - 0.5 * h as f64)) / reach;
        (1.0 - share * along * along) as f32
    })
}

/// What is left of the light in the shadow.
const SHADOW: f64 = 0.6;
/// Width of the shadow's edge, pixels.
const PENUMBRA_PX: f64 = 1.5;

/// A slanted shadow from the right; its edge lies `beyond` of the way from the object's box to the border, or, below 0,
/// by so much of the object's width within it.
pub(super) fn shadowed(known: &Known, beyond: f64) -> Image<LinearRgb> {
    let [left, _, right, _] = known.box_px;
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let free = if beyond > 0.0 {
        w - right
    } else {
        right - left
    };
    let edge = right + beyond * free;
    scaled(&known.photo, |x, y| {
        let slant = edge + 0.1 * (y - 0.5 * h) * f64::from(u8::from(beyond < 0.0));
        let inside = ((x - slant) / PENUMBRA_PX).clamp(0.0, 1.0);
        (1.0 - (1.0 - SHADOW) * inside) as f32
    })
}

/// How far the hues of the two lamps are from white, as a share of red and of blue.
const HUE: f64 = 0.2;

/// Light that is warm on one side and cool on the other.
pub(super) fn two_hues(photo: &Image<LinearRgb>, direction: f64) -> Image<LinearRgb> {
    let (w, h) = photo.size();
    let (sin, cos) = libm::sincos(direction);
    let reach = 0.5 * (cos.abs() * w as f64 + sin.abs() * h as f64);
    Image::from_fn(w, h, |x, y| {
        let along = (cos * (x as f64 + 0.5 - 0.5 * w as f64)
            + sin * (y as f64 + 0.5 - 0.5 * h as f64))
            / reach;
        let warm = (HUE * along) as f32;
        photo[(x, y)] * LinearRgb::new(1.0 + warm, 1.0, 1.0 - warm)
    })
}

/// How far a hard shadow reaches beyond the object, as a share of the shorter side of its box.
const CAST: f64 = 0.08;
/// Blur of its edge, standard deviation in pixels.
const CAST_BLUR_PX: f32 = 1.0;

/// The shadow that a lamp behind the photographer makes of the object, on the screen beside it: denser where the object lets
/// less through.
pub(super) fn cast(known: &Known, direction: f64) -> Image<LinearRgb> {
    let [left, top, right, bottom] = known.box_px;
    let reach = CAST * (right - left).min(bottom - top);
    let (sin, cos) = libm::sincos(direction);
    let (dx, dy) = (
        (reach * cos).round() as isize,
        (reach * sin).round() as isize,
    );
    let (w, h) = known.photo.size();
    let dense = known.transmittance.zip_map(&known.mask, |t, m| {
        Coverage(m.0 * (1.0 - (t.r + t.g + t.b) / 3.0))
    });
    let moved = Image::from_fn(w, h, |x, y| dense.nearest(x as isize - dx, y as isize - dy));
    let soft = filter::gaussian_blur(&moved, CAST_BLUR_PX);
    Image::from_fn(w, h, |x, y| {
        let at = (x, y);
        let beside = 1.0 - known.mask[at].0;
        known.photo[at].scale(1.0 - (1.0 - SHADOW as f32) * soft[at].0 * beside)
    })
}
