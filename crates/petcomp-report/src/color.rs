//! Colour transfer: exact curves compared with tables and with a plain power, error against run
//! time.
//!
//! The reference is the closed form of IEC 61966-2-1, evaluated here with the standard library's
//! power in double precision; the stage computes with `libm`.

use super::clock::timed;
use super::{Diagram, Point};
use petcomp::color::{
    Curve, decode_srgb8, decode_srgb16, encode_srgb8, encode_srgb16, linear_to_srgb, srgb_to_linear,
};
use petcomp::{LinearRgb, Result, Srgb8};

/// Values to convert: a megapixel of three channels.
const VALUE_COUNT: usize = 3 << 20;
const TIMED_RUNS: usize = 5;
/// A power that is often used instead of the curve.
const PLAIN_GAMMA: f64 = 2.2;
/// The largest codes of 8 and 16 bits.
const MAX_CODE_8: f64 = 255.0;
const MAX_CODE_16: f64 = 65_535.0;
/// Rounding changes a value by up to half a code: uniformly distributed, its root mean square is
/// this share of a code.
const ROUNDING_RMS: f64 = 0.288_675_134_594_812_9;

/// Encoding and decoding, a point per variant.
pub(crate) fn diagrams() -> Result<Vec<Diagram>> {
    Ok(vec![encoding()?, decoding()?])
}

/// Light of every brightness from 0 to 1, in an order that no cache or branch predictor can learn.
fn shuffled_lights() -> Vec<f32> {
    let range = VALUE_COUNT.next_power_of_two();
    // An odd multiplier runs through all numbers of as many bits.
    let mixed = (0..VALUE_COUNT).map(|i| i.wrapping_mul(2_654_435_761) & (range - 1));
    mixed.map(|i| (i as f64 / range as f64) as f32).collect()
}

/// Codes of 8 bits in a similar order.
fn shuffled_codes() -> Vec<u8> {
    let mixed = (0..VALUE_COUNT).map(|i| i.wrapping_mul(2_654_435_761));
    mixed.map(|i| (i >> 8) as u8).collect()
}

fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

fn decoded(value: f64) -> f64 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// Values, the exact result of their conversion, and measurements of time and error of its
/// variants.
struct Conversion<'a> {
    values: &'a [f32],
    exact: fn(f64) -> f64,
}

impl Conversion<'_> {
    /// Seconds and error of a variant; `meaning` of its codes is not timed.
    fn point<T: Send>(
        &self,
        [name, setting]: [&str; 2],
        form: impl Fn(&[f32]) -> Vec<T> + Sync,
        meaning: impl Fn(&T) -> f64,
    ) -> Result<Point> {
        let (made, seconds) = timed(TIMED_RUNS, || Ok(form(self.values)))?;
        let found: Vec<f64> = made.iter().map(meaning).collect();
        Ok(Point::new(name, setting, seconds, self.rms_error(&found)))
    }

    /// For a variant that converts value by value.
    fn point_of_each(&self, names: [&str; 2], form: fn(f32) -> f32) -> Result<Point> {
        self.point(
            names,
            |values| values.iter().map(|v| form(*v)).collect(),
            |v| f64::from(*v),
        )
    }

    fn rms_error(&self, found: &[f64]) -> f64 {
        let pairs = found.iter().zip(self.values);
        let squares = pairs.map(|(m, v)| (m - (self.exact)(f64::from(*v))).powi(2));
        (squares.sum::<f64>() / self.values.len() as f64).sqrt()
    }
}

fn encoding() -> Result<Diagram> {
    let lights = shuffled_lights();
    let reason = "error of rounding to 8 bits, plus 1 % for the finite number of values";
    Ok(Diagram {
        file: "color_encode".into(),
        title: "color: light to display values".into(),
        input: "a megapixel of three channels, evenly spread from 0 to 1".into(),
        error: "RMS error of the encoded value".into(),
        points: encoding_points(&lights)?,
        limit: Some((1.01 * ROUNDING_RMS / MAX_CODE_8, reason.into())),
        why: why_table(&lights),
        ..color_diagram()
    })
}

fn why_table(lights: &[f32]) -> String {
    let (wrong, all) = (
        count_wrong_codes(&encode_by_table(lights), lights),
        lights.len(),
    );
    format!(
        "Pictures have 8 bits, and {wrong} of {all} codes differ from the nearest one: the table is the formula, rounded."
    )
}

/// Properties shared by both diagrams.
fn color_diagram() -> Diagram {
    Diagram {
        cost: "CPU seconds per megapixel".into(),
        reference: "closed form of IEC 61966-2-1 in double precision".into(),
        ..Diagram::default()
    }
}

fn encoding_points(lights: &[f32]) -> Result<Vec<Point>> {
    let conversion = Conversion {
        values: lights,
        exact: encoded,
    };
    Ok(vec![
        conversion
            .point(["table", "8 bits"], encode_by_table, value_of_code_8)?
            .used_where(|_| true),
        conversion.point(["table", "16 bits"], encode_by_table_16, value_of_code_16)?,
        conversion.point_of_each(["formula", "32-bit float"], linear_to_srgb)?,
        conversion.point_of_each(["plain power", "gamma 2.2"], encode_by_power)?,
    ])
}

fn value_of_code_8(code: &u8) -> f64 {
    f64::from(*code) / MAX_CODE_8
}

fn value_of_code_16(code: &u16) -> f64 {
    f64::from(*code) / MAX_CODE_16
}

fn encode_by_table(values: &[f32]) -> Vec<u8> {
    let pixels = values.chunks_exact(3);
    pixels
        .map(|v| encode_srgb8(LinearRgb::new(v[0], v[1], v[2])))
        .flat_map(|c| [c.r, c.g, c.b])
        .collect()
}

fn encode_by_table_16(values: &[f32]) -> Vec<u16> {
    values.iter().map(|v| encode_srgb16(*v)).collect()
}

/// Codes that are not the nearest to the closed form.
fn count_wrong_codes(codes: &[u8], lights: &[f32]) -> usize {
    let all = codes.iter().zip(lights);
    all.filter(|(code, light)| is_wrong_code(**code, **light))
        .count()
}

fn is_wrong_code(code: u8, light: f32) -> bool {
    let exact = MAX_CODE_8 * encoded(f64::from(light));
    // Half a code, and a margin for the closed form's own rounding.
    (f64::from(code) - exact).abs() > 0.5 + 1e-9
}

fn decoding() -> Result<Diagram> {
    let codes = shuffled_codes();
    Ok(Diagram {
        file: "color_decode".into(),
        title: "color: display values to light".into(),
        input: "a megapixel of three channels, every 8-bit code".into(),
        error: "RMS error of the light".into(),
        points: decoding_points(&codes)?,
        limit: Some((f64::from(f32::EPSILON), "rounding of a float".into())),
        ..color_diagram()
    })
}

fn decoding_points(codes: &[u8]) -> Result<Vec<Point>> {
    let values: Vec<f32> = codes.iter().map(|c| value_of_code_8(c) as f32).collect();
    let conversion = Conversion {
        values: &values,
        exact: decoded,
    };
    // The tables take codes, not values: both represent the same light.

    Ok(vec![
        conversion
            .point(["table", "8 bits"], |_| decode_by_table(codes), to_double)?
            .used_where(|_| true),
        conversion.point(
            ["table", "16 bits"],
            |_| decode_by_table_16(codes),
            to_double,
        )?,
        conversion.point_of_each(["formula", "32-bit float"], srgb_to_linear)?,
        conversion.point_of_each(["plain power", "gamma 2.2"], decode_by_power)?,
    ])
}

fn encode_by_power(v: f32) -> f32 {
    Curve::Gamma(PLAIN_GAMMA).encode(v)
}

fn decode_by_power(v: f32) -> f32 {
    Curve::Gamma(PLAIN_GAMMA).decode(v)
}

fn to_double(v: &f32) -> f64 {
    f64::from(*v)
}

fn decode_by_table(codes: &[u8]) -> Vec<f32> {
    let pixels = codes.chunks_exact(3);
    let triples = pixels.map(|c| {
        decode_srgb8(Srgb8 {
            r: c[0],
            g: c[1],
            b: c[2],
        })
    });
    triples.flat_map(<[f32; 3]>::from).collect()
}

fn decode_by_table_16(codes: &[u8]) -> Vec<f32> {
    codes
        .iter()
        .map(|c| decode_srgb16(u16::from(*c) * 257))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_is_that_of_the_stage() {
        for i in 0..=1000 {
            let v = f64::from(i) / 1000.0;
            assert!((encoded(v) - f64::from(linear_to_srgb(v as f32))).abs() < 1e-6);
            assert!((decoded(v) - f64::from(srgb_to_linear(v as f32))).abs() < 1e-6);
        }
    }

    #[test]
    fn lights_are_spread_evenly() {
        let lights = shuffled_lights();
        let mean = lights.iter().map(|v| f64::from(*v)).sum::<f64>() / VALUE_COUNT as f64;
        assert!(
            (mean - 0.5).abs() < 1e-3 && lights.iter().all(|v| (0.0..1.0).contains(v)),
            "{mean}"
        );
    }

    #[test]
    fn no_code_of_the_table_is_wrong_and_a_wrong_one_is_counted() {
        let lights = [0.0, 0.2, 1.0];
        let right = encode_srgb8(LinearRgb::from(lights));
        assert_eq!(count_wrong_codes(&[right.r, right.g, right.b], &lights), 0);
        assert_eq!(
            count_wrong_codes(&[right.r, right.g + 1, right.b], &lights),
            1
        );
    }

    #[test]
    fn a_table_of_eight_bits_is_off_by_its_rounding() {
        let values: Vec<f32> = (0..3 * 4096)
            .map(|i| i as f32 / (3 * 4096) as f32)
            .collect();
        let round = |values: &[f32]| {
            values
                .iter()
                .map(|v| (linear_to_srgb(*v) * 255.0).round())
                .collect()
        };
        let conversion = Conversion {
            values: &values,
            exact: encoded,
        };
        let found = conversion
            .point(["", ""], round, |code: &f32| f64::from(*code) / MAX_CODE_8)
            .unwrap();
        assert!(
            (found.error / (ROUNDING_RMS / MAX_CODE_8) - 1.0).abs() < 0.05,
            "{}",
            found.error
        );
    }
}
