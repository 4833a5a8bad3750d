//! Textures made ready for one picture: one level of detail, a transparent border, the card's colours.

#![expect(
    clippy::needless_range_loop,
    reason = "several arrays in step, which vectorises"
)]
#![expect(clippy::manual_clamp, reason = "takes a number that is none to 0")]

use crate::asset::Texture;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};
use crate::render::float4::Float4;
use crate::scene::Grade;
use nalgebra::Vector3;

/// Transparent texels around a texture: what positions reach beyond its outermost ones, and one to read on.
const BORDER_TEXELS: usize = 2;

/// Positions are worked out for this many samples at once.
pub(super) const SIMD_LANES: usize = 16;

/// Where a texture's pixels lie in its own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelGrid {
    /// Texels that `u` and `v` from 0 to 1 run over; not whole on halved levels of odd sizes.
    texels: [f64; 2],
    /// How far the texture reaches beyond 0..1, as a share of it.
    pub(super) reach: [f64; 2],
}

impl TexelGrid {
    fn new((width, height): (usize, usize), level: f64, reach_texels: f64) -> Self {
        let scale = libm::exp2(-level);
        let texels = [width as f64 * scale, height as f64 * scale];
        Self {
            texels,
            reach: texels.map(|n| reach_texels / n),
        }
    }

    /// Rows that give positions among bordered texels, from rows that give texture coordinates.
    pub(super) fn rows(
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

/// Positions along a line over bordered texels: numbers that grow evenly, the third the divisor of the others.
pub(super) type TexelLine = [(f32, f32); 3];

/// Bilinear cells that a run of samples falls into: index of the first of the four texels, and the way to the others.
pub(super) struct BilinearCells {
    pub(super) at: [u32; SIMD_LANES],
    pub(super) fx: [f32; SIMD_LANES],
    pub(super) fy: [f32; SIMD_LANES],
}

impl BilinearCells {
    /// Samples `first`, `first + 1` and so on of a line; positions outside count as the nearest inside.
    #[inline(always)]
    pub(super) fn of([u, v, w]: &TexelLine, first: f32, (width, height): (usize, usize)) -> Self {
        let mut cells = Self {
            at: [0; SIMD_LANES],
            fx: [0.0; SIMD_LANES],
            fy: [0.0; SIMD_LANES],
        };
        let last = [
            width as f32 - 1.0 - INSET_TEXELS,
            height as f32 - 1.0 - INSET_TEXELS,
        ];
        let stride = width as u32;
        for lane in 0..SIMD_LANES {
            let k = first + lane as f32;
            let scale = 1.0 / (w.0 + k * w.1);
            let (i, fx) = whole_and_rest((u.0 + k * u.1) * scale, last[0]);
            let (j, fy) = whole_and_rest((v.0 + k * v.1) * scale, last[1]);
            cells.at[lane] = j.wrapping_mul(stride).wrapping_add(i);
            (cells.fx[lane], cells.fy[lane]) = (fx, fy);
        }
        cells
    }
}

/// How far positions are kept from the first and the last texel, which are empty anyway.
const INSET_TEXELS: f32 = 1.0 / 64.0;

/// 2^23: floats from here on are whole, and their lowest bits count them.
const TWO_POW_23: f32 = 8_388_608.0;

/// A position between texels 0 and `last` as the texel before it and the way on.
///
/// By bits, since a conversion with all its checks keeps loops from being vectorised; a position on a texel may come as
/// the one before and a whole way on, which is the same place.
#[inline(always)]
fn whole_and_rest(x: f32, last: f32) -> (u32, f32) {
    let x = x.max(INSET_TEXELS).min(last);
    let next = (x + 0.5) + TWO_POW_23;
    (
        (next.to_bits() & 0x007f_ffff).wrapping_sub(1),
        x - (next - TWO_POW_23 - 1.0),
    )
}

/// Colour and opacity at the level of detail that a picture asks for.
#[derive(Debug)]
pub(super) struct BakedTexture {
    pub(super) grid: TexelGrid,
    width: usize,
    height: usize,
    /// Colour, and alpha; for film the mean opacity.
    pub(super) texels: Vec<Float4>,
    /// Opacity of film, per channel; empty for a texture with alpha.
    pub(super) opacity: Vec<Float4>,
}

impl BakedTexture {
    /// A texture at a level of detail, which need not be whole, in a card's own colours.
    ///
    /// The level below is averaged further, so that there are no more texels than are needed and a reading costs four of
    /// them.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: f64) -> Self {
        let level = level.clamp(0.0, (texture.levels() - 1) as f64);
        let detail = DetailLevel {
            level: level as usize,
            step: libm::exp2(level.fract()),
        };
        // The full picture ends at its edge; smaller ones fade half a texel out.
        let grid = TexelGrid::new(texture.size(), level, if level > 0.0 { 0.5 } else { 0.0 });
        let (size, texels, opacity) = match texture {
            Texture::Rgba(pyramid) => {
                let (size, texels) = detail.read(|l| pyramid.level(l), |p: PremulRgba| p.into());
                (size, texels, Vec::new())
            }
            Texture::Film(pyramid) => {
                let (size, texels) = detail.read(|l| pyramid.level(l), |p: Film| p.color.into());
                let (_, opacity) = detail.read(|l| pyramid.level(l), |p: Film| p.opacity.into());
                (size, texels, opacity)
            }
        };
        let mut baked = Self {
            grid,
            width: size.0,
            height: size.1,
            texels,
            opacity,
        };
        baked.grade(grade);
        baked
    }

    /// Columns and rows with their border.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn grade(&mut self, grade: &Grade) {
        grade_colors(&mut self.texels, grade);
        // Film of another hue lets another hue pass; how bright it reflects is no matter of what passes.
        let through = Grade {
            value: 1.0,
            ..*grade
        };
        if through != Grade::default() {
            for o in self.opacity.iter_mut().filter(|o| **o != Float4::ZERO) {
                *o = graded_opacity(o.rgb(), &through).into();
            }
        }
        for (t, o) in self.texels.iter_mut().zip(&self.opacity) {
            t.0[3] = mean(o.rgb());
        }
    }
}

/// Opacity of film whose transmittance is turned in hue and changed in saturation; grey stays as it is.
pub(super) fn graded_opacity(opacity: LinearRgb, grade: &Grade) -> LinearRgb {
    if opacity.r == opacity.g && opacity.g == opacity.b {
        return opacity;
    }
    let through = opacity.map(|o| 1.0 - o);
    crate::color::shift_hsv(through, grade.hue_deg, grade.saturation, 1.0).map(|t| 1.0 - t.min(1.0))
}

/// The mean over channels; exactly the channels' value where they are the same.
#[inline(always)]
pub(super) fn mean(c: LinearRgb) -> f32 {
    if c.r == c.g && c.g == c.b {
        c.r
    } else {
        (c.r + c.g + c.b) / 3.0
    }
}

fn grade_colors(texels: &mut [Float4], grade: &Grade) {
    if *grade != Grade::default() {
        shift_colors(texels, grade.hue_deg, grade.saturation, grade.value);
    }
}

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

/// A level of detail, and how much smaller the picture is to be.
struct DetailLevel {
    level: usize,
    /// Texels of the level that make one, along each side: 1 up to 2.
    step: f64,
}

impl DetailLevel {
    /// Size and texels, bordered.
    fn read<'a, P: Copy + 'a>(
        &self,
        level: impl Fn(usize) -> &'a Image<P>,
        four: impl Fn(P) -> Float4,
    ) -> ((usize, usize), Vec<Float4>) {
        let image = level(self.level);
        let (columns, rows) = (
            DownsampleAxis::of(image.width(), self.step),
            DownsampleAxis::of(image.height(), self.step),
        );
        let (width, height) = (
            columns.0.len() + 2 * BORDER_TEXELS,
            rows.0.len() + 2 * BORDER_TEXELS,
        );
        let mut texels = vec![Float4::ZERO; width * height];
        let (mut line, mut sum) = (
            vec![Float4::ZERO; image.width()],
            vec![Float4::ZERO; image.width()],
        );
        for (share, out) in rows
            .0
            .iter()
            .zip(texels.chunks_exact_mut(width).skip(BORDER_TEXELS))
        {
            sum.fill(Float4::ZERO);
            for (y, weight) in share.weighted() {
                line.iter_mut()
                    .zip(image.row(y))
                    .for_each(|(t, &p)| *t = four(p));
                sum.iter_mut()
                    .zip(&line)
                    .for_each(|(s, t)| *s = s.add_scaled(weight, *t));
            }
            for (share, out) in columns.0.iter().zip(&mut out[BORDER_TEXELS..]) {
                *out = share
                    .weighted()
                    .fold(Float4::ZERO, |s, (x, weight)| s.add_scaled(weight, sum[x]));
            }
        }
        ((width, height), texels)
    }
}

/// What each texel of a smaller picture takes from a larger one, along one side.
struct DownsampleAxis(Vec<TexelWeights>);

/// Up to three texels in a row and their weights, which add up to 1 (less at the end, where the picture ends).
struct TexelWeights {
    first: usize,
    weights: [f32; 3],
    count: usize,
}

impl DownsampleAxis {
    /// Averages over `step` texels (1 up to 2).
    fn of(len: usize, step: f64) -> Self {
        let count = (len as f64 / step).ceil() as usize;
        Self(
            (0..count)
                .map(|k| TexelWeights::of(k as f64 * step, (k + 1) as f64 * step, len))
                .collect(),
        )
    }
}

impl TexelWeights {
    fn of(start: f64, end: f64, len: usize) -> Self {
        let first = (start as usize).min(len - 1);
        let count = ((end.ceil() as usize).min(len) - first).min(3);
        let weight = |n: usize| {
            let at = (first + n) as f64;
            (((at + 1.0).min(end) - at.max(start)).max(0.0) / (end - start)) as f32
        };
        Self {
            first,
            weights: [weight(0), weight(1), weight(2)],
            count,
        }
    }

    #[inline(always)]
    fn weighted(&self) -> impl Iterator<Item = (usize, f32)> {
        self.weights
            .into_iter()
            .take(self.count)
            .enumerate()
            .map(|(n, weight)| (self.first + n, weight))
    }
}

/// Opacity alone, for what falls into shadow.
#[derive(Debug)]
pub(super) struct OpacityLevel {
    pub(super) grid: TexelGrid,
    width: usize,
    height: usize,
    /// One plane of alpha, or one for each channel of film.
    planes: Vec<Vec<f32>>,
    /// Every texel stops all light.
    opaque: bool,
}

/// Positions in single precision are off by less than this, texels.
const POSITION_ERROR_TEXELS: f64 = 1.0 / 8.0;

impl OpacityLevel {
    /// Opacity of a texture halved `level` times, in a card's own colours.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: usize) -> Self {
        let grid = TexelGrid::new(
            texture.size(),
            level as f64,
            if level > 0 { 0.5 } else { 0.0 },
        );
        match texture {
            Texture::Rgba(pyramid) => Self::of(grid, pyramid.level(level), &[&|p: PremulRgba| p.a]),
            Texture::Film(pyramid) => {
                let graded = pyramid
                    .level(level)
                    .map(|p: Film| graded_opacity(p.opacity, grade));
                let channels: [&dyn Fn(LinearRgb) -> f32; 3] = [&|o| o.r, &|o| o.g, &|o| o.b];
                Self::of(grid, &graded, &channels)
            }
        }
    }

    fn of<P: Copy>(grid: TexelGrid, image: &Image<P>, channels: &[&dyn Fn(P) -> f32]) -> Self {
        let (width, height) = (
            image.width() + 2 * BORDER_TEXELS,
            image.height() + 2 * BORDER_TEXELS,
        );
        let plane = |channel: &&dyn Fn(P) -> f32| {
            let mut plane = vec![0.0; width * height];
            for (y, row) in image.rows().enumerate() {
                let line = &mut plane[(y + BORDER_TEXELS) * width + BORDER_TEXELS..][..row.len()];
                line.iter_mut().zip(row).for_each(|(a, &p)| *a = channel(p));
            }
            plane
        };
        let planes = channels.iter().map(plane).collect();
        let opaque = image
            .pixels()
            .iter()
            .all(|&p| channels.iter().all(|channel| channel(p) == 1.0));
        Self {
            grid,
            width,
            height,
            planes,
            opaque,
        }
    }

    /// How far inside of its sides an opaque texture is surely read as opaque, as shares of it; none for one that is not.
    pub(super) fn inset(&self) -> Option<[f64; 2]> {
        self.opaque
            .then(|| self.grid.texels.map(|n| (0.5 + POSITION_ERROR_TEXELS) / n))
    }

    /// Multiplies what gets through, along a line over bordered texels from its sample `first` on, in one channel.
    pub(super) fn darken(
        &self,
        channel: usize,
        line: &TexelLine,
        first: usize,
        through: &mut [f32],
    ) {
        let plane = &self.planes[channel.min(self.planes.len() - 1)];
        darken(
            plane,
            (self.width, self.height),
            line,
            first as f32,
            through,
        );
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn darken(
    opacity: &[f32],
    size: (usize, usize),
    line: &TexelLine,
    first: f32,
    through: &mut [f32],
) {
    let mut first = first;
    for run in through.chunks_mut(SIMD_LANES) {
        let cells = BilinearCells::of(line, first, size);
        let mut corners = [[0.0; SIMD_LANES]; 4];
        for lane in 0..SIMD_LANES {
            let at = cells.at[lane] as usize;
            let (top, bottom) = (&opacity[at..][..2], &opacity[at + size.0..][..2]);
            (corners[0][lane], corners[1][lane]) = (top[0], top[1]);
            (corners[2][lane], corners[3][lane]) = (bottom[0], bottom[1]);
        }
        let mut passes = [0.0; SIMD_LANES];
        for lane in 0..SIMD_LANES {
            let (fx, fy) = (cells.fx[lane], cells.fy[lane]);
            let top = corners[0][lane] + fx * (corners[1][lane] - corners[0][lane]);
            let bottom = corners[2][lane] + fx * (corners[3][lane] - corners[2][lane]);
            passes[lane] = 1.0 - (top + fy * (bottom - top)).max(0.0).min(1.0);
        }
        run.iter_mut().zip(&passes).for_each(|(t, p)| *t *= p);
        first += SIMD_LANES as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_and_rest_make_up_the_position() {
        for k in 0..4000 {
            let x = 0.02 + k as f32 * 0.013;
            let (i, f) = whole_and_rest(x, 60.0);
            assert!(
                (0.0..=1.0).contains(&f) && (i as f32 + f - x).abs() < 1e-5,
                "{x}: {i} + {f}"
            );
        }
    }

    #[test]
    fn shares_add_up_but_for_the_end() {
        for (len, step) in [(7, 1.0), (7, 1.3), (10, 1.999), (1, 1.5)] {
            let shares = DownsampleAxis::of(len, step).0;
            let mut taken = vec![0.0; len];
            shares
                .iter()
                .flat_map(TexelWeights::weighted)
                .for_each(|(x, w)| taken[x] += f64::from(w) * step);
            assert!(
                taken.iter().all(|t| (t - 1.0).abs() < 1e-6),
                "{len}, {step}: every texel is used once"
            );
            assert!(shares.len() == (len as f64 / step).ceil() as usize);
        }
    }

    #[test]
    fn positions_outside_or_nowhere_are_brought_inside() {
        for x in [f32::NAN, f32::NEG_INFINITY, -7.0, 0.0] {
            assert_eq!(whole_and_rest(x, 9.0).0, 0);
        }
        assert_eq!(whole_and_rest(f32::INFINITY, 8.9).0, 8);
    }

    #[test]
    fn grey_film_is_baked_and_shaded_as_its_alpha_is() {
        let image = Image::from_fn(9, 7, |x, y| {
            let a = 0.1 * x as f32;
            PremulRgba::new(0.5 * a, 0.01 * y as f32 * a, 0.3 * a, a)
        });
        let film = Texture::Film(std::sync::Arc::new(crate::filter::Pyramid::new(
            image.map(Film::from),
        )));
        let alpha = Texture::from(image);
        let grade = Grade {
            hue_deg: 40.0,
            saturation: 0.8,
            value: 1.2,
        };
        let (a, b) = (
            BakedTexture::new(&alpha, &grade, 0.6),
            BakedTexture::new(&film, &grade, 0.6),
        );
        assert_eq!(a.texels, b.texels);
        assert!(
            b.opacity
                .iter()
                .zip(&a.texels)
                .all(|(o, t)| o.rgb() == LinearRgb::grey(t.alpha()))
        );
        let (a, b) = (
            OpacityLevel::new(&alpha, &grade, 1),
            OpacityLevel::new(&film, &grade, 1),
        );
        assert!(b.planes.len() == 3 && b.planes.iter().all(|plane| *plane == a.planes[0]));
    }
}
