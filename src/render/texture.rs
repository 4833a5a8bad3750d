//! Textures made ready for one picture: one level of detail, a transparent border, the card's
//! colours.

use crate::asset::Texture;
use crate::pixel::{Film, PremulRgba};
use crate::render::float4::Float4;
use crate::render::grade::{channel_mean, grade_colors, graded_opacity};
use crate::render::resample::{BorderedTexels, DetailLevel};
use crate::render::texel_grid::TexelGrid;
use crate::scene::Grade;

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
    /// A texture at a level of detail, which need not be an integer, in a card's own colours.
    ///
    /// The level below is averaged further, so that there are no more texels than are needed and a
    /// reading costs four of them.
    pub(super) fn new(texture: &Texture, grade: &Grade, level: f64) -> Self {
        let level = level.clamp(0.0, (texture.levels() - 1) as f64);
        let (colors, opacity) = resample_texture(texture, DetailLevel::new(level));
        let mut baked = Self {
            grid: TexelGrid::new(texture.size(), level),
            width: colors.width,
            height: colors.height,
            texels: colors.texels,
            opacity,
        };
        baked.apply_grade(grade);
        baked
    }

    /// Columns and rows with their border.
    #[inline(always)]
    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn apply_grade(&mut self, grade: &Grade) {
        grade_colors(&mut self.texels, grade);
        self.grade_opacity(grade);
        self.average_opacity();
    }

    /// Alpha of a film's texels is the mean opacity of their channels.
    fn average_opacity(&mut self) {
        for (t, o) in self.texels.iter_mut().zip(&self.opacity) {
            t.0[3] = channel_mean(o.rgb());
        }
    }

    /// Film of another hue lets another hue pass; how bright it reflects does not change what
    /// passes.
    fn grade_opacity(&mut self, grade: &Grade) {
        let through = Grade {
            value: 1.0,
            ..*grade
        };
        if through != Grade::default() {
            for o in self.opacity.iter_mut().filter(|o| **o != Float4::ZERO) {
                *o = graded_opacity(o.rgb(), &through).into();
            }
        }
    }
}

/// Colours, and the opacity of film.
fn resample_texture(texture: &Texture, detail: DetailLevel) -> (BorderedTexels, Vec<Float4>) {
    match texture {
        Texture::Rgba(pyramid) => {
            let texels = detail.resample(|l| pyramid.level(l), |p: PremulRgba| p.into());
            (texels, Vec::new())
        }
        Texture::Film(pyramid) => {
            let texels = detail.resample(|l| pyramid.level(l), |p: Film| p.color.into());
            let opacity = detail.resample(|l| pyramid.level(l), |p: Film| p.opacity.into());
            (texels, opacity.texels)
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
        let film = Texture::Film(std::sync::Arc::new(crate::filter::Pyramid::new(
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
