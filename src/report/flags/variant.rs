//! Photos made harder, their outlines still known.

use super::Trial;
use super::sides;
use crate::color::{linear_to_srgb, srgb_to_linear};
use crate::filter;
use crate::geom::Point2;
use crate::image::{Image, Roi};
use crate::pixel::{Coverage, LinearRgb};
use crate::report::matte::{normal, truth::Known};

/// What should become of a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// A cut-out that is right, or says that it may not be.
    Right,
    /// A cut-out and a doubt: the photo does not show all of the object.
    Flagged,
    /// No cut-out.
    Refused,
}

/// A way in which a photo is harder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Variant {
    /// As it was taken.
    Plain,
    /// The light falls off by 15 % over the picture.
    Uneven,
    /// By 60 %.
    VeryUneven,
    /// The edge of a hard shadow lies on the screen beside the object.
    ShadowBeside,
    /// The edge of a hard shadow runs across the object.
    ShadowAcross,
    /// Three times the light: highlights, or all of the screen, saturate.
    Overexposed,
    /// Sensor noise of 0.03.
    Noisy,
    /// The lens is out of focus by a blur of 2 pixels.
    Blurred,
    /// A screen of the other colour: of the plastic's own, where it has one.
    OtherScreen,
    /// A grey screen.
    GreyScreen,
    /// What is opaque of the object has the screen's hue.
    ScreenHue,
    /// A tenth of the object lies beyond the border of the photo.
    OverBorder,
    /// Two objects beside each other.
    Two,
    /// The screen without an object.
    Empty,
    /// The same in light that falls off by 60 %.
    EmptyUneven,
    /// 64 pixels wide.
    Tiny,
}

impl Variant {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::Plain,
        Self::Uneven,
        Self::VeryUneven,
        Self::ShadowBeside,
        Self::ShadowAcross,
        Self::Overexposed,
        Self::Noisy,
        Self::Blurred,
        Self::OtherScreen,
        Self::GreyScreen,
        Self::ScreenHue,
        Self::OverBorder,
        Self::Two,
        Self::Empty,
        Self::EmptyUneven,
        Self::Tiny,
    ];

    /// What it is called in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "as taken",
            Self::Uneven => "screen 15 % uneven",
            Self::VeryUneven => "screen 60 % uneven",
            Self::ShadowBeside => "hard shadow beside",
            Self::ShadowAcross => "hard shadow across",
            Self::Overexposed => "overexposed 3 times",
            Self::Noisy => "noise 0.03",
            Self::Blurred => "out of focus",
            Self::OtherScreen => "other screen colour",
            Self::GreyScreen => "grey screen",
            Self::ScreenHue => "object of the screen's hue",
            Self::OverBorder => "over the border",
            Self::Two => "two objects",
            Self::Empty => "empty screen",
            Self::EmptyUneven => "empty, 60 % uneven",
            Self::Tiny => "64 pixels",
        }
    }

    /// What should become of such a photo.
    pub fn expected(self) -> Expected {
        match self {
            Self::OverBorder => Expected::Flagged,
            Self::Two | Self::Empty | Self::EmptyUneven => Expected::Refused,
            _ => Expected::Right,
        }
    }

    /// The photo in this variant; nothing where it cannot be made of it.
    pub(super) fn of(self, known: &Known, seed: u64) -> Option<Trial> {
        let plain = || Trial {
            photo: known.photo.clone(),
            mask: known.mask.clone(),
            box_px: known.box_px,
            expected: self.expected(),
        };
        let with = |photo: Image<LinearRgb>| Trial { photo, ..plain() };
        let direction = GOLDEN_ANGLE * seed as f64;
        let trial = match self {
            Self::Plain => plain(),
            Self::Uneven => with(lit(&known.photo, direction, 0.15)),
            Self::VeryUneven => with(lit(&known.photo, direction, 0.6)),
            Self::ShadowBeside => with(shadowed(known, 0.5)),
            Self::ShadowAcross => with(shadowed(known, -0.3)),
            Self::Overexposed => with(known.photo.map(|p| p.scale(3.0))),
            Self::Noisy => with(noisy(&known.photo, 0.03, seed)),
            Self::Blurred => with(filter::gaussian_blur(&known.photo, 2.0)),
            Self::OtherScreen => with(on(known, |k| LinearRgb::new(k.r, k.b, k.g))),
            Self::GreyScreen => with(on(known, |k| LinearRgb::grey(k.r.max(k.g).max(k.b)))),
            Self::ScreenHue => with(hued(known)?),
            Self::OverBorder => over_border(plain()),
            Self::Two => two(&plain()),
            Self::Empty => with(noisy(&known.screen, known.noise.read as f32, seed)),
            Self::EmptyUneven => with(noisy(&lit(&known.screen, direction, 0.6), known.noise.read as f32, seed)),
            Self::Tiny => tiny(&plain()),
        };
        Some(Trial { photo: trial.photo.map(taken), ..trial })
    }
}

/// Turns a seed into a direction: no two of the first hundred are alike.
const GOLDEN_ANGLE: f64 = 2.399_963;

/// A value as a camera of 8 bits stores it.
fn taken(p: LinearRgb) -> LinearRgb {
    p.map(|v| srgb_to_linear((255.0 * linear_to_srgb(v.clamp(0.0, 1.0))).round() / 255.0))
}

/// Light that falls off by a share along a direction, as that of a lamp to the side does.
fn lit(photo: &Image<LinearRgb>, direction: f64, share: f64) -> Image<LinearRgb> {
    let (w, h) = photo.size();
    let (sin, cos) = libm::sincos(direction);
    let reach = 0.5 * (cos.abs() * w as f64 + sin.abs() * h as f64);
    scaled(photo, |x, y| {
        let along = 0.5 + 0.5 * (cos * (x - 0.5 * w as f64) + sin * (y - 0.5 * h as f64)) / reach;
        (1.0 - share * along * along) as f32
    })
}

fn scaled(photo: &Image<LinearRgb>, light: impl Fn(f64, f64) -> f32 + Sync) -> Image<LinearRgb> {
    let at = |x: usize, y: usize| photo[(x, y)].scale(light(x as f64 + 0.5, y as f64 + 0.5));
    Image::from_fn(photo.width(), photo.height(), at)
}

/// What is left of the light in the shadow.
const SHADOW: f64 = 0.6;
/// Width of the shadow's edge, pixels.
const PENUMBRA_PX: f64 = 1.5;

/// A slanted shadow from the right; its edge lies `beyond` of the way from the object's box to the border, or, below 0,
/// by so much of the object's width within it.
fn shadowed(known: &Known, beyond: f64) -> Image<LinearRgb> {
    let [left, _, right, _] = known.box_px;
    let (w, h) = (known.photo.width() as f64, known.photo.height() as f64);
    let free = if beyond > 0.0 { w - right } else { right - left };
    let edge = right + beyond * free;
    scaled(&known.photo, |x, y| {
        let slant = edge + 0.1 * (y - 0.5 * h) * f64::from(u8::from(beyond < 0.0));
        let inside = ((x - slant) / PENUMBRA_PX).clamp(0.0, 1.0);
        (1.0 - (1.0 - SHADOW) * inside) as f32
    })
}

fn noisy(photo: &Image<LinearRgb>, sigma: f32, seed: u64) -> Image<LinearRgb> {
    let mut draw = normal(seed);
    let mut noisy = photo.clone();
    noisy.pixels_mut().iter_mut().for_each(|p| *p = p.map(|v| v + sigma * draw() as f32));
    noisy
}

/// The photo on another screen, of which the object hides and shades the same shares.
fn on(known: &Known, other: impl Fn(LinearRgb) -> LinearRgb + Sync) -> Image<LinearRgb> {
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
fn hued(known: &Known) -> Option<Image<LinearRgb>> {
    let opaque = known.transmittance.map(|t| t.r.max(t.g).max(t.b) < OPAQUE);
    let area = |set: &mut dyn Iterator<Item = bool>| set.filter(|p| *p).count() as f64;
    let painted = area(&mut opaque.pixels().iter().copied());
    if painted < PAINTED * area(&mut known.mask.pixels().iter().map(|c| c.0 > 0.5)) {
        return None;
    }
    let (w, h) = known.photo.size();
    Some(Image::from_fn(w, h, |x, y| {
        let (p, f, k) = (known.photo[(x, y)], known.foreground[(x, y)], known.screen[(x, y)]);
        let sum = |c: LinearRgb| c.r + c.g + c.b;
        if opaque[(x, y)] { p + f.scale(-1.0) + k.scale(sum(f) / sum(k).max(f32::MIN_POSITIVE)) } else { p }
    }))
}

/// How much of the object's width the border cuts off.
const CUT_OFF: f64 = 0.1;

fn over_border(whole: Trial) -> Trial {
    let [left, top, right, bottom] = whole.box_px;
    let from = (left + CUT_OFF * (right - left)) as usize;
    let (w, h) = whole.photo.size();
    let roi = Roi::spanning(from..w, 0..h);
    let box_px = [0.0, top, right - from as f64, bottom];
    Trial { photo: whole.photo.crop(roi), mask: whole.mask.crop(roi), box_px, ..whole }
}

/// The photo and its mirror image beside each other.
fn two(one: &Trial) -> Trial {
    let w = one.photo.width();
    let column = |x: usize| if x < w { x } else { 2 * w - 1 - x };
    let photo = Image::from_fn(2 * w, one.photo.height(), |x, y| one.photo[(column(x), y)]);
    let mask = Image::from_fn(2 * w, one.mask.height(), |x, y| one.mask[(column(x), y)]);
    Trial { photo, mask, ..one.clone() }
}

/// The longer side of a tiny photo, pixels.
const TINY_PX: usize = 64;

fn tiny(whole: &Trial) -> Trial {
    let (w, h) = whole.photo.size();
    let scale = TINY_PX as f64 / w.max(h) as f64;
    let side = |len: usize| (len as f64 * scale).round() as usize;
    let small = |x: f64, y: f64| Point2::new(x * side(w) as f64 / w as f64, y * side(h) as f64 / h as f64);
    let [left, top, right, bottom] = whole.box_px;
    Trial {
        photo: filter::resize(&whole.photo, side(w), side(h)),
        mask: filter::resize::<Coverage>(&whole.mask, side(w), side(h)),
        box_px: sides(&[small(left, top), small(right, bottom)]),
        expected: whole.expected,
    }
}
