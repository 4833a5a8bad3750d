//! A card's texture read at full resolution.

use crate::asset::Texture;
use crate::filter::sample_bilinear;
use crate::geom::Vector3;
use crate::pixel::Film;
use crate::render::grade::shifted_opacity;
use crate::render::view::ScenePlane;
use crate::scene::Card;

/// Reads a card as seen from a point: at full detail, transparent outside its texture.
pub(super) fn card_texel(
    card: &Card,
    plane: &ScenePlane,
    [u, v]: [f64; 2],
    from: &Vector3<f64>,
) -> Film {
    let film = match &card.back {
        Some(back) if plane.is_seen_from_behind(from) => texture_at(back, 1.0 - u, v),
        _ => texture_at(&card.texture, u, v),
    };
    let grade = &card.grade;
    Film {
        color: crate::color::shift_hsv(film.color, grade.hue_deg, grade.saturation, grade.value),
        opacity: shifted_opacity(film.opacity, grade.hue_deg, grade.saturation),
    }
}

fn texture_at(texture: &Texture, u: f64, v: f64) -> Film {
    let (width, height) = texture.size();
    let (x, y) = (u * width as f64, v * height as f64);
    match texture {
        Texture::Rgba(pyramid) => sample_bilinear(pyramid.base(), x, y).into(),
        Texture::Film(pyramid) => sample_bilinear(pyramid.base(), x, y),
    }
}
