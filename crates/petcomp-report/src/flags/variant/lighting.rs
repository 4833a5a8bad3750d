//! The light on screen and object.

use super::scaled;
use crate::matte::truth::Known;
use petcomp::filter;
use petcomp::{Coverage, Image, LinearRgb};

/// How far a point lies along a direction: -1 and 1 at the edges of the picture.
struct Gradient {
    center: [f64; 2],
    sin: f64,
    cos: f64,
    reach: f64,
}

impl Gradient {
    fn new((w, h): (usize, usize), direction: f64) -> Self {
        let (sin, cos) = libm::sincos(direction);
        Self {
            center: [0.5 * w as f64, 0.5 * h as f64],
            sin,
            cos,
            reach: 0.5 * (cos.abs() * w as f64 + sin.abs() * h as f64),
        }
    }

    /// The distance from the middle along the direction, pixels.
    fn distance(&self, x: f64, y: f64) -> f64 {
        self.cos * (x - self.center[0]) + self.sin * (y - self.center[1])
    }
}

/// Light that falls off by a share along a direction, as that of a lamp to the side does.
pub(super) fn fallen_off(photo: &Image<LinearRgb>, direction: f64, share: f64) -> Image<LinearRgb> {
    let gradient = Gradient::new(photo.size(), direction);
    scaled(photo, |x, y| {
        let along = 0.5 + 0.5 * gradient.distance(x, y) / gradient.reach;
        (1.0 - share * along * along) as f32
    })
}

/// Share of the light that is left in the shadow.
const SHADOW_LIGHT: f64 = 0.6;
/// Width of the shadow's edge, pixels.
const PENUMBRA_PX: f64 = 1.5;

/// A slanted shadow from the right. Its edge is at the share `beyond` of the distance from the
/// object's box to the border or, if negative, at that share of the object's width inside the box.
pub(super) fn shadowed(known: &Known, beyond: f64) -> Image<LinearRgb> {
    let edge = shadow_edge(known, beyond);
    let h = known.photo.height() as f64;
    scaled(&known.photo, |x, y| {
        let slant = edge + 0.1 * (y - 0.5 * h) * f64::from(u8::from(beyond < 0.0));
        let inside = ((x - slant) / PENUMBRA_PX).clamp(0.0, 1.0);
        (1.0 - (1.0 - SHADOW_LIGHT) * inside) as f32
    })
}

fn shadow_edge(known: &Known, beyond: f64) -> f64 {
    let [left, _, right, _] = known.box_px;
    let w = known.photo.width() as f64;
    let free = if beyond > 0.0 {
        w - right
    } else {
        right - left
    };
    right + beyond * free
}

/// How far the hues of the two lamps are from white, as a share of red and of blue.
const HUE_SHARE: f64 = 0.2;

/// Light that is warm on one side and cool on the other.
pub(super) fn two_hues(photo: &Image<LinearRgb>, direction: f64) -> Image<LinearRgb> {
    let (w, h) = photo.size();
    let gradient = Gradient::new((w, h), direction);
    Image::from_fn(w, h, |x, y| {
        let along = gradient.distance(x as f64 + 0.5, y as f64 + 0.5) / gradient.reach;
        let warm = (HUE_SHARE * along) as f32;
        photo[(x, y)] * LinearRgb::new(1.0 + warm, 1.0, 1.0 - warm)
    })
}

/// Reach of a hard shadow beyond the object, as a share of the shorter side of its box.
const CAST_SHADOW_REACH: f64 = 0.08;
/// Blur of its edge, standard deviation in pixels.
const CAST_BLUR_PX: f32 = 1.0;

/// The shadow of the object from a lamp behind the photographer, on the screen around it: denser
/// where the object transmits less.
pub(super) fn cast_shadow(known: &Known, direction: f64) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    let soft = soft_shadow(known, direction);
    Image::from_fn(w, h, |x, y| {
        let at = (x, y);
        let beside = 1.0 - known.mask[at].0;
        known.photo[at].scale(1.0 - (1.0 - SHADOW_LIGHT as f32) * soft[at].0 * beside)
    })
}

/// Density of the shadow, moved away from the object and blurred.
fn soft_shadow(known: &Known, direction: f64) -> Image<Coverage> {
    let (dx, dy) = shadow_offset(known.box_px, direction);
    let (w, h) = known.photo.size();
    let dense = known.transmittance.zip_map(&known.mask, |t, m| {
        Coverage(m.0 * (1.0 - (t.r + t.g + t.b) / 3.0))
    });
    let moved = Image::from_fn(w, h, |x, y| dense.nearest(x as isize - dx, y as isize - dy));
    filter::gaussian_blur(&moved, CAST_BLUR_PX)
}

fn shadow_offset([left, top, right, bottom]: [f64; 4], direction: f64) -> (isize, isize) {
    let reach = CAST_SHADOW_REACH * (right - left).min(bottom - top);
    let (sin, cos) = libm::sincos(direction);
    (
        (reach * cos).round() as isize,
        (reach * sin).round() as isize,
    )
}
