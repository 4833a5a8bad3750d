//! What the renderer asks of a shot, asked once.

use crate::asset::Texture;
use crate::error::{Error, Result};
use crate::scene::{Card, Shot};

/// Is a shot something that can be rendered?
///
/// Reads every texel, so ask once per shot that comes from outside, not once per frame. [`render`](super::render) itself
/// neither asks nor panics: a NaN in a texture then becomes a NaN in the picture. Cards that are edge-on, behind the
/// eye or without area are fine; they are not seen.
///
/// # Errors
/// [`Error::Value`] that names the card: a texel that is NaN or infinite, an alpha outside 0..1, the id 0 or one used
/// twice; a plate of another size; a light or an exposure that is not finite.
pub fn check(shot: &Shot) -> Result<()> {
    let size = (shot.camera.image[0] as usize, shot.camera.image[1] as usize);
    if let Some(plate) = &shot.plate
        && plate.size() != size
    {
        let (w, h) = plate.size();
        return Err(Error::value(
            "plate",
            format!("{w} x {h} pixels, expected {} x {}", size.0, size.1),
        ));
    }
    for (i, light) in shot.lights.iter().enumerate() {
        let numbers = light
            .position
            .iter()
            .chain(&light.target)
            .chain(&light.size)
            .chain([&light.power]);
        if !numbers.into_iter().all(|v| v.is_finite()) || !light.color.is_finite() {
            return Err(Error::value(
                format!("lights[{i}]"),
                "not finite, expected numbers",
            ));
        }
    }
    if let Some(map) = &shot.environment
        && !(map.rotation.is_finite() && map.strength.is_finite() && map.strength >= 0.0)
    {
        return Err(Error::value(
            "environment",
            "rotation or strength is not a number that can be, expected finite ones",
        ));
    }
    if !shot.exposure.is_finite() || !shot.ambient.is_finite() {
        return Err(Error::value(
            "exposure",
            "exposure or ambient is not finite, expected numbers",
        ));
    }
    let mut ids: Vec<_> = shot.cards.iter().map(|c| c.id).collect();
    ids.sort_unstable();
    if let Some(twice) = ids.windows(2).find(|w| w[0] == w[1]) {
        return Err(Error::value(
            "cards",
            format!("id {} is used twice, expected one card each", twice[0].0),
        ));
    }
    shot.cards.iter().enumerate().try_for_each(|(i, card)| {
        check_card(card).map_err(|what| Error::value(format!("cards[{i}]"), what))
    })
}

fn check_card(card: &Card) -> std::result::Result<(), String> {
    if card.id.0 == 0 {
        return Err("id 0, expected 1 or more".into());
    }
    check_texture(&card.texture)?;
    card.back.as_ref().map_or(Ok(()), |back| {
        check_texture(back).map_err(|what| format!("back: {what}"))
    })
}

fn check_texture(texture: &Texture) -> std::result::Result<(), String> {
    let (width, height) = texture.size();
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let texel = texture.texel(x, y);
        let opacity: [f32; 3] = texel.opacity.into();
        if !texel.color.is_finite() || !texel.opacity.is_finite() {
            return Err(format!(
                "texture has a value that is not finite at ({x}, {y})"
            ));
        }
        if let Some(wrong) = opacity.iter().find(|o| !(0.0..=1.0).contains(*o)) {
            return Err(format!(
                "texture has alpha {wrong} at ({x}, {y}), expected 0 to 1"
            ));
        }
    }
    Ok(())
}
