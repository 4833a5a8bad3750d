//! Tables of the sRGB curve for integer codes: decoding is a look-up, exact to the last bit of `f32`.

use std::sync::LazyLock;

/// Linear value of each 8-bit display code.
pub(super) static DECODE_8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_to_linear(code as f64 / 255.0) as f32));

/// Linear value of each 16-bit display code.
pub(super) static DECODE_16: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|code| srgb_to_linear(f64::from(code) / 65_535.0) as f32).collect());

/// IEC 61966-2-1, the exact piecewise curve.
pub(super) fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// The inverse of [`srgb_to_linear`].
pub(super) fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

/// The 8-bit code of a value of 0 to 1; what is outside is clipped, NaN is 0.
pub(super) fn code8(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The 16-bit code of a value of 0 to 1; what is outside is clipped, NaN is 0.
pub(super) fn code16(v: f32) -> u16 {
    (v.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_a_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(code8(linear_to_srgb(DECODE_8[usize::from(code)])), code);
        }
        for code in 0..=u16::MAX {
            assert_eq!(code16(linear_to_srgb(DECODE_16[usize::from(code)])), code);
        }
    }

    #[test]
    fn what_is_not_a_number_becomes_black() {
        assert_eq!((code8(f32::NAN), code16(f32::NAN)), (0, 0));
        assert_eq!((code8(f32::INFINITY), code16(-1.0)), (255, 0));
    }
}
