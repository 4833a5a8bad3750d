//! A card's own colours.

use crate::pixel::LinearRgb;
use crate::render::float4::Float4;
use crate::render::texel_grid::SIMD_LANES;
use crate::scene::Grade;

/// Opacity of film whose transmittance is turned in hue and changed in saturation; grey stays as it
/// is.
pub(super) fn graded_opacity(opacity: LinearRgb, grade: &Grade) -> LinearRgb {
    if opacity.r == opacity.g && opacity.g == opacity.b {
        return opacity;
    }
    let through = opacity.map(|o| 1.0 - o);
    crate::color::shift_hsv(through, grade.hue_deg, grade.saturation, 1.0).map(|t| 1.0 - t.min(1.0))
}

/// The mean over channels; exactly the channels' value where they are the same.
#[inline(always)]
pub(super) fn channel_mean(c: LinearRgb) -> f32 {
    if c.r == c.g && c.g == c.b {
        c.r
    } else {
        (c.r + c.g + c.b) / 3.0
    }
}

/// Grades the colours of texels; their fourth numbers stay.
pub(super) fn grade_colors(texels: &mut [Float4], grade: &Grade) {
    if *grade != Grade::default() {
        shift_colors(texels, grade.hue_deg, grade.saturation, grade.value);
    }
}

/// Dense since it is compiled as one piece for each set of vector instructions, over channels
/// apart.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn shift_colors(texels: &mut [Float4], hue_deg: f32, saturation: f32, value: f32) {
    for run in texels
        .chunks_mut(SIMD_LANES)
        .filter(|run| run.iter().any(|t| t.0 != [0.0; 4]))
    {
        let mut colors = [[0.0; SIMD_LANES]; 3];
        for (lane, t) in run.iter().enumerate() {
            (0..3).for_each(|c| colors[c][lane] = t.0[c]);
        }
        // By index: three arrays are read and written at the same lane, and vectorised.
        #[allow(clippy::needless_range_loop)]
        for lane in 0..SIMD_LANES {
            let color = LinearRgb::new(colors[0][lane], colors[1][lane], colors[2][lane]);
            let LinearRgb { r, g, b } = crate::color::shift_hsv(color, hue_deg, saturation, value);
            (colors[0][lane], colors[1][lane], colors[2][lane]) = (r, g, b);
        }
        for (lane, t) in run.iter_mut().enumerate() {
            (0..3).for_each(|c| t.0[c] = colors[c][lane]);
        }
    }
}
