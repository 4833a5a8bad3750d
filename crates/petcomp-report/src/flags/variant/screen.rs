//! Variants of the screen and of what lies on it.

use crate::matte::truth::Known;
use crate::matte::{largest_channel, uniform};
use petcomp::{Image, LinearRgb};
use std::f64::consts::TAU;

/// The photo on another screen, with the same shares hidden and shaded by the object.
pub(super) fn on_screen(
    known: &Known,
    other: impl Fn(LinearRgb) -> LinearRgb + Sync,
) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    Image::from_fn(w, h, |x, y| {
        let screen = other(known.screen[(x, y)]);
        pixel_on_screen(known, (x, y), screen)
    })
}

fn pixel_on_screen(known: &Known, at: (usize, usize), other: LinearRgb) -> LinearRgb {
    let (photo, screen) = (known.photo[at], known.screen[at]);
    if known.mask[at].0 == 0.0 {
        // Next to the object everything is screen, shadow and noise.
        other.scale(light_on_screen(photo, screen))
    } else {
        photo + known.transmittance[at] * (other + screen.scale(-1.0))
    }
}

/// How bright a photo of a screen is, in the channel of the screen's colour.
fn light_on_screen(photo: LinearRgb, screen: LinearRgb) -> f32 {
    let [photo, screen]: [[f32; 3]; 2] = [photo.into(), screen.into()];
    let key = largest_channel(screen);
    photo[key] / screen[key].max(f32::MIN_POSITIVE)
}

/// A transmittance below this is opaque.
const OPAQUE_TRANSMITTANCE: f32 = 0.15;
/// The smallest share of an object that is painted where it is opaque.
const MIN_PAINTED_SHARE: f64 = 0.02;

/// The object with its opaque parts painted in the screen's hue, as bright as before; none if it
/// has no such parts.
pub(super) fn hued(known: &Known) -> Option<Image<LinearRgb>> {
    let opaque = known
        .transmittance
        .map(|t| t.r.max(t.g).max(t.b) < OPAQUE_TRANSMITTANCE);
    let object = known.mask.pixels().iter().filter(|c| c.0 > 0.5).count();
    if (opaque.count() as f64) < MIN_PAINTED_SHARE * object as f64 {
        return None;
    }
    let (w, h) = known.photo.size();
    Some(Image::from_fn(w, h, |x, y| {
        if opaque[(x, y)] {
            painted(known, (x, y))
        } else {
            known.photo[(x, y)]
        }
    }))
}

/// A pixel whose foreground has the screen's hue.
fn painted(known: &Known, at: (usize, usize)) -> LinearRgb {
    let (foreground, screen) = (known.foreground[at], known.screen[at]);
    let brightness = channel_sum(foreground) / channel_sum(screen).max(f32::MIN_POSITIVE);
    known.photo[at] + foreground.scale(-1.0) + screen.scale(brightness)
}

fn channel_sum(c: LinearRgb) -> f32 {
    c.r + c.g + c.b
}

/// The photo with the screen's light changed by a factor, as far as it is seen through the object.
fn relit(known: &Known, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    Image::from_fn(w, h, |x, y| {
        let change = light(x as f64 + 0.5, y as f64 + 0.5) - 1.0;
        known.photo[(x, y)] + screen_light(known, (x, y)).scale(change)
    })
}

/// The part of a pixel's light that comes from the screen.
fn screen_light(known: &Known, at: (usize, usize)) -> LinearRgb {
    if known.mask[at].0 == 0.0 {
        known.photo[at]
    } else {
        known.transmittance[at] * known.screen[at]
    }
}

/// Creases of a screen, how much darker they are and how wide in pixels.
const CREASE_COUNT: usize = 12;
const CREASE_DEPTH: f64 = 0.06;
const CREASE_WIDTH_PX: f64 = 4.0;

/// Slack cloth: creases in all directions, dark on one side and light on the other.
pub(super) fn wrinkled(known: &Known, seed: u64) -> Image<LinearRgb> {
    let mut draw = uniform(seed);
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let creases: Vec<Crease> = (0..CREASE_COUNT)
        .map(|_| Crease::random(w, h, &mut draw))
        .collect();
    relit(known, |x, y| {
        let bends = creases.iter().map(|crease| crease.bend(x, y));
        (1.0 + CREASE_DEPTH * bends.sum::<f64>()).max(0.0) as f32
    })
}

/// A straight line through a point.
struct Crease {
    through: [f64; 2],
    sin: f64,
    cos: f64,
}

impl Crease {
    fn random(w: f64, h: f64, mut draw: impl FnMut() -> f64) -> Self {
        let (sin, cos) = libm::sincos(TAU * draw());
        Self {
            through: [w * draw(), h * draw()],
            sin,
            cos,
        }
    }

    /// Inclination of the cloth at a point: 1 and -1 on either side of the crease.
    fn bend(&self, x: f64, y: f64) -> f64 {
        let [u, v] = self.through;
        let across = ((x - u) * self.sin + (y - v) * self.cos) / CREASE_WIDTH_PX;
        across * libm::exp(0.5 * (1.0 - across * across))
    }
}

/// Specks on a screen, their minimum and maximum radii in pixels, and the share of light that they
/// leave.
const SPECK_COUNT: usize = 60;
const SPECK_RADII_PX: [f64; 2] = [0.7, 2.2];
const SPECK_LIGHT: f32 = 0.35;

/// Dust and crumbs all over.
pub(super) fn specks(known: &Known, seed: u64) -> Image<LinearRgb> {
    let mut draw = uniform(seed);
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let specks: Vec<Speck> = (0..SPECK_COUNT)
        .map(|_| Speck::random(w, h, &mut draw))
        .collect();
    relit(known, |x, y| {
        let cover = specks.iter().map(|speck| speck.cover(x, y));
        1.0 - (1.0 - SPECK_LIGHT) * cover.fold(0.0, f64::max) as f32
    })
}

struct Speck {
    center: [f64; 2],
    radius: f64,
}

impl Speck {
    fn random(w: f64, h: f64, mut draw: impl FnMut() -> f64) -> Self {
        let [least, most] = SPECK_RADII_PX;
        Self {
            center: [w * draw(), h * draw()],
            radius: least + (most - least) * draw(),
        }
    }

    /// Coverage of a pixel.
    fn cover(&self, x: f64, y: f64) -> f64 {
        let [u, v] = self.center;
        (self.radius + 0.5 - (x - u).hypot(y - v)).clamp(0.0, 1.0)
    }
}

/// The table beyond the screen's edge: brown.
const TABLE: LinearRgb = LinearRgb::new(0.25, 0.15, 0.08);
/// Where the screen ends, as a share of the way from the border to the object.
const SCREEN_END_SHARE: f64 = 0.4;

/// A screen that ends on the right, slightly aslant, with a table beyond.
pub(super) fn ending(known: &Known) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    let edge = w as f64 - SCREEN_END_SHARE * (w as f64 - known.box_px[2]);
    Image::from_fn(w, h, |x, y| {
        let slant = 0.02 * (y as f64 - 0.5 * h as f64);
        let beyond = (x as f64 + 1.0 - edge - slant).clamp(0.0, 1.0) as f32;
        known.photo[(x, y)].scale(1.0 - beyond) + TABLE.scale(beyond)
    })
}
