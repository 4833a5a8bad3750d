//! What passes through the layers of a block so far, for each sub-sample, and a row of one more
//! layer.

#![expect(clippy::manual_clamp, reason = "turns NaN into 0")]

use crate::pixel::LinearRgb;
use crate::render::block::PixelBlock;
use crate::render::float4::Float4;
use crate::render::grade::channel_mean;
use crate::render::irradiance::IrradianceMap;
use crate::render::lattice::LatticePosition;
use crate::render::ranges::range_union;
use crate::render::refill;
use crate::render::texel_grid::{BilinearCells, SIMD_LANES, TexelLine};
use crate::render::texture::BakedTexture;
use crate::work::Kind;
use std::ops::Range;

/// Transmittance of each sub-sample of a block: a plane for each of the places inside a pixel.
#[derive(Debug)]
pub(super) struct Transmittance {
    width: usize,
    /// Pixels of a plane.
    area: usize,
    /// One number for all channels; empty where there is film.
    grey: Vec<f32>,
    /// A number for each channel; empty where there is none.
    tinted: Vec<Float4>,
}

/// A row of one layer, a value for each pixel.
#[derive(Debug, Default)]
pub(super) struct LayerRow {
    /// Pixels that the layer touches.
    pub(super) touched: Range<usize>,
    /// Sum over sub-samples of its colour, as far as it is seen; the fourth number is the same of
    /// its alpha.
    pub(super) light: Vec<Float4>,
    /// The same of its opacity, where there is film.
    pub(super) hidden: Vec<Float4>,
    /// Sum of its alpha, whatever is in front.
    pub(super) alpha: Vec<f32>,
    /// Light on it at the sub-samples under work, where that is not the pixel's.
    irradiance: Vec<Float4>,
    /// Texture readings, and light looked up, for all rows so far.
    read: usize,
    /// See `read`.
    pub(super) lit: usize,
}

/// One sub-sample of some pixels of a row.
pub(super) struct SubsampleRun<'a> {
    /// Texel positions, counted from the first of the pixels.
    pub(super) line: &'a TexelLine,
    /// Number of the sub-sample inside its pixel.
    pub(super) plane: usize,
    /// Row of the block.
    pub(super) y: usize,
    /// Columns of the block.
    pub(super) pixels: Range<usize>,
}

impl LayerRow {
    /// What all rows took.
    pub(super) fn work_counts(&self, tinted: bool) -> [(Kind, u64); 3] {
        let film = if tinted { self.read } else { 0 };
        [
            (Kind::TextureSamples, self.read as u64),
            (Kind::FilmSamples, film as u64),
            (Kind::ShadedSamples, self.lit as u64),
        ]
    }

    /// Empties a row of `n` pixels.
    pub(super) fn start(&mut self, n: usize, tinted: bool) {
        self.touched = 0..0;
        self.irradiance.clear();
        refill(&mut self.light, n, Float4::ZERO);
        refill(&mut self.hidden, if tinted { n } else { 0 }, Float4::ZERO);
        refill(&mut self.alpha, n, 0.0);
    }

    /// Notes that some pixels' sub-samples read the layer's texture.
    pub(super) fn touch(&mut self, pixels: &Range<usize>) {
        self.touched = range_union(self.touched.clone(), pixels.clone());
        self.read += pixels.len();
    }

    /// What pixel `i` of the layer hides of all behind it, per channel, added up over sub-samples.
    #[inline(always)]
    pub(super) fn hidden_by(&self, i: usize, tinted: bool) -> LinearRgb {
        if tinted {
            self.hidden[i].rgb()
        } else {
            LinearRgb::grey(self.light[i].alpha())
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
    /// Nothing in the way of `r` x `r` sub-samples a pixel.
    pub(super) fn unobstructed(block: &PixelBlock, r: usize, tinted: bool) -> Self {
        let (width, area) = (block.x.len(), block.len());
        let count = area * r * r;
        let (grey, tints) = if tinted { (0, count) } else { (count, 0) };
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

    /// Passes a layer at one sub-sample of some pixels: adds to the row what is seen of the layer,
    /// and takes away what it hides of all that comes later.
    pub(super) fn pass_layer(
        &mut self,
        texture: &BakedTexture,
        run: SubsampleRun<'_>,
        row: &mut LayerRow,
    ) {
        let SubsampleRun { pixels, line, .. } = run;
        let start = run.plane * self.area + run.y * self.width;
        let places = start + pixels.start..start + pixels.end;
        let light = &mut row.light[pixels.clone()];
        let alpha = &mut row.alpha[pixels.clone()];
        let irradiance = &row.irradiance;
        if self.tinted.is_empty() {
            let through = &mut self.grey[places];
            pass_grey(texture, line, irradiance, through, light, alpha);
        } else {
            let through = &mut self.tinted[places];
            let hidden = &mut row.hidden[pixels];
            pass_tinted(texture, line, irradiance, through, light, alpha, hidden);
        }
    }
}

/// A layer without film; `through` is one number a pixel.
///
/// Dense since it is the renderer's innermost loop: it is compiled as one piece for each set of
/// vector instructions.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn pass_grey(
    texture: &BakedTexture,
    line: &TexelLine,
    irradiance: &[Float4],
    through: &mut [f32],
    light: &mut [Float4],
    alpha: &mut [f32],
) {
    let size = texture.size();
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
            let texel = bilinear_texel(&texture.texels, size.0, &cells, lane);
            let a = texel.alpha().max(0.0).min(1.0);
            *light = light.add_scaled(*through, lit_by(texel, irradiance.get(lane)));
            *alpha += a;
            *through *= 1.0 - a;
        }
    }
}

/// A layer where there is film; `through` and `hidden` are a number for each channel.
///
/// Dense since it is the innermost loop where there is film: all that it reads and writes is at
/// hand in one piece.
fn pass_tinted(
    texture: &BakedTexture,
    line: &TexelLine,
    irradiance: &[Float4],
    through: &mut [Float4],
    light: &mut [Float4],
    alpha: &mut [f32],
    hidden: &mut [Float4],
) {
    let size = texture.size();
    let pixels = through
        .iter_mut()
        .zip(light)
        .zip(alpha.iter_mut().zip(hidden))
        .enumerate();
    let mut cells = BilinearCells::along_line(line, 0.0, size);
    for (i, ((through, light), (alpha, hidden))) in pixels {
        let lane = i % SIMD_LANES;
        if lane == 0 {
            cells = BilinearCells::along_line(line, i as f32, size);
        }
        let texel = bilinear_texel(&texture.texels, size.0, &cells, lane);
        let opacity = film_opacity(texture, texel, &cells, lane);
        // The fourth number is above 0 where anything is seen at all.
        let seen = lit_by(texel, irradiance.get(i)).with_fourth(texel.alpha());
        *light = light.add_product(*through, seen);
        *alpha += channel_mean(opacity.rgb());
        *hidden = hidden.add_product(*through, opacity);
        *through = through.times(opacity.complement());
    }
}

/// Opacity per channel, 0 to 1: that of film, or alpha.
#[inline(always)]
fn film_opacity(
    texture: &BakedTexture,
    texel: Float4,
    cells: &BilinearCells,
    lane: usize,
) -> Float4 {
    let opacity = match texture.opacity.as_slice() {
        [] => Float4([texel.alpha(); 4]),
        film => bilinear_texel(film, texture.size().0, cells, lane),
    };
    Float4(opacity.0.map(|o| o.max(0.0).min(1.0)))
}

/// A texel under some light; as it is where light comes later.
#[inline(always)]
fn lit_by(texel: Float4, irradiance: Option<&Float4>) -> Float4 {
    match irradiance {
        Some(&e) => texel.times(e),
        None => texel,
    }
}

#[inline(always)]
fn bilinear_texel(texels: &[Float4], stride: usize, cells: &BilinearCells, lane: usize) -> Float4 {
    let at = cells.at[lane] as usize;
    let (top, bottom) = (&texels[at..][..2], &texels[at + stride..][..2]);
    Float4::bilinear(
        [top[0], top[1]],
        [bottom[0], bottom[1]],
        cells.fx[lane],
        cells.fy[lane],
    )
}
