//! Brightness and colour differences of a colour.
//!
//! The signals are those of ITU-R BT.709 with studio swing, in the rounding of Blender's own table.
//! Its two matrices are not exact inverses of each other: even without blurring, colours move by up
//! to 7e-4 per unit.

use super::model::Model;
use crate::pixel::PremulRgba;

/// Code value 1.0.
const CODE_MAX: f32 = 255.0;
/// Blender multiplies by this float or divides by 255, depending on its version.
const PER_CODE_MAX: f32 = 1.0 / 255.0;
/// Offset of brightness, code values.
const LUMA_OFFSET: f32 = 16.0;
/// Zero of the colour differences, code values.
const NEUTRAL_CODE: f32 = 128.0;
/// Weights of R, G, B in brightness.
const LUMA_WEIGHTS: [f32; 3] = [0.183, 0.614, 0.062];
/// Weights of R, G, B in the blue and the red difference.
const DIFFERENCES: [[f32; 3]; 2] = [[-0.101, -0.338, 0.439], [0.439, -0.399, -0.040]];

/// One signal in code values.
#[inline(always)]
fn code_value(p: PremulRgba, w: [f32; 3], offset: f32) -> f32 {
    w[0] * (p.r * CODE_MAX) + w[1] * (p.g * CODE_MAX) + w[2] * (p.b * CODE_MAX) + offset
}

/// Code values to unit scale.
#[inline(always)]
fn to_unit(code: f32, is_late: bool) -> f32 {
    if is_late {
        code / CODE_MAX
    } else {
        code * PER_CODE_MAX
    }
}

/// Blue and red difference of a colour in unit scale, 128/255 being neutral.
#[inline(always)]
pub(in crate::matte) fn differences(p: PremulRgba, is_late: bool) -> [f32; 2] {
    DIFFERENCES.map(|w| to_unit(code_value(p, w, NEUTRAL_CODE), is_late))
}

/// All three signals of a colour in unit scale.
pub(in crate::matte) fn to_ycc(p: PremulRgba, is_late: bool) -> [f32; 3] {
    let luma = code_value(p, LUMA_WEIGHTS, LUMA_OFFSET);
    let [cb, cr] = differences(p, is_late);
    [to_unit(luma, is_late), cb, cr]
}

/// The colour of three signals in unit scale.
pub(in crate::matte) fn from_ycc(signals: [f32; 3]) -> [f32; 3] {
    let [y, cb, cr] = signals.map(|s| s * CODE_MAX);
    color_from_codes(y, cb, cr, 1.0).color().channels()
}

/// The colour of three signals in code values.
#[inline(always)]
fn color_from_codes(y: f32, cb: f32, cr: f32, alpha: f32) -> PremulRgba {
    let (l, cb, cr) = (
        1.164 * (y - LUMA_OFFSET),
        cb - NEUTRAL_CODE,
        cr - NEUTRAL_CODE,
    );
    let (r, g, b) = (l + 1.793 * cr, l - 0.534 * cr - 0.213 * cb, l + 2.115 * cb);
    PremulRgba::new(r / CODE_MAX, g / CODE_MAX, b / CODE_MAX, alpha)
}

/// The pixel with other colour differences, unit scale; a lost one stays as it is.
#[inline(always)]
pub(super) fn recolored<M: Model>(p: PremulRgba, cb: f32, cr: f32) -> PremulRgba {
    let luma = code_value(p, LUMA_WEIGHTS, LUMA_OFFSET);
    // Blender 4.5 alone leaves brightness out of the journey to unit scale and back.
    let luma = if M::IS_LATE {
        luma
    } else {
        luma * PER_CODE_MAX * CODE_MAX
    };
    let colored = color_from_codes(luma, cb * CODE_MAX, cr * CODE_MAX, p.a);
    if M::is_lost(p) { p } else { colored }
}
