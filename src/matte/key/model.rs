//! The three behaviours of the raw matte, one type each, so that a row loop is compiled for exactly
//! one of them.

use super::options::Profile;
use crate::pixel::{LinearRgb, PremulRgba};

/// What the profiles compute differently at a single pixel.
pub(super) trait Model: 'static {
    /// Colour codes are scaled as Blender 4.5 does it.
    const IS_LATE: bool = false;

    /// The balance mix of the two channels that are not the key's: `b lo + (1 - b) hi`, in one of
    /// two roundings.
    #[inline(always)]
    fn mix(balance: f32, lo: f32, hi: f32) -> f32 {
        balance * lo + (1.0 - balance) * hi
    }

    /// Every channel is above 1, so the pixel is foreground whatever its hue.
    #[inline(always)]
    fn is_overexposed(p: PremulRgba) -> bool {
        let first = if p.r < p.g { p.r } else { p.g };
        (if first < p.b { first } else { p.b }) > 1.0
    }

    /// The pixel cannot be keyed, and is background.
    #[inline(always)]
    fn is_lost(_: PremulRgba) -> bool {
        false
    }

    /// The pixel, transparent where it is lost.
    #[inline(always)]
    fn seen(p: PremulRgba) -> PremulRgba {
        if Self::is_lost(p) {
            PremulRgba::TRANSPARENT
        } else {
            p
        }
    }
}

/// Blender 3.4.
pub(super) struct V34;
/// Blender 4.2.
pub(super) struct V42;
/// Blender 4.5.
pub(super) struct V45;
/// Blender 3.4, with unusable pixels lost.
pub(super) struct Robust;

impl Model for V34 {}

impl Model for V42 {
    #[inline(always)]
    fn mix(balance: f32, lo: f32, hi: f32) -> f32 {
        hi + balance * (lo - hi)
    }
}

impl Model for V45 {
    const IS_LATE: bool = true;

    #[inline(always)]
    fn is_overexposed(p: PremulRgba) -> bool {
        lesser(lesser(lesser(p.r, p.g), p.b), p.a) > 1.0
    }
}

impl Model for Robust {
    #[inline(always)]
    fn is_lost(p: PremulRgba) -> bool {
        !is_usable(p)
    }
}

/// Largest magnitude that the robust profile computes with: beyond it, sums in single precision
/// could reach infinity.
const MAX_USABLE: f32 = 1e30;

/// The second of two numbers where it is less, else the first.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// Whether the robust profile takes a pixel as it is: no channel is NaN, infinite or too large to
/// compute with.
#[inline(always)]
pub(super) fn is_usable(p: PremulRgba) -> bool {
    // `&` instead of `&&`: without branches the row loops vectorise.
    (p.r.abs() <= MAX_USABLE)
        & (p.g.abs() <= MAX_USABLE)
        & (p.b.abs() <= MAX_USABLE)
        & (p.a.abs() <= MAX_USABLE)
}

/// Which channel a screen is keyed by: the largest; of equal ones the later, as Blender has it.
pub(super) fn primary_channel(key: LinearRgb) -> usize {
    let LinearRgb { r, g, b } = key;
    let after_red = if g > b { 1 } else { 2 };
    if r > g {
        if r > b { 0 } else { 2 }
    } else {
        after_red
    }
}

impl Profile {
    /// Which of Blender's three behaviours the larger stages follow.
    pub(super) fn behaviour(self) -> Behaviour {
        match self {
            Self::Blender34 | Self::Robust => Behaviour::V34,
            Self::Blender42 => Behaviour::V42,
            Self::Blender45 => Behaviour::V45,
        }
    }
}

/// Blender's three behaviours beyond the single pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Behaviour {
    V34,
    V42,
    V45,
}

impl Behaviour {
    /// Samples outside the picture repeat the border pixel; otherwise windows are cut off there.
    pub(super) fn repeats_border(self) -> bool {
        self == Self::V45
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_between_channels_go_to_the_later_one() {
        let cases = [
            ([1.0, 1.0, 1.0], 2),
            ([0.0, 1.0, 1.0], 2),
            ([1.0, 1.0, 0.0], 1),
            ([1.0, 0.0, 1.0], 2),
        ];
        for (key, want) in cases {
            assert_eq!(primary_channel(key.into()), want, "{key:?}");
        }
        assert_eq!(primary_channel(LinearRgb::new(3.0, 2.0, 1.0)), 0);
    }
}
