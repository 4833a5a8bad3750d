//! Which detection is matched with which box, whatever their classes.

use super::overlap::{BoxIndex, area, intersection, iou, share};
use super::{ConfusionOptions, EvalImage};
use crate::geom::BBox;
use std::collections::BinaryHeap;

/// A detection and the box that it is matched with, by their indices in the sheet: without a box it
/// is a false positive, without a detection a miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BoxPair {
    pub(super) found: Option<usize>,
    pub(super) truth: Option<usize>,
}

/// Every detection and every box that counts, once. Pairs are formed by decreasing overlap;
/// detections in a crowd are ignored.
pub(super) fn pairs(sheet: &EvalImage, options: &ConfusionOptions) -> Vec<BoxPair> {
    let mut search = PairSearch::new(sheet, options);
    let sure = sure_detections(sheet, options.confidence);
    let matched = search.match_boxes(&sure);
    let pairs = sure.iter().map(|&f| BoxPair {
        found: Some(f),
        truth: matched[f],
    });
    pairs
        .filter(|pair| pair.truth.is_some() || !search.in_crowd(pair.found))
        .chain(search.missed())
        .collect()
}

/// Indices of the detections above this confidence.
fn sure_detections(sheet: &EvalImage, confidence: f64) -> Vec<usize> {
    let places = 0..sheet.found.len();
    places
        .filter(|&f| sheet.found[f].confidence > confidence)
        .collect()
}

/// A detection and the free box that it overlaps most. Candidates are ordered by decreasing
/// overlap; of equal overlaps the first box comes first, then the first detection.
#[derive(Clone, Copy, PartialEq)]
struct PairCandidate {
    overlap: f64,
    truth: usize,
    found: usize,
}

impl Eq for PairCandidate {}

impl Ord for PairCandidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let by_overlap = self.overlap.total_cmp(&other.overlap);
        by_overlap.then_with(|| (other.truth, other.found).cmp(&(self.truth, self.found)))
    }
}

impl PartialOrd for PairCandidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

struct PairSearch<'a> {
    sheet: &'a EvalImage,
    index: BoxIndex,
    taken: Vec<bool>,
    min_iou: f64,
}

impl<'a> PairSearch<'a> {
    fn new(sheet: &'a EvalImage, options: &ConfusionOptions) -> Self {
        Self {
            sheet,
            index: BoxIndex::for_truth(sheet),
            taken: vec![false; sheet.truth.len()],
            min_iou: options.iou,
        }
    }

    /// The box that each detection is matched with.
    fn match_boxes(&mut self, found: &[usize]) -> Vec<Option<usize>> {
        let mut open: BinaryHeap<PairCandidate> =
            found.iter().filter_map(|&f| self.best(f)).collect();
        let mut matched = vec![None; self.sheet.found.len()];
        while let Some(PairCandidate { truth, found, .. }) = open.pop() {
            if self.taken[truth] {
                // Its box is taken; the set of free boxes only shrinks, so its next one overlaps no
                // more than this one did.
                open.extend(self.best(found));
            } else {
                self.taken[truth] = true;
                matched[found] = Some(truth);
            }
        }
        matched
    }

    /// The boxes without a detection.
    fn missed(&self) -> impl Iterator<Item = BoxPair> {
        (0..self.sheet.truth.len())
            .filter(|&t| self.is_open(t))
            .map(|t| BoxPair {
                found: None,
                truth: Some(t),
            })
    }

    /// Whether a box is still unmatched.
    fn is_open(&self, t: usize) -> bool {
        !self.taken[t] && !self.sheet.truth[t].crowd
    }

    fn best(&self, found: usize) -> Option<PairCandidate> {
        let near = self.index.near(&self.sheet.found[found].bbox);
        near.into_iter()
            .filter(|&t| self.is_open(t))
            .map(|t| self.candidate(t, found))
            .filter(|candidate| candidate.overlap > self.min_iou)
            .max()
    }

    fn candidate(&self, truth: usize, found: usize) -> PairCandidate {
        PairCandidate {
            overlap: self.overlap(truth, found),
            truth,
            found,
        }
    }

    fn overlap(&self, t: usize, f: usize) -> f64 {
        iou(&self.sheet.truth[t].bbox, &self.sheet.found[f].bbox)
    }

    /// As in the COCO tools, by the share of the detection that is inside a crowd.
    fn in_crowd(&self, found: Option<usize>) -> bool {
        found.is_some_and(|f| {
            let bbox = &self.sheet.found[f].bbox;
            let near = self.index.near(bbox);
            near.into_iter().any(|t| self.is_in_crowd(bbox, t))
        })
    }

    /// Whether enough of a detection is inside this box, and the box is a crowd.
    fn is_in_crowd(&self, bbox: &BBox, t: usize) -> bool {
        let truth = &self.sheet.truth[t];
        truth.crowd && share(intersection(bbox, &truth.bbox), area(bbox)) > self.min_iou
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, crowd, found, sheet, there};
    use super::super::{Detection, GroundTruth};
    use super::*;
    use proptest::prelude::*;

    /// All pairs in order of overlap: the brute-force equivalent of the search above.
    fn by_sorting(sheet: &EvalImage, least: f64) -> Vec<(usize, usize)> {
        let each = (0..sheet.truth.len()).flat_map(|t| (0..sheet.found.len()).map(move |f| (t, f)));
        let mut all: Vec<_> = each
            .map(|(t, f)| (iou(&sheet.truth[t].bbox, &sheet.found[f].bbox), t, f))
            .collect();
        all.retain(|pair| pair.0 > least);
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut truths, mut names) = (vec![], vec![]);
        let mut pairs = Vec::new();
        for (_, t, f) in all {
            if !truths.contains(&t) && !names.contains(&f) {
                truths.push(t);
                names.push(f);
                pairs.push((t, f));
            }
        }
        pairs.sort_unstable();
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn pairs_are_those_of_a_sorted_list_of_all(
            truth in prop::collection::vec([0_u8..30, 0..30, 1..20, 1..20], 0..40),
            seen in prop::collection::vec([0_u8..30, 0..30, 1..20, 1..20], 0..40),
        ) {
            let made = |[x, y, w, h]: [u8; 4]| bbox(x.into(), y.into(), w.into(), h.into());
            let truth: Vec<GroundTruth> = truth.into_iter().map(|b| there(0, made(b))).collect();
            let seen: Vec<Detection> = seen.into_iter().map(|b| found(0, made(b), 0.9)).collect();
            let sheet = sheet(truth, seen);
            let mut made: Vec<_> = pairs(&sheet, &Default::default())
                .iter().filter_map(|p| p.truth.zip(p.found)).collect();
            made.sort_unstable();
            prop_assert_eq!(made, by_sorting(&sheet, 0.45));
        }
    }

    #[test]
    fn a_crowd_is_not_missed_and_what_lies_in_it_is_no_alarm() {
        let truth = vec![
            there(0, bbox(0.0, 0.0, 10.0, 10.0)),
            crowd(0, bbox(50.0, 0.0, 100.0, 100.0)),
        ];
        let seen = vec![
            found(0, bbox(60.0, 10.0, 9.0, 9.0), 0.9),
            found(0, bbox(300.0, 0.0, 9.0, 9.0), 0.9),
        ];
        let expected = [(Some(1), None), (None, Some(0))];
        let expected = expected.map(|(found, truth)| BoxPair { found, truth });
        assert_eq!(pairs(&sheet(truth, seen), &Default::default()), expected);
    }
}
