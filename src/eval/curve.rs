//! Curves over confidence and over recall, at threshold 0.5.

use super::yolov5::{CONFIDENCES, Ranked, best_confidence, confidence};
use super::{Sheet, rank};
use rayon::prelude::*;

/// How many points of a curve are kept.
const POINTS: usize = 101;

/// Curves of every class that occurs in the truth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// The classes.
    pub classes: Vec<u32>,
    /// Per class: recall and the precision there, from the surest detection on.
    pub precision_recall: Vec<Vec<[f64; 2]>>,
    /// Per class: confidence and F1.
    pub f1: Vec<Vec<[f64; 2]>>,
    /// Where the mean F1 of the classes, smoothed, is greatest.
    pub best_confidence: f64,
}

/// Precision over recall, and F1 over confidence, at intersection over union 0.5, matched as by
/// [`yolov5`](super::yolov5()).
pub fn curves(sheets: &[Sheet]) -> Curves {
    let ranked: Vec<Ranked> =
        rank::classes(sheets).into_par_iter().filter_map(|class| Ranked::new(sheets, class, &[])).collect();
    Curves {
        classes: ranked.iter().map(|r| r.class).collect(),
        precision_recall: ranked.iter().map(precision_recall).collect(),
        f1: ranked.iter().map(f1).collect(),
        best_confidence: confidence(best_confidence(&ranked)),
    }
}

fn precision_recall(ranked: &Ranked) -> Vec<[f64; 2]> {
    let all: Vec<[f64; 2]> = ranked.recall.iter().zip(&ranked.precision).map(|(&r, &p)| [r, p]).collect();
    let last = all.len().saturating_sub(1);
    let step = all.len().div_ceil(POINTS).max(1);
    all.into_iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last).map(|(_, p)| p).collect()
}

fn f1(ranked: &Ranked) -> Vec<[f64; 2]> {
    let at = |i| [confidence(i), ranked.f1_at(confidence(i))];
    (0..CONFIDENCES).step_by(CONFIDENCES / POINTS).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn f1_falls_where_right_detections_are_no_longer_taken() {
        let b = bbox(0.0, 0.0, 10.0, 10.0);
        let curves = curves(&[sheet(vec![there(2, b)], vec![found(2, b, 0.6)])]);
        assert_eq!(curves.classes, [2]);
        let f1 = |c: f64| curves.f1[0].iter().min_by(|a, b| (a[0] - c).abs().total_cmp(&(b[0] - c).abs())).unwrap()[1];
        assert!(f1(0.3) > 0.99 && f1(0.9) < 0.01);
        assert!(curves.best_confidence < 0.6);
        assert_eq!(curves.precision_recall, [[[1.0, 1.0]]]);
    }
}
