//! The kinds of pixel, one type each, so that a wrong mix of colour or alpha does not compile.
//!
//! Geometry errors are loud, colour and alpha errors are silent; hence geometry gets names
//! (`world_from_camera`) and pixels get types. Everything inside the library is *scene-linear*,
//! Rec. 709 primaries, `f32`, values above 1 kept. Display-encoded types ([`Srgb8`], [`Srgba8`])
//! stop at [`io`](crate::io).
//!
//! Averaging identifiers, depths, straight alpha or display values is meaningless, and the compiler
//! rejects it:
//!
//! ```compile_fail
//! use petcomp::{Image, StraightRgba, filter};
//! let photo: Image<StraightRgba> = Image::new(8, 8);
//! let small = filter::resize(&photo, 4, 4); // error: `StraightRgba` pixels cannot be averaged
//! ```
//!
//! The same call on premultiplied pixels compiles:
//!
//! ```
//! use petcomp::{Image, PremulRgba, filter};
//! let cutout: Image<PremulRgba> = Image::new(8, 8);
//! let small = filter::resize(&cutout, 4, 4);
//! assert_eq!((small.width(), small.height()), (4, 4));
//! ```

use bytemuck::{Pod, Zeroable};

/// Opaque scene-linear colour, Rec. 709 primaries.
#[repr(C)]
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, serde::Serialize, serde::Deserialize,
)]
#[serde(from = "[f32; 3]", into = "[f32; 3]")]
pub struct LinearRgb {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
}

/// Scene-linear colour multiplied by its alpha (associated alpha): the form in which pixels add up.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PremulRgba {
    /// Red times alpha.
    pub r: f32,
    /// Green times alpha.
    pub g: f32,
    /// Blue times alpha.
    pub b: f32,
    /// Alpha: the share of the pixel that is covered, 0 to 1.
    pub a: f32,
}

/// Scene-linear colour with separate alpha (unassociated alpha): the form in which colours are edited.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct StraightRgba {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// Alpha, 0 to 1.
    pub a: f32,
}

/// Tinted see-through film: the light that a pixel adds, and the share of the light from behind
/// that each channel loses.
///
/// A [`PremulRgba`] with a separate alpha for each channel; all zeros is fully transparent. Stored
/// as opacity, which averages like alpha; [`Film::transmittance`] is 1 minus that.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Film {
    /// Light that the film reflects, multiplied by how much of the pixel it covers.
    pub color: LinearRgb,
    /// 1 minus the transmittance, per channel, 0 to 1.
    pub opacity: LinearRgb,
}

/// Display-encoded sRGB, 8 bits per channel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Srgb8 {
    /// Red.
    pub r: u8,
    /// Green.
    pub g: u8,
    /// Blue.
    pub b: u8,
}

/// Display-encoded sRGB with straight alpha, 8 bits per channel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Srgba8 {
    /// Red.
    pub r: u8,
    /// Green.
    pub g: u8,
    /// Blue.
    pub b: u8,
    /// Alpha, linear.
    pub a: u8,
}

/// The share of a pixel that something covers: a matte. 0 = nothing, 1 = all.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Pod, Zeroable)]
pub struct Coverage(pub f32);

/// Distance from the camera along its optical axis, metres.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Pod, Zeroable)]
pub struct Depth(pub f32);

/// Which object of a scene; 0 means none, the first object is 1.
#[repr(transparent)]
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Pod,
    Zeroable,
    serde::Serialize,
    serde::Deserialize,
)]
pub struct ObjectId(pub u32);

/// Pixels whose weighted sums are meaningful: they may be blurred, resampled and averaged.
#[diagnostic::on_unimplemented(
    message = "`{Self}` pixels cannot be averaged",
    note = "premultiply straight alpha and decode display values first"
)]
pub trait Mix: Copy + Default + Send + Sync {
    /// `self + weight * other`.
    fn add_scaled(self, weight: f32, other: Self) -> Self;
}

impl Mix for LinearRgb {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        Self {
            r: self.r + w * o.r,
            g: self.g + w * o.g,
            b: self.b + w * o.b,
        }
    }
}

impl Mix for PremulRgba {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        Self {
            r: self.r + w * o.r,
            g: self.g + w * o.g,
            b: self.b + w * o.b,
            a: self.a + w * o.a,
        }
    }
}

impl Mix for Film {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        Self {
            color: self.color.add_scaled(w, o.color),
            opacity: self.opacity.add_scaled(w, o.opacity),
        }
    }
}

impl Mix for Coverage {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        Self(self.0 + w * o.0)
    }
}

/// A plane of numbers of any meaning and sign: brightness, a band of a pyramid, an error.
impl Mix for f32 {
    #[inline(always)]
    fn add_scaled(self, w: f32, o: Self) -> Self {
        self + w * o
    }
}

impl LinearRgb {
    /// No light.
    pub const BLACK: Self = Self::new(0.0, 0.0, 0.0);
    /// One in every channel.
    pub const WHITE: Self = Self::new(1.0, 1.0, 1.0);

    /// A colour from its channels.
    #[inline(always)]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self { r, g, b }
    }

    /// Whether there is no light in any channel.
    pub(crate) fn is_black(&self) -> bool {
        *self == Self::BLACK
    }

    /// The same value in every channel.
    #[inline(always)]
    pub const fn grey(v: f32) -> Self {
        Self::new(v, v, v)
    }

    /// Applies a function to every channel.
    #[inline(always)]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self::new(f(self.r), f(self.g), f(self.b))
    }

    /// Applies a function to each channel of two colours.
    #[inline(always)]
    pub(crate) fn zip_map(self, o: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self::new(f(self.r, o.r), f(self.g, o.g), f(self.b, o.b))
    }

    /// The colour with a share of it replaced by another.
    #[inline(always)]
    pub(crate) fn mixed(self, o: Self, share: f32) -> Self {
        self.scale(1.0 - share).add_scaled(share, o)
    }

    /// The mean of the channels.
    #[inline(always)]
    pub(crate) fn mean(self) -> f32 {
        (self.r + self.g + self.b) / 3.0
    }

    /// Every channel times `k`.
    #[inline(always)]
    pub fn scale(self, k: f32) -> Self {
        self.map(|v| v * k)
    }

    /// Relative luminance Y of Rec. 709 (0.2126, 0.7152, 0.0722).
    #[inline(always)]
    pub fn luminance(self) -> f32 {
        0.2126 * self.r + 0.7152 * self.g + 0.0722 * self.b
    }

    /// Red, green and blue.
    #[inline(always)]
    pub fn channels(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    /// The largest channel.
    #[inline(always)]
    pub fn max_channel(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    /// Whether no channel is NaN or infinite.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }

    /// The colour as an opaque pixel.
    #[inline(always)]
    pub fn opaque(self) -> PremulRgba {
        PremulRgba::new(self.r, self.g, self.b, 1.0)
    }
}

impl std::ops::Add for LinearRgb {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.r + o.r, self.g + o.g, self.b + o.b)
    }
}

impl std::ops::Mul for LinearRgb {
    type Output = Self;
    /// Multiplies channel by channel: a filter, a tint, a shadow factor.
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self::new(self.r * o.r, self.g * o.g, self.b * o.b)
    }
}

impl From<[f32; 3]> for LinearRgb {
    fn from([r, g, b]: [f32; 3]) -> Self {
        Self { r, g, b }
    }
}

impl From<LinearRgb> for [f32; 3] {
    fn from(c: LinearRgb) -> Self {
        [c.r, c.g, c.b]
    }
}

impl PremulRgba {
    /// Fully transparent.
    pub const TRANSPARENT: Self = Self::new(0.0, 0.0, 0.0, 0.0);

    /// A pixel from colour already multiplied by `a`.
    #[inline(always)]
    pub const fn new(r: f32, g: f32, b: f32, a: f32) -> Self {
        Self { r, g, b, a }
    }

    /// The premultiplied colour without its alpha: the light that this pixel adds.
    #[inline(always)]
    pub fn color(self) -> LinearRgb {
        LinearRgb::new(self.r, self.g, self.b)
    }

    /// Colour divided by alpha; black where alpha is 0.
    #[inline(always)]
    pub fn to_straight(self) -> StraightRgba {
        let k = if self.a > 0.0 { 1.0 / self.a } else { 0.0 };
        StraightRgba {
            r: self.r * k,
            g: self.g * k,
            b: self.b * k,
            a: self.a,
        }
    }

    /// Whether every channel is finite and alpha is between 0 and 1, as required of a texture.
    #[inline(always)]
    pub fn is_sound(self) -> bool {
        self.color().is_finite() && (0.0..=1.0).contains(&self.a)
    }

    /// All four channels times `k`: the pixel seen through a matte.
    #[inline(always)]
    pub fn masked(self, Coverage(k): Coverage) -> Self {
        Self::new(self.r * k, self.g * k, self.b * k, self.a * k)
    }
}

impl StraightRgba {
    /// Colour times alpha.
    #[inline(always)]
    pub fn to_premul(self) -> PremulRgba {
        PremulRgba {
            r: self.r * self.a,
            g: self.g * self.a,
            b: self.b * self.a,
            a: self.a,
        }
    }
}

impl Film {
    /// A film from the light it adds and the share of the light from behind that passes, per channel.
    #[inline(always)]
    pub fn new(color: LinearRgb, transmittance: LinearRgb) -> Self {
        Self {
            color,
            opacity: transmittance.map(|t| 1.0 - t),
        }
    }

    /// The share of the light from behind that passes, per channel.
    #[inline(always)]
    pub fn transmittance(self) -> LinearRgb {
        self.opacity.map(|o| 1.0 - o)
    }

    /// `self` in front of an opaque colour: `color + transmittance * behind`.
    #[inline(always)]
    pub fn over_color(self, behind: LinearRgb) -> LinearRgb {
        self.color + self.transmittance() * behind
    }

    /// A film that also darkens what is behind it by the factor `shadow`.
    #[inline(always)]
    pub(crate) fn shaded(self, shadow: LinearRgb) -> Self {
        Self::new(self.color, self.transmittance() * shadow)
    }

    /// The same with one alpha for all channels, their mean, for programs that do not support film.
    #[inline(always)]
    pub fn to_rgba(self) -> PremulRgba {
        let o = self.opacity;
        let a = if self.is_grey() { o.r } else { o.mean() };
        PremulRgba::new(self.color.r, self.color.g, self.color.b, a)
    }

    /// Whether every channel loses the same share.
    #[inline(always)]
    pub fn is_grey(self) -> bool {
        self.opacity.r == self.opacity.g && self.opacity.g == self.opacity.b
    }

    /// The same with every opacity clamped to 0 to 1, since the weights of a filter add up to 1
    /// only up to rounding.
    #[inline(always)]
    pub(crate) fn clamped(self) -> Self {
        Self {
            opacity: self.opacity.map(|o| o.clamp(0.0, 1.0)),
            ..self
        }
    }

    /// Whether every channel is finite and every opacity between 0 and 1, as required of a texture.
    #[inline(always)]
    pub fn is_sound(self) -> bool {
        let mut opacities = self.opacity.channels().into_iter();
        self.color.is_finite() && opacities.all(|o| (0.0..=1.0).contains(&o))
    }
}

impl From<PremulRgba> for Film {
    /// Grey film: every channel loses alpha.
    #[inline(always)]
    fn from(p: PremulRgba) -> Self {
        Self {
            color: p.color(),
            opacity: LinearRgb::grey(p.a),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_round_trip_is_exact_where_alpha_is_a_power_of_two() {
        let p = PremulRgba::new(0.1, 0.2, 0.3, 0.5);
        assert_eq!(p.to_straight().to_premul(), p);
    }

    #[test]
    fn transparent_pixels_become_straight_without_nan() {
        assert_eq!(
            PremulRgba::TRANSPARENT.to_straight(),
            StraightRgba::default()
        );
    }

    #[test]
    fn grey_film_and_rgba_are_the_same() {
        let p = PremulRgba::new(0.1, 0.2, 0.3, 0.7);
        assert_eq!(Film::from(p).to_rgba(), p);
        assert!(Film::from(p).is_grey() && Film::default() == PremulRgba::TRANSPARENT.into());
    }

    #[test]
    fn film_tints_what_is_behind() {
        let film = Film::new(LinearRgb::grey(0.125), LinearRgb::new(0.5, 1.0, 0.25));
        assert_eq!(
            film.over_color(LinearRgb::WHITE),
            LinearRgb::new(0.625, 1.125, 0.375)
        );
        assert!(!film.is_grey() && film.is_sound());
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((LinearRgb::WHITE.luminance() - 1.0).abs() < 1e-6);
    }
}
