//! Positions of a texture's texels, and of a line of samples between them.

use crate::geom::Vector3;
use crate::render::float4::Blend;

/// Transparent texels around a texture: one for positions beyond its outermost texels, and one more
/// for bilinear reading.
pub(super) const BORDER_TEXELS: usize = 2;

/// Maximum error of positions in single precision, texels.
pub(super) const POSITION_ERROR_TEXELS: f64 = 1.0 / 8.0;

/// Number of samples whose positions are computed at once: a register of AVX-512, two of AVX2.
pub(super) const SIMD_LANES: usize = 16;

/// Minimum distance of positions from the first and the last texel, which are empty anyway.
const INSET_TEXELS: f32 = 1.0 / 64.0;

/// 2^23: floats from here on are integers, and their lowest bits count them.
const TWO_POW_23: f32 = 8_388_608.0;

/// Positions of a texture's pixels in its own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelGrid {
    /// Texels that `u` and `v` from 0 to 1 span; fractional at mip levels of odd sizes.
    pub(super) texels: [f64; 2],
    /// How far the texture reaches beyond 0..1, as a share of it.
    pub(super) reach: [f64; 2],
}

impl TexelGrid {
    /// The grid of a texture of some size, halved `level` times.
    ///
    /// The full texture ends at its edge; smaller ones fade over half a texel outside it.
    pub(super) fn new((width, height): (usize, usize), level: f64) -> Self {
        let scale = libm::exp2(-level);
        let texels = [width as f64 * scale, height as f64 * scale];
        let reach_texels = if level > 0.0 { 0.5 } else { 0.0 };
        Self {
            texels,
            reach: texels.map(|n| reach_texels / n),
        }
    }

    /// Converts rows that give texture coordinates to rows that give positions among bordered
    /// texels.
    pub(super) fn texel_rows(
        &self,
        u: &Vector3<f64>,
        v: &Vector3<f64>,
        w: &Vector3<f64>,
    ) -> [Vector3<f64>; 2] {
        let first = BORDER_TEXELS as f64 - 0.5;
        [
            u * self.texels[0] + w * first,
            v * self.texels[1] + w * first,
        ]
    }
}

/// Positions along a line over bordered texels: three numbers that grow linearly, the third the
/// divisor of the others.
pub(super) type TexelLine = [(f32, f32); 3];

/// The line from `first` on, in steps of one to the right; `u`, `v` and `w` give positions among
/// bordered texels.
pub(super) fn texel_line(rows: [Vector3<f64>; 3], first: &Vector3<f64>) -> TexelLine {
    rows.map(|row| (row.dot(first) as f32, row.x as f32))
}

/// Bilinear cells of a run of samples: index of the first of the four texels, and the fractions
/// towards the others.
#[derive(Default)]
pub(super) struct BilinearCells {
    pub(super) at: [u32; SIMD_LANES],
    pub(super) fx: [f32; SIMD_LANES],
    pub(super) fy: [f32; SIMD_LANES],
}

impl BilinearCells {
    /// Samples `first`, `first + 1` and so on of a line; positions outside are clamped to the
    /// nearest inside.
    #[inline(always)]
    pub(super) fn along_line(
        [u, v, w]: &TexelLine,
        first: f32,
        (width, height): (usize, usize),
    ) -> Self {
        let mut cells = Self::default();
        let last = [width, height].map(|texels| texels as f32 - 1.0 - INSET_TEXELS);
        let stride = width as u32;
        for lane in 0..SIMD_LANES {
            let k = first + lane as f32;
            let scale = 1.0 / (w.0 + k * w.1);
            let (i, fx) = integer_and_fraction((u.0 + k * u.1) * scale, last[0]);
            let (j, fy) = integer_and_fraction((v.0 + k * v.1) * scale, last[1]);
            cells.at[lane] = j.wrapping_mul(stride).wrapping_add(i);
            (cells.fx[lane], cells.fy[lane]) = (fx, fy);
        }
        cells
    }

    /// Interpolates a sample in texels whose rows are `stride` long.
    #[inline(always)]
    pub(super) fn texel<T: Blend>(&self, lane: usize, texels: &[T], stride: usize) -> T {
        let at = self.at[lane] as usize;
        let cell = &texels[at..][..stride + 2];
        T::bilinear(
            [cell[0], cell[1]],
            [cell[stride], cell[stride + 1]],
            self.fx[lane],
            self.fy[lane],
        )
    }
}

/// A position between texels 0 and `last` as the texel before it and the fraction towards the next.
///
/// By bit operations, since a checked conversion keeps loops from being vectorised; a position on a
/// texel may come as the one before and a fraction of 1, which is the same place.
#[inline(always)]
fn integer_and_fraction(x: f32, last: f32) -> (u32, f32) {
    let x = x.max(INSET_TEXELS).min(last);
    let next = (x + 0.5) + TWO_POW_23;
    (
        (next.to_bits() & 0x007f_ffff).wrapping_sub(1),
        x - (next - TWO_POW_23 - 1.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integer_and_fraction_make_up_the_position() {
        for k in 0..4000 {
            let x = 0.02 + k as f32 * 0.013;
            let (i, f) = integer_and_fraction(x, 60.0);
            assert!(
                (0.0..=1.0).contains(&f) && (i as f32 + f - x).abs() < 1e-5,
                "{x}: {i} + {f}"
            );
        }
    }

    #[test]
    fn positions_outside_or_nowhere_are_brought_inside() {
        for x in [f32::NAN, f32::NEG_INFINITY, -7.0, 0.0] {
            assert_eq!(integer_and_fraction(x, 9.0).0, 0);
        }
        assert_eq!(integer_and_fraction(f32::INFINITY, 8.9).0, 8);
    }
}
