//! How files describe their display codes: ICC colour profiles, the curve and primaries in a PNG,
//! and the colour space in a camera's EXIF data.
//!
//! Profiles with three primaries and three curves (sRGB, Display P3, Adobe RGB, ProPhoto, ...) or
//! with one grey curve are applied, with a warning if they also contain a colour table; others are
//! named in a warning and the codes treated as sRGB.
//!
//! # Method
//! ICC.1:2022: curves to linear light (10.6, 10.18), the matrix of the colorant columns to XYZ
//! under D50 (F.3), Bradford to D65 (E.3), and from there to Rec. 709. A grey curve in CIELab gives
//! lightness, which CIE 15:2018, 8.2.1, converts to light. Evaluated here, not by the crate that
//! parses the profile, so that the bits are the same on every machine.
//!
//! A table takes precedence over primaries and curves (8.10), but is not applied: the curves in the
//! same profile are meant for programs without table support, and closer to it than sRGB.

use crate::color::{ColorMatrix, RgbSpace, bradford, rgb_from_rgb, rgb_from_xyz, srgb_to_linear};
use moxcms::{ColorProfile, DataColorSpace, ToneReprCurve};
use nalgebra::Matrix3;

/// CIE x, y of the white of the profile connection space (ICC.1:2022, 7.2.16: X 0.9642, Y 1, Z 0.8249).
const D50_WHITE: [f64; 2] = [0.345_70, 0.358_54];
/// 16-bit codes, the finest in files.
const CODE_COUNT: usize = 1 << 16;
/// The largest code.
const LARGEST_CODE: f32 = 65_535.0;
/// Curves and matrices that differ from sRGB's by less count as sRGB: they were written with fewer
/// digits or measured from a table.
const SRGB_TOLERANCE: f32 = 2e-3;
/// Exponents of screens: files that mean sRGB state them, rounded to a hundredth or coarser.
const SCREEN_EXPONENTS: std::ops::RangeInclusive<f64> = 2.16..=2.24;
/// Adobe RGB (1998), 4.3.4.2.
const ADOBE_EXPONENT: f64 = 563.0 / 256.0;
/// Chromaticities that differ by less count as equal, written with fewer digits.
const CHROMATICITY_TOLERANCE: f64 = 1e-3;
/// Primaries whose triangle (in x, y) has less area cannot form a colour space; Rec. 709 has 0.11.
const SMALLEST_GAMUT: f64 = 1e-3;

/// How a file describes its colours.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ColorDescription {
    /// A colour profile.
    Icc(Vec<u8>),
    /// Light is the code raised to an exponent, if given, in primaries, if given.
    Curve {
        exponent: Option<f64>,
        primaries: Option<RgbSpace>,
    },
    /// Primaries and transfer function by their numbers in ITU-T H.273.
    CodePoints(u8, u8),
    /// Adobe RGB (1998), by name.
    AdobeRgb,
    /// Not sRGB, and otherwise unspecified.
    Uncalibrated,
}

/// The meaning of those code points of ITU-T H.273 that are supported: an exponent or the curve of
/// sRGB, and primaries.
pub(crate) fn known_code_points(primaries: u8, transfer: u8) -> Option<(Option<f64>, RgbSpace)> {
    let exponent = match transfer {
        8 => Some(1.0),
        13 => None,
        _ => return None,
    };
    let space = match primaries {
        1 => RgbSpace::REC709,
        9 => RgbSpace::REC2020,
        12 => RgbSpace::DISPLAY_P3,
        _ => return None,
    };
    Some((exponent, space))
}

/// Conversion of display codes to light, as described by a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DisplayProfile {
    /// Linear light of each 16-bit code, for red, green and blue.
    curves: [Vec<f32>; 3],
    to_rec709: ColorMatrix,
    /// Whether there is also a colour table, which is more exact.
    pub(crate) has_unapplied_table: bool,
}

impl DisplayProfile {
    /// The profile that a file describes, if it is not sRGB.
    ///
    /// # Errors
    /// What the description contains that cannot be applied.
    pub(crate) fn from_description(description: ColorDescription) -> Result<Option<Self>, String> {
        match description {
            ColorDescription::Icc(bytes) => Self::from_icc(&bytes),
            ColorDescription::Curve {
                exponent,
                primaries,
            } => Self::from_curve(exponent, primaries),
            ColorDescription::CodePoints(primaries, transfer) => {
                let (exponent, space) = known_code_points(primaries, transfer)
                    .ok_or_else(|| format!("code points {primaries}/{transfer} for its colours"))?;
                Self::from_curve(exponent, Some(space))
            }
            ColorDescription::AdobeRgb => {
                let matrix = to_rec709(&RgbSpace::ADOBE_RGB)?;
                Self::from_power(Some(ADOBE_EXPONENT), matrix).map(Some)
            }
            ColorDescription::Uncalibrated => Err(
                "colours other than sRGB according to its EXIF data, and no colour profile".into(),
            ),
        }
    }

    fn from_curve(
        exponent: Option<f64>,
        primaries: Option<RgbSpace>,
    ) -> Result<Option<Self>, String> {
        let exponent = exponent.filter(|e| !SCREEN_EXPONENTS.contains(e));
        let matrix = primaries.map_or(Ok(None), |space| to_rec709(&space))?;
        if exponent.is_none() && matrix.is_none() {
            return Ok(None);
        }
        Self::from_power(exponent, matrix).map(Some)
    }

    /// The curve of an exponent, or that of sRGB, and the matrix for primaries other than Rec. 709.
    fn from_power(exponent: Option<f64>, matrix: Option<ColorMatrix>) -> Result<Self, String> {
        let curve = power_or_srgb_table(exponent).ok_or("a gamma that is not a number")?;
        Ok(Self {
            to_rec709: matrix.unwrap_or_else(|| Matrix3::identity().into()),
            ..Self::from_grey_curve(&curve)
        })
    }

    /// The same curve for red, green and blue of Rec. 709.
    fn from_grey_curve(curve: &[f32]) -> Self {
        Self {
            curves: std::array::from_fn(|_| curve.to_vec()),
            to_rec709: Matrix3::identity().into(),
            has_unapplied_table: false,
        }
    }

    fn from_icc(bytes: &[u8]) -> Result<Option<Self>, String> {
        let icc = ColorProfile::new_from_slice(bytes).map_err(|_| "a damaged colour profile")?;
        Self::from_parsed(&icc)
    }

    fn from_parsed(icc: &ColorProfile) -> Result<Option<Self>, String> {
        let profile = match icc.color_space {
            DataColorSpace::Rgb => Self::from_primaries(icc),
            DataColorSpace::Gray => Self::from_grey(icc),
            other => {
                let space = format!("{other:?}").to_uppercase();
                return Err(format!("a colour profile for {space}"));
            }
        };
        let profile = profile.ok_or("a colour profile without primaries and curves")?;
        Ok((!profile.is_srgb()).then(|| Self {
            has_unapplied_table: has_table(icc),
            ..profile
        }))
    }

    fn from_grey(icc: &ColorProfile) -> Option<Self> {
        let curve = icc.gray_trc.as_ref()?;
        let light = curve_table(|x| match icc.pcs {
            DataColorSpace::Lab => luminance_of_lightness(100.0 * evaluate(curve, x)),
            _ => evaluate(curve, x),
        });
        light.map(|light| Self::from_grey_curve(&light))
    }

    fn from_primaries(icc: &ColorProfile) -> Option<Self> {
        let curves = [
            trc_table(&icc.red_trc)?,
            trc_table(&icc.green_trc)?,
            trc_table(&icc.blue_trc)?,
        ];
        let matrix = rec709_from_icc(icc);
        matrix.iter().all(|v| v.is_finite()).then(|| Self {
            curves,
            to_rec709: matrix.into(),
            has_unapplied_table: false,
        })
    }

    fn is_srgb(&self) -> bool {
        let identity = ColorMatrix::from(Matrix3::identity());
        let numbers = self.to_rec709.rows.iter().flatten();
        let same_primaries = numbers
            .zip(identity.rows.iter().flatten())
            .all(|(&v, &w)| is_near(v, w));
        same_primaries && self.curves.iter().all(|curve| is_srgb_curve(curve))
    }

    /// Linear Rec. 709 of display values from 0 to 1.
    #[inline]
    pub(crate) fn light(&self, display: [f32; 3]) -> [f32; 3] {
        let light = [0, 1, 2].map(|c: usize| self.curves[c][nearest_code(display[c])]);
        self.to_rec709.apply(light)
    }
}

fn has_table(icc: &ColorProfile) -> bool {
    icc.lut_a_to_b_perceptual.is_some() || icc.lut_a_to_b_colorimetric.is_some()
}

/// Light relative to white for a lightness of 0 to 100 (CIE 15:2018, 8.2.1: L*).
fn luminance_of_lightness(lightness: f64) -> f64 {
    const LINEAR_UP_TO: f64 = 8.0;
    if lightness <= LINEAR_UP_TO {
        return lightness * 27.0 / 24_389.0;
    }
    let root = (lightness + 16.0) / 116.0;
    root * root * root
}

/// Index of the code nearest to a display value.
#[inline]
fn nearest_code(display: f32) -> usize {
    (display.clamp(0.0, 1.0) * LARGEST_CODE + 0.5) as usize
}

fn rec709_from_icc(icc: &ColorProfile) -> Matrix3<f64> {
    let columns =
        [icc.red_colorant, icc.green_colorant, icc.blue_colorant].map(|c| [c.x, c.y, c.z]);
    let xyz_d50_from_rgb = Matrix3::from_columns(&columns.map(Into::into));
    rgb_from_xyz(&RgbSpace::REC709) * bradford(RgbSpace::REC709.white, D50_WHITE) * xyz_d50_from_rgb
}

fn is_near(v: f32, w: f32) -> bool {
    (v - w).abs() < SRGB_TOLERANCE
}

fn is_srgb_curve(light: &[f32]) -> bool {
    light
        .iter()
        .enumerate()
        .all(|(code, &v)| is_near(v, srgb_to_linear(code as f32 / LARGEST_CODE)))
}

/// Light of every 16-bit code; none if there is no curve, or if its values are not numbers.
fn trc_table(curve: &Option<ToneReprCurve>) -> Option<Vec<f32>> {
    let curve = curve.as_ref()?;
    curve_table(|x| evaluate(curve, x))
}

fn power_or_srgb_table(exponent: Option<f64>) -> Option<Vec<f32>> {
    curve_table(|x| match exponent {
        Some(exponent) => libm::pow(x, exponent),
        None => f64::from(srgb_to_linear(x as f32)),
    })
}

fn curve_table(curve: impl Fn(f64) -> f64) -> Option<Vec<f32>> {
    let light: Vec<f32> = (0..CODE_COUNT)
        .map(|code| curve(f64::from(code as u16) / f64::from(LARGEST_CODE)) as f32)
        .collect();
    light.iter().all(|v| v.is_finite()).then_some(light)
}

/// ICC.1:2022, 10.6 (tables, or a gamma of 8.8 bits) and 10.18 (functions of one to seven
/// parameters).
fn evaluate(curve: &ToneReprCurve, x: f64) -> f64 {
    match curve {
        ToneReprCurve::Lut(table) => match table[..] {
            [] => x,
            [gamma] => libm::pow(x, f64::from(gamma) / 256.0),
            _ => interpolated(table, x),
        },
        ToneReprCurve::Parametric(parameters) => {
            let parameters: Vec<f64> = parameters.iter().map(|&v| f64::from(v)).collect();
            evaluate_parametric(&parameters, x)
        }
    }
}

/// ICC.1:2022, table 68: a power for `x` above a bound, and a straight line below it. One line of
/// code per row of the table.
fn evaluate_parametric(parameters: &[f64], x: f64) -> f64 {
    match *parameters {
        [g] => libm::pow(x, g),
        [g, a, b] if x >= -b / a => libm::pow(a * x + b, g),
        [_, _, _] => 0.0,
        [g, a, b, c] if x >= -b / a => libm::pow(a * x + b, g) + c,
        [_, _, _, c] => c,
        [g, a, b, _, d] if x >= d => libm::pow(a * x + b, g),
        [_, _, _, c, _] => c * x,
        [g, a, b, _, d, e, _] if x >= d => libm::pow(a * x + b, g) + e,
        [_, _, _, c, _, _, f] => c * x + f,
        _ => f64::NAN,
    }
}

fn interpolated(table: &[u16], x: f64) -> f64 {
    let at = x * (table.len() - 1) as f64;
    let i = (at as usize).min(table.len() - 2);
    let (low, high) = (f64::from(table[i]), f64::from(table[i + 1]));
    (low + (high - low) * (at - i as f64)) / f64::from(LARGEST_CODE)
}

/// The matrix from the primaries that a file names to the library's primaries; none if they are the
/// same.
///
/// # Errors
/// For primaries and a white that are not those of a colour space.
pub(crate) fn to_rec709(named: &RgbSpace) -> Result<Option<ColorMatrix>, String> {
    let (given, ours) = (chromaticities(named), chromaticities(&RgbSpace::REC709));
    if !is_color_space(named) {
        return Err(format!(
            "chromaticities {given:?}, expected those of a colour space"
        ));
    }
    let mut pairs = given.iter().zip(ours);
    let same = pairs.all(|(v, w)| (v - w).abs() < CHROMATICITY_TOLERANCE);
    Ok((!same).then(|| rgb_from_rgb(&RgbSpace::REC709, named).into()))
}

/// Converts the first three of every `n` samples.
pub(crate) fn convert_primaries(samples: &mut [f32], n: usize, matrix: &ColorMatrix) {
    for px in samples.chunks_exact_mut(n) {
        if let Some(color) = px.first_chunk_mut() {
            *color = matrix.apply(*color);
        }
    }
}

/// Primaries may be outside the visible colours, as those of XYZ and ACES are.
fn is_color_space(space: &RgbSpace) -> bool {
    chromaticities(space).iter().all(|v| v.abs() <= 2.0)
        && gamut_area(space) >= SMALLEST_GAMUT
        && space.white[1] >= SMALLEST_GAMUT
}

/// CIE x, y of the primaries and of white.
fn chromaticities(space: &RgbSpace) -> Vec<f64> {
    space
        .primaries
        .into_iter()
        .chain([space.white])
        .flatten()
        .collect()
}

/// Area of the triangle of primaries in CIE x, y.
fn gamut_area(space: &RgbSpace) -> f64 {
    let [r, g, b] = space.primaries;
    ((g[0] - r[0]) * (b[1] - r[1]) - (b[0] - r[0]) * (g[1] - r[1])).abs() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use moxcms::{LutDataType, LutStore, LutType, LutWarehouse};

    fn parsed(icc: &ColorProfile) -> Option<DisplayProfile> {
        DisplayProfile::from_icc(&icc.encode().unwrap()).unwrap()
    }

    #[test]
    fn srgb_is_what_was_assumed_anyway() {
        assert_eq!(parsed(&ColorProfile::new_srgb()), None);
    }

    /// SMPTE EG 432-1: P3 primaries, D65; Adobe RGB (1998): 4.3.1 and gamma 563/256.
    #[test]
    fn other_primaries_become_rec_709() {
        let p3 = RgbSpace::DISPLAY_P3;
        let adobe = RgbSpace::ADOBE_RGB;
        fn gamma(v: f64) -> f64 {
            libm::pow(v, 563.0 / 256.0)
        }
        fn srgb(v: f64) -> f64 {
            f64::from(srgb_to_linear(v as f32))
        }
        let cases = [
            (ColorProfile::new_display_p3(), p3, srgb as fn(f64) -> f64),
            (
                ColorProfile::new_adobe_rgb(),
                adobe,
                gamma as fn(f64) -> f64,
            ),
        ];
        for (icc, space, curve) in cases {
            let profile = parsed(&icc).unwrap();
            for display in [
                [0.2, 0.5, 0.9],
                [1.0, 1.0, 1.0],
                [0.0, 0.0, 0.0],
                [0.8, 0.1, 0.3],
            ] {
                let light = nalgebra::Vector3::from(display.map(curve));
                let expected = rgb_from_rgb(&RgbSpace::REC709, &space) * light;
                let got = profile.light(display.map(|v| v as f32));
                // Colorants are stored in steps of 1/65536, and some programs round their curves to
                // 1/256.
                for (v, w) in got.iter().zip(expected.iter()) {
                    assert!(
                        (f64::from(*v) - w).abs() < 1e-3,
                        "{display:?}: {got:?}, expected {expected:?}"
                    );
                }
            }
        }
    }

    /// An empty 8-bit table with two nodes per side.
    fn table() -> LutWarehouse {
        let store = |count| LutStore::Store8(vec![0; count]);
        LutWarehouse::Lut(LutDataType {
            num_input_channels: 3,
            num_output_channels: 3,
            num_clut_grid_points: 2,
            matrix: moxcms::Matrix3d::IDENTITY,
            num_input_table_entries: 256,
            num_output_table_entries: 256,
            input_table: store(3 * 256),
            clut_table: store(3 * 8),
            output_table: store(3 * 256),
            lut_type: LutType::Lut8,
        })
    }

    #[test]
    fn a_table_beside_primaries_is_missed() {
        let plain = ColorProfile::new_display_p3();
        let without = DisplayProfile::from_parsed(&plain).unwrap().unwrap();
        assert!(!without.has_unapplied_table);
        let [mut perceptual, mut colorimetric] = [plain.clone(), plain];
        perceptual.lut_a_to_b_perceptual = Some(table());
        colorimetric.lut_a_to_b_colorimetric = Some(table());
        for icc in [perceptual, colorimetric] {
            let with = DisplayProfile::from_parsed(&icc).unwrap().unwrap();
            assert!(with.has_unapplied_table);
            assert_eq!(with.light([0.8, 0.1, 0.3]), without.light([0.8, 0.1, 0.3]));
        }
        let mut srgb = ColorProfile::new_srgb();
        srgb.lut_a_to_b_perceptual = Some(table());
        assert_eq!(DisplayProfile::from_parsed(&srgb), Ok(None));
    }

    #[test]
    fn a_grey_curve_of_lightness_gives_light() {
        let mut icc = ColorProfile::new_gray_with_gamma(1.0);
        icc.pcs = DataColorSpace::Xyz;
        let by_light = DisplayProfile::from_parsed(&icc).unwrap().unwrap();
        icc.pcs = DataColorSpace::Lab;
        let by_lightness = DisplayProfile::from_parsed(&icc).unwrap().unwrap();
        // CIE 15:2018, 8.2.1.
        for (code, expected) in [
            (0.0_f32, 0.0_f32),
            (0.05, 0.005_535),
            (0.5, 0.184_187),
            (1.0, 1.0),
        ] {
            assert!((by_light.light([code; 3])[1] - code).abs() < 1e-4);
            let light = by_lightness.light([code; 3]);
            assert!(
                light.iter().all(|&v| (v - expected).abs() < 1e-4),
                "{code}: {light:?}"
            );
        }
    }

    #[test]
    fn curves_are_those_of_the_standard() {
        let at = |curve: ToneReprCurve, x| evaluate(&curve, x);
        assert_eq!(at(ToneReprCurve::Lut(vec![]), 0.3), 0.3);
        assert_eq!(at(ToneReprCurve::Lut(vec![512]), 0.5), 0.25);
        assert_eq!(at(ToneReprCurve::Lut(vec![0, 0, 65_535]), 0.75), 0.5);
        assert_eq!(at(ToneReprCurve::Lut(vec![0, 65_535]), 1.0), 1.0);
        assert_eq!(at(ToneReprCurve::Parametric(vec![2.0]), 0.5), 0.25);
        assert_eq!(
            at(ToneReprCurve::Parametric(vec![2.0, 1.0, -0.5]), 0.25),
            0.0
        );
        assert_eq!(
            at(
                ToneReprCurve::Parametric(vec![2.0, 1.0, 0.0, 0.5, 0.25]),
                0.125
            ),
            0.0625
        );
        assert!(trc_table(&Some(ToneReprCurve::Parametric(vec![1.0, 2.0]))).is_none());
    }

    #[test]
    fn code_points_of_screens_are_applied_and_others_named() {
        let described = |primaries, transfer| {
            DisplayProfile::from_description(ColorDescription::CodePoints(primaries, transfer))
        };
        assert_eq!(described(1, 13), Ok(None));
        let grey = 32768.0 / 65535.0;
        // Red in Rec. 709: for Rec. 2020 by ITU-R BT.2407, for Display P3 by CSS Color 4.
        for (primaries, expected) in [
            (1, [1.0, 0.0, 0.0]),
            (9, [1.6605, -0.1246, -0.0182]),
            (12, [1.2249, -0.0421, -0.0196]),
        ] {
            let linear = described(primaries, 8).unwrap().unwrap();
            let red = linear.light([1.0, 0.0, 0.0]);
            let errors = red.iter().zip(expected).map(|(v, w): (_, f32)| v - w);
            assert!(
                errors.map(f32::abs).all(|e| e < 1e-4),
                "{primaries}: {red:?}"
            );
            assert!((linear.light([0.5; 3])[1] - grey).abs() < 1e-6);
        }
        for primaries in [9, 12] {
            let screen = described(primaries, 13).unwrap().unwrap();
            let light = screen.light([0.5; 3])[1];
            assert!((light - srgb_to_linear(grey)).abs() < 1e-6, "{light}");
        }
        for (primaries, transfer) in [(9, 16), (4, 13)] {
            let what = format!("code points {primaries}/{transfer} for its colours");
            assert_eq!(described(primaries, transfer).unwrap_err(), what);
        }
    }

    /// CIE XYZ of equal energy: its centre is the white of Rec. 709.
    #[test]
    fn primaries_without_luminance_are_primaries() {
        let xyz = RgbSpace {
            primaries: [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
            white: [1.0 / 3.0; 2],
        };
        let matrix = to_rec709(&xyz).unwrap().unwrap();
        let white = matrix.apply([1.0; 3]);
        assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-6), "{white:?}");
        // Y is the luminance of Rec. 709 before white adaptation: green has most of it.
        let [r, g, b] = matrix.apply([0.0, 1.0, 0.0]);
        assert!(g > 1.0 && r < 0.0 && b < 0.0, "{r} {g} {b}");
        assert_eq!(to_rec709(&RgbSpace::REC709), Ok(None));
        let line = RgbSpace {
            primaries: [[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]],
            ..xyz
        };
        let black = RgbSpace {
            white: [0.3, 0.0],
            ..xyz
        };
        let endless = RgbSpace {
            white: [f64::NAN, 0.3],
            ..xyz
        };
        assert!(
            [line, black, endless]
                .iter()
                .all(|space| to_rec709(space).is_err())
        );
    }

    #[test]
    fn damaged_profiles_are_refused_and_named() {
        let whole = ColorProfile::new_display_p3().encode().unwrap();
        for length in (0..whole.len()).step_by(7) {
            // A truncated profile may still have all relevant parts.
            let _ = DisplayProfile::from_icc(&whole[..length]);
        }
        assert_eq!(
            DisplayProfile::from_icc(b"profile").unwrap_err(),
            "a damaged colour profile"
        );
    }
}
