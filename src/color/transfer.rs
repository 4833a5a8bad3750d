//! Transfer curves between scene-linear light and encoded values.

/// A curve between scene-linear light and encoded values, both about 0 to 1.
///
/// Every curve is odd: a negative value is the mirror image of the positive one, so nothing is lost
/// below zero and no power of a negative number is taken. Values above 1 follow the curve's own
/// formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// IEC 61966-2-1: `12.92 x` up to 0.0031308, then `1.055 x^(1/2.4) - 0.055`.
    Srgb,
    /// ITU-R BT.709 camera curve: `4.5 x` below 0.018, then `1.099 x^0.45 - 0.099`.
    Rec709,
    /// `x^(1/gamma)`.
    Gamma(f64),
}

impl Curve {
    /// The encoded value of an amount of light.
    #[inline]
    pub fn encode(self, light: f32) -> f32 {
        self.encode_f64(light.into()) as f32
    }

    /// The light that an encoded value stands for.
    #[inline]
    pub fn decode(self, value: f32) -> f32 {
        self.decode_f64(value.into()) as f32
    }

    /// [`encode`](Self::encode) without rounding to `f32`.
    pub(super) fn encode_f64(self, light: f64) -> f64 {
        mirrored(light, |x| match self {
            Self::Srgb if x <= SRGB_KNEE => SRGB_SLOPE * x,
            Self::Srgb => 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055,
            Self::Rec709 if x < REC709_KNEE => REC709_SLOPE * x,
            Self::Rec709 => 1.099 * libm::pow(x, 0.45) - 0.099,
            Self::Gamma(gamma) => libm::pow(x, 1.0 / gamma),
        })
    }

    /// [`decode`](Self::decode) without rounding to `f32`.
    pub(super) fn decode_f64(self, value: f64) -> f64 {
        mirrored(value, |v| match self {
            Self::Srgb if v <= SRGB_SLOPE * SRGB_KNEE => v / SRGB_SLOPE,
            Self::Srgb => libm::pow((v + 0.055) / 1.055, 2.4),
            Self::Rec709 if v < REC709_KNEE_VALUE => v / REC709_SLOPE,
            Self::Rec709 => libm::pow((v + 0.099) / 1.099, 1.0 / 0.45),
            Self::Gamma(gamma) => libm::pow(v, gamma),
        })
    }
}

/// Light where the straight part of sRGB ends (IEC 61966-2-1).
const SRGB_KNEE: f64 = 0.003_130_8;
/// Slope of the straight part of sRGB (IEC 61966-2-1).
const SRGB_SLOPE: f64 = 12.92;
/// Light where the straight part of Rec. 709 ends (ITU-R BT.709-6, item 1.2).
const REC709_KNEE: f64 = 0.018;
/// Slope of the straight part of Rec. 709 (ITU-R BT.709-6, item 1.2).
const REC709_SLOPE: f64 = 4.5;
/// `1.099 * 0.018^0.45 - 0.099`: the smallest value that the power part gives. The rounded
/// constants of the standard leave a gap between 0.081 and this; decoding by this bound takes every
/// encoded value back to where it came from.
const REC709_KNEE_VALUE: f64 = 0.081_247_944_035_140_46;

/// An odd function from its positive half.
fn mirrored(x: f64, positive: impl Fn(f64) -> f64) -> f64 {
    positive(x.abs()).copysign(x)
}

/// Scene-linear light of an sRGB-encoded value; negative values mirrored.
///
/// ```
/// assert_eq!(petcomp::color::srgb_to_linear(1.0), 1.0);
/// ```
#[inline]
pub fn srgb_to_linear(value: f32) -> f32 {
    Curve::Srgb.decode(value)
}

/// The sRGB-encoded value of scene-linear light; negative light mirrored, nothing clipped.
///
/// ```
/// let half = petcomp::color::linear_to_srgb(0.5);
/// assert!((half - 188.0 / 255.0).abs() < 0.002);
/// ```
#[inline]
pub fn linear_to_srgb(light: f32) -> f32 {
    Curve::Srgb.encode(light)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [Curve; 4] = [
        Curve::Srgb,
        Curve::Rec709,
        Curve::Gamma(2.2),
        Curve::Gamma(2.6),
    ];

    /// 0 to 4 in steps that hit every binade, plus its awkward ends.
    fn samples() -> impl Iterator<Item = f32> {
        (0..4000)
            .map(|i| i as f32 * 1e-3)
            .chain([f32::MIN_POSITIVE, 1e-6, 0.003_130_8, 0.018, 1e4])
    }

    /// The two parts of sRGB, with the rounded constants of its standard, miss each other by as
    /// much at the knee.
    const GAP: f32 = 3e-9;

    #[test]
    fn decoding_undoes_encoding() {
        for curve in CURVES {
            for x in samples() {
                let back = curve.decode(curve.encode(x));
                assert!(
                    (back - x).abs() <= 4.0 * f32::EPSILON * x + GAP,
                    "{curve:?}: {x} became {back}"
                );
            }
        }
    }

    #[test]
    fn every_curve_is_odd() {
        for curve in CURVES {
            for x in samples() {
                assert_eq!(curve.encode(-x), -curve.encode(x));
                assert_eq!(curve.decode(-x), -curve.decode(x));
            }
        }
    }

    #[test]
    fn every_curve_rises() {
        for curve in CURVES {
            let values: Vec<_> = samples().take(4000).map(|x| curve.encode(x)).collect();
            assert!(values.is_sorted(), "{curve:?}");
        }
    }

    #[test]
    fn every_curve_fixes_zero_and_one() {
        for curve in CURVES {
            for x in [0.0, 1.0] {
                assert!((curve.encode(x) - x).abs() < 1e-7);
                assert!((curve.decode(x) - x).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn nan_stays_nan_and_infinity_infinite() {
        for curve in CURVES {
            assert!(curve.encode(f32::NAN).is_nan() && curve.decode(f32::NAN).is_nan());
            assert_eq!(curve.encode(f32::NEG_INFINITY), f32::NEG_INFINITY);
        }
    }

    #[test]
    fn the_knee_of_rec709_is_where_its_power_part_starts() {
        assert!((Curve::Rec709.encode_f64(REC709_KNEE) - REC709_KNEE_VALUE).abs() < 1e-16);
    }

    #[test]
    fn srgb_and_rec709_agree_with_the_palette_crate() {
        use palette::encoding::{FromLinear, IntoLinear, RecOetf, Srgb};
        for x in samples().take(1000).map(f64::from) {
            let theirs: f64 = Srgb::from_linear(x);
            assert!((Curve::Srgb.encode_f64(x) - theirs).abs() < 1e-7, "{x}");
            let theirs: f64 = Srgb::into_linear(x);
            assert!((Curve::Srgb.decode_f64(x) - theirs).abs() < 1e-7, "{x}");
            // It has the unrounded constants of BT.2020, which differ in the fourth digit.
            let theirs: f64 = RecOetf::from_linear(x);
            assert!((Curve::Rec709.encode_f64(x) - theirs).abs() < 3e-4, "{x}");
        }
    }
}
