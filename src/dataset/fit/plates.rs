//! What the photos of the place show without any picture of objects.

use super::knobs::{KNOBS, Knob, three_digits};
use super::measured::PixelMeasures;
use super::statistics::{Moments, Weighted};
use super::{FittedKey, range_text, unfitted};
use crate::dataset::{DatasetConfig, Pipeline};
use crate::error;
use crate::plot::Table;
use crate::quantile;
use crate::scene::{Blur, Noise, Range};

/// With fewer photos there is no spread.
const MIN_PLATES: usize = 3;
/// Noise (codes of 8 bits) and blur (pixels) below which objects need none.
const LEAST_NOISE: f64 = 0.3;
const LEAST_BLUR_PX: f64 = 0.2;
const MATCH_PLATE: &str = "\"match_plate\"";
/// The keys whose ranges come from how the photos differ: exposure and white balance.
const LIGHT_KNOBS: &[Knob] = KNOBS.split_at(2).0;

/// A photo of the place and its measurements, at the size of the recipe's pictures.
pub(super) struct MeasuredPlate {
    name: String,
    pixels: PixelMeasures,
    wall: String,
}

/// Measures the photos that a recipe names.
///
/// # Errors
/// A photo that cannot be read.
pub(super) fn measured_plates(pipeline: &Pipeline) -> error::Result<Vec<MeasuredPlate>> {
    let mut measured = Vec::new();
    for place in pipeline.places() {
        let wall = place.background.wall;
        let wall = wall.map(|wall| format!("{} m", wall.height));
        let pixels = PixelMeasures::around(&place.plate()?.image, &[]);
        measured.extend(pixels.map(|pixels| MeasuredPlate {
            name: place.background.name.clone(),
            pixels,
            wall: wall.unwrap_or_else(|| "not in its label".into()),
        }));
    }
    Ok(measured)
}

pub(super) fn table(plates: &[MeasuredPlate]) -> Table {
    let mut table = Table::new([
        "photo",
        "noise in mid grey, codes",
        "blur, px",
        "median luminance, EV",
        "red over blue",
        "walls",
    ]);
    for plate in plates {
        let numbers = [
            plate.pixels.grey_noise(),
            plate.pixels.blur_px(),
            plate.pixels.exposure_ev,
            plate.pixels.red_over_blue.exp(),
        ];
        let [noise, blur, light, color] = numbers.map(|number| format!("{number:.2}"));
        table.push([&plate.name, &noise, &blur, &light, &color, &plate.wall]);
    }
    table
}

/// Gives objects the noise and blur of the photos, if the recipe does not set them.
pub(super) fn match_objects(
    config: &mut DatasetConfig,
    plates: &[MeasuredPlate],
) -> Vec<FittedKey> {
    let finish = &mut config.scene.finish;
    let noise = (finish.noise == Noise::None).then(|| median(plates, PixelMeasures::grey_noise));
    let no_blur = Blur::Known(Range::fixed(0.0));
    let blur = (finish.blur_px == no_blur).then(|| median(plates, PixelMeasures::blur_px));
    if noise.is_some_and(|noise| noise > LEAST_NOISE) {
        finish.noise = Noise::MatchPlate;
    }
    if blur.is_some_and(|blur| blur > LEAST_BLUR_PX) {
        finish.blur_px = Blur::MatchPlate;
    }
    [noise.map(noise_key), blur.map(blur_key)]
        .into_iter()
        .flatten()
        .collect()
}

fn noise_key(noise: f64) -> FittedKey {
    FittedKey {
        key: "scene.finish.noise".into(),
        before: "\"none\"".into(),
        fitted: (noise > LEAST_NOISE).then(|| MATCH_PLATE.into()),
        why: format!("the photos of the place have {noise:.2} codes of noise in mid grey"),
    }
}

fn blur_key(blur_px: f64) -> FittedKey {
    FittedKey {
        key: "scene.finish.blur_px".into(),
        before: "0".into(),
        fitted: (blur_px > LEAST_BLUR_PX).then(|| MATCH_PLATE.into()),
        why: format!("the photos of the place have a blur of {blur_px:.2} px"),
    }
}

fn median(plates: &[MeasuredPlate], value: fn(&PixelMeasures) -> f64) -> f64 {
    let values = plates.iter().map(|plate| value(&plate.pixels));
    quantile::median(values, f64::total_cmp).unwrap_or(0.0)
}

/// Varies exposure and white balance as much as they vary between the photos.
pub(super) fn vary_light(config: &mut DatasetConfig, plates: &[MeasuredPlate]) -> Vec<FittedKey> {
    let knobs = LIGHT_KNOBS.iter();
    knobs.map(|knob| vary(knob, config, plates)).collect()
}

fn vary(knob: &Knob, config: &mut DatasetConfig, plates: &[MeasuredPlate]) -> FittedKey {
    let before = (knob.get)(&config.scene);
    let mut key = unfitted(knob.key, range_text(before), String::new());
    match varied(knob, before, plates) {
        Err(why) => key.why = why,
        Ok(fitted) => {
            (knob.set)(&mut config.scene, fitted);
            key.fitted = Some(range_text(fitted));
            key.why = "one standard deviation of the photos, either way".into();
        }
    }
    key
}

/// A fixed value plus and minus the photos' standard deviation, or why there is none.
fn varied(knob: &Knob, before: Range, plates: &[MeasuredPlate]) -> Result<Range, String> {
    if before.min != before.max {
        return Err("the recipe already gives a range".into());
    }
    if plates.len() < MIN_PLATES {
        return Err(format!(
            "fewer than {MIN_PLATES} photos do not show how it varies"
        ));
    }
    let values = plates.iter().map(|plate| (knob.of_picture)(&plate.pixels));
    let values: Vec<Weighted> = values.map(|value| (value, 1.0)).collect();
    let moments = Moments::new(&values).ok_or("nothing could be measured")?;
    let (middle, sigma) = ((knob.to_measure)(before.min), moments.variance.sqrt());
    let [min, max] = [middle - sigma, middle + sigma].map(|end| (knob.to_value)(end));
    Ok(Range::new(three_digits(min), three_digits(max)))
}
