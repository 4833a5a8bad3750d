//! Opacity alone, for shadows.

use crate::asset::Texture;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};
use crate::render::float4::Float4;
use crate::render::grade::grade_opacities;
use crate::render::texel_extent::TexelExtent;
use crate::render::texel_grid::{
    BORDER_TEXELS, BilinearCells, POSITION_ERROR_TEXELS, SIMD_LANES, TexelGrid, TexelLine,
};
use crate::scene::Grade;
use crate::work::{self, Kind};
use std::f64::consts::SQRT_2;
use std::sync::{Arc, OnceLock};

/// Mip levels of a texture's opacity, computed on first use; shared by the cards that show it.
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

    /// Whether it differs between channels.
    pub(super) fn is_film(&self) -> bool {
        self.texture.is_film()
    }

    /// Whether a texture has the same opacity: a cut-out's alpha does not depend on the colours.
    pub(super) fn serves(&self, texture: &Texture, grade: &Grade) -> bool {
        match (self.texture, texture) {
            (Texture::Rgba(a), Texture::Rgba(b)) => Arc::ptr_eq(a, b),
            (Texture::Film(a), Texture::Film(b)) => Arc::ptr_eq(a, b) && self.grade == *grade,
            _ => false,
        }
    }

    /// The coarsest level whose texels are no larger than `cell` metres, or a coarser one that
    /// blurs by `blur` metres; on a card of this size.
    pub(super) fn level_for(&self, size: [f64; 2], cell: f64, blur: f64) -> Arc<OpacityLevel> {
        let (width, height) = self.texture.size();
        let texel = (size[0] * size[1] / (width * height) as f64).sqrt();
        let level = halvings_within(cell / texel).max(halvings_within(SQRT_2 * blur / texel));
        self.halved(level.min(self.levels.len() - 1))
    }

    fn halved(&self, level: usize) -> Arc<OpacityLevel> {
        if let Some(opacity) = self.levels[level].get() {
            return opacity.clone();
        }
        // Computed outside the lock: a pyramid may be halved in parallel, and a waiting thread may
        // come back here.
        let opacity = Arc::new(OpacityLevel::new(self.texture, &self.grade, level));
        let kept = self.levels[level].get_or_init(|| {
            work::add(Kind::Bakes, 1);
            opacity
        });
        kept.clone()
    }
}

/// Number of times that texels can be doubled within a length of this many texels.
fn halvings_within(texels: f64) -> usize {
    (texels.max(1.0).to_bits() >> 52) as usize - 1023
}

/// Opacity of a texture at one mip level.
#[derive(Debug)]
pub(super) struct OpacityLevel {
    pub(super) grid: TexelGrid,
    width: usize,
    height: usize,
    /// Transmittance of each texel, per channel: 1 minus alpha in all of them for a texture that is
    /// no film.
    pub(super) passing: Vec<Float4>,
    /// Where it blocks any light.
    pub(super) extent: TexelExtent,
    /// Whether every texel that is wholly on the texture blocks all light.
    opaque: bool,
}

impl OpacityLevel {
    /// Opacity of a texture halved `level` times, with a card's grade.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: usize) -> Self {
        let grid = TexelGrid::new(texture.size(), level as f64);
        match texture {
            Texture::Rgba(pyramid) => {
                let alpha = |p: PremulRgba| Float4([p.a; 4]);
                Self::from_texels(grid, bordered(pyramid.level(level), alpha))
            }
            Texture::Film(pyramid) => {
                let mut film = bordered(pyramid.level(level), |p: Film| p.opacity.into());
                grade_opacities(film.pixels_mut(), grade);
                Self::from_texels(grid, film)
            }
        }
    }

    fn from_texels(grid: TexelGrid, texels: Image<Float4>) -> Self {
        let (width, height) = texels.size();
        Self {
            grid,
            width,
            height,
            extent: TexelExtent::around(texels.pixels(), width, &grid),
            opaque: is_opaque(&texels, &grid),
            passing: passing(texels),
        }
    }

    /// How far inside its sides an opaque texture is certain to be read as opaque, as shares of it;
    /// none for one that is not opaque.
    pub(super) fn opaque_inset(&self) -> Option<[f64; 2]> {
        // A last texel that is on the texture for a part only is not opaque.
        let inset = |n: f64| (0.5 + n.fract() + POSITION_ERROR_TEXELS) / n;
        self.opaque.then(|| self.grid.texels.map(inset))
    }

    /// Multiplies transmittances along a line over bordered texels from its sample `first` on.
    pub(super) fn attenuate(&self, line: &TexelLine, first: usize, through: &mut [Float4]) {
        let size = (self.width, self.height);
        attenuate_line(&self.passing, size, line, first as f32, through);
    }
}

/// An image as opacities, with a transparent border.
fn bordered<P: Copy>(image: &Image<P>, opacity: impl Fn(P) -> Float4) -> Image<Float4> {
    let [width, height] = [image.width(), image.height()].map(|n| n + 2 * BORDER_TEXELS);
    let mut texels = Image::filled(width, height, Float4::ZERO);
    for (y, row) in image.rows().enumerate() {
        let line = &mut texels.row_mut(y + BORDER_TEXELS)[BORDER_TEXELS..];
        line.iter_mut().zip(row).for_each(|(o, &p)| *o = opacity(p));
    }
    texels
}

/// Transmittances from opacities.
fn passing(mut texels: Image<Float4>) -> Vec<Float4> {
    for t in texels.pixels_mut() {
        *t = t.clamped().complement();
    }
    texels.into_vec()
}

/// Whether every texel inside the border that is wholly on the texture blocks all light.
fn is_opaque(texels: &Image<Float4>, grid: &TexelGrid) -> bool {
    let [columns, rows] = grid
        .texels
        .map(|n| BORDER_TEXELS..BORDER_TEXELS + n as usize);
    let stops_all = |o: &Float4| o.rgb() == LinearRgb::WHITE;
    let mut rows = rows.map(|y| &texels.row(y)[columns.clone()]);
    rows.all(|row| row.iter().all(stops_all))
}

/// Dense since it is the innermost loop of shadows: compiled as one piece for each vector
/// instruction set.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn attenuate_line(
    passing: &[Float4],
    size: (usize, usize),
    line: &TexelLine,
    first: f32,
    through: &mut [Float4],
) {
    let mut first = first;
    for run in through.chunks_mut(SIMD_LANES) {
        let cells = BilinearCells::along_line(line, first, size);
        for (lane, through) in run.iter_mut().enumerate() {
            *through = through.times(cells.texel(lane, passing, size.0));
        }
        first += SIMD_LANES as f32;
    }
}
