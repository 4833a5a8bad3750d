//! Which images an epoch shows, in which batches, and how much each batch counts.

use crate::error::{Error, Result};
use crate::train::{Balance, BatchOptions, Source, Weights, batches};
use serde::{Deserialize, Serialize};

/// How two sources of images are put together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// As one set; a batch may hold both.
    Concatenated,
    /// Batches of one source, weighted (equation 2 of the paper).
    Combined(Balance),
}

/// Images of a batch and its weight in the loss.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Step {
    /// Places in the list of real images followed by the synthetic ones.
    pub(super) images: Vec<usize>,
    /// Places that a mosaic may take its other images from.
    pub(super) pool: std::ops::Range<usize>,
    pub(super) weight: f64,
}

/// The batches of an epoch; with one source alone the modes are the same.
///
/// # Errors
/// [`Error::Value`] for no images, and for a combination with a source that is empty.
pub(super) fn plan(
    mode: Mode,
    [real, synthetic]: [usize; 2],
    epoch: usize,
    options: &BatchOptions,
) -> Result<Vec<Step>> {
    let all = real + synthetic;
    if all == 0 {
        return Err(Error::value("images", "none to learn from, expected at least one"));
    }
    let epoch = epoch as u64;
    let Mode::Combined(balance) = mode else {
        let one = batches(all, 0, epoch, options).into_iter();
        return Ok(one.map(|batch| Step { images: batch.images, pool: 0..all, weight: 1.0 }).collect());
    };
    let Weights { real: of_real, synthetic: of_synthetic } = balance.weights(real as u64, synthetic as u64)?;
    let step = |batch: crate::train::Batch| match batch.source {
        Source::Real => Step { images: batch.images, pool: 0..real, weight: of_real },
        Source::Synthetic => {
            let images = batch.images.into_iter().map(|i| real + i).collect();
            Step { images, pool: real..all, weight: of_synthetic }
        }
    };
    Ok(batches(real, synthetic, epoch, options).into_iter().map(step).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combined_batches_stay_within_a_source_and_weigh_what_equation_2_says() {
        let options = BatchOptions { size: 8, seed: 1 };
        let steps = plan(Mode::Combined(Balance::default()), [10, 30], 2, &options).unwrap();
        for step in &steps {
            assert!(step.images.iter().all(|i| step.pool.contains(i)));
            assert_eq!(step.weight, if step.pool.start == 0 { 1.0 } else { 1.0 / 3.0 });
        }
        assert_eq!(steps.iter().map(|s| s.images.len()).sum::<usize>(), 40);
        assert!(plan(Mode::Combined(Balance::default()), [10, 0], 0, &options).is_err());
    }

    #[test]
    fn concatenated_batches_mix_and_weigh_the_same() {
        let options = BatchOptions { size: 8, seed: 1 };
        let steps = plan(Mode::Concatenated, [10, 30], 0, &options).unwrap();
        assert!(steps.iter().all(|s| s.weight == 1.0 && s.pool == (0..40)));
        assert!(steps.iter().any(|s| s.images.iter().any(|i| *i < 10) && s.images.iter().any(|i| *i >= 10)));
        assert!(plan(Mode::Concatenated, [0, 0], 0, &options).is_err());
    }
}
