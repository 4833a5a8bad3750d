//! Between light and whole-number sRGB codes: decoding by table, encoding correctly rounded.
//!
//! # Method
//! Code `k` begins at the light whose encoded value is `(k - 1/2) / max`. That threshold, computed in `f64` and rounded
//! up to the next `f32`, decides every `f32` exactly: encoding is a search among thresholds, without a power per pixel.
//! The search starts from a table indexed by the top bits of the float (its exponent and [`CELL_BITS`] bits of its
//! fraction), which cuts every octave into cells.

use super::transfer::Curve;
use crate::image::Image;
use crate::pixel::{LinearRgb, Srgb8};
use rayon::prelude::*;
use std::sync::LazyLock;

/// Light of an sRGB code.
///
/// ```
/// use petcomp::{LinearRgb, Srgb8, color};
/// assert_eq!(color::decode_srgb8(Srgb8 { r: 255, g: 255, b: 0 }), LinearRgb::new(1.0, 1.0, 0.0));
/// ```
#[inline]
pub fn decode_srgb8(code: Srgb8) -> LinearRgb {
    decode_with(&DECODE8, code)
}

/// The sRGB code nearest to a colour, clipped to 0..1; NaN becomes 0.
#[inline]
pub fn encode_srgb8(color: LinearRgb) -> Srgb8 {
    encode_with(&ENCODE8, color)
}

/// Light of one 16-bit sRGB code.
#[inline]
pub fn decode_srgb16(code: u16) -> f32 {
    DECODE16[code as usize]
}

/// The 16-bit sRGB code nearest to one channel of light, clipped to 0..1; NaN becomes 0.
#[inline]
pub fn encode_srgb16(light: f32) -> u16 {
    ENCODE16.code(light) as u16
}

/// [`decode_srgb8`] for as many pixels as both rows have.
pub fn decode_row(codes: &[Srgb8], colors: &mut [LinearRgb]) {
    let table = &*DECODE8;
    for (color, &code) in colors.iter_mut().zip(codes) {
        *color = decode_with(table, code);
    }
}

/// [`encode_srgb8`] for as many pixels as both rows have.
pub fn encode_row(colors: &[LinearRgb], codes: &mut [Srgb8]) {
    let encoder = &*ENCODE8;
    for (code, &color) in codes.iter_mut().zip(colors) {
        *code = encode_with(encoder, color);
    }
}

/// A display picture as scene-linear light.
pub fn from_srgb8(picture: &Image<Srgb8>) -> Image<LinearRgb> {
    let mut light = Image::new(picture.width(), picture.height());
    light.par_rows_mut().enumerate().for_each(|(y, row)| decode_row(picture.row(y), row));
    light
}

/// Scene-linear light as a display picture, clipped to 0..1; no tone curve.
pub fn to_srgb8(light: &Image<LinearRgb>) -> Image<Srgb8> {
    let mut picture = Image::new(light.width(), light.height());
    picture.par_rows_mut().enumerate().for_each(|(y, row)| encode_row(light.row(y), row));
    picture
}

#[inline(always)]
fn decode_with(table: &[f32; 256], code: Srgb8) -> LinearRgb {
    LinearRgb::new(table[code.r as usize], table[code.g as usize], table[code.b as usize])
}

#[inline(always)]
fn encode_with(encoder: &Encoder, color: LinearRgb) -> Srgb8 {
    let [r, g, b] = <[f32; 3]>::from(color).map(|light| encoder.code(light) as u8);
    Srgb8 { r, g, b }
}

static DECODE8: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| light_of(code as f64, 255)));
static DECODE16: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|code| light_of(code.into(), u16::MAX.into())).collect());
static ENCODE8: LazyLock<Encoder> = LazyLock::new(|| Encoder::new(u8::MAX.into()));
static ENCODE16: LazyLock<Encoder> = LazyLock::new(|| Encoder::new(u16::MAX.into()));

/// Light of a code, which may lie between two whole codes.
fn light_of(code: f64, max: u32) -> f32 {
    Curve::Srgb.decode_f64(code / f64::from(max)) as f32
}

/// Fraction bits of a float that choose a cell: 128 cells an octave, at most one 8-bit threshold in each.
const CELL_BITS: u32 = 7;
/// Bits of a float below those that choose a cell.
const REST_BITS: u32 = f32::MANTISSA_DIGITS - 1 - CELL_BITS;

/// The way from light to the nearest code.
struct Encoder {
    /// `thresholds[k]`: the least light of code `k`; `thresholds[0]` is minus infinity, one past the last is infinity.
    thresholds: Vec<f32>,
    /// The code at the lower end of each cell, from the cell of the first threshold to that of 1.
    starts: Vec<u16>,
    /// The cell of the first threshold.
    first_cell: u32,
}

impl Encoder {
    fn new(max: u32) -> Self {
        let least = (1..=max).map(|code| least_light(code, max));
        let thresholds: Vec<f32> = [f32::NEG_INFINITY].into_iter().chain(least).chain([f32::INFINITY]).collect();
        let [first_cell, last_cell] = [thresholds[1], 1.0].map(|light| light.to_bits() >> REST_BITS);
        let start = |cell: u32| thresholds[1..].partition_point(|&t| t <= f32::from_bits(cell << REST_BITS)) as u16;
        let starts = (first_cell..=last_cell).map(start).collect();
        Self { thresholds, starts, first_cell }
    }

    /// The code nearest to an amount of light.
    #[inline(always)]
    fn code(&self, light: f32) -> u32 {
        // `max` and `min` in this order take NaN to 0.
        let light = light.max(0.0).min(1.0);
        let cell = (light.to_bits() >> REST_BITS).saturating_sub(self.first_cell);
        let mut code = usize::from(self.starts[cell as usize]);
        while light >= self.thresholds[code + 1] {
            code += 1;
        }
        code as u32
    }
}

/// The smallest `f32` whose nearest code is `code` or more.
fn least_light(code: u32, max: u32) -> f32 {
    let exact = Curve::Srgb.decode_f64((f64::from(code) - 0.5) / f64::from(max));
    let near = exact as f32;
    if f64::from(near) < exact { near.next_up() } else { near }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition: clip, encode in `f64`, round half up.
    fn nearest_code(light: f32, max: f64) -> u32 {
        let clipped = f64::from(light).clamp(0.0, 1.0);
        (Curve::Srgb.encode_f64(clipped) * max + 0.5).floor() as u32
    }

    /// Floats of all sizes from far below the first code to above 1, spread over their bit patterns.
    fn floats(count: u32) -> impl Iterator<Item = f32> {
        let (low, high) = (1e-6_f32.to_bits(), 1.01_f32.to_bits());
        (0..count).map(move |i| f32::from_bits(low + ((high - low) as u64 * i as u64 / count as u64) as u32))
    }

    #[test]
    fn every_8_bit_code_survives() {
        for v in 0..=255 {
            let code = Srgb8 { r: v, g: 255 - v, b: v / 2 };
            assert_eq!(encode_srgb8(decode_srgb8(code)), code);
        }
    }

    #[test]
    fn every_16_bit_code_survives() {
        assert!((0..=u16::MAX).all(|code| encode_srgb16(decode_srgb16(code)) == code));
    }

    #[test]
    fn encoding_rounds_as_f64_does() {
        for light in floats(400_000) {
            assert_eq!(ENCODE8.code(light), nearest_code(light, 255.0), "{light:e}");
            assert_eq!(ENCODE16.code(light), nearest_code(light, 65535.0), "{light:e}");
        }
    }

    #[test]
    fn encoding_is_right_on_both_sides_of_every_threshold() {
        for (encoder, max) in [(&*ENCODE8, 255), (&*ENCODE16, 65535)] {
            for code in 1..=max {
                let least = least_light(code, max);
                assert_eq!(encoder.code(least), code);
                assert_eq!(encoder.code(least.next_down()), code - 1);
                assert_eq!(nearest_code(least, max.into()), code);
                assert_eq!(nearest_code(least.next_down(), max.into()), code - 1);
            }
        }
    }

    #[test]
    fn what_no_code_can_hold_is_clipped() {
        let strange = [f32::NAN, f32::NEG_INFINITY, -1.0, -0.0, f32::MIN_POSITIVE, f32::from_bits(1)];
        assert!(strange.iter().all(|&light| ENCODE8.code(light) == 0 && ENCODE16.code(light) == 0));
        assert!([1.0, 2.0, f32::MAX, f32::INFINITY].iter().all(|&light| ENCODE8.code(light) == 255));
    }

    #[test]
    fn a_cell_holds_at_most_one_8_bit_threshold() {
        assert!(ENCODE8.starts.windows(2).all(|w| w[1] - w[0] <= 1));
    }

    #[test]
    fn whole_pictures_are_their_pixels() {
        let codes = Image::from_fn(17, 9, |x, y| Srgb8 { r: x as u8 * 15, g: y as u8 * 28, b: (x * y) as u8 });
        assert_eq!(from_srgb8(&codes), codes.map(decode_srgb8));
        assert_eq!(to_srgb8(&from_srgb8(&codes)), codes);
        assert!(to_srgb8(&Image::new(0, 3)).is_empty());
    }
}
