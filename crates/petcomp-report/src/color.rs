//! Colour transfer: exact curves against tables and against a plain power, error against run time.
//!
//! The reference is the closed form of IEC 61966-2-1, evaluated here with the standard library's power in double precision;
//! the stage computes with `libm`.

use super::clock::timed;
use super::{Diagram, Point};
use petcomp::Result;
use petcomp::color::{
    Curve, decode_srgb8, decode_srgb16, encode_srgb8, encode_srgb16, linear_to_srgb, srgb_to_linear,
};
use petcomp::{LinearRgb, Srgb8};

/// Values that are converted: a megapixel of three channels.
const VALUES: usize = 3 << 20;
const RUNS: usize = 5;
/// A power that is often used in place of the curve.
const PLAIN_GAMMA: f64 = 2.2;
/// Codes of 8 and 16 bits.
const MOST8: f64 = 255.0;
const MOST16: f64 = 65_535.0;
/// Half of a code is what rounding may take away: uniformly spread, its root mean square is this share of a code.
const ROUNDING: f64 = 0.288_675_134_594_812_9;

/// Encoding and decoding, a point for each form.
///
/// # Errors
/// A thread that cannot be had.
pub fn diagrams() -> Result<Vec<Diagram>> {
    Ok(vec![encoding()?, decoding()?])
}

/// Light of every brightness from 0 to 1, in an order that no cache or branch can learn.
fn lights() -> Vec<f32> {
    // An odd multiplier runs through all numbers of as many bits.
    let mixed = |i: usize| i.wrapping_mul(2_654_435_761) & (VALUES.next_power_of_two() - 1);
    (0..VALUES)
        .map(|i| (mixed(i) as f64 / VALUES.next_power_of_two() as f64) as f32)
        .collect()
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

/// Seconds and error of a form that turns values into codes; what those stand for is not timed.
fn point<T: Send>(
    [name, setting]: [&str; 2],
    values: &[f32],
    right: fn(f64) -> f64,
    form: impl Fn(&[f32]) -> Vec<T> + Sync,
    meant: impl Fn(&T) -> f64,
) -> Result<Point> {
    let (made, seconds) = timed(RUNS, || Ok(form(values)))?;
    let squares = made
        .iter()
        .zip(values)
        .map(|(m, v)| (meant(m) - right(f64::from(*v))).powi(2));
    Ok(Point::new(
        name,
        setting,
        seconds,
        (squares.sum::<f64>() / values.len() as f64).sqrt(),
    ))
}

fn encoding() -> Result<Diagram> {
    let lights = lights();
    let table8 = |values: &[f32]| -> Vec<u8> {
        let triples = values
            .chunks_exact(3)
            .map(|v| encode_srgb8(LinearRgb::new(v[0], v[1], v[2])));
        triples.flat_map(|c| [c.r, c.g, c.b]).collect()
    };
    let table16 = |values: &[f32]| values.iter().map(|v| encode_srgb16(*v)).collect();
    let each =
        |f: fn(f32) -> f32| move |values: &[f32]| values.iter().map(|v| f(*v)).collect::<Vec<_>>();
    let gamma = |v: f32| Curve::Gamma(PLAIN_GAMMA).encode(v);
    let wrong = wrong_codes(&table8(&lights), &lights);
    Ok(Diagram {
        file: "color_encode".into(),
        title: "color: light to display values".into(),
        input: "a megapixel of three channels, evenly spread from 0 to 1".into(),
        error: "RMS error of the encoded value".into(),
        cost: "CPU seconds per megapixel".into(),
        reference: "closed form of IEC 61966-2-1 in double precision".into(),
        points: vec![
            point(["table", "8 bits"], &lights, encoded, table8, |c| {
                f64::from(*c) / MOST8
            })?
            .used_where(|_| true),
            point(["table", "16 bits"], &lights, encoded, table16, |c| {
                f64::from(*c) / MOST16
            })?,
            point(
                ["formula", "32-bit float"],
                &lights,
                encoded,
                each(linear_to_srgb),
                |v| f64::from(*v),
            )?,
            point(
                ["plain power", "gamma 2.2"],
                &lights,
                encoded,
                each(gamma),
                |v| f64::from(*v),
            )?,
        ],
        limit: Some((
            1.01 * ROUNDING / MOST8,
            "what rounding to 8 bits costs, and 1 % for the few values".into(),
        )),
        why: format!(
            "Pictures have 8 bits, and {wrong} of {} codes differ from the nearest one: the table is the formula, rounded.",
            lights.len()
        ),
        ..Diagram::default()
    })
}

/// Codes that are not the nearest to what the closed form gives.
fn wrong_codes(codes: &[u8], lights: &[f32]) -> usize {
    let all = codes.iter().zip(lights);
    // Half a code, and a hair for the closed form's own rounding.
    all.filter(|(c, v)| (f64::from(**c) - MOST8 * encoded(f64::from(**v))).abs() > 0.5 + 1e-9)
        .count()
}

fn decoding() -> Result<Diagram> {
    let codes: Vec<u8> = (0..VALUES)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 8) as u8)
        .collect();
    let values: Vec<f32> = codes
        .iter()
        .map(|c| (f64::from(*c) / MOST8) as f32)
        .collect();
    // The table takes codes, not values: both stand for the same.
    let table8 = |_: &[f32]| -> Vec<f32> {
        let triples = codes.chunks_exact(3).map(|c| {
            decode_srgb8(Srgb8 {
                r: c[0],
                g: c[1],
                b: c[2],
            })
        });
        triples.flat_map(<[f32; 3]>::from).collect()
    };
    let table16 = |_: &[f32]| {
        codes
            .iter()
            .map(|c| decode_srgb16(u16::from(*c) * 257))
            .collect()
    };
    let each =
        |f: fn(f32) -> f32| move |values: &[f32]| values.iter().map(|v| f(*v)).collect::<Vec<_>>();
    let gamma = |v: f32| Curve::Gamma(PLAIN_GAMMA).decode(v);
    let light = |v: &f32| f64::from(*v);
    Ok(Diagram {
        file: "color_decode".into(),
        title: "color: display values to light".into(),
        input: "a megapixel of three channels, every 8-bit code".into(),
        error: "RMS error of the light".into(),
        cost: "CPU seconds per megapixel".into(),
        reference: "closed form of IEC 61966-2-1 in double precision".into(),
        points: vec![
            point(["table", "8 bits"], &values, decoded, table8, light)?.used_where(|_| true),
            point(["table", "16 bits"], &values, decoded, table16, light)?,
            point(
                ["formula", "32-bit float"],
                &values,
                decoded,
                each(srgb_to_linear),
                light,
            )?,
            point(
                ["plain power", "gamma 2.2"],
                &values,
                decoded,
                each(gamma),
                light,
            )?,
        ],
        limit: Some((f64::from(f32::EPSILON), "rounding of a float".into())),
        ..Diagram::default()
    })
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
        let lights = lights();
        let mean = lights.iter().map(|v| f64::from(*v)).sum::<f64>() / VALUES as f64;
        assert!(
            (mean - 0.5).abs() < 1e-3 && lights.iter().all(|v| (0.0..1.0).contains(v)),
            "{mean}"
        );
    }

    #[test]
    fn no_code_of_the_table_is_wrong_and_a_wrong_one_is_counted() {
        let lights = [0.0, 0.2, 1.0];
        let right = encode_srgb8(LinearRgb::from(lights));
        assert_eq!(wrong_codes(&[right.r, right.g, right.b], &lights), 0);
        assert_eq!(wrong_codes(&[right.r, right.g + 1, right.b], &lights), 1);
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
        let found = point(["", ""], &values, encoded, round, |code: &f32| {
            f64::from(*code) / MOST8
        })
        .unwrap();
        assert!(
            (found.error / (ROUNDING / MOST8) - 1.0).abs() < 0.05,
            "{}",
            found.error
        );
    }
}
