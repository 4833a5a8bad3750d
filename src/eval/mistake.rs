//! What a detector got wrong, box by box.

use super::overlap::{BoxIndex, iou};
use super::pairing::{BoxPair, pairs};
use super::{ConfusionOptions, EvalImage};
use rayon::prelude::*;
use std::cmp::Ordering;

/// How a detection or a box is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MistakeKind {
    /// A detection where there is nothing, or a second one of the same box.
    FalseAlarm,
    /// A detection of a box of another class.
    WrongClass,
    /// A box without a detection.
    Missed,
}

/// A wrong box, and the one that it overlaps most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mistake {
    /// The index of the sheet.
    pub sheet: usize,
    /// What is wrong.
    pub kind: MistakeKind,
    /// The detection; for a miss the one that overlaps it most, at any confidence, if any does.
    pub found: Option<usize>,
    /// The ground-truth box; for a false positive the one that it overlaps most, if any.
    pub truth: Option<usize>,
    /// How much the two overlap (intersection over union).
    pub iou: f64,
}

/// All mistakes by the pairs that a [`Confusion`](super::Confusion) counts, the worst first: the
/// most confident detections, and the missed boxes with the largest area that no detection covers.
pub fn mistakes(sheets: &[EvalImage], options: &ConfusionOptions) -> Vec<Mistake> {
    let numbered = sheets.par_iter().enumerate();
    let mut all: Vec<(f64, Mistake)> = numbered
        .flat_map_iter(|(i, sheet)| rated_mistakes(i, sheet, options))
        .collect();
    all.sort_by(worst_first);
    all.into_iter().map(|(_, mistake)| mistake).collect()
}

/// The mistakes of one image, each with its severity.
fn rated_mistakes(
    i: usize,
    sheet: &EvalImage,
    options: &ConfusionOptions,
) -> impl Iterator<Item = (f64, Mistake)> {
    let mistakes = MistakeFinder::new(i, sheet).find(options);
    mistakes.into_iter().map(|m| (severity(sheet, &m), m))
}

/// Detections before misses; the most severe of each kind first.
fn worst_first(a: &(f64, Mistake), b: &(f64, Mistake)) -> Ordering {
    let by_kind = a.1.is_miss().cmp(&b.1.is_miss());
    by_kind.then(b.0.total_cmp(&a.0))
}

impl Mistake {
    pub(super) fn is_miss(&self) -> bool {
        self.kind == MistakeKind::Missed
    }
}

/// Finds the mistakes of one image.
struct MistakeFinder<'a> {
    place: usize,
    sheet: &'a EvalImage,
    truth: BoxIndex,
    found: BoxIndex,
}

impl<'a> MistakeFinder<'a> {
    fn new(place: usize, sheet: &'a EvalImage) -> Self {
        Self {
            place,
            sheet,
            truth: BoxIndex::for_truth(sheet),
            found: BoxIndex::for_found(sheet),
        }
    }

    fn find(&self, options: &ConfusionOptions) -> Vec<Mistake> {
        pairs(self.sheet, options)
            .into_iter()
            .filter_map(|pair| self.mistake_in(pair))
            .collect()
    }

    fn mistake_in(&self, pair: BoxPair) -> Option<Mistake> {
        match (pair.found, pair.truth) {
            (Some(f), Some(t)) => self.wrong_class(f, t),
            (Some(f), None) => Some(self.false_alarm(f)),
            (None, Some(t)) => Some(self.missed(t)),
            (None, None) => None,
        }
    }

    fn wrong_class(&self, f: usize, t: usize) -> Option<Mistake> {
        let is_wrong = self.sheet.found[f].class != self.sheet.truth[t].class;
        let pair = [Some(f), Some(t)];
        is_wrong.then(|| self.mistake(MistakeKind::WrongClass, pair, self.overlap(f, t)))
    }

    fn false_alarm(&self, f: usize) -> Mistake {
        let (truth, iou) = self.nearest_truth(f).unzip();
        self.mistake(
            MistakeKind::FalseAlarm,
            [Some(f), truth],
            iou.unwrap_or(0.0),
        )
    }

    fn missed(&self, t: usize) -> Mistake {
        let (found, iou) = self.nearest_found(t).unzip();
        self.mistake(MistakeKind::Missed, [found, Some(t)], iou.unwrap_or(0.0))
    }

    fn mistake(&self, kind: MistakeKind, pair: [Option<usize>; 2], iou: f64) -> Mistake {
        let [found, truth] = pair;
        Mistake {
            sheet: self.place,
            kind,
            found,
            truth,
            iou,
        }
    }

    /// The box that a detection overlaps most, and how much.
    fn nearest_truth(&self, f: usize) -> Option<(usize, f64)> {
        let near = self.truth.near(&self.sheet.found[f].bbox);
        greatest(near, |t| self.overlap(f, t))
    }

    /// The detection that overlaps a box most, and how much.
    fn nearest_found(&self, t: usize) -> Option<(usize, f64)> {
        let near = self.found.near(&self.sheet.truth[t].bbox);
        greatest(near, |f| self.overlap(f, t))
    }

    fn overlap(&self, f: usize, t: usize) -> f64 {
        iou(&self.sheet.found[f].bbox, &self.sheet.truth[t].bbox)
    }
}

/// The box with the greatest overlap, the last of equal ones.
fn greatest(boxes: Vec<usize>, overlap: impl Fn(usize) -> f64) -> Option<(usize, f64)> {
    boxes
        .into_iter()
        .map(|i| (i, overlap(i)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
}

fn severity(sheet: &EvalImage, mistake: &Mistake) -> f64 {
    match (mistake.kind, mistake.truth, mistake.found) {
        (MistakeKind::Missed, Some(t), _) => sheet.truth[t].area * (1.0 - mistake.iou),
        (_, _, Some(f)) => sheet.found[f].confidence,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn the_worst_come_first_with_what_is_nearest_to_them() {
        let (small, large) = (bbox(0.0, 0.0, 10.0, 10.0), bbox(50.0, 0.0, 40.0, 40.0));
        let aside = bbox(50.0, 30.0, 40.0, 40.0);
        let seen = vec![
            found(0, bbox(200.0, 0.0, 9.0, 9.0), 0.5),
            found(1, small, 0.9),
            found(0, aside, 0.3),
        ];
        let all = mistakes(
            &[sheet(vec![there(0, small), there(1, large)], seen)],
            &Default::default(),
        );
        let told = |m: &Mistake| (m.kind, m.found, m.truth);
        assert_eq!(
            all.iter().map(told).collect::<Vec<_>>(),
            [
                (MistakeKind::WrongClass, Some(1), Some(0)),
                (MistakeKind::FalseAlarm, Some(0), None),
                (MistakeKind::FalseAlarm, Some(2), Some(1)),
                (MistakeKind::Missed, Some(2), Some(1)),
            ]
        );
        assert!((all[3].iou - 400.0 / 2800.0).abs() < 1e-12);
    }
}
