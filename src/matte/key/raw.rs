//! The raw matte: how far a pixel is from being as saturated as the screen.

use super::model::{Model, primary_channel};
use crate::pixel::{LinearRgb, PremulRgba};

/// What the raw matte needs to know of a key, worked out once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    /// Weight of the earlier of the two other channels.
    pub(super) balance: f32,
    /// The matte is not tied to brightness.
    pub(super) ignore_brightness: bool,
    /// Saturation of the key.
    pub(super) saturation: f32,
}

impl Terms {
    /// The terms of a key colour whose primary channel is `PRIMARY`.
    #[inline(always)]
    pub(super) fn for_key<M: Model, const PRIMARY: usize>(
        key: LinearRgb,
        balance: f32,
        ignore_brightness: bool,
    ) -> Self {
        let unkeyed = Self {
            balance,
            ignore_brightness,
            saturation: 0.0,
        };
        Self {
            saturation: unkeyed.saturation_of::<M, PRIMARY>(key.opaque()),
            ..unkeyed
        }
    }

    /// `(C[p] - v) |1 - v|`: the excess of the primary channel over the mix of the others.
    #[inline(always)]
    fn saturation_of<M: Model, const PRIMARY: usize>(&self, p: PremulRgba) -> f32 {
        let (main, lo, hi) = split_channels::<PRIMARY>(p);
        let v = M::mix(self.balance, lo, hi);
        let brightness = if self.ignore_brightness {
            1.0
        } else {
            (1.0 - v).abs()
        };
        (main - v) * brightness
    }

    /// The raw matte of one pixel.
    #[inline(always)]
    pub(super) fn matte<M: Model, const PRIMARY: usize>(&self, p: PremulRgba) -> f32 {
        let s = self.saturation_of::<M, PRIMARY>(p);
        let ratio = 1.0 - s / self.saturation;
        let inside = if s >= self.saturation { 0.0 } else { ratio };
        let is_front = M::is_overexposed(p) | (s < 0.0);
        let matte = if is_front { 1.0 } else { inside };
        if M::is_lost(p) { 0.0 } else { matte }
    }
}

/// The raw matte of one pixel against a screen of its own; the primary channel is the screen's, or
/// the one given.
#[inline(always)]
pub(super) fn matte_against<M: Model>(
    p: PremulRgba,
    key: LinearRgb,
    fixed: Option<usize>,
    terms: Terms,
) -> f32 {
    let Terms {
        balance,
        ignore_brightness: flat,
        ..
    } = terms;
    match fixed.unwrap_or_else(|| primary_channel(key)) {
        0 => Terms::for_key::<M, 0>(key, balance, flat).matte::<M, 0>(p),
        1 => Terms::for_key::<M, 1>(key, balance, flat).matte::<M, 1>(p),
        _ => Terms::for_key::<M, 2>(key, balance, flat).matte::<M, 2>(p),
    }
}

/// A pixel's primary channel and the other two in order.
#[inline(always)]
pub(super) fn split_channels<const PRIMARY: usize>(p: PremulRgba) -> (f32, f32, f32) {
    match PRIMARY {
        0 => (p.r, p.g, p.b),
        1 => (p.g, p.r, p.b),
        _ => (p.b, p.r, p.g),
    }
}
