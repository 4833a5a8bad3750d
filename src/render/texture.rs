//! Textures made ready for one picture: one level of detail, a transparent border, the card's colours.

use crate::asset::Texture;
use crate::image::Image;
use crate::pixel::{LinearRgb, PremulRgba};
use crate::render::four::Four;
use crate::scene::{Card, Grade};
use nalgebra::Vector3;

/// Transparent texels around a texture: what the coarser of two mixed levels reaches beyond the finer one's edge.
const BORDER: usize = 2;

/// Where a texture's pixels lie in its own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Texels that `u` and `v` from 0 to 1 run over; not whole on halved levels of odd sizes.
    texels: [f64; 2],
    /// How far the texture reaches beyond 0..1, as a share of it.
    pub(super) reach: [f64; 2],
}

impl Grid {
    fn new((width, height): (usize, usize), level: usize, reach_texels: f64) -> Self {
        let scale = libm::exp2(-(level as f64));
        let texels = [width as f64 * scale, height as f64 * scale];
        Self { texels, reach: texels.map(|n| reach_texels / n) }
    }

    /// Rows that give positions among bordered texels, from rows that give texture coordinates.
    pub(super) fn rows(&self, u: &Vector3<f64>, v: &Vector3<f64>, w: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let first = BORDER as f64 - 0.5;
        [u * self.texels[0] + w * first, v * self.texels[1] + w * first]
    }
}

/// Colour and alpha at the level of detail that a picture asks for.
#[derive(Debug)]
pub(super) struct Baked {
    pub(super) grid: Grid,
    width: usize,
    height: usize,
    texels: Vec<Four>,
}

impl Baked {
    /// A card's texture at a level of detail between two halvings, in the card's own colours.
    ///
    /// Levels are mixed before they are read, so that a reading costs four texels and not eight.
    pub(super) fn new(card: &Card, level: f64) -> Self {
        let texture = &card.texture;
        let last = texture.levels() - 1;
        let fine = (level.max(0.0) as usize).min(last);
        let mix = if fine < last { (level.max(0.0) - fine as f64) as f32 } else { 0.0 };
        let image = &rgba(texture, fine);
        // The full picture ends at its edge; smaller ones fade half a texel out, and as far again where mixed.
        let reach = [0.0, 0.5, 1.5][usize::from(fine > 0 || mix > 0.0) + usize::from(mix > 0.0)];
        let mut baked = Self::bordered(image, Grid::new(texture.size(), fine, reach));
        if mix > 0.0 {
            baked.mix_in(&rgba(texture, fine + 1), mix);
        }
        baked.grade(&card.grade);
        baked
    }

    fn bordered(image: &Image<PremulRgba>, grid: Grid) -> Self {
        let (width, height) = (image.width() + 2 * BORDER, image.height() + 2 * BORDER);
        let mut texels = vec![Four::ZERO; width * height];
        for (y, row) in image.rows().enumerate() {
            let line = &mut texels[(y + BORDER) * width + BORDER..][..row.len()];
            line.iter_mut().zip(row).for_each(|(t, &p)| *t = p.into());
        }
        Self { grid, width, height, texels }
    }

    /// Mixes in the next smaller level, enlarged: `mix` of it, the rest of what is there.
    fn mix_in(&mut self, coarse: &Image<PremulRgba>, mix: f32) {
        let empty = vec![PremulRgba::TRANSPARENT; coarse.width()];
        let row = |j: isize| if (0..coarse.height() as isize).contains(&j) { coarse.row(j as usize) } else { &empty };
        for (y, line) in self.texels.chunks_exact_mut(self.width).enumerate() {
            let (near, far) = taps(y);
            let (near, far) = (row(near), row(far));
            let at = |i: isize| {
                let inside = (0..coarse.width() as isize).contains(&i);
                if inside { Four::from(near[i as usize]).lerp(far[i as usize].into(), 0.25) } else { Four::ZERO }
            };
            for (x, texel) in line.iter_mut().enumerate() {
                let (near, far) = taps(x);
                *texel = texel.lerp(at(near).lerp(at(far), 0.25), mix);
            }
        }
    }

    fn grade(&mut self, grade: &Grade) {
        if *grade == Grade::default() {
            return;
        }
        for t in self.texels.iter_mut().filter(|t| t.alpha() > 0.0) {
            let LinearRgb { r, g, b } = crate::color::shift_hsv(t.rgb(), grade.hue_deg, grade.saturation, grade.value);
            *t = Four([r, g, b, t.alpha()]);
        }
    }

    /// Bilinear value at a position among bordered texels; the nearest one for positions outside.
    #[inline(always)]
    pub(super) fn at(&self, x: f32, y: f32) -> Four {
        let (i, fx) = cell(x, self.width);
        let (j, fy) = cell(y, self.height);
        let top = &self.texels[j * self.width + i..][..2];
        let bottom = &self.texels[(j + 1) * self.width + i..][..2];
        Four::bilinear([top[0], top[1]], [bottom[0], bottom[1]], fx, fy)
    }
}

/// A level of detail, film by its mean opacity.
fn rgba(texture: &Texture, level: usize) -> Image<PremulRgba> {
    match texture {
        Texture::Rgba(pyramid) => pyramid.level(level).clone(),
        Texture::Film(pyramid) => pyramid.level(level).map(crate::pixel::Film::to_rgba),
    }
}

/// The nearer (weight 3/4) and farther (1/4) of the two coarse texels around bordered fine texel `i`.
fn taps(i: usize) -> (isize, isize) {
    let i = i as isize - BORDER as isize;
    let near = i.div_euclid(2);
    (near, if i.rem_euclid(2) == 0 { near - 1 } else { near + 1 })
}

/// Index of the sample before a position, at most the last but one, and the way to the next.
#[inline(always)]
fn cell(x: f32, count: usize) -> (usize, f32) {
    // Negative positions wrap to huge indices; positions outside come from roundings only.
    let i = (x as i32 as usize).min(count - 2);
    (i, x - i as f32)
}

/// Alpha alone, for what falls into shadow.
#[derive(Debug)]
pub(super) struct Shade {
    pub(super) grid: Grid,
    width: usize,
    height: usize,
    alpha: Vec<f32>,
}

impl Shade {
    /// Alpha of a texture halved `level` times.
    pub(super) fn new(texture: &Texture, level: usize) -> Self {
        let image = &rgba(texture, level);
        let grid = Grid::new(texture.size(), level, if level > 0 { 0.5 } else { 0.0 });
        let (width, height) = (image.width() + 2 * BORDER, image.height() + 2 * BORDER);
        let mut alpha = vec![0.0; width * height];
        for (y, row) in image.rows().enumerate() {
            let line = &mut alpha[(y + BORDER) * width + BORDER..][..row.len()];
            line.iter_mut().zip(row).for_each(|(a, p)| *a = p.a);
        }
        Self { grid, width, height, alpha }
    }

    /// Bilinear alpha at a position among bordered texels.
    #[inline(always)]
    pub(super) fn at(&self, x: f32, y: f32) -> f32 {
        let (i, fx) = cell(x, self.width);
        let (j, fy) = cell(y, self.height);
        let top = &self.alpha[j * self.width + i..][..2];
        let bottom = &self.alpha[(j + 1) * self.width + i..][..2];
        let a = top[0] + fx * (top[1] - top[0]);
        let b = bottom[0] + fx * (bottom[1] - bottom[0]);
        a + fy * (b - a)
    }
}
