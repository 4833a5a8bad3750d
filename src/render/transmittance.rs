//! What passes through the layers of a block so far, for each sub-sample, and a row of one more layer.

#![expect(clippy::manual_clamp, reason = "takes a number that is none to 0")]

use crate::render::float4::Float4;
use crate::render::irradiance::IrradianceMap;
use crate::render::lattice::LatticePosition;
use crate::render::layers::{Layer, PixelBlock};
use crate::render::texture::{BakedTexture, BilinearCells, SIMD_LANES, TexelLine, mean};
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
    /// Sum over sub-samples of its colour, as far as it is seen; the fourth number is the same of its alpha.
    pub(super) light: Vec<Float4>,
    /// The same of its opacity, where there is film.
    pub(super) hidden: Vec<Float4>,
    /// Sum of its alpha, whatever is in front.
    pub(super) alpha: Vec<f32>,
    /// Light on it at the sub-samples under work, where that is not the pixel's.
    irradiance: Vec<Float4>,
    /// Texture readings, and light looked up, for all rows so far.
    pub(super) read: usize,
    /// See `read`.
    pub(super) lit: usize,
}

impl LayerRow {
    /// What all rows took.
    pub(super) fn counts(&self, tinted: bool) -> [(Kind, u64); 3] {
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
        for fours in [&mut self.light, &mut self.hidden] {
            fours.clear();
        }
        self.light.resize(n, Float4::ZERO);
        self.hidden.resize(if tinted { n } else { 0 }, Float4::ZERO);
        self.alpha.clear();
        self.alpha.resize(n, 0.0);
    }

    /// Looks up the light on a layer at one sub-sample of each pixel.
    pub(super) fn light_between(
        &mut self,
        light: &IrradianceMap,
        pixels: Range<usize>,
        column: impl Fn(usize) -> LatticePosition,
        row: LatticePosition,
    ) {
        self.irradiance.clear();
        self.lit += pixels.len();
        self.irradiance
            .extend(pixels.map(|i| light.at(column(i), row)));
    }
}

impl Transmittance {
    /// Nothing in the way of `r` x `r` sub-samples a pixel.
    pub(super) fn all(block: &PixelBlock, r: usize, tinted: bool) -> Self {
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
    pub(super) fn of(&self, x: usize, y: usize) -> impl Iterator<Item = Float4> {
        let i = y * self.width + x;
        let grey = self
            .grey
            .iter()
            .skip(i)
            .step_by(self.area.max(1))
            .map(|&t| Float4([t; 4]));
        grey.chain(
            self.tinted
                .iter()
                .skip(i)
                .step_by(self.area.max(1))
                .copied(),
        )
    }

    /// Passes a layer at some pixels of a row, one sub-sample each: adds to the row what is seen of the layer, and takes
    /// away what it hides of all that comes later.
    pub(super) fn pass(
        &mut self,
        layer: &Layer,
        line: &TexelLine,
        plane: usize,
        y: usize,
        pixels: Range<usize>,
        row: &mut LayerRow,
    ) {
        let start = plane * self.area + y * self.width;
        let places = start + pixels.start..start + pixels.end;
        let (light, alpha) = (
            &mut row.light[pixels.clone()],
            &mut row.alpha[pixels.clone()],
        );
        if self.tinted.is_empty() {
            pass_grey(
                &layer.texture,
                line,
                &row.irradiance,
                &mut self.grey[places],
                light,
                alpha,
            );
        } else {
            let sums = (light, alpha, &mut row.hidden[pixels]);
            pass_tinted(
                &layer.texture,
                line,
                &row.irradiance,
                &mut self.tinted[places],
                sums,
            );
        }
    }
}

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
    let sums = through
        .chunks_mut(SIMD_LANES)
        .zip(light.chunks_mut(SIMD_LANES))
        .zip(alpha.chunks_mut(SIMD_LANES));
    for (run, ((through, light), alpha)) in sums.enumerate() {
        let cells = BilinearCells::of(line, (run * SIMD_LANES) as f32, size);
        let irradiance = irradiance.get(run * SIMD_LANES..).unwrap_or_default();
        for (lane, ((through, light), alpha)) in
            through.iter_mut().zip(light).zip(alpha).enumerate()
        {
            let texel = bilinear(&texture.texels, size.0, &cells, lane);
            let a = texel.alpha().max(0.0).min(1.0);
            let lit = if let Some(&e) = irradiance.get(lane) {
                texel.times(e)
            } else {
                texel
            };
            *light = light.add_scaled(*through, lit);
            *alpha += a;
            *through *= 1.0 - a;
        }
    }
}

fn pass_tinted(
    texture: &BakedTexture,
    line: &TexelLine,
    irradiance: &[Float4],
    through: &mut [Float4],
    (light, alpha, hidden): (&mut [Float4], &mut [f32], &mut [Float4]),
) {
    let size = texture.size();
    let sums = through
        .iter_mut()
        .zip(light)
        .zip(alpha.iter_mut().zip(hidden))
        .enumerate();
    let mut cells = BilinearCells::of(line, 0.0, size);
    for (i, ((through, light), (alpha, hidden))) in sums {
        let lane = i % SIMD_LANES;
        if lane == 0 {
            cells = BilinearCells::of(line, i as f32, size);
        }
        let texel = bilinear(&texture.texels, size.0, &cells, lane);
        let opacity = match texture.opacity.as_slice() {
            [] => Float4([texel.alpha(); 4]),
            film => bilinear(film, size.0, &cells, lane),
        };
        let opacity = Float4(opacity.0.map(|o| o.max(0.0).min(1.0)));
        let lit = if let Some(&e) = irradiance.get(i) {
            texel.times(e)
        } else {
            texel
        };
        // The fourth number tells whether anything is seen at all.
        *light = Float4(std::array::from_fn(|c| {
            light.0[c] + through.0[c] * if c < 3 { lit.0[c] } else { texel.alpha() }
        }));
        *alpha += mean(opacity.rgb());
        *hidden = Float4(std::array::from_fn(|c| {
            hidden.0[c] + through.0[c] * opacity.0[c]
        }));
        *through = Float4(std::array::from_fn(|c| through.0[c] * (1.0 - opacity.0[c])));
    }
}

#[inline(always)]
fn bilinear(texels: &[Float4], stride: usize, cells: &BilinearCells, lane: usize) -> Float4 {
    let at = cells.at[lane] as usize;
    let (top, bottom) = (&texels[at..][..2], &texels[at + stride..][..2]);
    Float4::bilinear(
        [top[0], top[1]],
        [bottom[0], bottom[1]],
        cells.fx[lane],
        cells.fy[lane],
    )
}
