//! What the photos of the place tell without any picture of objects in it.

use super::knobs::{KNOBS, Knob, three_digits};
use super::measured::PixelMeasures;
use super::statistics::{Moments, Weighted};
use super::{FittedKey, range_text};
use crate::dataset::{DatasetConfig, Pipeline};
use crate::error::Result;
use crate::plot::Table;
use crate::scene::{Blur, Noise, Range};

/// Fewer photos have no spread.
const MIN_PLATES: usize = 3;
/// Noise (codes of 8 bits) and blur (pixels) below which objects need none.
const LEAST_NOISE: f64 = 0.3;
const LEAST_BLUR_PX: f64 = 0.2;
/// The keys whose ranges come from how the photos differ: exposure and white balance.
const LIGHT_KNOBS: &[Knob] = KNOBS.split_at(2).0;

/// A photo of the place and what it is like, at the size of the recipe's pictures.
pub(super) struct MeasuredPlate {
    name: String,
    pixels: PixelMeasures,
    wall: String,
}

/// Measures the photos that a recipe names.
///
/// # Errors
/// One that cannot be read.
pub(super) fn measured_plates(pipeline: &Pipeline) -> Result<Vec<MeasuredPlate>> {
    let mut measured = Vec::new();
    for place in pipeline.places() {
        let wall = place
            .background
            .wall
            .map(|wall| format!("{} m", wall.height));
        let pixels = PixelMeasures::around(&*place.plate()?, &[]);
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
        let numbers = numbers.map(|number| format!("{number:.2}"));
        table.push(
            [plate.name.clone()]
                .into_iter()
                .chain(numbers)
                .chain([plate.wall.clone()]),
        );
    }
    table
}

/// Gives objects the noise and blur that the photos have, where the recipe does not say which.
pub(super) fn match_objects(
    config: &mut DatasetConfig,
    plates: &[MeasuredPlate],
) -> Vec<FittedKey> {
    let finish = &mut config.scene.finish;
    let mut keys = Vec::new();
    let noise = median(plates, PixelMeasures::grey_noise);
    if finish.noise == Noise::None {
        let fitted = noise > LEAST_NOISE;
        finish.noise = if fitted {
            Noise::MatchPlate
        } else {
            finish.noise
        };
        let why = format!("the photos have {noise:.2} codes of noise in mid grey");
        keys.push(matched("scene.finish.noise", "\"none\"", fitted, why));
    }
    let blur = median(plates, PixelMeasures::blur_px);
    if finish.blur_px == Blur::Known(Range::fixed(0.0)) {
        let fitted = blur > LEAST_BLUR_PX;
        finish.blur_px = if fitted {
            Blur::MatchPlate
        } else {
            finish.blur_px
        };
        let why = format!("the photos have a blur of {blur:.2} px");
        keys.push(matched("scene.finish.blur_px", "0", fitted, why));
    }
    keys
}

fn matched(key: &str, before: &str, fitted: bool, why: String) -> FittedKey {
    FittedKey {
        key: key.into(),
        before: before.into(),
        fitted: fitted.then(|| "\"match_plate\"".into()),
        why,
    }
}

fn median(plates: &[MeasuredPlate], value: fn(&PixelMeasures) -> f64) -> f64 {
    let mut values: Vec<f64> = plates.iter().map(|plate| value(&plate.pixels)).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Varies exposure and white balance as much as they do between the photos.
pub(super) fn vary_light(config: &mut DatasetConfig, plates: &[MeasuredPlate]) -> Vec<FittedKey> {
    let knobs = LIGHT_KNOBS.iter();
    knobs.map(|knob| vary(knob, config, plates)).collect()
}

fn vary(knob: &Knob, config: &mut DatasetConfig, plates: &[MeasuredPlate]) -> FittedKey {
    let before = (knob.get)(&config.scene);
    let unfitted = |why: String| FittedKey {
        key: knob.key.into(),
        before: range_text(before),
        fitted: None,
        why,
    };
    if before.min != before.max {
        return unfitted("the recipe says how it varies".into());
    }
    let values: Vec<Weighted> = plates
        .iter()
        .map(|p| ((knob.of_picture)(&p.pixels), 1.0))
        .collect();
    let moments = Moments::new(&values).filter(|_| plates.len() >= MIN_PLATES);
    let Some(moments) = moments else {
        return unfitted(format!(
            "fewer than {MIN_PLATES} photos do not tell how it varies"
        ));
    };
    let (middle, sigma) = ((knob.to_measure)(before.min), moments.variance.sqrt());
    let ends = [middle - sigma, middle + sigma].map(|end| three_digits((knob.to_value)(end)));
    let fitted = Range::new(ends[0], ends[1]);
    (knob.set)(&mut config.scene, fitted);
    FittedKey {
        fitted: Some(range_text(fitted)),
        ..unfitted("one standard deviation between the photos, either way".into())
    }
}
