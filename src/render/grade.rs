//! A card's own colours.

use crate::pixel::LinearRgb;
use crate::render::float4::Float4;
use crate::render::float8::Float8;
use crate::render::texel_grid::SIMD_LANES;
use crate::scene::Grade;
use bytemuck::Pod;

/// Opacity of film after a hue shift and a change of saturation of its transmittance; grey is
/// unchanged.
#[inline(always)]
pub(super) fn shifted_opacity(opacity: LinearRgb, hue_deg: f32, saturation: f32) -> LinearRgb {
    let through = opacity.map(|o| 1.0 - o);
    let shifted = crate::color::shift_hsv(through, hue_deg, saturation, 1.0);
    let is_grey = opacity.r == opacity.g && opacity.g == opacity.b;
    if is_grey {
        opacity
    } else {
        shifted.map(|t| 1.0 - t.min(1.0))
    }
}

/// The mean over channels; exactly the channels' value if they are equal.
#[inline(always)]
pub(super) fn channel_mean(c: LinearRgb) -> f32 {
    if c.r == c.g && c.g == c.b {
        c.r
    } else {
        (c.r + c.g + c.b) / 3.0
    }
}

/// Grades the colours of texels, the first numbers of each.
pub(super) fn grade_colors<T: Pod>(texels: &mut [T], grade: &Grade) {
    if *grade != Grade::default() {
        let step = size_of::<T>() / size_of::<Float4>();
        let parts = bytemuck::cast_slice_mut(texels);
        shift_colors(parts, step, grade.hue_deg, grade.saturation, grade.value);
    }
}

/// Grades the colours of film, and its opacity.
pub(super) fn grade_film(texels: &mut [Float8], grade: &Grade) {
    grade_colors(texels, grade);
    if turns_opacity(grade) {
        let parts = bytemuck::cast_slice_mut(texels);
        shift_opacities(parts, 2, grade.hue_deg, grade.saturation);
    }
}

/// Grades opacities as [`shifted_opacity`] does each.
pub(super) fn grade_opacities(opacities: &mut [Float4], grade: &Grade) {
    if turns_opacity(grade) {
        shift_opacities(opacities, 1, grade.hue_deg, grade.saturation);
    }
}

/// Whether film's opacity changes: hue and saturation affect it, the brightness of its reflection
/// does not.
fn turns_opacity(grade: &Grade) -> bool {
    (grade.hue_deg, grade.saturation) != (0.0, 1.0)
}

/// The first of every `step` elements is a colour.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn shift_colors(texels: &mut [Float4], step: usize, hue_deg: f32, saturation: f32, value: f32) {
    map_colors(texels, step, 0, |color| {
        crate::color::shift_hsv(color, hue_deg, saturation, value)
    });
}

/// The last of every `step` elements is an opacity.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn shift_opacities(texels: &mut [Float4], step: usize, hue_deg: f32, saturation: f32) {
    map_colors(texels, step, step - 1, |opacity| {
        shifted_opacity(opacity, hue_deg, saturation)
    });
}

/// Changes one of every `step` colours, channel by channel, so that it is vectorised; empty ones
/// are unchanged.
#[inline(always)]
fn map_colors(
    texels: &mut [Float4],
    step: usize,
    first: usize,
    change: impl Fn(LinearRgb) -> LinearRgb,
) {
    for run in texels
        .chunks_mut(step * SIMD_LANES)
        .filter(|run| run.iter().any(|t| t.0 != [0.0; 4]))
    {
        let mut colors = [[0.0; SIMD_LANES]; 3];
        for (lane, t) in run.iter().skip(first).step_by(step).enumerate() {
            (0..3).for_each(|c| colors[c][lane] = t.0[c]);
        }
        // By index: three arrays are read and written at the same lane.
        #[allow(clippy::needless_range_loop)]
        for lane in 0..SIMD_LANES {
            let color = LinearRgb::new(colors[0][lane], colors[1][lane], colors[2][lane]);
            let LinearRgb { r, g, b } = change(color);
            (colors[0][lane], colors[1][lane], colors[2][lane]) = (r, g, b);
        }
        for (lane, t) in run.iter_mut().skip(first).step_by(step).enumerate() {
            (0..3).for_each(|c| t.0[c] = colors[c][lane]);
        }
    }
}
