//! Colour and opacity that are processed together, as one vector register.

use crate::pixel::{Film, LinearRgb, Mix, PremulRgba};
use crate::render::float4::{Blend, Float4};
use bytemuck::{Pod, Zeroable};

/// Colour and alpha, then opacity per channel and 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub(super) struct Float8([f32; 8]);

impl Float8 {
    pub(super) const ZERO: Self = Self([0.0; 8]);

    /// A colour and an opacity.
    #[inline(always)]
    pub(super) fn new(color: Float4, opacity: Float4) -> Self {
        let ([r, g, b, a], [p, q, s, t]) = (color.0, opacity.0);
        Self([r, g, b, a, p, q, s, t])
    }

    #[inline(always)]
    pub(super) fn color(self) -> Float4 {
        let [r, g, b, a, ..] = self.0;
        Float4([r, g, b, a])
    }

    #[inline(always)]
    pub(super) fn opacity(self) -> Float4 {
        let [.., p, q, s, t] = self.0;
        Float4([p, q, s, t])
    }

    /// `self + a * b`, element by element.
    #[inline(always)]
    pub(super) fn add_product(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + a.0[i] * b.0[i]))
    }
}

impl Blend for Float8 {
    #[inline(always)]
    fn lerp(self, o: Self, t: f32) -> Self {
        Self(std::array::from_fn(|i| {
            self.0[i] + t * (o.0[i] - self.0[i])
        }))
    }
}

impl Mix for Float8 {
    #[inline(always)]
    fn add_scaled(self, weight: f32, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + weight * o.0[i]))
    }
}

impl From<Film> for Float8 {
    /// With 0 as alpha.
    #[inline(always)]
    fn from(film: Film) -> Self {
        Self::new(film.color.into(), film.opacity.into())
    }
}

impl From<PremulRgba> for Float8 {
    #[inline(always)]
    fn from(p: PremulRgba) -> Self {
        Self::new(p.into(), LinearRgb::grey(p.a).into())
    }
}
