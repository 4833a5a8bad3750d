//! Average precision and recall as computed by the COCO tools.

use super::average::{mean_of_samples, recall_and_precision};
use super::by_class::{ByClass, ImageBoxes};
use super::overlap::{BoxIndex, intersection, share};
use super::rank::{Hit, Marks, Ranking};
use super::{
    ClassScores, Definition, Detection, EvalImage, GroundTruth, Scores, THRESHOLDS, check_weights,
    mean, thresholds,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Maximum number of detections of a class that count in an image: the most confident ones.
pub(crate) const MAX_DETECTIONS: [usize; 3] = [1, 10, 100];
/// Keeps a precision defined: the distance from 1 to the next float, as in the original.
const PRECISION_EPSILON: f64 = f64::EPSILON;
/// An overlap may not quite reach 1 because of rounding.
const MAX_THRESHOLD: f64 = 1.0 - 1e-10;

/// The size range of the objects to find; others are ignored.
#[derive(Clone, Copy)]
pub(super) enum AreaRange {
    /// Of any size.
    All,
    /// Up to 32 x 32 pixels.
    Small,
    /// Up to 96 x 96 pixels.
    Medium,
    /// Larger.
    Large,
}

/// The twelve numbers of the COCO tools, with scores per class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CocoScores {
    /// Average precision over objects of all sizes.
    pub scores: Scores,
    /// AP@0.5:0.95 of small, medium and large objects; none where there are no such objects.
    pub ap_by_area: [Option<f64>; 3],
    /// Average recall over objects of all sizes with 1, 10 and 100 detections per image.
    pub ar_by_count: [Option<f64>; 3],
    /// Average recall of small, medium and large objects with 100 detections per image.
    pub ar_by_area: [Option<f64>; 3],
}

impl AreaRange {
    const ALL: [Self; 4] = [Self::All, Self::Small, Self::Medium, Self::Large];

    /// Whether it contains an area, square pixels; both limits are included.
    fn holds(self, area: f64) -> bool {
        let limits = match self {
            Self::All => 0.0..=1e10,
            Self::Small => 0.0..=1024.0,
            Self::Medium => 1024.0..=9216.0,
            Self::Large => 9216.0..=1e10,
        };
        limits.contains(&area)
    }
}

/// Average precision and recall by the definition of the COCO tools.
///
/// # Method
/// `COCOeval` of pycocotools 2.0 for boxes.
///
/// # Panics
/// When there are weights and not one per sheet.
pub fn coco(sheets: &[EvalImage], weights: &[u32]) -> CocoScores {
    check_weights(weights, sheets.len());
    let rankings = rankings_by_area(sheets);
    let measured = rankings
        .each_ref()
        .map(|rankings| measured(rankings, weights));
    CocoScores::from_measured(&measured)
}

/// Rankings for each of [`AreaRange::ALL`].
fn rankings_by_area(sheets: &[EvalImage]) -> [Vec<Ranking>; 4] {
    let classes = ByClass::new(sheets);
    AreaRange::ALL.map(|range| rankings(&classes, range))
}

impl CocoScores {
    /// From the results for all areas, and for each size range.
    fn from_measured([all, by_area @ ..]: &[Vec<RangeScore<'_>>; 4]) -> Self {
        let by_area = by_area.each_ref();
        Self {
            ap_by_area: by_area.map(|m| over(m, |m| mean(m.ap))),
            ar_by_count: MAX_DETECTIONS.map(|count| over(all, |m| mean(m.recall_within(count)))),
            ar_by_area: by_area.map(|m| over(m, |m| mean(m.recall))),
            scores: class_scores(all),
        }
    }
}

/// The detections of every class with something to find, the 100 most confident ones of each image.
pub(super) fn rankings(classes: &ByClass<'_>, range: AreaRange) -> Vec<Ranking> {
    let classes = classes.classes();
    let rank = classes.par_iter();
    rank.map(|boxes| Ranking::new(boxes, |image| match_image(image, range)))
        .collect()
}

pub(super) fn scores(rankings: &[Ranking], weights: &[u32]) -> Scores {
    class_scores(&measured(rankings, weights))
}

fn class_scores(measured: &[RangeScore<'_>]) -> Scores {
    Scores {
        definition: Definition::Coco,
        classes: measured.iter().map(RangeScore::scores).collect(),
    }
}

/// Average precision of a class at every threshold; none if there is nothing to find.
pub(super) fn average_precision(ranking: &Ranking, weights: &[u32]) -> Option<[f64; THRESHOLDS]> {
    RangeScore::new(ranking, weights).map(|measured| measured.ap)
}

fn measured<'a>(rankings: &'a [Ranking], weights: &'a [u32]) -> Vec<RangeScore<'a>> {
    rankings
        .par_iter()
        .filter_map(|ranking| RangeScore::new(ranking, weights))
        .collect()
}

fn over(measured: &[RangeScore<'_>], value: impl Fn(&RangeScore<'_>) -> f64) -> Option<f64> {
    (!measured.is_empty()).then(|| mean(measured.iter().map(value)))
}

/// A class in one size range.
struct RangeScore<'a> {
    ranking: &'a Ranking,
    weights: &'a [u32],
    truths: f64,
    ap: [f64; THRESHOLDS],
    recall: [f64; THRESHOLDS],
    precision: f64,
}

impl<'a> RangeScore<'a> {
    /// None for a class without objects in the range.
    fn new(ranking: &'a Ranking, weights: &'a [u32]) -> Option<Self> {
        let truths = ranking.truths_to_find(weights)?;
        let curves = curves_at_thresholds(ranking, weights, truths);
        let curves = curves.each_ref();
        Some(Self {
            ranking,
            weights,
            truths,
            ap: curves.map(|(recall, precision)| mean_of_samples(recall, precision)),
            recall: curves.map(|(recall, _)| last_of(recall)),
            precision: last_of(&curves[0].1),
        })
    }

    /// Recall with this many detections per image.
    fn recall_within(&self, count: usize) -> [f64; THRESHOLDS] {
        let mut right = [0.0; THRESHOLDS];
        for (hit, weight) in self.surest(count) {
            for t in hit.true_positives() {
                right[t] += weight;
            }
        }
        right.map(|sum| sum / self.truths)
    }

    /// The most confident detections of each image.
    fn surest(&self, count: usize) -> impl Iterator<Item = (&Hit, f64)> {
        let hits = self.ranking.counting(self.weights);
        hits.filter(move |(hit, _)| (hit.place as usize) < count)
    }

    fn scores(&self) -> ClassScores {
        let Self {
            ranking,
            truths,
            ap,
            recall,
            precision,
            ..
        } = *self;
        ClassScores {
            class: ranking.class,
            truths: truths as u64,
            precision,
            recall: recall[0],
            ap,
        }
    }
}

/// A ground-truth box in the context of one size range.
struct Target<'a> {
    truth: &'a GroundTruth,
    /// Whether it is ignored.
    ignored: bool,
    taken: Marks,
}

/// The detections of a class in one image, matched with its boxes, and the number of boxes to find.
fn match_image(image: &ImageBoxes<'_>, range: AreaRange) -> (Vec<Hit>, usize) {
    let mut targets = targets_of(image, range);
    let hits = match_targets(image, &mut targets, range);
    (hits, targets.iter().filter(|t| !t.ignored).count())
}

/// The most confident detections, each with the targets that it matches.
fn match_targets(image: &ImageBoxes<'_>, targets: &mut [Target<'_>], range: AreaRange) -> Vec<Hit> {
    let index = BoxIndex::new(targets.iter().map(|t| t.truth.bbox));
    let surest = image.found.iter().take(MAX_DETECTIONS[2]).enumerate();
    surest
        .map(|(place, found)| {
            let overlaps = overlaps_with(found, targets, &index);
            Hit::new(image, place, marks(found, targets, &overlaps, range))
        })
        .collect()
}

/// Indices of the targets that a detection overlaps, and by how much.
fn overlaps_with(found: &Detection, targets: &[Target<'_>], index: &BoxIndex) -> Vec<(usize, f64)> {
    let near = index.near(&found.bbox).into_iter();
    near.map(|k| (k, overlap(found, targets[k].truth)))
        .collect()
}

/// Targets that count come first: a detection matches an ignored box only if none of them is left.
fn targets_of<'a>(image: &ImageBoxes<'a>, range: AreaRange) -> Vec<Target<'a>> {
    let truth = image.truth.iter();
    let mut targets: Vec<_> = truth.map(|&truth| Target::new(truth, range)).collect();
    targets.sort_by_key(|t| t.ignored);
    targets
}

impl<'a> Target<'a> {
    fn new(truth: &'a GroundTruth, range: AreaRange) -> Self {
        Self {
            truth,
            ignored: truth.crowd || !range.holds(truth.area),
            taken: 0,
        }
    }

    /// Whether it is free at a threshold. A crowd may match any number of detections.
    fn is_free(&self, bit: Marks) -> bool {
        self.taken & bit == 0 || self.truth.crowd
    }
}

/// Thresholds at which a detection is a match, and at which it is ignored.
fn marks(
    found: &Detection,
    targets: &mut [Target<'_>],
    overlaps: &[(usize, f64)],
    range: AreaRange,
) -> [Marks; 2] {
    let (mut right, mut ignored) = (0, 0);
    for (i, threshold) in thresholds().into_iter().enumerate() {
        let bit: Marks = 1 << i;
        match nearest(targets, overlaps, threshold, bit) {
            Some(k) => {
                targets[k].taken |= bit;
                if targets[k].ignored {
                    ignored |= bit
                } else {
                    right |= bit
                }
            }
            None if !range.holds(found.box_area) => ignored |= bit,
            None => {}
        }
    }
    [right, ignored]
}

/// The free target with the greatest overlap, at least `threshold`, the last of equal ones; targets
/// that count precede ignored ones.
fn nearest(
    targets: &[Target<'_>],
    overlaps: &[(usize, f64)],
    threshold: f64,
    bit: Marks,
) -> Option<usize> {
    let mut least = threshold.min(MAX_THRESHOLD);
    let mut best: Option<usize> = None;
    for &(k, overlap) in overlaps {
        let target = &targets[k];
        if !target.is_free(bit) {
            continue;
        }
        if target.ignored && best.is_some_and(|b| !targets[b].ignored) {
            break;
        }
        if overlap >= least {
            (least, best) = (overlap, Some(k));
        }
    }
    best
}

/// Intersection over union; for a crowd, over the detection's own area.
fn overlap(found: &Detection, truth: &GroundTruth) -> f64 {
    let shared = intersection(&found.bbox, &truth.bbox);
    share(shared, whole_area(found, truth, shared))
}

/// The area to divide by: for a crowd only that of the detection.
fn whole_area(found: &Detection, truth: &GroundTruth, shared: f64) -> f64 {
    match truth.crowd {
        true => found.box_area,
        false => found.box_area + truth.box_area - shared,
    }
}

fn last_of(values: &[f64]) -> f64 {
    values.last().copied().unwrap_or(0.0)
}

/// Recall and precision of a class after each detection, at every threshold.
fn curves_at_thresholds(
    ranking: &Ranking,
    weights: &[u32],
    truths: f64,
) -> [(Vec<f64>, Vec<f64>); THRESHOLDS] {
    let turns = ranking.turns(weights);
    let epsilon = [0.0, PRECISION_EPSILON];
    turns
        .each_ref()
        .map(|sums| recall_and_precision(sums, truths, epsilon))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, crowd, found, sheet, there};
    use super::*;

    #[test]
    fn a_crowd_is_neither_found_nor_missed() {
        let b = bbox(0.0, 0.0, 40.0, 40.0);
        let truth = vec![there(0, b), crowd(0, bbox(100.0, 0.0, 200.0, 200.0))];
        let seen = vec![
            found(0, b, 0.5),
            found(0, bbox(110.0, 10.0, 30.0, 30.0), 0.9),
            found(0, bbox(150.0, 10.0, 30.0, 30.0), 0.8),
        ];
        let scores = coco(&[sheet(truth, seen)], &[]);
        assert!((scores.scores.map() - 1.0).abs() < 1e-12);
        assert_eq!(scores.scores.classes[0].truths, 1);
    }

    #[test]
    fn sizes_are_scored_apart() {
        let (small, large) = (bbox(0.0, 0.0, 20.0, 20.0), bbox(100.0, 100.0, 200.0, 200.0));
        let truth = vec![there(0, small), there(0, large)];
        let scores = coco(&[sheet(truth, vec![found(0, large, 0.5)])], &[]);
        let whole = |v: Option<f64>| v.map(|v| (v * 1e12).round() / 1e12);
        assert_eq!(scores.ap_by_area.map(whole), [Some(0.0), None, Some(1.0)]);
        assert_eq!(scores.ar_by_area, [Some(0.0), None, Some(1.0)]);
    }

    #[test]
    fn more_than_a_hundred_detections_do_not_count() {
        let b = bbox(0.0, 0.0, 20.0, 20.0);
        let noise = (0..100).map(|i| found(0, bbox(100.0 + f64::from(i), 50.0, 9.0, 9.0), 0.9));
        let seen = noise.chain([found(0, b, 0.1)]).collect();
        let scores = coco(&[sheet(vec![there(0, b)], seen)], &[]);
        assert_eq!(
            (scores.scores.map(), scores.ar_by_count),
            (0.0, [Some(0.0); 3])
        );
    }
}
