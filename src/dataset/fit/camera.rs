//! Ranges fitted by how a measure of the real pictures differs: camera, light, size.

use super::knobs::{self, Difference, KNOBS, Knob};
use super::measured::MeasuredSet;
use super::{FittedKey, Fitting, range_text, unfitted};
use crate::error::Result;
use crate::scene::{Range, Recipe};
use std::path::Path;

impl Fitting<'_> {
    /// Sets a range by the difference of a measure, and returns the reason.
    pub(super) fn fit_knob(&mut self, knob: &Knob, difference: Option<&Difference>) -> FittedKey {
        let scene = &self.config.scene;
        let before = (knob.get)(scene);
        let Some(difference) = difference else {
            let why = "too few pictures could be measured".into();
            return unfitted(knob.key, range_text(before), why);
        };
        let mut key = unfitted(knob.key, range_text(before), describe(knob, difference));
        if let Some(fitted) = knob.fitted(scene, difference) {
            match self.with_range(knob, fitted) {
                Err(error) => key.why = format!("{} was fitted, but: {error}", range_text(fitted)),
                Ok(changed) => {
                    self.config.scene = changed;
                    key.fitted = Some(range_text(fitted));
                }
            }
        }
        key
    }

    /// The scene with another range; an error if that is not valid, for example if objects have no
    /// room.
    pub(super) fn with_range(&self, knob: &Knob, range: Range) -> Result<Recipe> {
        let mut scene = self.config.scene.clone();
        (knob.set)(&mut scene, range);
        scene.check()?;
        self.pipeline.check_room_with(&scene)?;
        Ok(scene)
    }

    /// Fits the ranges of the whole picture, then refines them with pictures made with them.
    pub(super) fn fit_camera(&mut self, real: &MeasuredSet, before: &MeasuredSet) -> Result<()> {
        let mut fitted: Vec<(&Knob, FittedKey)> = Vec::new();
        let first = self.config.scene.clone();
        for knob in &KNOBS {
            let difference = self.difference(knob, real, before);
            let key = match knob.is_of_pixels && real.is_narrower_than(self.config.scene.image[0]) {
                true => self.too_small_for(knob),
                false => self.fit_knob(knob, difference.as_ref()),
            };
            fitted.push((knob, key));
        }
        if fitted.iter().any(|(_, key)| key.fitted.is_some()) {
            self.refine_camera(real, (before, &first), &mut fitted)?;
        }
        self.keys.extend(fitted.into_iter().map(|(_, key)| key));
        Ok(())
    }

    fn too_small_for(&self, knob: &Knob) -> FittedKey {
        let before = range_text((knob.get)(&self.config.scene));
        let why = "real pictures are smaller than scene.image and show it differently";
        unfitted(knob.key, before, why.into())
    }

    /// A second step, scaled by the response to the first one: for example, only a part of the
    /// noise is measured in a brighter picture that clips it.
    fn refine_camera(
        &mut self,
        real: &MeasuredSet,
        (before, first): (&MeasuredSet, &Recipe),
        fitted: &mut [(&Knob, FittedKey)],
    ) -> Result<()> {
        let trial = self.rendered()?;
        for (knob, key) in fitted.iter_mut().filter(|(_, key)| key.fitted.is_some()) {
            let response = self.difference(knob, &trial, before);
            let slope = knob.slope([first, &self.config.scene], response.as_ref());
            let difference = self.difference(knob, real, &trial);
            if let Some(range) = difference.and_then(|d| knob.moved(&self.config.scene, &d, slope))
            {
                (knob.set)(&mut self.config.scene, range);
                key.fitted = Some(range_text(range));
            }
        }
        Ok(())
    }

    fn difference(&self, knob: &Knob, real: &MeasuredSet, own: &MeasuredSet) -> Option<Difference> {
        let real = real.values(knob.of_picture).into_iter();
        let real: Vec<_> = real.map(|value| vec![(value, 1.0)]).collect();
        let own = own.grouped(knob.of_picture, |name| self.plate_of(name));
        Difference::new(&real, &own, self.options.seed)
    }

    /// The photo behind a picture of the recipe, whose name is its number.
    fn plate_of(&self, picture: &str) -> String {
        let number = Path::new(picture)
            .file_stem()
            .and_then(|stem| stem.to_str()?.parse().ok());
        let (recipe, seed) = (&self.config.scene, self.options.seed);
        let scene = number.and_then(|k| self.pipeline.explain_with(recipe, seed, k).ok());
        scene.map_or_else(String::new, |(scene, _)| scene.plate)
    }
}

fn describe(knob: &Knob, difference: &Difference) -> String {
    let mean = difference.mean_interval();
    let [value, low, high] = [mean.value, mean.low, mean.high].map(knobs::three_digits);
    let unit = knob.unit;
    let limit = match value < 0.0 && knob.least == 0.0 {
        true => "; no key removes what the photos of the place already have",
        false => "",
    };
    format!("real pictures differ by {value} ({low} to {high}) {unit} on average{limit}")
}
