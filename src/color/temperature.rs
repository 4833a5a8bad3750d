//! The colour of glowing bodies.

use crate::color::{ColorMatrix, RgbSpace, rgb_from_xyz};
use crate::pixel::LinearRgb;

/// Light of a black body of `kelvin` (1667 to 25 000; clamped), scene-linear, of luminance 1: red
/// when cool, blue when hot.
///
/// Channels that would be negative, colours that Rec. 709 does not have, are 0. About 6504 K is
/// white.
///
/// # Method
/// Cubic splines through the Planckian locus in CIE 1931 x, y (Kang et al., "Design of advanced
/// color temperature control system for HDTV applications", 2002).
pub fn planckian(kelvin: f64) -> LinearRgb {
    let t = kelvin.clamp(MIN_KELVIN, MAX_KELVIN);
    let (x_spline, y_spline) = splines_at(t);
    let x = polynomial(x_spline, 1.0 / t);
    let y = polynomial(y_spline, x);
    let xyz = [x / y, 1.0, (1.0 - x - y) / y].map(|v| v as f32);
    let linear_from_xyz = ColorMatrix::from(rgb_from_xyz(&RgbSpace::REC709));
    LinearRgb::from(linear_from_xyz.apply(xyz)).map(|v| v.max(0.0))
}

/// Where the splines begin (Kang et al. 2002).
const MIN_KELVIN: f64 = 1667.0;
/// Where they end.
const MAX_KELVIN: f64 = 25_000.0;
/// Chromaticity x by the inverse of the temperature, highest power first (Kang et al. 2002).
const X_BELOW_4000_K: [f64; 4] = [-0.266_123_9e9, -0.234_358_9e6, 0.877_695_6e3, 0.179_910];
const X_ABOVE_4000_K: [f64; 4] = [-3.025_846_9e9, 2.107_037_9e6, 0.222_634_7e3, 0.240_390];
/// Chromaticity y by x, highest power first (Kang et al. 2002).
const Y_BELOW_2222_K: [f64; 4] = [-1.106_381_4, -1.348_110_20, 2.185_558_32, -0.202_196_83];
const Y_BELOW_4000_K: [f64; 4] = [-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67];
const Y_ABOVE_4000_K: [f64; 4] = [3.081_758_0, -5.873_386_70, 3.751_129_97, -0.370_014_83];

/// The parts of the splines for x and for y that hold at a temperature.
fn splines_at(kelvin: f64) -> ([f64; 4], [f64; 4]) {
    if kelvin <= 2222.0 {
        (X_BELOW_4000_K, Y_BELOW_2222_K)
    } else if kelvin <= 4000.0 {
        (X_BELOW_4000_K, Y_BELOW_4000_K)
    } else {
        (X_ABOVE_4000_K, Y_ABOVE_4000_K)
    }
}

fn polynomial([a, b, c, d]: [f64; 4], v: f64) -> f64 {
    ((a * v + b) * v + c) * v + d
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `CCT_to_xy_Kang2002` of colour-science 0.4.7, by its own matrix for Rec. 709.
    #[test]
    fn colours_are_those_of_colour_science() {
        for (kelvin, expected) in [
            (2500.0, [2.062_744, 0.770_762, 0.140_674]),
            (4000.0, [1.414_966, 0.923_736, 0.533_245]),
            (6504.0, [1.042_469, 0.983_794, 1.035_451]),
            (15_000.0, [0.785_448, 0.992_522, 1.706_031]),
        ] {
            let found: [f32; 3] = planckian(kelvin).into();
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(f, e): (&f32, f32)| (f - e).abs() < 1e-4),
                "{kelvin}: {found:?}"
            );
        }
    }

    #[test]
    fn luminance_is_one_where_the_colour_exists() {
        assert!(
            (2000..=20_000)
                .step_by(500)
                .all(|t| (planckian(f64::from(t)).luminance() - 1.0).abs() < 2e-3)
        );
        assert_eq!(planckian(1.0), planckian(1667.0));
    }
}
