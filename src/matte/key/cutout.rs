//! The picture seen through its matte, with the screen's colour cast taken away.

use super::model::{Model, primary_channel};
use super::options::KeyOptions;
use super::raw::split_channels;
use crate::pixel::{LinearRgb, PremulRgba};

/// What the cut-out needs to know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Despill {
    /// Share of the excess that is taken away.
    pub(super) factor: f32,
    /// Weight of the earlier of the two other channels.
    pub(super) balance: f32,
    /// The screen is subtracted instead.
    pub(super) subtract: bool,
}

impl Despill {
    pub(super) fn new(options: &KeyOptions) -> Self {
        Self {
            factor: options.despill_factor,
            balance: options.despill_balance,
            subtract: options.subtract_screen,
        }
    }

    /// One pixel of the cut-out, premultiplied.
    #[inline(always)]
    pub(super) fn cutout<M: Model, const PRIMARY: usize>(
        &self,
        p: PremulRgba,
        m: f32,
        key: LinearRgb,
    ) -> PremulRgba {
        let p = M::seen(p);
        let c = PremulRgba::new(p.r * m, p.g * m, p.b * m, p.a * m);
        if self.subtract {
            without_screen(p, m, key)
        } else {
            self.despilled::<M, PRIMARY>(c)
        }
    }

    /// The primary channel loses its excess over the mix of the others.
    #[inline(always)]
    fn despilled<M: Model, const PRIMARY: usize>(&self, c: PremulRgba) -> PremulRgba {
        let (main, lo, hi) = split_channels::<PRIMARY>(c);
        let amount = self.factor * (main - (self.balance * lo + (1.0 - self.balance) * hi));
        let main = if amount > 0.0 { main - amount } else { main };
        match PRIMARY {
            0 => PremulRgba { r: main, ..c },
            1 => PremulRgba { g: main, ..c },
            _ => PremulRgba { b: main, ..c },
        }
    }

    /// One pixel of the cut-out against a screen of its own.
    #[inline(always)]
    pub(super) fn cutout_against<M: Model>(
        &self,
        p: PremulRgba,
        m: f32,
        key: LinearRgb,
        fixed: Option<usize>,
    ) -> PremulRgba {
        match fixed.unwrap_or_else(|| primary_channel(key)) {
            0 => self.cutout::<M, 0>(p, m, key),
            1 => self.cutout::<M, 1>(p, m, key),
            _ => self.cutout::<M, 2>(p, m, key),
        }
    }
}

/// `max(0, I - (1 - M) K)`: what the screen does not explain.
#[inline(always)]
fn without_screen(p: PremulRgba, m: f32, key: LinearRgb) -> PremulRgba {
    PremulRgba::new(
        rest(p.r, m, key.r),
        rest(p.g, m, key.g),
        rest(p.b, m, key.b),
        p.a * m,
    )
}

/// What one channel of the screen leaves of a pixel's.
#[inline(always)]
fn rest(c: f32, m: f32, k: f32) -> f32 {
    let left = c - (1.0 - m) * k;
    if left > 0.0 { left } else { 0.0 }
}
