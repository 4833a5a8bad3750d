//! What a card shows: a cut-out with one alpha, or a film that each channel passes differently.

use crate::filter::Pyramid;
use crate::image::Image;
use crate::pixel::{Film, PremulRgba};
use bytemuck::NoUninit;
use std::sync::{Arc, Weak};

/// A cut-out at all its levels of detail, shared by all that show it. Scene-linear, premultiplied.
///
/// Made from a picture of either kind. A film without tint becomes a cut-out with alpha, so that
/// nothing pays for a tint that it does not have; to keep the film, build the variant directly.
#[derive(Clone, Debug)]
pub enum Texture {
    /// Every channel loses the same share of what is behind.
    Rgba(Arc<Pyramid<PremulRgba>>),
    /// Every channel loses a share of its own.
    Film(Arc<Pyramid<Film>>),
}

/// A texture while somebody shows it.
#[derive(Debug)]
pub(super) enum WeakTexture {
    Rgba(Weak<Pyramid<PremulRgba>>),
    Film(Weak<Pyramid<Film>>),
}

impl WeakTexture {
    pub(super) fn upgrade(&self) -> Option<Texture> {
        match self {
            Self::Rgba(pyramid) => pyramid.upgrade().map(Texture::Rgba),
            Self::Film(pyramid) => pyramid.upgrade().map(Texture::Film),
        }
    }
}

impl Texture {
    pub(super) fn downgrade(&self) -> WeakTexture {
        match self {
            Self::Rgba(pyramid) => WeakTexture::Rgba(Arc::downgrade(pyramid)),
            Self::Film(pyramid) => WeakTexture::Film(Arc::downgrade(pyramid)),
        }
    }

    /// Columns and rows at full detail.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Rgba(pyramid) => pyramid.base().size(),
            Self::Film(pyramid) => pyramid.base().size(),
        }
    }

    /// Whether there are no texels.
    pub fn is_empty(&self) -> bool {
        let (width, height) = self.size();
        width * height == 0
    }

    /// Number of levels of detail, the full one included.
    pub fn levels(&self) -> usize {
        match self {
            Self::Rgba(pyramid) => pyramid.levels(),
            Self::Film(pyramid) => pyramid.levels(),
        }
    }

    /// Whether it may tint what is behind.
    pub fn is_film(&self) -> bool {
        matches!(self, Self::Film(_))
    }

    /// The texel at a column and row, whatever its kind.
    ///
    /// # Panics
    /// When it lies outside.
    pub fn texel(&self, x: usize, y: usize) -> Film {
        match self {
            Self::Rgba(pyramid) => pyramid.base()[(x, y)].into(),
            Self::Film(pyramid) => pyramid.base()[(x, y)],
        }
    }

    /// The full picture as film.
    pub fn to_film(&self) -> Image<Film> {
        match self {
            Self::Rgba(pyramid) => pyramid.base().map(Film::from),
            Self::Film(pyramid) => pyramid.base().clone(),
        }
    }

    /// The picture halved `level` times as film.
    pub fn film_level(&self, level: usize) -> Image<Film> {
        match self {
            Self::Rgba(pyramid) => pyramid.level(level).map(Film::from),
            Self::Film(pyramid) => pyramid.level(level).clone(),
        }
    }

    /// CRC-32 of the texels at full detail.
    pub fn checksum(&self) -> u32 {
        match self {
            Self::Rgba(pyramid) => checksum_of(pyramid.base()),
            Self::Film(pyramid) => checksum_of(pyramid.base()),
        }
    }
}

fn is_grey(image: &Image<Film>) -> bool {
    image.pixels().iter().all(|film| film.is_grey())
}

fn checksum_of<P: NoUninit>(image: &Image<P>) -> u32 {
    crc32fast::hash(bytemuck::cast_slice(image.pixels()))
}

impl From<Image<PremulRgba>> for Texture {
    fn from(image: Image<PremulRgba>) -> Self {
        Self::Rgba(Arc::new(Pyramid::over_nothing(image)))
    }
}

impl From<Image<Film>> for Texture {
    fn from(image: Image<Film>) -> Self {
        if is_grey(&image) {
            image.map(Film::to_rgba).into()
        } else {
            Self::Film(Arc::new(Pyramid::over_nothing(image)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::LinearRgb;

    #[test]
    fn film_without_tint_becomes_a_cut_out_of_the_same_bits() {
        let rgba = Image::from_fn(3, 2, |x, y| {
            PremulRgba::new(0.1, 0.03 * x as f32, 0.1 * y as f32, 0.3)
        });
        let Texture::Rgba(pyramid) = Texture::from(rgba.map(Film::from)) else {
            panic!("took grey for tint")
        };
        assert_eq!(pyramid.base(), &rgba);
    }

    #[test]
    fn one_tinted_texel_makes_a_film() {
        let mut film = Image::filled(3, 2, Film::default());
        film.pixels_mut()[4] = Film::new(LinearRgb::BLACK, LinearRgb::new(1.0, 0.5, 1.0));
        let texture = Texture::from(film);
        assert!(texture.is_film() && texture.size() == (3, 2));
        assert_eq!(texture.texel(1, 1).opacity.g, 0.5);
    }

    #[test]
    fn checksums_tell_pictures_apart() {
        let of =
            |v: f32| Texture::from(Image::filled(2, 2, PremulRgba::new(v, v, v, 1.0))).checksum();
        assert_eq!(of(0.5), of(0.5));
        assert_ne!(of(0.5), of(0.25));
    }

    #[test]
    fn an_empty_picture_is_an_empty_texture() {
        let texture = Texture::from(Image::<PremulRgba>::new(0, 3));
        assert!(texture.is_empty() && !texture.is_film() && texture.levels() > 0);
    }
}
