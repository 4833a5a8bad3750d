//! Average precision as computed by YOLOv5.

use super::average::{interpolated, recall_and_precision, trapezoid};
use super::by_class::{ByClass, ImageBoxes};
use super::overlap::{BoxIndex, area, intersection, share};
use super::rank::{Hit, Marks, Ranking, Running};
use super::{ClassScores, Definition, Detection, EvalImage, Scores, THRESHOLDS, check_weights};
use crate::geom::BBox;
use rayon::prelude::*;

/// Number of confidences at which precision, recall and F1 are sampled.
pub(super) const CONFIDENCE_STEPS: usize = 1000;
/// Keeps recall and F1 defined, as in the original.
const RATIO_EPSILON: f64 = 1e-16;
/// Keeps an intersection over union defined, square pixels, as in the original.
const AREA_EPSILON: f32 = 1e-7;
/// Half the width, in samples, of the window that smooths F1 before its best confidence is chosen.
const SMOOTHING_READINGS: usize = 50;

/// Average precision by the definition of YOLOv5, with precision and recall at the confidence of
/// the best F1.
///
/// Each detection is compared with the box of its class that it overlaps most; of those that match
/// the same box the most confident one counts. A box marked as crowd need not be found, and a
/// detection that is inside it and matches nothing else is ignored, as in the COCO tools; YOLO
/// labels have no such mark.
///
/// # Method
/// YOLOv5 7.0: `val.py` (`process_batch`) and `utils/metrics.py` (`ap_per_class`); overlaps also in
/// single precision. Departs from it for equal confidences or overlaps: YOLOv5 uses the order of an
/// unstable sort, petcomp that of the input.
///
/// # Panics
/// When `weights` is neither empty nor one per sheet.
pub fn yolov5(sheets: &[EvalImage], weights: &[u32]) -> Scores {
    check_weights(weights, sheets.len());
    scores(&rankings(sheets), weights)
}

/// The detections of every class with something to find.
pub(super) fn rankings(sheets: &[EvalImage]) -> Vec<Ranking> {
    ByClass::new(sheets)
        .classes()
        .par_iter()
        .map(|boxes| Ranking::new(boxes, match_image))
        .collect()
}

pub(super) fn scores(rankings: &[Ranking], weights: &[u32]) -> Scores {
    let classes = ranked(rankings, weights);
    let best = best_confidence(&classes);
    Scores {
        definition: Definition::Yolov5,
        classes: scores_at(best, &classes, weights),
    }
}

/// The scores of all classes at a sampled confidence.
fn scores_at(reading: usize, classes: &[Ranked<'_>], weights: &[u32]) -> Vec<ClassScores> {
    let scores = classes
        .par_iter()
        .map(|class| class.scores(reading, weights));
    scores.collect()
}

/// Average precision of a class at every threshold; none if there is nothing to find.
pub(super) fn average_precision(ranking: &Ranking, weights: &[u32]) -> Option<[f64; THRESHOLDS]> {
    let truths = ranking.truths_to_find(weights)?;
    let turns = ranking.turns(weights);
    Some(turns.each_ref().map(|sums| area_below(sums, truths)))
}

/// Area under the curve of precision over recall.
fn area_below(sums: &Running, truths: f64) -> f64 {
    let (recall, precision) = curve(sums, truths);
    if recall.is_empty() {
        0.0
    } else {
        trapezoid(&recall, &precision)
    }
}

/// The classes with something to find, with precision and recall by confidence.
pub(super) fn ranked<'a>(rankings: &'a [Ranking], weights: &[u32]) -> Vec<Ranked<'a>> {
    rankings
        .par_iter()
        .filter_map(|ranking| Ranked::new(ranking, weights))
        .collect()
}

/// The precision and recall of a class over confidence, at threshold 0.5.
pub(super) struct Ranked<'a> {
    pub(super) ranking: &'a Ranking,
    pub(super) recall: Vec<f64>,
    pub(super) precision: Vec<f64>,
    /// Negated, so that they are ascending.
    confidences: Vec<f64>,
}

impl<'a> Ranked<'a> {
    fn new(ranking: &'a Ranking, weights: &[u32]) -> Option<Self> {
        let truths = ranking.truths_to_find(weights)?;
        let (recall, precision) = curve(&ranking.running(0, weights), truths);
        Some(Self {
            ranking,
            recall,
            precision,
            confidences: negated_confidences(ranking, weights),
        })
    }

    fn scores(&self, best: usize, weights: &[u32]) -> ClassScores {
        ClassScores {
            class: self.ranking.class,
            truths: self.ranking.truths(weights) as u64,
            precision: self.precision_at(confidence(best)),
            recall: self.recall_at(confidence(best)),
            ap: average_precision(self.ranking, weights).unwrap_or_default(),
        }
    }

    pub(super) fn precision_at(&self, confidence: f64) -> f64 {
        self.read(&self.precision, confidence, 1.0)
    }

    pub(super) fn recall_at(&self, confidence: f64) -> f64 {
        self.read(&self.recall, confidence, 0.0)
    }

    /// 0 for a class without any detections.
    fn read(&self, values: &[f64], confidence: f64, above_all: f64) -> f64 {
        match self.confidences.first() {
            None => 0.0,
            Some(&surest) if -confidence < surest => above_all,
            Some(_) => interpolated(-confidence, &self.confidences, values),
        }
    }

    pub(super) fn f1_at(&self, confidence: f64) -> f64 {
        let (p, r) = (self.precision_at(confidence), self.recall_at(confidence));
        2.0 * p * r / (p + r + RATIO_EPSILON)
    }
}

fn negated_confidences(ranking: &Ranking, weights: &[u32]) -> Vec<f64> {
    let counting = ranking.counting_at(0, weights);
    counting.map(|(hit, ..)| -hit.confidence).collect()
}

fn curve(sums: &Running, truths: f64) -> (Vec<f64>, Vec<f64>) {
    recall_and_precision(sums, truths, [RATIO_EPSILON, 0.0])
}

/// Sample `i` of [`CONFIDENCE_STEPS`], 0 to 1.
pub(super) fn confidence(i: usize) -> f64 {
    i as f64 / (CONFIDENCE_STEPS - 1) as f64
}

/// The sample at which the smoothed mean F1 of the classes is greatest.
pub(super) fn best_confidence(classes: &[Ranked<'_>]) -> usize {
    let sums = f1_sums(classes);
    first_greatest((0..CONFIDENCE_STEPS).map(|i| window_sum(&sums, i)))
}

/// The sum of the classes' F1 at every sampled confidence.
fn f1_sums(classes: &[Ranked<'_>]) -> Vec<f64> {
    let readings = (0..CONFIDENCE_STEPS).into_par_iter();
    readings.map(|i| f1_sum(classes, confidence(i))).collect()
}

fn f1_sum(classes: &[Ranked<'_>], confidence: f64) -> f64 {
    classes.iter().map(|class| class.f1_at(confidence)).sum()
}

/// The index of the greatest value, the first of equal ones.
fn first_greatest(values: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (i, value) in values.enumerate() {
        if value > best.1 {
            best = (i, value);
        }
    }
    best.0
}

/// Sum of the samples around one; the end values are extended.
fn window_sum(values: &[f64], i: usize) -> f64 {
    let (i, reach, last) = (
        i as isize,
        SMOOTHING_READINGS as isize,
        values.len() as isize - 1,
    );
    let window = i - reach..=i + reach;
    window.map(|i| values[i.clamp(0, last) as usize]).sum()
}

/// The detections of a class in one image, marked as right where they match, and the number of
/// boxes to find.
fn match_image(image: &ImageBoxes<'_>) -> (Vec<Hit>, usize) {
    let [crowds, truth] = [true, false].map(|crowd| boxes_of(image, crowd));
    let right = right_marks(&truth, &image.found);
    let ignored = crowd_marks(&crowds, &image.found);
    let marks = right.into_iter().zip(ignored).enumerate();
    let hits =
        marks.map(|(place, (right, ignored))| Hit::new(image, place, [right, ignored & !right]));
    (hits.collect(), truth.len())
}

/// The boxes that are crowds, or those that are not.
fn boxes_of(image: &ImageBoxes<'_>, crowd: bool) -> Vec<BBox> {
    let boxes = image.truth.iter().filter(|truth| truth.crowd == crowd);
    boxes.map(|truth| truth.bbox).collect()
}

/// The thresholds at which each detection matches a box that no more confident one has matched.
fn right_marks(truth: &[BBox], found: &[&Detection]) -> Vec<Marks> {
    let index = BoxIndex::new(truth.iter().copied());
    let mut taken: Vec<Marks> = vec![0; truth.len()];
    let found = found.iter();
    found
        .map(|found| match nearest(truth, &index, found) {
            Some((truth, overlap)) => take_free(&mut taken[truth], reached(overlap)),
            None => 0,
        })
        .collect()
}

/// The thresholds that the share of each detection inside a crowd reaches.
fn crowd_marks(crowds: &[BBox], found: &[&Detection]) -> Vec<Marks> {
    let index = BoxIndex::new(crowds.iter().copied());
    let marks = |found: &&Detection| {
        let near = index.near(&found.bbox).into_iter();
        near.map(|crowd| reached(share_within(&crowds[crowd], &found.bbox)))
            .fold(0, |all, marks| all | marks)
    };
    found.iter().map(marks).collect()
}

fn share_within(crowd: &BBox, found: &BBox) -> f32 {
    share(intersection(crowd, found), area(found)) as f32
}

/// Takes a box at the thresholds that are reached; returns those at which it was still free.
fn take_free(taken: &mut Marks, reached: Marks) -> Marks {
    let free = reached & !*taken;
    *taken |= reached;
    free
}

/// The box that a detection overlaps most, the last of equal ones, as left by the original's
/// descending sort.
fn nearest(truth: &[BBox], index: &BoxIndex, found: &Detection) -> Option<(usize, f32)> {
    let near = index.near(&found.bbox).into_iter();
    let overlaps = near.map(|t| (t, overlap(&truth[t], &found.bbox)));
    overlaps.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Intersection over union in single precision.
fn overlap(a: &BBox, b: &BBox) -> f32 {
    let [a, b] = [corners_of(a), corners_of(b)];
    let shared = shared_area(a, b);
    shared / (area_of(a) + area_of(b) - shared + AREA_EPSILON)
}

/// Left, top, right, bottom in single precision.
#[inline]
fn corners_of(b: &BBox) -> [f32; 4] {
    [b.x0, b.y0, b.x1, b.y1].map(|v| v as f32)
}

#[inline]
fn shared_area(a: [f32; 4], b: [f32; 4]) -> f32 {
    (a[2].min(b[2]) - a[0].max(b[0])).max(0.0) * (a[3].min(b[3]) - a[1].max(b[1])).max(0.0)
}

#[inline]
fn area_of(b: [f32; 4]) -> f32 {
    (b[2] - b[0]) * (b[3] - b[1])
}

fn reached(overlap: f32) -> Marks {
    (0..THRESHOLDS)
        .filter(|&i| overlap >= threshold(i))
        .fold(0, |marks, i| marks | 1 << i)
}

/// Computed from both ends, as PyTorch's `linspace` rounds.
#[inline]
fn threshold(i: usize) -> f32 {
    let step = (0.95_f32 - 0.5) / (THRESHOLDS - 1) as f32;
    if i < THRESHOLDS / 2 {
        0.5 + step * i as f32
    } else {
        0.95 - step * (THRESHOLDS - 1 - i) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, crowd, found, sheet, there};
    use super::*;

    #[test]
    fn the_surer_of_two_that_name_a_box_counts() {
        let b = bbox(0.0, 0.0, 100.0, 100.0);
        let near = bbox(0.0, 0.0, 100.0, 90.0);
        let sheets = [sheet(
            vec![there(0, b)],
            vec![found(0, b, 0.5), found(0, near, 0.9)],
        )];
        let hits = rankings(&sheets).remove(0).hits;
        assert_eq!(hits[0].confidence, 0.9);
        // The more confident one overlaps by 0.9 (just below, with the original's epsilon); the
        // exact one gets only the remaining threshold.
        assert_eq!((hits[0].right | hits[1].right).count_ones(), 10);
        assert_eq!(hits[0].right & hits[1].right, 0);
        assert_eq!(hits[1].right & 1, 0);
    }

    #[test]
    fn a_class_that_was_never_found_scores_zero_and_counts() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let truth = vec![there(0, b), there(1, b)];
        let scores = yolov5(&[sheet(truth, vec![found(0, b, 0.5)])], &[]);
        assert_eq!(scores.classes[1].ap, [0.0; 10]);
        assert!((scores.map() - 0.995 / 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_crowd_need_not_be_found_and_what_lies_in_it_does_not_count() {
        let only_crowd = crowd(1, bbox(300.0, 0.0, 50.0, 50.0));
        let crowd = crowd(0, bbox(100.0, 0.0, 50.0, 50.0));
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let alarm = found(0, bbox(500.0, 0.0, 9.0, 9.0), 0.7);
        let plain = [sheet(vec![there(0, b)], vec![alarm, found(0, b, 0.5)])];
        let crowded = [sheet(
            vec![crowd, there(0, b), only_crowd],
            vec![
                found(0, bbox(105.0, 5.0, 9.0, 9.0), 0.9),
                alarm,
                found(0, crowd.bbox, 0.6),
                found(0, b, 0.5),
                found(1, only_crowd.bbox, 0.4),
            ],
        )];
        assert_eq!(yolov5(&crowded, &[]), yolov5(&plain, &[]));
        // Half of the detection is inside the crowd: it is ignored only at the first threshold.
        let half = found(0, bbox(145.0, 0.0, 10.0, 50.0), 0.9);
        let hits = rankings(&[sheet(vec![crowd], vec![half])]).remove(0).hits;
        assert_eq!((hits[0].right, hits[0].ignored), (0, 1));
    }

    #[test]
    fn other_classes_do_not_take_a_box() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let seen = vec![found(1, b, 0.9), found(0, b, 0.5)];
        let scores = yolov5(&[sheet(vec![there(0, b)], seen)], &[]);
        assert!((scores.map_at(0) - 0.995).abs() < 1e-12);
    }
}
