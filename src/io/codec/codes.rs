//! Pixels as stored in a file: integer codes, or scene-linear channels.

use crate::color::{decode_srgb8, encode_srgb8, encode_srgb16};
use crate::image::Image;
use crate::pixel::{Coverage, Depth, Film, LinearRgb, PremulRgba, Srgb8, Srgba8, StraightRgba};
use rayon::prelude::*;

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bits {
    /// 8-bit codes: PNG, JPEG, TIFF.
    Eight,
    /// 16-bit codes: PNG, TIFF.
    Sixteen,
    /// Half float: EXR.
    Half,
    /// Float: EXR, TIFF.
    Float,
}

impl Bits {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Eight => "8-bit",
            Self::Sixteen => "16-bit",
            Self::Half => "half float",
            Self::Float => "float",
        }
    }
}

/// How a pixel type is stored in a file. Sealed by being private to `io`.
pub trait ToFile: Copy + Send + Sync {
    /// Names of its channels.
    #[doc(hidden)]
    const NAMES: &'static [&'static str];
    /// Whether it is meaningful as integer codes for 0 to 1.
    #[doc(hidden)]
    const CODED: bool = true;
    /// Display-encoded straight codes (a matte unchanged); only as many as there are names are used.
    #[doc(hidden)]
    fn codes<C: DisplayCode>(self) -> [C; 4];
    /// Scene-linear channels, colours premultiplied.
    #[doc(hidden)]
    fn linear(self) -> [f32; MAX_CHANNELS];
}

/// Channels of the pixel type that has the most.
const MAX_CHANNELS: usize = 7;

/// The channels, with zeros for the rest.
#[inline]
fn padded<const N: usize>(channels: [f32; N]) -> [f32; MAX_CHANNELS] {
    std::array::from_fn(|i| if i < N { channels[i] } else { 0.0 })
}

const RGB: &[&str] = &["R", "G", "B"];
const RGBA: &[&str] = &["R", "G", "B", "A"];

/// An integer code for 0 to 1: values outside are clipped, NaN is 0.
pub trait DisplayCode: Copy + Default + Send {
    #[doc(hidden)]
    const FULL_SCALE: Self;
    /// The value without display encoding.
    #[doc(hidden)]
    fn from_value(v: f32) -> Self;
    /// Light encoded as sRGB.
    #[doc(hidden)]
    fn from_light(light: LinearRgb) -> [Self; 3];
    /// The same value as an 8-bit code.
    #[doc(hidden)]
    fn from_8_bits(code: u8) -> Self;
}

impl DisplayCode for u8 {
    const FULL_SCALE: Self = Self::MAX;
    #[inline]
    fn from_value(v: f32) -> Self {
        (v.clamp(0.0, 1.0) * 255.0 + 0.5) as Self
    }
    #[inline]
    fn from_light(light: LinearRgb) -> [Self; 3] {
        let Srgb8 { r, g, b } = encode_srgb8(light);
        [r, g, b]
    }
    #[inline]
    fn from_8_bits(code: u8) -> Self {
        code
    }
}

impl DisplayCode for u16 {
    const FULL_SCALE: Self = Self::MAX;
    #[inline]
    fn from_value(v: f32) -> Self {
        // In single precision a product near 65535 may be off by 0.002.
        (f64::from(v.clamp(0.0, 1.0)) * 65_535.0 + 0.5) as Self
    }
    #[inline]
    fn from_light(light: LinearRgb) -> [Self; 3] {
        [light.r, light.g, light.b].map(encode_srgb16)
    }
    #[inline]
    fn from_8_bits(code: u8) -> Self {
        Self::from(code) * 257
    }
}

impl ToFile for LinearRgb {
    const NAMES: &'static [&'static str] = RGB;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        let [r, g, b] = C::from_light(self);
        [r, g, b, C::FULL_SCALE]
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        padded([self.r, self.g, self.b])
    }
}

impl ToFile for StraightRgba {
    const NAMES: &'static [&'static str] = RGBA;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        let [r, g, b] = C::from_light(LinearRgb::new(self.r, self.g, self.b));
        [r, g, b, C::from_value(self.a)]
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        self.to_premul().linear()
    }
}

impl ToFile for PremulRgba {
    const NAMES: &'static [&'static str] = RGBA;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        self.to_straight().codes()
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        padded([self.r, self.g, self.b, self.a])
    }
}

impl ToFile for Film {
    /// Programs without film support see the grey one: `A`.
    const NAMES: &'static [&'static str] = &["R", "G", "B", "A", "TR", "TG", "TB"];
    const CODED: bool = false;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        self.to_rgba().codes()
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        let (PremulRgba { r, g, b, a }, t) = (self.to_rgba(), self.transmittance());
        [r, g, b, a, t.r, t.g, t.b]
    }
}

impl ToFile for Coverage {
    const NAMES: &'static [&'static str] = &["Y"];
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        [C::from_value(self.0); 4]
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        padded([self.0])
    }
}

impl ToFile for f32 {
    const NAMES: &'static [&'static str] = Coverage::NAMES;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        Coverage(self).codes()
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        Coverage(self).linear()
    }
}

impl ToFile for Depth {
    const NAMES: &'static [&'static str] = &["Z"];
    const CODED: bool = false;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        [C::from_value(self.0); 4]
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        padded([self.0])
    }
}

impl ToFile for Srgb8 {
    const NAMES: &'static [&'static str] = RGB;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        [self.r, self.g, self.b, u8::MAX].map(C::from_8_bits)
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        decode_srgb8(self).linear()
    }
}

impl ToFile for Srgba8 {
    const NAMES: &'static [&'static str] = RGBA;
    fn codes<C: DisplayCode>(self) -> [C; 4] {
        [self.r, self.g, self.b, self.a].map(C::from_8_bits)
    }
    fn linear(self) -> [f32; MAX_CHANNELS] {
        let (r, g, b) = (self.r, self.g, self.b);
        let LinearRgb { r, g, b } = decode_srgb8(Srgb8 { r, g, b });
        let a = f32::from(self.a) / 255.0;
        StraightRgba { r, g, b, a }.linear()
    }
}

/// Interleaved codes of 8 or 16 bits.
pub(crate) enum Codes {
    U8(Vec<u8>),
    U16(Vec<u16>),
}

impl Codes {
    pub(crate) fn new<P: ToFile>(image: &Image<P>, bits: Bits) -> Self {
        match bits {
            Bits::Sixteen => Self::U16(interleaved(image, P::codes::<u16>)),
            _ => Self::U8(interleaved(image, P::codes::<u8>)),
        }
    }
}

/// Channels of pixel after pixel, interleaved, rows in parallel.
pub(crate) fn interleaved<P: ToFile, T: Copy + Default + Send, const N: usize>(
    image: &Image<P>,
    channels: impl Fn(P) -> [T; N] + Sync,
) -> Vec<T> {
    let n = P::NAMES.len();
    let mut out = vec![T::default(); image.pixels().len() * n];
    let slots = out
        .par_chunks_exact_mut(n)
        .with_min_len(image.width().max(1));
    slots.zip(image.pixels()).for_each(|(slot, &p)| {
        // Not as a slice: the call to copy three bytes takes longer than copying them.
        for (slot, channel) in slot.iter_mut().zip(channels(p)) {
            *slot = channel;
        }
    });
    out
}
