//! Detections of one class from all images, the surest first.

use super::{Sheet, THRESHOLDS};
use std::collections::BTreeSet;

/// Bits, one per threshold.
pub(super) type Marks = u16;

/// A detection after it was held against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    pub(super) confidence: f64,
    /// Which sheet it is from.
    pub(super) sheet: usize,
    /// Thresholds at which it found something.
    pub(super) right: Marks,
    /// Thresholds at which it counts for nobody.
    pub(super) ignored: Marks,
}

/// Running sums of true and false positives at one threshold, the surest detection first.
pub(super) struct Running {
    pub(super) right: Vec<f64>,
    pub(super) wrong: Vec<f64>,
}

/// How often an image counts.
pub(super) fn weight(weights: &[u32], sheet: usize) -> f64 {
    if weights.is_empty() { 1.0 } else { f64::from(weights[sheet]) }
}

/// The surest first; equal ones keep their order.
pub(super) fn sort(hits: &mut [Hit]) {
    hits.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
}

/// Sums at a threshold. Images that do not count are left out.
pub(super) fn running(hits: &[Hit], threshold: usize, weights: &[u32]) -> Running {
    debug_assert!(threshold < THRESHOLDS);
    let (mut right, mut wrong) = (0.0, 0.0);
    let mut sums = Running { right: Vec::with_capacity(hits.len()), wrong: Vec::with_capacity(hits.len()) };
    for hit in hits {
        let count = weight(weights, hit.sheet);
        if count == 0.0 {
            continue;
        }
        let bit = |marks: Marks| marks >> threshold & 1 == 1;
        match (bit(hit.ignored), bit(hit.right)) {
            (true, _) => {}
            (_, true) => right += count,
            _ => wrong += count,
        }
        sums.right.push(right);
        sums.wrong.push(wrong);
    }
    sums
}

/// The classes that occur, in order.
pub(super) fn classes(sheets: &[Sheet]) -> Vec<u32> {
    let all: BTreeSet<u32> = sheets.iter().flat_map(|s| s.truth.iter().map(|t| t.class)).collect();
    all.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_confidences_keep_their_order() {
        let hit = |confidence, sheet| Hit { confidence, sheet, right: 0, ignored: 0 };
        let mut hits = [hit(0.5, 0), hit(0.9, 1), hit(0.5, 2)];
        sort(&mut hits);
        assert_eq!(hits.map(|h| h.sheet), [1, 0, 2]);
    }

    #[test]
    fn ignored_detections_move_neither_sum() {
        let hits = [(1, 0), (0, 1), (0, 0)].map(|(right, ignored)| Hit { confidence: 0.5, sheet: 0, right, ignored });
        let sums = running(&hits, 0, &[]);
        assert_eq!((sums.right, sums.wrong), (vec![1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0]));
    }
}
