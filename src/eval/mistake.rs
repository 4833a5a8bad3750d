//! What a detector got wrong, box by box.

use super::overlap::{BoxIndex, iou};
use super::pairing::{Pair, pairs};
use super::{ConfusionOptions, EvalImage};
use rayon::prelude::*;
use std::cmp::Ordering;

/// How a detection or a box is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum MistakeKind {
    /// A detection where nothing is, or the second one of a box.
    FalseAlarm,
    /// A detection of a box of another class.
    WrongClass,
    /// A box that nothing was found for.
    Missed,
}

/// A box that is wrong, and the one nearest to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mistake {
    /// Which sheet.
    pub sheet: usize,
    /// What is wrong.
    pub kind: MistakeKind,
    /// The detection: of a miss the one that overlaps it most, however unsure, if any does.
    pub found: Option<usize>,
    /// The box of the truth: of a false alarm the one that it overlaps most, if any.
    pub truth: Option<usize>,
    /// How much the two overlap (intersection over union).
    pub iou: f64,
}

/// All mistakes by the pairs that a [`Confusion`](super::Confusion) counts, the worst first: of detections the surest,
/// of misses the box with the most area that no detection covers.
pub fn mistakes(sheets: &[EvalImage], options: &ConfusionOptions) -> Vec<Mistake> {
    let of_sheet = |(i, sheet): (usize, &EvalImage)| -> Vec<(f64, Mistake)> {
        let mistakes = in_sheet(i, sheet, options);
        mistakes
            .into_iter()
            .map(|m| (badness(sheet, &m), m))
            .collect()
    };
    let mut all: Vec<(f64, Mistake)> = sheets
        .par_iter()
        .enumerate()
        .flat_map_iter(of_sheet)
        .collect();
    let worse = |a: &(f64, Mistake), b: &(f64, Mistake)| -> Ordering {
        (a.1.kind == MistakeKind::Missed)
            .cmp(&(b.1.kind == MistakeKind::Missed))
            .then(b.0.total_cmp(&a.0))
    };
    all.sort_by(worse);
    all.into_iter().map(|(_, mistake)| mistake).collect()
}

fn in_sheet(place: usize, sheet: &EvalImage, options: &ConfusionOptions) -> Vec<Mistake> {
    let truth = BoxIndex::new(sheet.truth.iter().map(|t| t.bbox));
    let found = BoxIndex::new(sheet.found.iter().map(|f| f.bbox));
    let overlap = |f: usize, t: usize| iou(&sheet.found[f].bbox, &sheet.truth[t].bbox);
    let most = |near: Vec<usize>, overlap: &dyn Fn(usize) -> f64| -> Option<(usize, f64)> {
        near.into_iter()
            .map(|i| (i, overlap(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let mistake = |pair: Pair| match pair {
        Pair {
            found: Some(f),
            truth: Some(t),
        } => {
            let wrong = sheet.found[f].class != sheet.truth[t].class;
            wrong.then(|| Mistake {
                sheet: place,
                kind: MistakeKind::WrongClass,
                found: Some(f),
                truth: Some(t),
                iou: overlap(f, t),
            })
        }
        Pair {
            found: Some(f),
            truth: None,
        } => {
            let nearest = most(truth.near(&sheet.found[f].bbox), &|t| overlap(f, t));
            let (truth, iou) = nearest.map_or((None, 0.0), |(t, iou)| (Some(t), iou));
            Some(Mistake {
                sheet: place,
                kind: MistakeKind::FalseAlarm,
                found: Some(f),
                truth,
                iou,
            })
        }
        Pair {
            found: None,
            truth: Some(t),
        } => {
            let nearest = most(found.near(&sheet.truth[t].bbox), &|f| overlap(f, t));
            let (found, iou) = nearest.map_or((None, 0.0), |(f, iou)| (Some(f), iou));
            Some(Mistake {
                sheet: place,
                kind: MistakeKind::Missed,
                found,
                truth: Some(t),
                iou,
            })
        }
        Pair {
            found: None,
            truth: None,
        } => None,
    };
    pairs(sheet, options)
        .into_iter()
        .filter_map(mistake)
        .collect()
}

fn badness(sheet: &EvalImage, mistake: &Mistake) -> f64 {
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
