//! Textures prepared for one picture: one level of detail, a transparent border, the card's grade.

use crate::asset::Texture;
use crate::geom::Vector3;
use crate::pixel::{Film, Mix, PremulRgba};
use crate::render::float4::Float4;
use crate::render::float8::Float8;
use crate::render::grade::{channel_mean, grade_colors, grade_film, grade_opacities};
use crate::render::resample::{BorderedTexels, DetailLevel};
use crate::render::texel_extent::TexelExtent;
use crate::render::texel_grid::TexelGrid;
use crate::render::view::ProjectedPlane;
use crate::scene::Grade;

/// Colour and opacity at the level of detail that a picture needs.
#[derive(Debug)]
pub(super) struct BakedTexture {
    pub(super) grid: TexelGrid,
    width: usize,
    height: usize,
    pub(super) texels: BakedTexels,
    /// Its non-empty part.
    extent: TexelExtent,
}

/// The parts of textures that a picture needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TexelContent {
    /// Colour and alpha.
    Alpha,
    /// The same with the opacity of each channel, if some card is film.
    Film,
    /// Opacity alone, if some card is film and no light shines.
    Opacity,
}

impl TexelContent {
    /// The parts that a picture needs.
    pub(super) fn needed(with_film: bool, is_lit: bool) -> Self {
        match (with_film, is_lit) {
            (false, _) => Self::Alpha,
            (true, true) => Self::Film,
            (true, false) => Self::Opacity,
        }
    }

    /// Whether transmittance differs between channels.
    pub(super) fn is_tinted(self) -> bool {
        self != Self::Alpha
    }
}

/// Texels, row by row; alpha is the mean of the channels' opacity.
#[derive(Debug)]
pub(super) enum BakedTexels {
    /// Colour and alpha.
    Alpha(Vec<Float4>),
    /// Colour and alpha, and the opacity of each channel.
    Film(Vec<Float8>),
    /// The opacity of each channel, and alpha.
    Opacity(Vec<Float4>),
}

impl BakedTexture {
    /// A texture at a level of detail, which need not be an integer, with a card's grade.
    ///
    /// The next finer integer level is averaged further, so that there are no more texels than
    /// needed and a reading costs four of them.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: f64, content: TexelContent) -> Self {
        let level = level.clamp(0.0, (texture.levels() - 1) as f64);
        let grid = TexelGrid::new(texture.size(), level);
        let detail = DetailLevel::new(level);
        match content {
            TexelContent::Alpha => Self::from_texels(
                resample_colors(texture, detail, grade),
                grid,
                BakedTexels::Alpha,
            ),
            TexelContent::Film => Self::from_texels(
                resample_film(texture, detail, grade),
                grid,
                BakedTexels::Film,
            ),
            TexelContent::Opacity => Self::from_texels(
                resample_opacity(texture, detail, grade),
                grid,
                BakedTexels::Opacity,
            ),
        }
    }

    fn from_texels<T: Mix + PartialEq>(
        baked: BorderedTexels<T>,
        grid: TexelGrid,
        content: impl Fn(Vec<T>) -> BakedTexels,
    ) -> Self {
        Self {
            extent: TexelExtent::around(&baked.texels, baked.width, &grid),
            grid,
            width: baked.width,
            height: baked.height,
            texels: content(baked.texels),
        }
    }

    /// Columns and rows, including the border.
    #[inline(always)]
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Linear conditions on `(x, y, 1)` for where a plane shows a non-empty part of it in front of
    /// the eye.
    pub(super) fn sides_on(&self, plane: &ProjectedPlane) -> [Vector3<f64>; 9] {
        let [u, v] = self.grid.texel_rows(&plane.u, &plane.v, &plane.w);
        let sides = self.extent.sides([&u, &v], &plane.w);
        std::array::from_fn(|k| sides.get(k).copied().unwrap_or(plane.w))
    }
}

/// Alpha of a film's texel: the mean opacity of its channels.
#[inline(always)]
fn film_alpha(opacity: Float4) -> f32 {
    channel_mean(opacity.clamped().rgb())
}

/// Colour and alpha; for film the mean opacity, which is not graded.
fn resample_colors(
    texture: &Texture,
    detail: DetailLevel,
    grade: &Grade,
) -> BorderedTexels<Float4> {
    let finish = |row: &mut [Float4]| grade_colors(row, grade);
    match texture {
        Texture::Rgba(pyramid) => detail.resample(|l| pyramid.level(l), Float4::from, finish),
        Texture::Film(pyramid) => detail.resample(|l| pyramid.level(l), flat_film, finish),
    }
}

/// Film without its tint.
#[inline(always)]
fn flat_film(film: Film) -> Float4 {
    Float4::from(film.color).with_fourth(film_alpha(film.opacity.into()))
}

fn resample_film(texture: &Texture, detail: DetailLevel, grade: &Grade) -> BorderedTexels<Float8> {
    match texture {
        Texture::Rgba(pyramid) => detail.resample(
            |l| pyramid.level(l),
            Float8::from,
            |row| grade_colors(row, grade),
        ),
        Texture::Film(pyramid) => detail.resample(
            |l| pyramid.level(l),
            Float8::from,
            |row| {
                grade_film(row, grade);
                row.iter_mut().for_each(|t| {
                    let color = t.color().with_fourth(film_alpha(t.opacity()));
                    *t = Float8::new(color, t.opacity());
                });
            },
        ),
    }
}

/// The same opacities as those of [`resample_film`].
fn resample_opacity(
    texture: &Texture,
    detail: DetailLevel,
    grade: &Grade,
) -> BorderedTexels<Float4> {
    match texture {
        Texture::Rgba(pyramid) => {
            let alpha = |p: PremulRgba| Float4([p.a; 4]);
            detail.resample(
                |l| pyramid.level(l),
                alpha,
                |row| grade_opacities(row, grade),
            )
        }
        Texture::Film(pyramid) => {
            let opacity = |p: Film| Float4::from(p.opacity);
            let finish = |row: &mut [Float4]| {
                grade_opacities(row, grade);
                row.iter_mut()
                    .for_each(|t| *t = t.with_fourth(film_alpha(*t)));
            };
            detail.resample(|l| pyramid.level(l), opacity, finish)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::pixel::LinearRgb;
    use crate::render::opacity::OpacityLevel;

    #[test]
    fn grey_film_is_baked_and_shaded_as_its_alpha_is() {
        let image = Image::from_fn(9, 7, |x, y| {
            let a = 0.1 * x as f32;
            PremulRgba::new(0.5 * a, 0.01 * y as f32 * a, 0.3 * a, a)
        });
        let film = Texture::Film(std::sync::Arc::new(crate::filter::Pyramid::over_nothing(
            image.map(Film::from),
        )));
        let alpha = Texture::from(image);
        let grade = Grade {
            hue_deg: 40.0,
            saturation: 0.8,
            value: 1.2,
            ..Grade::default()
        };
        let (a, b) = (
            BakedTexture::new(&alpha, &grade, 0.6, TexelContent::Alpha),
            BakedTexture::new(&film, &grade, 0.6, TexelContent::Film),
        );
        let (BakedTexels::Alpha(a), BakedTexels::Film(b)) = (a.texels, b.texels) else {
            panic!("texels of a picture without film, and of one with film");
        };
        assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| *a == b.color()));
        let is_grey = |t: &Float8| t.opacity().rgb() == LinearRgb::grey(t.color().alpha());
        assert!(b.iter().all(is_grey));
        let (a, b) = (
            OpacityLevel::new(&alpha, &grade, 1),
            OpacityLevel::new(&film, &grade, 1),
        );
        let colors = |level: OpacityLevel| -> Vec<LinearRgb> {
            level.passing.iter().map(|t| t.rgb()).collect()
        };
        assert_eq!(colors(a), colors(b));
    }
}
