//! The first rows of the chain: a photo's pixels and the raw matte made of them.

use super::Screen;
use super::cutout::Despill;
use super::model::{Model, Robust, V34, V42, V45, primary_channel};
use super::options::{KeyOptions, Profile};
use super::raw::{Terms, matte_against};
use super::ycc::recolored;
use crate::pixel::{Coverage, LinearRgb, PremulRgba};

/// Pixels that can be keyed: opaque scene-linear colour, or colour premultiplied by its alpha.
pub trait Photo: Copy + Default + Send + Sync + 'static {
    /// The pixel with its alpha.
    fn premul(self) -> PremulRgba;
}

impl Photo for LinearRgb {
    #[inline(always)]
    fn premul(self) -> PremulRgba {
        self.opaque()
    }
}

impl Photo for PremulRgba {
    #[inline(always)]
    fn premul(self) -> PremulRgba {
        self
    }
}

/// A row of the raw matte from a row of pixels, all against one key.
type MatteRow<P> = fn(&[P], &mut [f32], Terms);
/// A row of the raw matte, every pixel against its own key.
type MatteRowAgainst<P> = fn(&[P], &[LinearRgb], Option<usize>, &mut [f32], Terms);
/// The same of pixels with other colour differences.
type RecoloredRow<P> = fn(&[P], [&[f32]; 2], &mut [f32], Terms);
/// The same, every pixel against its own key.
type RecoloredRowAgainst<P> = fn(&[P], [&[f32]; 2], &[LinearRgb], Option<usize>, &mut [f32], Terms);
/// A row of the cut-out from rows of pixels and matte.
type CutoutRow<P> = fn(&[P], &[Coverage], LinearRgb, &mut [PremulRgba], Despill);
/// A row of the cut-out, every pixel against its own key.
type CutoutRowAgainst<P> =
    fn(&[P], &[Coverage], &[LinearRgb], Option<usize>, &mut [PremulRgba], Despill);

/// The row loops of one profile for one kind of pixel.
#[derive(Clone, Copy)]
struct Loops<P> {
    terms: [fn(LinearRgb, f32, bool) -> Terms; 3],
    matte: [MatteRow<P>; 3],
    matte_against: MatteRowAgainst<P>,
    recolored: [RecoloredRow<P>; 3],
    recolored_against: RecoloredRowAgainst<P>,
    cutout: [CutoutRow<P>; 3],
    cutout_against: CutoutRowAgainst<P>,
}

impl<P: Photo> Loops<P> {
    fn for_profile(profile: Profile) -> Self {
        match profile {
            Profile::Blender34 => Self::for_model::<V34>(),
            Profile::Blender42 => Self::for_model::<V42>(),
            Profile::Blender45 => Self::for_model::<V45>(),
            Profile::Robust => Self::for_model::<Robust>(),
        }
    }

    fn for_model<M: Model>() -> Self {
        Self {
            terms: [
                Terms::for_key::<M, 0>,
                Terms::for_key::<M, 1>,
                Terms::for_key::<M, 2>,
            ],
            matte: [
                matte_row::<P, M, 0>,
                matte_row::<P, M, 1>,
                matte_row::<P, M, 2>,
            ],
            matte_against: matte_row_against::<P, M>,
            recolored: [
                recolored_matte_row::<P, M, 0>,
                recolored_matte_row::<P, M, 1>,
                recolored_matte_row::<P, M, 2>,
            ],
            recolored_against: recolored_matte_row_against::<P, M>,
            cutout: [
                cutout_row::<P, M, 0>,
                cutout_row::<P, M, 1>,
                cutout_row::<P, M, 2>,
            ],
            cutout_against: cutout_row_against::<P, M>,
        }
    }
}

/// How pixels become matte and cut-out: a screen, a profile, and all that follows from them.
#[derive(Clone, Copy)]
pub(super) struct Keyer<'a, P> {
    screen: Screen<'a>,
    /// The primary channel of every pixel, where it does not follow each pixel's own key.
    channel: Option<usize>,
    terms: Terms,
    despill: Despill,
    loops: Loops<P>,
}

impl<'a, P: Photo> Keyer<'a, P> {
    pub(super) fn new(screen: Screen<'a>, channel: Option<usize>, options: &KeyOptions) -> Self {
        let loops = Loops::for_profile(options.profile);
        let (screen, color) = match screen {
            Screen::Color(c) => (Screen::Color(socket_color(c)), socket_color(c)),
            Screen::Plate(_) => (screen, LinearRgb::BLACK),
        };
        let terms = loops.terms[primary_channel(color)];
        Self {
            screen,
            channel,
            terms: terms(color, options.screen_balance, options.ignore_brightness),
            despill: Despill::new(options),
            loops,
        }
    }

    /// Row `y` of the raw matte.
    pub(super) fn matte_row(&self, y: usize, pixels: &[P], out: &mut [f32]) {
        match self.screen {
            Screen::Color(c) => self.loops.matte[primary_channel(c)](pixels, out, self.terms),
            Screen::Plate(plate) => {
                (self.loops.matte_against)(pixels, plate.row(y), self.channel, out, self.terms)
            }
        }
    }

    /// Row `y` of the raw matte of pixels with other colour differences.
    pub(super) fn recolored_matte_row(
        &self,
        y: usize,
        pixels: &[P],
        differences: [&[f32]; 2],
        out: &mut [f32],
    ) {
        let terms = self.terms;
        match self.screen {
            Screen::Color(c) => {
                self.loops.recolored[primary_channel(c)](pixels, differences, out, terms)
            }
            Screen::Plate(plate) => {
                let keys = plate.row(y);
                (self.loops.recolored_against)(pixels, differences, keys, self.channel, out, terms);
            }
        }
    }

    /// Row `y` of the cut-out.
    pub(super) fn cutout_row(
        &self,
        y: usize,
        pixels: &[P],
        matte: &[Coverage],
        out: &mut [PremulRgba],
    ) {
        match self.screen {
            Screen::Color(c) => {
                self.loops.cutout[primary_channel(c)](pixels, matte, c, out, self.despill)
            }
            Screen::Plate(plate) => {
                (self.loops.cutout_against)(
                    pixels,
                    matte,
                    plate.row(y),
                    self.channel,
                    out,
                    self.despill,
                );
            }
        }
    }
}

/// A key colour as Blender's colour socket holds it: never negative.
pub(super) fn socket_color(key: LinearRgb) -> LinearRgb {
    key.map(|v| if v > 0.0 { v } else { 0.0 })
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn matte_row<P: Photo, M: Model, const PRIMARY: usize>(
    pixels: &[P],
    out: &mut [f32],
    terms: Terms,
) {
    for (p, m) in pixels.iter().zip(out) {
        *m = terms.matte::<M, PRIMARY>(p.premul());
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn cutout_row<P: Photo, M: Model, const PRIMARY: usize>(
    pixels: &[P],
    matte: &[Coverage],
    key: LinearRgb,
    out: &mut [PremulRgba],
    despill: Despill,
) {
    for ((p, m), c) in pixels.iter().zip(matte).zip(out) {
        *c = despill.cutout::<M, PRIMARY>(p.premul(), m.0, key);
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn recolored_matte_row<P: Photo, M: Model, const PRIMARY: usize>(
    pixels: &[P],
    [cb, cr]: [&[f32]; 2],
    out: &mut [f32],
    terms: Terms,
) {
    for (((p, cb), cr), m) in pixels.iter().zip(cb).zip(cr).zip(out) {
        *m = terms.matte::<M, PRIMARY>(recolored::<M>(p.premul(), *cb, *cr));
    }
}

fn recolored_matte_row_against<P: Photo, M: Model>(
    pixels: &[P],
    [cb, cr]: [&[f32]; 2],
    keys: &[LinearRgb],
    channel: Option<usize>,
    out: &mut [f32],
    terms: Terms,
) {
    for ((((p, cb), cr), &key), m) in pixels.iter().zip(cb).zip(cr).zip(keys).zip(out) {
        *m = matte_against::<M>(recolored::<M>(p.premul(), *cb, *cr), key, channel, terms);
    }
}

fn matte_row_against<P: Photo, M: Model>(
    pixels: &[P],
    keys: &[LinearRgb],
    channel: Option<usize>,
    out: &mut [f32],
    terms: Terms,
) {
    for ((p, &key), m) in pixels.iter().zip(keys).zip(out) {
        *m = matte_against::<M>(p.premul(), key, channel, terms);
    }
}

fn cutout_row_against<P: Photo, M: Model>(
    pixels: &[P],
    matte: &[Coverage],
    keys: &[LinearRgb],
    channel: Option<usize>,
    out: &mut [PremulRgba],
    despill: Despill,
) {
    for (((p, m), &key), c) in pixels.iter().zip(matte).zip(keys).zip(out) {
        *c = despill.cutout_against::<M>(p.premul(), m.0, key, channel);
    }
}
