//! Transmittance of the layers of a block so far, for each sub-sample, and a row of one more layer.

#![expect(clippy::manual_clamp, reason = "turns NaN into 0")]

use crate::pixel::{LinearRgb, Mix};
use crate::render::block::PixelBlock;
use crate::render::float4::Float4;
use crate::render::float8::Float8;
use crate::render::irradiance::IrradianceMap;
use crate::render::lattice::LatticePosition;
use crate::render::ranges::range_union;
use crate::render::refill;
use crate::render::texel_grid::{BilinearCells, SIMD_LANES, TexelLine};
use crate::render::texture::{BakedTexels, BakedTexture, TexelContent};
use crate::work::Kind;
use std::ops::Range;

/// Transmittance of each sub-sample of a block: a plane for each position inside a pixel.
#[derive(Debug)]
pub(super) struct Transmittance {
    width: usize,
    /// Number of pixels of a plane.
    area: usize,
    /// One number for all channels; empty if there is film.
    grey: Vec<f32>,
    /// A number for each channel, and 1, so that alpha is summed unchanged; empty if there is no
    /// film.
    tinted: Vec<Float4>,
}

/// A row of one layer, one value per pixel.
#[derive(Debug, Default)]
pub(super) struct LayerRow {
    /// Pixels that the layer touches.
    pub(super) touched: Range<usize>,
    /// Without film: sum over sub-samples of its visible colour; the fourth number is that of its
    /// visible alpha. For opacity alone, what is hidden in each channel.
    light: Vec<Float4>,
    /// With film: the same, and that of its opacity.
    seen: Vec<Float8>,
    /// Without film: sum of its alpha, whatever is in front. With film it is the fourth number of
    /// `seen`.
    alpha: Vec<f32>,
    /// Light on it at the current sub-samples, if it differs from the pixel's.
    irradiance: Vec<Float4>,
    /// Factors on the light of the pixels that the layer touches.
    pub(super) pixel_light: Vec<Float4>,
    /// Texture readings, and light lookups, for all rows so far.
    read: usize,
    /// See `read`.
    pub(super) lit: usize,
}

/// One sub-sample of some pixels of a row.
pub(super) struct SubsampleRun<'a> {
    /// Texel positions, counted from the first of the pixels.
    pub(super) line: &'a TexelLine,
    /// Index of the sub-sample inside its pixel.
    pub(super) plane: usize,
    /// Row of the block.
    pub(super) y: usize,
    /// Columns of the block.
    pub(super) pixels: Range<usize>,
}

impl LayerRow {
    /// Work done for all rows.
    pub(super) fn work_counts(&self, content: TexelContent) -> [(Kind, u64); 3] {
        let film = if content.is_tinted() { self.read } else { 0 };
        [
            (Kind::TextureSamples, self.read as u64),
            (Kind::FilmSamples, film as u64),
            (Kind::ShadedSamples, self.lit as u64),
        ]
    }

    /// Resets to a row of `n` pixels.
    pub(super) fn start(&mut self, n: usize, content: TexelContent) {
        self.touched = 0..0;
        self.irradiance.clear();
        let [light, seen, alpha] = match content {
            TexelContent::Alpha => [n, 0, n],
            TexelContent::Film => [0, n, 0],
            TexelContent::Opacity => [n, 0, 0],
        };
        refill(&mut self.light, light, Float4::ZERO);
        refill(&mut self.seen, seen, Float8::ZERO);
        refill(&mut self.alpha, alpha, 0.0);
    }

    /// Records that some pixels' sub-samples read the layer's texture.
    pub(super) fn touch(&mut self, pixels: &Range<usize>) {
        self.touched = range_union(self.touched.clone(), pixels.clone());
        self.read += pixels.len();
    }

    /// Light of pixel `i` of the layer, and what it hides of everything behind it, per channel,
    /// summed over sub-samples.
    #[inline(always)]
    pub(super) fn seen_at(&self, i: usize, content: TexelContent) -> (Float4, LinearRgb) {
        match content {
            TexelContent::Alpha => (self.light[i], LinearRgb::grey(self.light[i].alpha())),
            TexelContent::Film => (self.seen[i].color(), self.seen[i].opacity().rgb()),
            TexelContent::Opacity => (Float4::ZERO, self.light[i].rgb()),
        }
    }

    /// Alpha of pixel `i` of the layer, whatever is in front, summed over sub-samples.
    #[inline(always)]
    pub(super) fn alpha_at(&self, i: usize, content: TexelContent) -> f32 {
        match content {
            TexelContent::Alpha => self.alpha[i],
            TexelContent::Film => self.seen[i].color().alpha(),
            TexelContent::Opacity => self.light[i].alpha(),
        }
    }

    /// Looks up the light on a layer at one sub-sample of each pixel.
    pub(super) fn look_up_light(
        &mut self,
        light: &IrradianceMap,
        pixels: Range<usize>,
        position: impl Fn(usize) -> (LatticePosition, LatticePosition),
    ) {
        self.irradiance.clear();
        self.lit += pixels.len();
        self.irradiance.extend(pixels.map(|i| {
            let (column, row) = position(i);
            light.value_at(column, row)
        }));
    }
}

impl Transmittance {
    /// Full transmittance for `r` x `r` sub-samples per pixel.
    pub(super) fn unobstructed(block: &PixelBlock, r: usize, content: TexelContent) -> Self {
        let (width, area) = (block.x.len(), block.len());
        let count = area * r * r;
        let (grey, tints) = match content.is_tinted() {
            true => (0, count),
            false => (count, 0),
        };
        Self {
            width,
            area,
            grey: vec![1.0; grey],
            tinted: vec![Float4::ONE; tints],
        }
    }

    /// The sub-samples of a pixel, row by row.
    #[inline(always)]
    pub(super) fn of_pixel(&self, x: usize, y: usize) -> impl Iterator<Item = Float4> {
        let (i, step) = (y * self.width + x, self.area.max(1));
        let grey = self.grey.iter().skip(i).step_by(step);
        let tinted = self.tinted.iter().skip(i).step_by(step);
        grey.map(|&t| Float4([t; 4])).chain(tinted.copied())
    }

    /// Composites a layer at one sub-sample of some pixels: adds its visible part to the row, and
    /// multiplies in its transmittance.
    pub(super) fn pass_layer(
        &mut self,
        texture: &BakedTexture,
        run: SubsampleRun<'_>,
        row: &mut LayerRow,
    ) {
        let SubsampleRun { pixels, line, .. } = run;
        let start = run.plane * self.area + run.y * self.width;
        let places = start + pixels.start..start + pixels.end;
        let (irradiance, size) = (&row.irradiance, texture.size());
        match &texture.texels {
            BakedTexels::Alpha(texels) => {
                let alpha = &mut row.alpha[pixels.clone()];
                let (through, light) = (&mut self.grey[places], &mut row.light[pixels]);
                pass_grey((texels, size), line, irradiance, through, light, alpha);
            }
            BakedTexels::Film(texels) => {
                let (through, seen) = (&mut self.tinted[places], &mut row.seen[pixels]);
                pass_film((texels, size), line, irradiance, through, seen);
            }
            BakedTexels::Opacity(texels) => {
                let (through, hidden) = (&mut self.tinted[places], &mut row.light[pixels]);
                pass_opacity((texels, size), line, through, hidden);
            }
        }
    }
}

/// A layer in a picture without film; `through` is one number per pixel.
///
/// Dense since it is the renderer's innermost loop: it is compiled as one piece for each vector
/// instruction set.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn pass_grey(
    (texels, size): (&[Float4], (usize, usize)),
    line: &TexelLine,
    irradiance: &[Float4],
    through: &mut [f32],
    light: &mut [Float4],
    alpha: &mut [f32],
) {
    let runs = through
        .chunks_mut(SIMD_LANES)
        .zip(light.chunks_mut(SIMD_LANES))
        .zip(alpha.chunks_mut(SIMD_LANES));
    for (run, ((through, light), alpha)) in runs.enumerate() {
        let cells = BilinearCells::along_line(line, (run * SIMD_LANES) as f32, size);
        let irradiance = irradiance.get(run * SIMD_LANES..).unwrap_or_default();
        for (lane, ((through, light), alpha)) in
            through.iter_mut().zip(light).zip(alpha).enumerate()
        {
            let texel = cells.texel(lane, texels, size.0);
            let a = texel.alpha().max(0.0).min(1.0);
            *light = light.add_scaled(*through, lit_by(texel, irradiance.get(lane)));
            *alpha += a;
            *through *= 1.0 - a;
        }
    }
}

/// A layer in a picture with film; `through` is a number for each channel, `seen` is light and what
/// is hidden.
///
/// Dense since it is the innermost loop for film: it is compiled as one piece for each vector
/// instruction set.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn pass_film(
    (texels, size): (&[Float8], (usize, usize)),
    line: &TexelLine,
    irradiance: &[Float4],
    through: &mut [Float4],
    seen: &mut [Float8],
) {
    let runs = through
        .chunks_mut(SIMD_LANES)
        .zip(seen.chunks_mut(SIMD_LANES));
    for (run, (through, seen)) in runs.enumerate() {
        let cells = BilinearCells::along_line(line, (run * SIMD_LANES) as f32, size);
        let irradiance = irradiance.get(run * SIMD_LANES..).unwrap_or_default();
        for (lane, (through, seen)) in through.iter_mut().zip(seen).enumerate() {
            let texel = cells.texel(lane, texels, size.0);
            let opacity = texel.opacity().clamped();
            let lit = lit_by(texel.color(), irradiance.get(lane));
            *seen = seen.add_product(Float8::new(*through, *through), Float8::new(lit, opacity));
            *through = through.times(opacity.complement());
        }
    }
}

/// A layer in the dark in a picture with film: the same opacities as [`pass_film`].
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn pass_opacity(
    (texels, size): (&[Float4], (usize, usize)),
    line: &TexelLine,
    through: &mut [Float4],
    hidden: &mut [Float4],
) {
    let runs = through
        .chunks_mut(SIMD_LANES)
        .zip(hidden.chunks_mut(SIMD_LANES));
    for (run, (through, hidden)) in runs.enumerate() {
        let cells = BilinearCells::along_line(line, (run * SIMD_LANES) as f32, size);
        for (lane, (through, hidden)) in through.iter_mut().zip(hidden).enumerate() {
            let opacity = cells.texel(lane, texels, size.0).clamped();
            *hidden = hidden.add_product(*through, opacity);
            *through = through.times(opacity.complement().with_fourth(1.0));
        }
    }
}

/// A texel under some light; unchanged if light is applied later.
#[inline(always)]
fn lit_by(texel: Float4, irradiance: Option<&Float4>) -> Float4 {
    match irradiance {
        Some(&e) => texel.times(e),
        None => texel,
    }
}
