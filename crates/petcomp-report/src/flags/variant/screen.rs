//! What the screen is, and what lies on it.

use crate::matte::truth::Known;
use petcomp::Image;
use petcomp::LinearRgb;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The photo on another screen, of which the object hides and shades the same shares.
pub(super) fn on(known: &Known, other: impl Fn(LinearRgb) -> LinearRgb + Sync) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    Image::from_fn(w, h, |x, y| {
        let at = (x, y);
        let (p, k) = (known.photo[at], known.screen[at]);
        let (from, to): ([f32; 3], [f32; 3]) = (k.into(), other(k).into());
        let key = (1..3).fold(0, |best, c| if from[c] > from[best] { c } else { best });
        if known.mask[at].0 == 0.0 {
            // Beside the object all is screen, shadow and noise.
            let light = <[f32; 3]>::from(p)[key] / from[key].max(f32::MIN_POSITIVE);
            return LinearRgb::from(to).scale(light);
        }
        p + known.transmittance[at] * (other(k) + k.scale(-1.0))
    })
}

/// What lets less than this through is opaque.
const OPAQUE: f32 = 0.15;
/// Least share of the object that is opaque, for there to be something to paint.
const PAINTED: f64 = 0.02;

/// The object with its opaque parts painted in the screen's hue, as bright as they were; nothing where it has none.
pub(super) fn hued(known: &Known) -> Option<Image<LinearRgb>> {
    let opaque = known.transmittance.map(|t| t.r.max(t.g).max(t.b) < OPAQUE);
    let area = |set: &mut dyn Iterator<Item = bool>| set.filter(|p| *p).count() as f64;
    let painted = area(&mut opaque.pixels().iter().copied());
    if painted < PAINTED * area(&mut known.mask.pixels().iter().map(|c| c.0 > 0.5)) {
        return None;
    }
    let (w, h) = known.photo.size();
    Some(Image::from_fn(w, h, |x, y| {
        let (p, f, k) = (
            known.photo[(x, y)],
            known.foreground[(x, y)],
            known.screen[(x, y)],
        );
        let sum = |c: LinearRgb| c.r + c.g + c.b;
        if opaque[(x, y)] {
            p + f.scale(-1.0) + k.scale(sum(f) / sum(k).max(f32::MIN_POSITIVE))
        } else {
            p
        }
    }))
}

/// The photo with the screen's light changed by a factor, as much of it as is seen through the object.
fn relit(known: &Known, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    Image::from_fn(w, h, |x, y| {
        let at = (x, y);
        let change = light(x as f64 + 0.5, y as f64 + 0.5) - 1.0;
        let t = if known.mask[at].0 == 0.0 {
            known.photo[at]
        } else {
            known.transmittance[at] * known.screen[at]
        };
        known.photo[at] + t.scale(change)
    })
}

/// Even numbers of 0 to 1.
fn shares(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move || f64::from(rng.next_u32()) / f64::from(u32::MAX)
}

/// Creases of a screen, how much darker they are and how wide in pixels.
const CREASES: usize = 12;
const CREASE: [f64; 2] = [0.06, 4.0];

/// Slack cloth: creases in all directions, dark on one side and light on the other.
pub(super) fn wrinkled(known: &Known, seed: u64) -> Image<LinearRgb> {
    let mut share = shares(seed);
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let creases: Vec<[f64; 4]> = (0..CREASES)
        .map(|_| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * share());
            [w * share(), h * share(), sin, cos]
        })
        .collect();
    relit(known, |x, y| {
        let bend = |[u, v, sin, cos]: &[f64; 4]| {
            let across = ((x - u) * sin + (y - v) * cos) / CREASE[1];
            across * libm::exp(0.5 * (1.0 - across * across))
        };
        (1.0 + CREASE[0] * creases.iter().map(bend).sum::<f64>()).max(0.0) as f32
    })
}

/// Specks on a screen, their radii in pixels from and to, and what they leave of the light.
const SPECKS: usize = 60;
const SPECK_PX: [f64; 2] = [0.7, 2.2];
const SPECK_LIGHT: f32 = 0.35;

/// Dust and crumbs all over.
pub(super) fn specks(known: &Known, seed: u64) -> Image<LinearRgb> {
    let mut share = shares(seed);
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let mut draw = |from: f64, to: f64| from + (to - from) * share();
    let specks: Vec<[f64; 3]> = (0..SPECKS)
        .map(|_| [draw(0.0, w), draw(0.0, h), draw(SPECK_PX[0], SPECK_PX[1])])
        .collect();
    relit(known, |x, y| {
        let depth = |[u, v, r]: &[f64; 3]| (r + 0.5 - (x - u).hypot(y - v)).clamp(0.0, 1.0);
        1.0 - (1.0 - SPECK_LIGHT) * specks.iter().map(depth).fold(0.0, f64::max) as f32
    })
}

/// The table beyond the screen's edge: brown.
const TABLE: LinearRgb = LinearRgb::new(0.25, 0.15, 0.08);
/// Where the screen ends, as a share of the way from the border to the object.
const SCREEN_ENDS: f64 = 0.4;

/// A screen that ends on the right, slightly aslant, with a table beyond.
pub(super) fn ending(known: &Known) -> Image<LinearRgb> {
    let (w, h) = known.photo.size();
    let edge = w as f64 - SCREEN_ENDS * (w as f64 - known.box_px[2]);
    Image::from_fn(w, h, |x, y| {
        let slant = 0.02 * (y as f64 - 0.5 * h as f64);
        let beyond = (x as f64 + 1.0 - edge - slant).clamp(0.0, 1.0) as f32;
        known.photo[(x, y)].scale(1.0 - beyond) + TABLE.scale(beyond)
    })
}
