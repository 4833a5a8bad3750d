//! A part of a card's plane as a picture.

use crate::asset::Texture;
use crate::geom::{Point2, Pose, Quad};
use crate::image::Image;
use crate::pixel::{Film, LinearRgb};
use crate::scene::{Bend, Card, Grade};
use std::sync::Arc;

/// A picture on a card's plane, x right and y up from its middle, metres.
pub(super) struct PaintedPlane {
    pub(super) film: Image<Film>,
    /// Upper left corner.
    pub(super) corner: Point2<f64>,
    /// Width and height of a texel.
    pub(super) texel: [f64; 2],
}

impl PaintedPlane {
    /// A texture on its card at a mip level. Texels of halved odd sizes reach beyond the card.
    pub(super) fn new(card: &Card, texture: &Texture, mirrored: bool, level: usize) -> Self {
        let film = turned(texture.film_level(level), mirrored);
        let ([w, h], (columns, rows)) = (card.quad.size, texture.size());
        let halved = libm::exp2(level as f64);
        let texel = [w * halved / columns as f64, h * halved / rows as f64];
        // Halved texels are counted from the texture's own left side.
        let left = if mirrored {
            0.5 * w - texel[0] * film.width() as f64
        } else {
            -0.5 * w
        };
        Self {
            film,
            corner: Point2::new(left, 0.5 * h),
            texel,
        }
    }

    /// Position among the texels, pixels.
    pub(super) fn position(&self, p: &Point2<f64>) -> [f64; 2] {
        [
            (p.x - self.corner.x) / self.texel[0],
            (self.corner.y - p.y) / self.texel[1],
        ]
    }

    /// The point at a position among the texels.
    pub(super) fn point(&self, x: f64, y: f64) -> Point2<f64> {
        Point2::new(
            self.corner.x + x * self.texel[0],
            self.corner.y - y * self.texel[1],
        )
    }

    /// The same with empty texels added on each side.
    pub(super) fn padded(&self, margin: usize) -> Self {
        let by = margin as f64;
        Self {
            film: padded(&self.film, margin),
            corner: self.point(-by, -by),
            texel: self.texel,
        }
    }

    /// A flat card with this picture in place of another one, whose back is the front seen through.
    pub(super) fn into_card(self, card: &Card) -> Card {
        Card {
            quad: self.quad(&card.quad),
            outline_uv: self.outline(card),
            texture: self.film.into(),
            back: None,
            grade: Grade {
                tint: LinearRgb::WHITE,
                glints: 1.0,
                ..card.grade
            },
            bend: Bend::default(),
            surfaces: Default::default(),
            ..card.clone()
        }
    }

    /// Its quad, in the plane of a card.
    fn quad(&self, card: &Quad) -> Quad {
        let size = [
            self.texel[0] * self.film.width() as f64,
            self.texel[1] * self.film.height() as f64,
        ];
        let [x, y] = [self.corner.x + 0.5 * size[0], self.corner.y - 0.5 * size[1]];
        Quad {
            world_from_card: card.world_from_card * Pose::translation(x, y, 0.0),
            size,
        }
    }

    /// The outline of a card in its own texture coordinates.
    fn outline(&self, card: &Card) -> Arc<[Point2<f64>]> {
        let ([w, h], corners) = (card.quad.size, card.outline_uv.iter());
        let (columns, rows) = (self.film.width() as f64, self.film.height() as f64);
        corners
            .map(|uv| self.position(&Point2::new((uv.x - 0.5) * w, (0.5 - uv.y) * h)))
            .map(|[x, y]| Point2::new(x / columns, y / rows))
            .collect()
    }
}

/// A picture with empty pixels added on each side.
pub(super) fn padded<P: Copy + Default + Send + Sync>(image: &Image<P>, margin: usize) -> Image<P> {
    let (width, height) = (image.width() + 2 * margin, image.height() + 2 * margin);
    Image::from_fn(width, height, |x, y| {
        let (x, y) = (x.wrapping_sub(margin), y.wrapping_sub(margin));
        if x < image.width() && y < image.height() {
            image[(x, y)]
        } else {
            P::default()
        }
    })
}

/// A picture, mirrored for a back.
pub(super) fn turned<P: Copy + Send + Sync>(image: Image<P>, mirrored: bool) -> Image<P> {
    if !mirrored {
        return image;
    }
    let right = image.width().saturating_sub(1);
    Image::from_fn(image.width(), image.height(), |x, y| image[(right - x, y)])
}
