//! Scores for many choices of images from one matching.

use super::by_class::ByClass;
use super::coco::{self, AreaRange};
use super::rank::Ranking;
use super::{Curves, Definition, EvalImage, Scores, curve, mean, yolov5};
use rayon::prelude::*;

/// Detections matched with the truth once, which is what takes long: they can be scored for any weights of the images.
#[derive(Clone, Debug)]
pub struct Matches {
    definition: Definition,
    images: usize,
    rankings: Vec<Ranking>,
}

impl Matches {
    /// Matches all detections with the truth.
    pub fn new(sheets: &[EvalImage], definition: Definition) -> Self {
        let rankings = match definition {
            Definition::Yolov5 => yolov5::rankings(sheets),
            Definition::Coco => coco::rankings(&ByClass::new(sheets), AreaRange::All),
        };
        Self {
            definition,
            images: sheets.len(),
            rankings,
        }
    }

    /// How many images there are.
    pub fn images(&self) -> usize {
        self.images
    }

    /// The scores, as [`evaluate`](super::evaluate) gives them.
    ///
    /// # Panics
    /// When there are weights and not one per image.
    pub fn scores(&self, weights: &[u32]) -> Scores {
        self.check(weights);
        match self.definition {
            Definition::Yolov5 => yolov5::scores(&self.rankings, weights),
            Definition::Coco => coco::scores(&self.rankings, weights),
        }
    }

    /// [`Scores::map`] of the scores, sooner.
    ///
    /// # Panics
    /// When there are weights and not one per image.
    pub fn map(&self, weights: &[u32]) -> f64 {
        self.check(weights);
        let average_precision = match self.definition {
            Definition::Yolov5 => yolov5::average_precision,
            Definition::Coco => coco::average_precision,
        };
        let each: Vec<f64> = self
            .rankings
            .par_iter()
            .filter_map(|r| average_precision(r, weights))
            .map(mean)
            .collect();
        mean(each)
    }

    /// As [`curves`](super::curves()), matched by this definition.
    pub fn curves(&self) -> Curves {
        curve::from_rankings(&self.rankings)
    }

    fn check(&self, weights: &[u32]) {
        assert!(
            weights.is_empty() || weights.len() == self.images,
            "one weight per sheet"
        );
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
