//! Between light and whole-number sRGB codes: decoding by table, encoding correctly rounded.
//!
//! # Method
//! Code `k` begins at the light whose encoded value is `(k - 1/2) / max`. That threshold, computed
//! in `f64` and rounded up to the next `f32`, decides every `f32` exactly. The top bits of a float
//! (its exponent and the first bits of its fraction) choose a cell so small that it holds at most
//! one threshold: encoding is one look into a table and one comparison, without a power and without
//! a branch.

use super::transfer::Curve;
use crate::image::Image;
use crate::pixel::{LinearRgb, Srgb8};
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
    ENCODE16.code(light)
}

/// [`decode_srgb8`] for as many pixels as both rows have.
pub fn decode_row(codes: &[Srgb8], colors: &mut [LinearRgb]) {
    let table = &*DECODE8;
    for (color, &code) in colors.iter_mut().zip(codes) {
        *color = decode_with(table, code);
    }
}

/// A display picture as scene-linear light.
pub fn from_srgb8(picture: &Image<Srgb8>) -> Image<LinearRgb> {
    let table = &*DECODE8;
    picture.map(|code| decode_with(table, code))
}

/// Scene-linear light as a display picture, clipped to 0..1; no tone curve.
pub fn to_srgb8(light: &Image<LinearRgb>) -> Image<Srgb8> {
    let encoder = &*ENCODE8;
    light.map(|color| encode_with(encoder, color))
}

#[inline(always)]
fn decode_with(table: &[f32; 256], code: Srgb8) -> LinearRgb {
    LinearRgb::new(
        table[code.r as usize],
        table[code.g as usize],
        table[code.b as usize],
    )
}

#[inline(always)]
fn encode_with(encoder: &Encoder<CELL_BITS8>, color: LinearRgb) -> Srgb8 {
    let [r, g, b] = color.channels().map(|light| encoder.code(light) as u8);
    Srgb8 { r, g, b }
}

static DECODE8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| light_of(code as u16, 255)));
static DECODE16: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=u16::MAX)
        .map(|code| light_of(code, u16::MAX))
        .collect()
});
static ENCODE8: LazyLock<Encoder<CELL_BITS8>> = LazyLock::new(|| Encoder::new(u8::MAX.into()));
static ENCODE16: LazyLock<Encoder<CELL_BITS16>> = LazyLock::new(|| Encoder::new(u16::MAX));

/// Light of a code.
fn light_of(code: u16, max: u16) -> f32 {
    Curve::Srgb.decode_f64(f64::from(code) / f64::from(max)) as f32
}

/// Cells in an octave, as a power of two, so many that no cell holds two thresholds: the 68 codes
/// of the octave below 1 are the most that 8 bits have in any.
const CELL_BITS8: u32 = 7;
/// The same for the 17300 codes that 16 bits have in the octave below 1.
const CELL_BITS16: u32 = 15;

/// The way from light to the nearest code, with 2^`CELL_BITS` cells an octave.
struct Encoder<const CELL_BITS: u32> {
    /// From the cell of the first threshold to that of 1.
    cells: Vec<LightCell>,
    /// The number of the first of them.
    first: u32,
}

/// The floats that agree in their exponent and their first fraction bits.
struct LightCell {
    /// The code of the least of them.
    code: u16,
    /// The least light of the next code, in this cell or further on.
    next: f32,
}

impl<const CELL_BITS: u32> Encoder<CELL_BITS> {
    /// Bits of a float below those that choose its cell.
    const REST_BITS: u32 = f32::MANTISSA_DIGITS - 1 - CELL_BITS;

    fn new(max: u16) -> Self {
        let first = next_light(0, max).to_bits() >> Self::REST_BITS;
        let last = 1.0_f32.to_bits() >> Self::REST_BITS;
        let mut code = 0;
        let cells = (first..=last).map(|number| {
            code = code_at(f32::from_bits(number << Self::REST_BITS), code, max);
            LightCell {
                code,
                next: next_light(code, max),
            }
        });
        Self {
            cells: cells.collect(),
            first,
        }
    }

    /// The code nearest to an amount of light.
    #[inline(always)]
    #[expect(
        clippy::manual_clamp,
        reason = "`max` and then `min` take NaN to 0, `clamp` keeps it"
    )]
    fn code(&self, light: f32) -> u16 {
        let light = light.max(0.0).min(1.0);
        let number = (light.to_bits() >> Self::REST_BITS).saturating_sub(self.first);
        let cell = &self.cells[number as usize];
        cell.code + u16::from(light >= cell.next)
    }
}

/// The code of some light, which is at least the given one.
fn code_at(light: f32, mut code: u16, max: u16) -> u16 {
    while next_light(code, max) <= light {
        code += 1;
    }
    code
}

/// The least light of the next code; infinite after the last.
fn next_light(code: u16, max: u16) -> f32 {
    if code < max {
        least_light(code + 1, max)
    } else {
        f32::INFINITY
    }
}

/// The smallest `f32` whose nearest code is `code` or more.
fn least_light(code: u16, max: u16) -> f32 {
    let exact = Curve::Srgb.decode_f64((f64::from(code) - 0.5) / f64::from(max));
    let near = exact as f32;
    if f64::from(near) < exact {
        near.next_up()
    } else {
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition: clip, encode in `f64`, round half up.
    fn nearest_code(light: f32, max: u16) -> u16 {
        let clipped = f64::from(light).clamp(0.0, 1.0);
        (Curve::Srgb.encode_f64(clipped) * f64::from(max) + 0.5).floor() as u16
    }

    /// Floats of all sizes from far below the first code to above 1, spread over their bit
    /// patterns.
    fn floats(count: u32) -> impl Iterator<Item = f32> {
        let (low, high) = (1e-6_f32.to_bits(), 1.01_f32.to_bits());
        (0..count).map(move |i| {
            f32::from_bits(low + ((high - low) as u64 * i as u64 / count as u64) as u32)
        })
    }

    #[test]
    fn every_8_bit_code_survives() {
        for v in 0..=255 {
            let code = Srgb8 {
                r: v,
                g: 255 - v,
                b: v / 2,
            };
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
            assert_eq!(ENCODE8.code(light), nearest_code(light, 255), "{light:e}");
            assert_eq!(
                ENCODE16.code(light),
                nearest_code(light, u16::MAX),
                "{light:e}"
            );
        }
    }

    #[test]
    fn encoding_is_right_on_both_sides_of_every_threshold() {
        fn check<const BITS: u32>(encoder: &Encoder<BITS>, max: u16) {
            for code in 1..=max {
                let least = least_light(code, max);
                for (light, right) in [(least, code), (least.next_down(), code - 1)] {
                    assert_eq!(
                        (encoder.code(light), nearest_code(light, max)),
                        (right, right),
                        "{light:e}"
                    );
                }
            }
        }
        check(&ENCODE8, 255);
        check(&ENCODE16, u16::MAX);
    }

    #[test]
    fn what_no_code_can_hold_is_clipped() {
        let strange = [
            f32::NAN,
            f32::NEG_INFINITY,
            -1.0,
            -0.0,
            f32::MIN_POSITIVE,
            f32::from_bits(1),
        ];
        assert!(
            strange
                .iter()
                .all(|&light| ENCODE8.code(light) == 0 && ENCODE16.code(light) == 0)
        );
        assert!(
            [1.0, 2.0, f32::MAX, f32::INFINITY]
                .iter()
                .all(|&light| ENCODE8.code(light) == 255)
        );
    }

    #[test]
    fn a_cell_holds_at_most_one_threshold() {
        assert!(ENCODE8.cells.windows(2).all(|w| w[1].code - w[0].code <= 1));
        assert!(
            ENCODE16
                .cells
                .windows(2)
                .all(|w| w[1].code - w[0].code <= 1)
        );
    }

    #[test]
    fn whole_pictures_are_their_pixels() {
        let codes = Image::from_fn(17, 9, |x, y| Srgb8 {
            r: x as u8 * 15,
            g: y as u8 * 28,
            b: (x * y) as u8,
        });
        assert_eq!(from_srgb8(&codes), codes.map(decode_srgb8));
        assert_eq!(to_srgb8(&from_srgb8(&codes)), codes);
        assert!(to_srgb8(&Image::new(0, 3)).is_empty());
    }
}
