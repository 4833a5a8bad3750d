//! Opacity alone, for what falls into shadow.

#![expect(
    clippy::needless_range_loop,
    reason = "several arrays in step, which vectorises"
)]
#![expect(clippy::manual_clamp, reason = "turns NaN into 0")]

use crate::asset::Texture;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};
use crate::render::grade::graded_opacity;
use crate::render::texel_grid::{BORDER_TEXELS, BilinearCells, SIMD_LANES, TexelGrid, TexelLine};
use crate::scene::Grade;
use crate::work::{self, Kind};
use std::sync::{Arc, OnceLock};

/// Positions in single precision are off by less than this, texels.
const POSITION_ERROR_TEXELS: f64 = 1.0 / 8.0;

/// A texture's opacity at each halving, made on first use; shared by the cards that show it.
#[derive(Debug)]
pub(super) struct OpacityMips<'a> {
    texture: &'a Texture,
    grade: Grade,
    levels: Vec<OnceLock<Arc<OpacityLevel>>>,
}

impl<'a> OpacityMips<'a> {
    pub(super) fn new(texture: &'a Texture, grade: Grade) -> Self {
        Self {
            texture,
            grade,
            levels: (0..texture.levels()).map(|_| OnceLock::new()).collect(),
        }
    }

    /// It differs from channel to channel.
    pub(super) fn is_film(&self) -> bool {
        self.texture.is_film()
    }

    /// The same opacity: colours do not matter to the alpha of a cut-out.
    pub(super) fn serves(&self, texture: &Texture, grade: &Grade) -> bool {
        match (self.texture, texture) {
            (Texture::Rgba(a), Texture::Rgba(b)) => Arc::ptr_eq(a, b),
            (Texture::Film(a), Texture::Film(b)) => Arc::ptr_eq(a, b) && self.grade == *grade,
            _ => false,
        }
    }

    /// The coarsest opacity whose texels are no larger than `cell` metres, or a coarser one that
    /// blurs by `blur` metres; on a card of this size.
    pub(super) fn level_for(&self, size: [f64; 2], cell: f64, blur: f64) -> Arc<OpacityLevel> {
        let (width, height) = self.texture.size();
        let texel = (size[0] * size[1] / (width * height) as f64).sqrt();
        let level = halvings_to(cell, texel)
            .floor()
            .max(halvings_to(blur, texel).round());
        self.halved((level as usize).min(self.levels.len() - 1))
    }

    fn halved(&self, level: usize) -> Arc<OpacityLevel> {
        if let Some(opacity) = self.levels[level].get() {
            return opacity.clone();
        }
        // Made outside of the lock: a pyramid may halve in parallel, and a thread that waits may
        // come back here.
        let opacity = Arc::new(OpacityLevel::new(self.texture, &self.grade, level));
        let kept = self.levels[level].get_or_init(|| {
            work::add(Kind::Bakes, 1);
            opacity
        });
        kept.clone()
    }
}

/// How often texels must be doubled to reach a length; 0 for a shorter one.
fn halvings_to(length: f64, texel: f64) -> f64 {
    libm::log2((length / texel).max(1.0))
}

/// Opacity of a texture at one level of detail.
#[derive(Debug)]
pub(super) struct OpacityLevel {
    pub(super) grid: TexelGrid,
    width: usize,
    height: usize,
    /// One plane of alpha, or one for each channel of film.
    pub(super) planes: Vec<Vec<f32>>,
    /// Every texel stops all light.
    opaque: bool,
}

impl OpacityLevel {
    /// Opacity of a texture halved `level` times, in a card's own colours.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: usize) -> Self {
        let grid = TexelGrid::new(texture.size(), level as f64);
        match texture {
            Texture::Rgba(pyramid) => {
                Self::from_channels(grid, pyramid.level(level), &[&|p: PremulRgba| p.a])
            }
            Texture::Film(pyramid) => Self::from_film(grid, pyramid.level(level), grade),
        }
    }

    fn from_film(grid: TexelGrid, image: &Image<Film>, grade: &Grade) -> Self {
        let graded = image.map(|p| graded_opacity(p.opacity, grade));
        let channels: [&dyn Fn(LinearRgb) -> f32; 3] = [&|o| o.r, &|o| o.g, &|o| o.b];
        Self::from_channels(grid, &graded, &channels)
    }

    fn from_channels<P: Copy>(
        grid: TexelGrid,
        image: &Image<P>,
        channels: &[&dyn Fn(P) -> f32],
    ) -> Self {
        let (width, height) = bordered_size(image.size());
        let planes = channels
            .iter()
            .map(|channel| bordered_plane(image, channel));
        let mut pixels = image.pixels().iter();
        Self {
            grid,
            width,
            height,
            planes: planes.collect(),
            opaque: pixels.all(|&p| channels.iter().all(|channel| channel(p) == 1.0)),
        }
    }

    /// How far inside of its sides an opaque texture is surely read as opaque, as shares of it;
    /// none for one that is not.
    pub(super) fn opaque_inset(&self) -> Option<[f64; 2]> {
        self.opaque
            .then(|| self.grid.texels.map(|n| (0.5 + POSITION_ERROR_TEXELS) / n))
    }

    /// Multiplies what gets through, along a line over bordered texels from its sample `first` on,
    /// in one channel.
    pub(super) fn attenuate(
        &self,
        channel: usize,
        line: &TexelLine,
        first: usize,
        through: &mut [f32],
    ) {
        let size = (self.width, self.height);
        attenuate_line(self.plane(channel), size, line, first as f32, through);
    }

    /// Opacities of a channel; a grey level has one plane for all.
    fn plane(&self, channel: usize) -> &[f32] {
        &self.planes[channel.min(self.planes.len() - 1)]
    }
}

/// One channel of an image, with a border of zeros.
fn bordered_plane<P: Copy>(image: &Image<P>, channel: impl Fn(P) -> f32) -> Vec<f32> {
    let (width, height) = bordered_size(image.size());
    let mut plane = vec![0.0; width * height];
    for (y, row) in image.rows().enumerate() {
        let line = &mut plane[(y + BORDER_TEXELS) * width + BORDER_TEXELS..][..row.len()];
        line.iter_mut().zip(row).for_each(|(a, &p)| *a = channel(p));
    }
    plane
}

fn bordered_size((width, height): (usize, usize)) -> (usize, usize) {
    (width + 2 * BORDER_TEXELS, height + 2 * BORDER_TEXELS)
}

/// Dense since it is the innermost loop of shadows: compiled as one piece for each set of vector
/// instructions, lanes apart.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn attenuate_line(
    opacity: &[f32],
    size: (usize, usize),
    line: &TexelLine,
    first: f32,
    through: &mut [f32],
) {
    let mut first = first;
    for run in through.chunks_mut(SIMD_LANES) {
        let cells = BilinearCells::along_line(line, first, size);
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
