//! Four numbers that are processed together, as one vector register.

use crate::pixel::{LinearRgb, Mix, PremulRgba};
use bytemuck::{Pod, Zeroable};

/// Values that can be interpolated.
pub(super) trait Blend: Copy {
    /// `self` at 0, `o` at 1; exactly the value if both are equal.
    fn lerp(self, o: Self, t: f32) -> Self;

    /// Bilinear interpolation between the four corners of a cell.
    #[inline(always)]
    fn bilinear(top: [Self; 2], bottom: [Self; 2], fx: f32, fy: f32) -> Self {
        top[0]
            .lerp(bottom[0], fy)
            .lerp(top[1].lerp(bottom[1], fy), fx)
    }
}

/// Red, green, blue and a fourth: alpha of a texel, 1 of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub(super) struct Float4(pub(super) [f32; 4]);

impl Float4 {
    pub(super) const ZERO: Self = Self([0.0; 4]);
    pub(super) const ONE: Self = Self([1.0; 4]);

    /// A light: a number for each colour channel, and 1.
    #[inline(always)]
    pub(super) fn light_from_fn(channel: impl Fn(usize) -> f32) -> Self {
        let [r, g, b] = [0, 1, 2].map(channel);
        Self([r, g, b, 1.0])
    }

    /// A light multiplied by a factor.
    #[inline(always)]
    pub(super) fn light_scaled(self, factor: f32) -> Self {
        Self::light_from_fn(|channel| factor * self.0[channel])
    }

    #[inline(always)]
    pub(super) fn rgb(self) -> LinearRgb {
        LinearRgb::new(self.0[0], self.0[1], self.0[2])
    }

    #[inline(always)]
    pub(super) fn alpha(self) -> f32 {
        self.0[3]
    }

    #[inline(always)]
    pub(super) fn scaled(self, factor: f32) -> Self {
        Self(self.0.map(|v| factor * v))
    }

    #[inline(always)]
    pub(super) fn times(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * o.0[i]))
    }

    /// `self + a * b`, element by element.
    #[inline(always)]
    pub(super) fn add_product(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + a.0[i] * b.0[i]))
    }

    /// `1 - self`, element by element.
    #[inline(always)]
    pub(super) fn complement(self) -> Self {
        Self(self.0.map(|v| 1.0 - v))
    }

    /// Every element clamped to 0 to 1; NaN becomes 0.
    #[inline(always)]
    #[expect(clippy::manual_clamp, reason = "turns NaN into 0")]
    pub(super) fn clamped(self) -> Self {
        Self(self.0.map(|v| v.max(0.0).min(1.0)))
    }

    /// Every element, or this if it is less.
    #[inline(always)]
    pub(super) fn at_least(self, least: f32) -> Self {
        Self(self.0.map(|v| v.max(least)))
    }

    /// The same with another fourth element.
    #[inline(always)]
    pub(super) fn with_fourth(self, fourth: f32) -> Self {
        Self([self.0[0], self.0[1], self.0[2], fourth])
    }
}

impl Blend for Float4 {
    /// Interpolates both columns at once, in one register, then between them.
    #[inline(always)]
    fn bilinear(top: [Self; 2], bottom: [Self; 2], fx: f32, fy: f32) -> Self {
        let (top, bottom): ([f32; 8], [f32; 8]) = (bytemuck::cast(top), bytemuck::cast(bottom));
        let columns: [f32; 8] = std::array::from_fn(|i| top[i] + fy * (bottom[i] - top[i]));
        let [left, right]: [Self; 2] = bytemuck::cast(columns);
        left.lerp(right, fx)
    }

    #[inline(always)]
    fn lerp(self, o: Self, t: f32) -> Self {
        Self(std::array::from_fn(|i| {
            self.0[i] + t * (o.0[i] - self.0[i])
        }))
    }
}

impl Mix for Float4 {
    #[inline(always)]
    fn add_scaled(self, weight: f32, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + weight * o.0[i]))
    }
}

impl From<LinearRgb> for Float4 {
    /// With 0 as the fourth element.
    #[inline(always)]
    fn from(c: LinearRgb) -> Self {
        Self([c.r, c.g, c.b, 0.0])
    }
}

impl From<PremulRgba> for Float4 {
    #[inline(always)]
    fn from(p: PremulRgba) -> Self {
        Self([p.r, p.g, p.b, p.a])
    }
}
