//! Pictures of a recipe without pixels: objects fall and are labelled, nothing is lit.

use crate::dataset::Pipeline;
use crate::dataset::page::labelled_pictures::shares_of;
use crate::error::{Error, Result};
use crate::label::Labels;
use crate::scene::{Count, Recipe};
use rayon::prelude::*;
use std::ops::Range;

/// Offset between the sample numbers of falls with different numbers of objects, so that every
/// recipe draws the same.
const NUMBERS_APART: u64 = 1_000_000;

/// The visible result of one fall.
#[derive(Clone, Debug)]
pub(super) struct Fall {
    /// Number of objects that fell.
    pub(super) objects: usize,
    /// The photo of the place.
    pub(super) plate: String,
    /// Centre, width and height of each label's box, as shares of the picture's.
    pub(super) boxes: Vec<[f64; 4]>,
}

/// How falls are generated.
pub(super) struct FallPlan<'a> {
    pub(super) pipeline: &'a Pipeline,
    pub(super) seed: u64,
    /// Which falls of each number of objects.
    pub(super) each: Range<u64>,
    /// Called after each.
    pub(super) step: &'a (dyn Fn() + Sync),
}

impl FallPlan<'_> {
    /// Falls of `objects` objects of a recipe; those that do not come to rest are skipped.
    pub(super) fn falls(&self, recipe: &Recipe, objects: usize) -> Result<Vec<Fall>> {
        let recipe = Recipe {
            objects: Count::fixed(objects as u32),
            negatives: 0.0,
            ..recipe.clone()
        };
        let numbers = self.each.clone().into_par_iter();
        let falls = numbers.map(|i| self.fall(&recipe, objects, i));
        let falls: Result<Vec<Option<Fall>>> = falls.collect();
        Ok(falls?.into_iter().flatten().collect())
    }

    fn fall(&self, recipe: &Recipe, objects: usize, i: u64) -> Result<Option<Fall>> {
        if self.pipeline.is_stopped() {
            return Err(stopped());
        }
        let k = objects as u64 * NUMBERS_APART + i;
        let (scene, _) = self.pipeline.explain_with(recipe, self.seed, k)?;
        let plate = scene.plate.clone();
        let labels = match self.pipeline.label(scene) {
            Err(Error::Unsettled { .. }) => None,
            labels => Some(labels?),
        };
        (self.step)();
        Ok(labels.map(|labels| Fall {
            objects,
            plate,
            boxes: self.boxes(&labels),
        }))
    }

    /// Box of each label, in shares of the picture.
    fn boxes(&self, labels: &Labels) -> Vec<[f64; 4]> {
        let config = &self.pipeline.config().labels;
        let extent = config.extent();
        let labelled = config.obstructed.labelled(labels, 0, &[extent]).into_iter();
        labelled
            .filter(|label| !label.ignored)
            .map(|label| extent.of(label.object).0)
            .map(|b| shares_of(&b, labels.image.map(f64::from)))
            .collect()
    }
}

pub(super) fn stopped() -> Error {
    Error::Interrupted {
        what: "nothing was written".into(),
    }
}

/// Natural logarithm of the root of a box's area.
pub(super) fn log_size([_, _, w, h]: &[f64; 4]) -> f64 {
    0.5 * (w * h).max(f64::MIN_POSITIVE).ln()
}
