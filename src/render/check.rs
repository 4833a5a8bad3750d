//! Validation of a shot, once.

use crate::asset::Texture;
use crate::error::{Error, Result};
use crate::pixel::Film;
use crate::scene::{AreaLight, Card, EnvironmentMap, Shot};

/// Checks that a shot can be rendered.
///
/// Reads every texel, so call it once per shot from an external source, not once per frame.
/// [`render`](super::render) itself neither checks nor panics: a NaN in a texture becomes a NaN in
/// the picture. Cards that are edge-on, behind the eye or without area are valid and simply not
/// visible.
///
/// # Errors
/// [`Error::Value`] that names the card: a texel that is NaN or infinite, an alpha outside 0..1,
/// the id 0 or a duplicate id; a plate of the wrong size; a light or an exposure that is not
/// finite.
pub fn check(shot: &Shot) -> Result<()> {
    check_plate(shot)?;
    check_lights(&shot.lights)?;
    check_sky(shot)?;
    check_ids(&shot.cards)?;
    check_cards(&shot.cards)
}

fn check_lights(lights: &[AreaLight]) -> Result<()> {
    let mut numbered = lights.iter().enumerate();
    numbered.try_for_each(|(i, light)| {
        let at = format!("lights[{i}]");
        require(is_finite(light), &at, "not finite, expected finite numbers")
    })
}

fn check_cards(cards: &[Card]) -> Result<()> {
    for (i, card) in cards.iter().enumerate() {
        check_card(card).map_err(|what| Error::value(format!("cards[{i}]"), what))?;
    }
    Ok(())
}

fn check_plate(shot: &Shot) -> Result<()> {
    let [width, height] = shot.camera.image.map(|side| side as usize);
    let (w, h) = shot.plate.as_ref().map_or((width, height), |p| p.size());
    if (w, h) == (width, height) {
        return Ok(());
    }
    let what = format!("{w} x {h} pixels, expected {width} x {height}");
    Err(Error::value("plate", what))
}

fn is_finite(light: &AreaLight) -> bool {
    let places = [light.position, light.target].into_iter().flatten();
    let mut numbers = places.chain(light.size).chain([light.power]);
    numbers.all(f64::is_finite) && light.color.is_finite()
}

/// Checks the environment, constant or a map, and the exposure.
fn check_sky(shot: &Shot) -> Result<()> {
    shot.environment.iter().try_for_each(check_map)?;
    require(
        shot.exposure.is_finite() && shot.ambient.is_finite(),
        "exposure",
        "exposure or ambient is not finite, expected finite numbers",
    )
}

fn require(holds: bool, at: &str, what: &str) -> Result<()> {
    holds.then_some(()).ok_or_else(|| Error::value(at, what))
}

fn check_map(map: &EnvironmentMap) -> Result<()> {
    require(
        map.rotation.is_finite() && map.strength.is_finite() && map.strength >= 0.0,
        "environment",
        "rotation or strength is out of range, expected a finite rotation and a strength of at least 0",
    )
}

fn check_ids(cards: &[Card]) -> Result<()> {
    let mut ids: Vec<_> = cards.iter().map(|card| card.id.0).collect();
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => {
            let what = format!(
                "id {} is used twice, expected a unique id for each card",
                pair[0]
            );
            Err(Error::value("cards", what))
        }
        None => Ok(()),
    }
}

fn check_card(card: &Card) -> std::result::Result<(), String> {
    if card.id.0 == 0 {
        return Err("id 0, expected 1 or more".into());
    }
    check_texture(&card.texture)?;
    let mut back = card.back.iter();
    back.try_for_each(|back| check_texture(back).map_err(|what| format!("back: {what}")))
}

fn check_texture(texture: &Texture) -> std::result::Result<(), String> {
    positions_in(texture.size()).try_for_each(|(x, y)| check_texel(&texture.texel(x, y), x, y))
}

fn positions_in((width, height): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

fn check_texel(texel: &Film, x: usize, y: usize) -> std::result::Result<(), String> {
    if !texel.color.is_finite() || !texel.opacity.is_finite() {
        return Err(format!(
            "texture has a value that is not finite at ({x}, {y})"
        ));
    }
    let opacity: [f32; 3] = texel.opacity.into();
    match opacity.iter().find(|o| !(0.0..=1.0).contains(*o)) {
        Some(wrong) => Err(format!(
            "texture has alpha {wrong} at ({x}, {y}), expected 0 to 1"
        )),
        None => Ok(()),
    }
}
