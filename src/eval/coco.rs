//! Average precision and recall as the COCO tools compute them.

use super::average::{mean_of_samples, recall_and_precision};
use super::overlap::{area, intersection, share};
use super::rank::{self, Hit, Marks};
use super::{ClassScores, Definition, FoundBox, Scores, Sheet, THRESHOLDS, TrueBox, mean, thresholds};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// No more detections of a class than this count in an image: the surest.
pub const MAX_DETECTIONS: [usize; 3] = [1, 10, 100];
/// Keeps a precision defined: the distance of 1 to the next number, as in the original.
const EPSILON: f64 = f64::EPSILON;
/// No overlap reaches 1 for sure.
const ALMOST_ONE: f64 = 1.0 - 1e-10;

/// Objects of which size are looked for; the others count for nobody.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AreaRange {
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
    /// Average recall over objects of all sizes with 1, 10 and 100 detections an image.
    pub ar_by_count: [Option<f64>; 3],
    /// Average recall of small, medium and large objects with 100 detections an image.
    pub ar_by_area: [Option<f64>; 3],
}

impl AreaRange {
    const SIZES: [Self; 3] = [Self::Small, Self::Medium, Self::Large];

    /// Least and greatest area, square pixels, both included.
    pub fn limits(self) -> [f64; 2] {
        match self {
            Self::All => [0.0, 1e10],
            Self::Small => [0.0, 1024.0],
            Self::Medium => [1024.0, 9216.0],
            Self::Large => [9216.0, 1e10],
        }
    }

    fn holds(self, area: f64) -> bool {
        let [low, high] = self.limits();
        (low..=high).contains(&area)
    }
}

/// Average precision and recall by the definition of the COCO tools.
///
/// # Method
/// `COCOeval` of pycocotools 2.0 for boxes.
///
/// # Panics
/// When there are weights and not one per sheet.
pub fn coco(sheets: &[Sheet], weights: &[u32]) -> CocoScores {
    assert!(weights.is_empty() || weights.len() == sheets.len(), "one weight per sheet");
    let classes = rank::classes(sheets);
    let measure = |range, count| -> Vec<Measured> {
        classes.par_iter().filter_map(|&class| Measured::new(sheets, class, range, count, weights)).collect()
    };
    let [few, some, most] = MAX_DETECTIONS;
    let all = measure(AreaRange::All, most);
    let by_area = AreaRange::SIZES.map(|range| measure(range, most));
    CocoScores {
        ap_by_area: by_area.each_ref().map(|m| over(m, |m| mean(m.ap))),
        ar_by_count: [
            over(&measure(AreaRange::All, few), Measured::mean_recall),
            over(&measure(AreaRange::All, some), Measured::mean_recall),
            over(&all, Measured::mean_recall),
        ],
        ar_by_area: by_area.each_ref().map(|m| over(m, Measured::mean_recall)),
        scores: Scores { definition: Definition::Coco, classes: all.iter().map(Measured::scores).collect() },
    }
}

fn over(measured: &[Measured], value: impl Fn(&Measured) -> f64) -> Option<f64> {
    (!measured.is_empty()).then(|| mean(measured.iter().map(value)))
}

/// One class, one range of sizes, one number of detections an image.
struct Measured {
    class: u32,
    truths: f64,
    ap: [f64; THRESHOLDS],
    recall: [f64; THRESHOLDS],
    precision: f64,
}

impl Measured {
    /// None for a class without an object in the range.
    fn new(sheets: &[Sheet], class: u32, range: AreaRange, count: usize, weights: &[u32]) -> Option<Self> {
        let each: Vec<(Vec<Hit>, usize)> =
            sheets.par_iter().enumerate().map(|(i, sheet)| held_against(sheet, i, class, range, count)).collect();
        let truths: f64 = each.iter().enumerate().map(|(i, e)| rank::weight(weights, i) * e.1 as f64).sum();
        let mut hits: Vec<Hit> = each.into_iter().flat_map(|(hits, _)| hits).collect();
        rank::sort(&mut hits);
        let curve = |t| recall_and_precision(&rank::running(&hits, t, weights), truths, [0.0, EPSILON]);
        let curves: [(Vec<f64>, Vec<f64>); THRESHOLDS] = std::array::from_fn(curve);
        (truths > 0.0).then(|| Self {
            class,
            truths,
            ap: curves.each_ref().map(|(recall, precision)| mean_of_samples(recall, precision)),
            recall: curves.each_ref().map(|(recall, _)| recall.last().copied().unwrap_or(0.0)),
            precision: curves[0].1.last().copied().unwrap_or(0.0),
        })
    }

    fn mean_recall(&self) -> f64 {
        mean(self.recall)
    }

    fn scores(&self) -> ClassScores {
        let Self { class, truths, ap, recall, precision } = *self;
        ClassScores { class, truths: truths as u64, precision, recall: recall[0], ap }
    }
}

/// A box of the truth as one range of sizes sees it.
struct Target<'a> {
    truth: &'a TrueBox,
    /// It counts for nobody.
    ignored: bool,
    taken: Marks,
}

/// The detections of a class in one image, and how many boxes there are to be found.
fn held_against(sheet: &Sheet, place: usize, class: u32, range: AreaRange, count: usize) -> (Vec<Hit>, usize) {
    let target = |truth| Target { truth, ignored: truth.crowd || !range.holds(truth.area), taken: 0 };
    let mut targets: Vec<Target<'_>> = sheet.truth.iter().filter(|t| t.class == class).map(target).collect();
    // Those that count come first: a detection takes an ignored box only where none of them is left.
    targets.sort_by_key(|t| t.ignored);
    let mut found: Vec<&FoundBox> = sheet.found.iter().filter(|f| f.class == class).collect();
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    found.truncate(count);
    let hits = found.into_iter().map(|f| hit(f, place, &mut targets, range)).collect();
    (hits, targets.iter().filter(|t| !t.ignored).count())
}

fn hit(found: &FoundBox, place: usize, targets: &mut [Target<'_>], range: AreaRange) -> Hit {
    let overlaps: Vec<f64> = targets.iter().map(|t| overlap(found, t.truth)).collect();
    let (mut right, mut ignored) = (0, 0);
    for (i, threshold) in thresholds().into_iter().enumerate() {
        let bit: Marks = 1 << i;
        match nearest(targets, &overlaps, threshold, bit) {
            Some(k) => {
                targets[k].taken |= bit;
                if targets[k].ignored { ignored |= bit } else { right |= bit }
            }
            None if !range.holds(area(&found.bbox)) => ignored |= bit,
            None => {}
        }
    }
    Hit { confidence: found.confidence, sheet: place, right, ignored }
}

/// The free target with the greatest overlap from `threshold` on, the last of equal ones; those that count before
/// ignored ones.
fn nearest(targets: &[Target<'_>], overlaps: &[f64], threshold: f64, bit: Marks) -> Option<usize> {
    let mut least = threshold.min(ALMOST_ONE);
    let mut best: Option<usize> = None;
    for (k, (target, &overlap)) in targets.iter().zip(overlaps).enumerate() {
        if target.taken & bit != 0 && !target.truth.crowd {
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

/// Intersection over union; over the detection's own area where the truth is a crowd.
fn overlap(found: &FoundBox, truth: &TrueBox) -> f64 {
    let shared = intersection(&found.bbox, &truth.bbox);
    let whole = if truth.crowd { area(&found.bbox) } else { area(&found.bbox) + area(&truth.bbox) - shared };
    share(shared, whole)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn a_crowd_is_neither_found_nor_missed() {
        let (b, crowd) = (bbox(0.0, 0.0, 40.0, 40.0), bbox(100.0, 0.0, 200.0, 200.0));
        let in_crowd = [found(0, bbox(110.0, 10.0, 30.0, 30.0), 0.9), found(0, bbox(150.0, 10.0, 30.0, 30.0), 0.8)];
        let truth = vec![there(0, b), TrueBox { crowd: true, ..there(0, crowd) }];
        let scores = coco(&[sheet(truth, [vec![found(0, b, 0.5)], in_crowd.to_vec()].concat())], &[]);
        assert!((scores.scores.map() - 1.0).abs() < 1e-12);
        assert_eq!(scores.scores.classes[0].truths, 1);
    }

    #[test]
    fn sizes_are_scored_apart() {
        let (small, large) = (bbox(0.0, 0.0, 20.0, 20.0), bbox(100.0, 100.0, 200.0, 200.0));
        let scores = coco(&[sheet(vec![there(0, small), there(0, large)], vec![found(0, large, 0.5)])], &[]);
        let whole = |v: Option<f64>| v.map(|v| (v * 1e12).round() / 1e12);
        assert_eq!(scores.ap_by_area.map(whole), [Some(0.0), None, Some(1.0)]);
        assert_eq!(scores.ar_by_area, [Some(0.0), None, Some(1.0)]);
    }

    #[test]
    fn more_than_a_hundred_detections_do_not_count() {
        let b = bbox(0.0, 0.0, 20.0, 20.0);
        let noise = (0..100).map(|i| found(0, bbox(100.0 + f64::from(i), 50.0, 9.0, 9.0), 0.9));
        let scores = coco(&[sheet(vec![there(0, b)], noise.chain([found(0, b, 0.1)]).collect())], &[]);
        assert_eq!((scores.scores.map(), scores.ar_by_count), (0.0, [Some(0.0); 3]));
    }
}
