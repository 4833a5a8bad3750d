//! How much of the picture the object takes, and where it lies.

use super::super::Trial;
use super::sensor::noisy;
use crate::matte::truth::Known;
use petcomp::Coverage;
use petcomp::filter;
use petcomp::{Image, Roi};

/// A photo whose left border cuts off a share of the object's width.
pub(super) fn cut_off(whole: Trial, share: f64) -> Trial {
    let [left, top, right, bottom] = whole.box_px;
    let from = (left + share * (right - left)) as usize;
    let (w, h) = whole.photo.size();
    let roi = Roi::spanning(from..w, 0..h);
    let box_px = [0.0, top, right - from as f64, bottom];
    Trial {
        photo: whole.photo.crop(roi),
        mask: whole.mask.crop(roi),
        box_px,
        ..whole
    }
}

/// The photo and its mirror image beside each other.
pub(super) fn two(one: &Trial) -> Trial {
    let w = one.photo.width();
    let column = |x: usize| if x < w { x } else { 2 * w - 1 - x };
    let photo = Image::from_fn(2 * w, one.photo.height(), |x, y| one.photo[(column(x), y)]);
    let mask = Image::from_fn(2 * w, one.mask.height(), |x, y| one.mask[(column(x), y)]);
    Trial {
        photo,
        mask,
        ..one.clone()
    }
}

/// The longer side of a tiny photo, pixels.
const TINY_PX: usize = 64;

/// The photo made so small.
pub(super) fn tiny(whole: &Trial) -> Trial {
    let (w, h) = whole.photo.size();
    resized(whole, TINY_PX as f64 / w.max(h) as f64)
}

/// Pixels of a huge photo.
const HUGE_PX: f64 = 12e6;

/// The photo made so large: as sharp, in its own pixels, as a small photo with a good lens is not.
pub(super) fn huge(whole: &Trial) -> Trial {
    let (w, h) = whole.photo.size();
    resized(whole, (HUGE_PX / (w * h) as f64).sqrt())
}

fn resized(whole: &Trial, scale: f64) -> Trial {
    let (w, h) = whole.photo.size();
    let side = |len: usize| (len as f64 * scale).round() as usize;
    let [sx, sy] = [side(w) as f64 / w as f64, side(h) as f64 / h as f64];
    let [left, top, right, bottom] = whole.box_px;
    Trial {
        photo: filter::resize(&whole.photo, side(w), side(h)),
        mask: filter::resize::<Coverage>(&whole.mask, side(w), side(h)),
        box_px: [left * sx, top * sy, right * sx, bottom * sy],
        expected: whole.expected,
    }
}

/// The photo turned on its side: rows become columns.
pub(super) fn upright(flat: &Trial) -> Trial {
    let (w, h) = flat.photo.size();
    let [left, top, right, bottom] = flat.box_px;
    Trial {
        photo: Image::from_fn(h, w, |x, y| flat.photo[(y, x)]),
        mask: Image::from_fn(h, w, |x, y| flat.mask[(y, x)]),
        box_px: [top, left, bottom, right],
        expected: flat.expected,
    }
}

/// Share of the picture that the box of an object that fills it has.
const FULL: f64 = 0.8;

/// The photo cut to the object's box and what is then left around it.
pub(super) fn full_frame(whole: Trial) -> Trial {
    let [left, top, right, bottom] = whole.box_px;
    let (w, h) = whole.photo.size();
    // Margins of one width m: (width + 2 m)(height + 2 m) = width height / FULL.
    let (width, height) = (right - left, bottom - top);
    let sum = width + height;
    let margin = 0.25 * ((sum * sum + 4.0 * width * height * (1.0 / FULL - 1.0)).sqrt() - sum);
    let range = |low: f64, high: f64, len: usize| {
        (low - margin).max(0.0) as usize..((high + margin).ceil() as usize).min(len)
    };
    let roi = Roi::spanning(range(left, right, w), range(top, bottom, h));
    let (x, y) = (roi.x as f64, roi.y as f64);
    let box_px = [left - x, top - y, right - x, bottom - y];
    Trial {
        photo: whole.photo.crop(roi),
        mask: whole.mask.crop(roi),
        box_px,
        ..whole
    }
}

/// Share of the picture that a small object covers.
const SMALL: f64 = 0.02;

/// The object so small on the same screen.
pub(super) fn small_object(known: &Known, whole: Trial) -> Trial {
    let (w, h) = known.photo.size();
    let covered: f64 = known.mask.pixels().iter().map(|c| f64::from(c.0)).sum();
    let scale = (SMALL * (w * h) as f64 / covered).sqrt();
    shrunk(known, whole, [scale, scale])
}

/// How thin a thin object is beside what it was.
const THIN: f64 = 0.125;

/// The object squeezed across its length.
pub(super) fn thin_object(known: &Known, whole: Trial) -> Trial {
    let [left, top, right, bottom] = known.box_px;
    let scale = if right - left > bottom - top {
        [1.0, THIN]
    } else {
        [THIN, 1.0]
    };
    shrunk(known, whole, scale)
}

/// The object made smaller by factors across and down, in the middle of its screen: `F + T K`, with the sensor's noise.
fn shrunk(known: &Known, whole: Trial, [sx, sy]: [f64; 2]) -> Trial {
    let (w, h) = known.photo.size();
    let side = |len: usize, scale: f64| ((len as f64 * scale).round() as usize).clamp(1, len);
    let (sw, sh) = (side(w, sx), side(h, sy));
    let (x0, y0) = ((w - sw) / 2, (h - sh) / 2);
    let inside = |x: usize, y: usize| (x0..x0 + sw).contains(&x) && (y0..y0 + sh).contains(&y);
    let [light, through] =
        [&known.foreground, &known.transmittance].map(|p| filter::resize(p, sw, sh));
    let small = filter::resize(&known.mask, sw, sh);
    let at = |x: usize, y: usize| (x - x0, y - y0);
    let clean = Image::from_fn(w, h, |x, y| match inside(x, y) {
        true => light[at(x, y)] + through[at(x, y)] * known.screen[(x, y)],
        false => known.screen[(x, y)],
    });
    let mask = Image::from_fn(w, h, |x, y| {
        if inside(x, y) {
            small[at(x, y)]
        } else {
            Coverage(0.0)
        }
    });
    let [left, top, right, bottom] = known.box_px;
    let moved = |v: f64, from: usize, to: usize, at: usize| at as f64 + v * to as f64 / from as f64;
    let box_px = [
        moved(left, w, sw, x0),
        moved(top, h, sh, y0),
        moved(right, w, sw, x0),
        moved(bottom, h, sh, y0),
    ];
    Trial {
        photo: noisy(&clean, known.noise.read as f32, 1),
        mask,
        box_px,
        ..whole
    }
}
