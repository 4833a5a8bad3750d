//! Curves over confidence and over recall, at threshold 0.5.

use super::average::{self, RECALL_POINTS};
use super::yolov5::{self, CONFIDENCE_STEPS, Ranked, best_confidence, confidence};
use super::{EvalImage, mean};

/// Curves of every class that occurs in the truth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// The classes.
    pub classes: Vec<u32>,
    /// Per class: recall and the precision there, by decreasing confidence.
    pub precision_recall: Vec<Vec<[f64; 2]>>,
    /// Per class: confidence and F1.
    pub f1: Vec<Vec<[f64; 2]>>,
    /// Mean precision of the classes, from the envelope, at recalls of 0, 0.01 .. 1.
    pub mean_precision: Vec<[f64; 2]>,
    /// Confidence and mean F1 of the classes.
    pub mean_f1: Vec<[f64; 2]>,
    /// Where the smoothed mean F1 of the classes is greatest.
    pub best_confidence: f64,
}

/// Precision over recall, and F1 over confidence, at intersection over union 0.5, matched as by
/// [`yolov5`](super::yolov5()).
pub fn curves(sheets: &[EvalImage]) -> Curves {
    let rankings = yolov5::rankings(sheets);
    let ranked = yolov5::ranked(&rankings, &[]);
    let f1: Vec<_> = ranked.iter().map(f1).collect();
    Curves {
        mean_precision: mean_precision(&ranked),
        mean_f1: mean_over(&f1),
        classes: ranked.iter().map(|r| r.ranking.class).collect(),
        precision_recall: ranked.iter().map(precision_recall).collect(),
        f1,
        best_confidence: confidence(best_confidence(&ranked)),
    }
}

fn precision_recall(ranked: &Ranked<'_>) -> Vec<[f64; 2]> {
    let pairs = ranked.recall.iter().zip(&ranked.precision);
    thinned(pairs)
        .map(|(&recall, &precision)| [recall, precision])
        .collect()
}

/// About [`RECALL_POINTS`] of the points, evenly spaced, and the last one.
fn thinned<T>(points: impl ExactSizeIterator<Item = T>) -> impl Iterator<Item = T> {
    let count = points.len();
    let step = count.div_ceil(RECALL_POINTS).max(1);
    points
        .enumerate()
        .filter(move |(i, _)| i % step == 0 || i + 1 == count)
        .map(|(_, point)| point)
}

fn mean_precision(ranked: &[Ranked<'_>]) -> Vec<[f64; 2]> {
    let curves: Vec<_> = ranked.iter().map(sampled_precision).collect();
    mean_over(&curves)
}

fn sampled_precision(ranked: &Ranked<'_>) -> Vec<[f64; 2]> {
    let samples = average::samples(&ranked.recall, &ranked.precision);
    let recalls = (0..).map(average::recall_at);
    recalls.zip(samples).map(|(x, y)| [x, y]).collect()
}

/// The mean of curves with points at the same positions.
fn mean_over(curves: &[Vec<[f64; 2]>]) -> Vec<[f64; 2]> {
    let first = curves.first().into_iter().flatten();
    first
        .enumerate()
        .map(|(i, [x, _])| [*x, mean(curves.iter().map(|curve| curve[i][1]))])
        .collect()
}

fn f1(ranked: &Ranked<'_>) -> Vec<[f64; 2]> {
    (0..CONFIDENCE_STEPS)
        .step_by(CONFIDENCE_STEPS / RECALL_POINTS)
        .map(|i| [confidence(i), ranked.f1_at(confidence(i))])
        .collect()
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
        let f1 = |c: f64| {
            curves.f1[0]
                .iter()
                .min_by(|a, b| (a[0] - c).abs().total_cmp(&(b[0] - c).abs()))
                .unwrap()[1]
        };
        assert!(f1(0.3) > 0.99 && f1(0.9) < 0.01);
        assert!(curves.best_confidence < 0.6);
        assert_eq!(curves.precision_recall, [[[1.0, 1.0]]]);
        assert!(
            curves.mean_precision.len() == 101 && curves.mean_precision.iter().all(|p| p[1] == 1.0)
        );
        assert_eq!(curves.mean_f1, curves.f1[0]);
    }
}
