//! Detections of one class from all images, by decreasing confidence.

use super::THRESHOLDS;
use super::by_class::{ClassBoxes, ImageBoxes};
use rayon::prelude::*;

/// Bits, one per threshold.
pub(super) type Marks = u16;

/// A detection matched with the ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    pub(super) confidence: f64,
    /// The index of its sheet.
    pub(super) sheet: usize,
    /// How many detections of its class and image are more confident.
    pub(super) place: u32,
    /// Thresholds at which it is a true positive.
    pub(super) right: Marks,
    /// Thresholds at which it is ignored.
    pub(super) ignored: Marks,
}

impl Hit {
    /// A detection with the thresholds at which it is right and those at which it is ignored.
    pub(super) fn new(image: &ImageBoxes<'_>, place: usize, [right, ignored]: [Marks; 2]) -> Self {
        Self {
            confidence: image.found[place].confidence,
            sheet: image.sheet,
            place: place as u32,
            right,
            ignored,
        }
    }

    /// Thresholds at which it is a true positive and counts.
    pub(super) fn true_positives(&self) -> impl Iterator<Item = usize> {
        marked(self.right & !self.ignored)
    }

    /// Whether it is right at a threshold; none if it is ignored there.
    fn is_right_at(&self, threshold: usize) -> Option<bool> {
        let is_ignored = is_marked(self.ignored, threshold);
        (!is_ignored).then(|| is_marked(self.right, threshold))
    }
}

/// Running sums of true and false positives at one threshold, by decreasing confidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Running {
    pub(super) right: Vec<f64>,
    pub(super) wrong: Vec<f64>,
}

/// The detections of a class, matched with the ground truth once: they can then be counted for any
/// weights of the images.
#[derive(Clone, Debug, Default)]
pub(super) struct Ranking {
    pub(super) class: u32,
    /// Sheets with boxes to find, and the number of such boxes.
    truths: Vec<(usize, usize)>,
    /// By decreasing confidence; equal ones in the order of images.
    pub(super) hits: Vec<Hit>,
}

impl Ranking {
    /// `match_image` returns the detections of an image, matched with its boxes, and the number of
    /// boxes to find.
    pub(super) fn new(
        boxes: &ClassBoxes<'_>,
        match_image: impl Fn(&ImageBoxes<'_>) -> (Vec<Hit>, usize) + Send + Sync,
    ) -> Self {
        let images = boxes.images();
        let each: Vec<(Vec<Hit>, usize)> = images.par_iter().map(match_image).collect();
        let (mut hits, mut truths) = (Vec::new(), Vec::new());
        for (image, (found, count)) in images.iter().zip(each) {
            hits.extend(found);
            if count > 0 {
                truths.push((image.sheet, count));
            }
        }
        hits.sort_by(|a: &Hit, b| b.confidence.total_cmp(&a.confidence));
        Self {
            class: boxes.class,
            truths,
            hits,
        }
    }

    /// The number of boxes to find.
    pub(super) fn truths(&self, weights: &[u32]) -> f64 {
        self.truths
            .iter()
            .map(|&(sheet, count)| weight(weights, sheet) * count as f64)
            .sum()
    }

    /// The number of boxes to find; none if it is 0.
    pub(super) fn truths_to_find(&self, weights: &[u32]) -> Option<f64> {
        Some(self.truths(weights)).filter(|&truths| truths > 0.0)
    }

    /// Detections in images with a positive weight, with that weight.
    pub(super) fn counting(&self, weights: &[u32]) -> impl Iterator<Item = (&Hit, f64)> {
        self.hits
            .iter()
            .map(|hit| (hit, weight(weights, hit.sheet)))
            .filter(|(_, count)| *count > 0.0)
    }

    /// The same without those ignored at a threshold, and whether they are right.
    pub(super) fn counting_at(
        &self,
        threshold: usize,
        weights: &[u32],
    ) -> impl Iterator<Item = (&Hit, bool, f64)> {
        debug_assert!(threshold < THRESHOLDS);
        let counting = self.counting(weights);
        counting.filter_map(move |(hit, count)| Some((hit, hit.is_right_at(threshold)?, count)))
    }

    /// Sums at a threshold after each detection that counts there.
    pub(super) fn running(&self, threshold: usize, weights: &[u32]) -> Running {
        let (mut right, mut wrong, mut sums) = (0.0, 0.0, Running::default());
        for (_, is_right, count) in self.counting_at(threshold, weights) {
            if is_right {
                right += count;
            } else {
                wrong += count;
            }
            sums.push(right, wrong);
        }
        sums
    }

    /// Sums at every threshold, only where a precision curve can turn: at each true positive,
    /// before it, and at the end.
    ///
    /// Between two true positives precision falls with every detection while recall is constant. So
    /// only the last of these is ever read, and the envelope of precision is unchanged.
    pub(super) fn turns(&self, weights: &[u32]) -> [Running; THRESHOLDS] {
        let mut tallies: [TurnTally; THRESHOLDS] = Default::default();
        let mut all = 0.0;
        for (hit, count) in self.counting(weights) {
            for t in marked(hit.ignored) {
                tallies[t].ignored += count;
            }
            for t in hit.true_positives() {
                tallies[t].add_right(all, count);
            }
            all += count;
        }
        tallies.map(|tally| tally.finish(all))
    }
}

/// The sums at one threshold where a precision curve can turn, while they are collected.
#[derive(Default)]
struct TurnTally {
    sums: Running,
    right: f64,
    ignored: f64,
}

impl TurnTally {
    /// Adds a true positive that follows `all` detections.
    fn add_right(&mut self, all: f64, count: f64) {
        self.turn(all);
        self.right += count;
        self.sums.push(self.right, self.wrong(all + count));
    }

    fn finish(mut self, all: f64) -> Running {
        self.turn(all);
        self.sums
    }

    fn turn(&mut self, all: f64) {
        self.sums.turn(self.right, self.wrong(all));
    }

    /// The number of false positives among the first `all` detections.
    fn wrong(&self, all: f64) -> f64 {
        all - self.right - self.ignored
    }
}

impl Running {
    fn push(&mut self, right: f64, wrong: f64) {
        self.right.push(right);
        self.wrong.push(wrong);
    }

    /// Adds sums unless they equal the last ones.
    fn turn(&mut self, right: f64, wrong: f64) {
        if self.last() != (right, wrong) {
            self.push(right, wrong);
        }
    }

    fn last(&self) -> (f64, f64) {
        let last = self.right.last().zip(self.wrong.last());
        last.map_or((0.0, 0.0), |(right, wrong)| (*right, *wrong))
    }
}

/// The indices of the set bits.
pub(super) fn marked(mut marks: Marks) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let next = (marks != 0).then(|| marks.trailing_zeros() as usize)?;
        marks &= marks - 1;
        Some(next)
    })
}

#[inline]
fn is_marked(marks: Marks, threshold: usize) -> bool {
    marks >> threshold & 1 == 1
}

/// How often an image counts.
fn weight(weights: &[u32], sheet: usize) -> f64 {
    if weights.is_empty() {
        1.0
    } else {
        f64::from(weights[sheet])
    }
}

#[cfg(test)]
mod tests {
    use super::super::average::{mean_of_samples, recall_and_precision, trapezoid};
    use super::super::by_class::ByClass;
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;
    use proptest::prelude::*;

    fn ranking(hits: Vec<Hit>) -> Ranking {
        Ranking {
            class: 0,
            truths: vec![(0, 9)],
            hits,
        }
    }

    fn hit(right: Marks, ignored: Marks) -> Hit {
        Hit {
            confidence: 0.5,
            sheet: 0,
            place: 0,
            right,
            ignored,
        }
    }

    #[test]
    fn equal_confidences_keep_their_order() {
        let b = bbox(0.0, 0.0, 9.0, 9.0);
        let sheets = [0.5, 0.9, 0.5].map(|c| sheet(vec![there(0, b)], vec![found(0, b, c)]));
        let held = |image: &ImageBoxes<'_>| {
            let hits = image.found.iter().map(|f| Hit {
                confidence: f.confidence,
                sheet: image.sheet,
                ..hit(0, 0)
            });
            (hits.collect(), image.truth.len())
        };
        let ranking = Ranking::new(&ByClass::new(&sheets).classes()[0], held);
        assert_eq!(
            ranking.hits.iter().map(|h| h.sheet).collect::<Vec<_>>(),
            [1, 0, 2]
        );
        assert_eq!(
            (ranking.truths(&[]), ranking.truths(&[1, 0, 3])),
            (3.0, 4.0)
        );
    }

    #[test]
    fn ignored_detections_move_neither_sum() {
        let all = ranking(
            [(1, 0), (0, 1), (0, 0)]
                .map(|(right, ignored)| hit(right, ignored))
                .to_vec(),
        );
        let sums = all.running(0, &[]);
        assert_eq!((sums.right, sums.wrong), (vec![1.0, 1.0], vec![0.0, 1.0]));
        let turns = &all.turns(&[])[0];
        assert_eq!(
            (&turns.right[..], &turns.wrong[..]),
            (&[1.0, 1.0][..], &[0.0, 1.0][..])
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn the_turns_of_a_curve_give_the_bits_that_all_of_it_gives(
            drawn in prop::collection::vec((0_u16..1024, 0_u16..1024, 0_u16..5, 0_usize..4), 0..60),
            weights in prop::collection::vec(0_u32..3, 4),
            rare in 0_u16..5,
        ) {
            // Most detections are wrong, as in practice, and one that is right at a threshold is
            // right at those below.
            let made = |&(right, ignored, kind, sheet): &(u16, u16, u16, usize)| {
                let right = if kind < rare { 0 } else { right };
                Hit { sheet, ..hit(right & !ignored, if kind == 4 { ignored } else { 0 }) }
            };
            let all = ranking(drawn.iter().map(made).collect());
            let truths = 60.0;
            for (t, turns) in all.turns(&weights).iter().enumerate() {
                let whole = all.running(t, &weights);
                for epsilon in [[1e-16, 0.0], [0.0, f64::EPSILON]] {
                    if whole.right.is_empty() {
                        continue;
                    }
                    let [(r, p), (few_r, few_p)] = [&whole, turns].map(|sums| recall_and_precision(sums, truths, epsilon));
                    prop_assert_eq!(mean_of_samples(&r, &p), mean_of_samples(&few_r, &few_p));
                    prop_assert_eq!(trapezoid(&r, &p), trapezoid(&few_r, &few_p));
                    prop_assert_eq!(r.last().copied().unwrap_or(0.0), few_r.last().copied().unwrap_or(0.0));
                    prop_assert_eq!(p.last().copied().unwrap_or(0.0), few_p.last().copied().unwrap_or(0.0));
                }
            }
        }
    }
}
