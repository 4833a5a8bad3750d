//! Scores for many choices of images from one matching.

use super::by_class::ByClass;
use super::coco::{self, AreaRange};
use super::rank::Ranking;
use super::{Definition, EvalImage, Scores, check_weights, mean, yolov5};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Detections matched with the ground truth once, which is the slow part: they can then be scored
/// for any weights of the images.
#[derive(Clone, Debug)]
pub struct Matches {
    definition: Definition,
    /// The group of each image.
    groups: Vec<usize>,
    rankings: Vec<Ranking>,
}

impl Matches {
    /// Matches all detections with the truth.
    pub fn new(sheets: &[EvalImage], definition: Definition) -> Self {
        Self {
            definition,
            groups: group_numbers(sheets),
            rankings: rankings_by(definition, sheets),
        }
    }

    /// The number of images.
    pub fn images(&self) -> usize {
        self.groups.len()
    }

    /// The group of each image, 0, 1, ..; an ungrouped image is its own group.
    pub(super) fn groups(&self) -> &[usize] {
        &self.groups
    }

    /// The number of groups.
    pub(super) fn group_count(&self) -> usize {
        self.groups.iter().max().map_or(0, |last| last + 1)
    }

    /// The scores, as returned by [`evaluate`](super::evaluate).
    ///
    /// # Panics
    /// When `weights` is neither empty nor one per image.
    pub fn scores(&self, weights: &[u32]) -> Scores {
        check_weights(weights, self.images());
        match self.definition {
            Definition::Yolov5 => yolov5::scores(&self.rankings, weights),
            Definition::Coco => coco::scores(&self.rankings, weights),
        }
    }

    /// [`Scores::map`] of the scores, but faster.
    ///
    /// # Panics
    /// When `weights` is neither empty nor one per image.
    pub fn map(&self, weights: &[u32]) -> f64 {
        self.map_if_any(weights).unwrap_or(0.0)
    }

    /// Like [`map`](Self::map); none if there is nothing to find.
    pub(crate) fn map_if_any(&self, weights: &[u32]) -> Option<f64> {
        check_weights(weights, self.images());
        let rankings = self.rankings.par_iter();
        let each: Vec<f64> = rankings
            .filter_map(|ranking| self.class_map(ranking, weights))
            .collect();
        (!each.is_empty()).then(|| mean(each))
    }

    /// A class's average precision, averaged over the thresholds.
    fn class_map(&self, ranking: &Ranking, weights: &[u32]) -> Option<f64> {
        let average_precision = match self.definition {
            Definition::Yolov5 => yolov5::average_precision(ranking, weights),
            Definition::Coco => coco::average_precision(ranking, weights),
        };
        average_precision.map(mean)
    }
}

/// Numbered by the first image of each group.
fn group_numbers(sheets: &[EvalImage]) -> Vec<usize> {
    let (mut known, mut numbers) = (BTreeMap::new(), 0_usize..);
    let mut next = || numbers.next().unwrap_or_default();
    let groups = sheets.iter().map(|sheet| sheet.group.as_str());
    groups
        .map(|group| match group {
            "" => next(),
            group => *known.entry(group).or_insert_with(&mut next),
        })
        .collect()
}

/// The detections of every class, ranked after matching by a definition.
fn rankings_by(definition: Definition, sheets: &[EvalImage]) -> Vec<Ranking> {
    match definition {
        Definition::Yolov5 => yolov5::rankings(sheets),
        Definition::Coco => coco::rankings(&ByClass::new(sheets), AreaRange::All),
    }
}

#[cfg(test)]
mod tests {
    use super::super::evaluate;
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn the_mean_is_that_of_the_scores_for_any_weights() {
        let near = |i: u32| bbox(10.0 + f64::from(i), 10.0, 50.0, 40.0);
        let one = |i: u32| {
            let seen = (0..i)
                .map(|k| found(k % 3, near(k), 0.1 * f64::from(k + 1)))
                .collect();
            sheet((0..3).map(|class| there(class, near(0))).collect(), seen)
        };
        let sheets: Vec<EvalImage> = (0..6).map(one).collect();
        for definition in [Definition::Yolov5, Definition::Coco] {
            let matches = Matches::new(&sheets, definition);
            for weights in [&[][..], &[1, 0, 3, 1, 2, 1], &[0, 0, 0, 0, 0, 5], &[0; 6]] {
                let scores = evaluate(&sheets, definition, weights);
                assert_eq!(
                    (matches.map(weights), &matches.scores(weights)),
                    (scores.map(), &scores)
                );
            }
        }
    }
}
