//! Which class is found for which true class.

use super::EvalImage;
use super::pairing::{BoxPair, pairs};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// How often each class was found for each true class; none stands for the background. Combinations
/// that never occur take no space.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Confusion {
    /// Found and true class, none for the background, and how often they occur.
    pub counts: BTreeMap<[Option<u32>; 2], u64>,
}

/// Which detections are considered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConfusionOptions {
    /// Minimum confidence, exclusive. Default: 0.25, as in YOLOv5.
    pub confidence: f64,
    /// Minimum intersection over union, exclusive, of a detection and its box. Default: 0.45, as in
    /// YOLOv5.
    pub iou: f64,
}

impl Default for ConfusionOptions {
    fn default() -> Self {
        Self {
            confidence: 0.25,
            iou: 0.45,
        }
    }
}

/// The classes of the detection and of the box that it is matched with.
fn classes_in(sheet: &EvalImage, pair: BoxPair) -> [Option<u32>; 2] {
    [
        pair.found.map(|f| sheet.found[f].class),
        pair.truth.map(|t| sheet.truth[t].class),
    ]
}

impl Confusion {
    /// Counts over all images, whatever the classes of two boxes that overlap. Pairs are formed by
    /// decreasing overlap; crowds, and detections in them, are ignored.
    pub fn new(sheets: &[EvalImage], options: &ConfusionOptions) -> Self {
        let mut confusion = Self::default();
        for sheet in sheets {
            for pair in pairs(sheet, options) {
                let classes = classes_in(sheet, pair);
                *confusion.counts.entry(classes).or_default() += 1;
            }
        }
        confusion
    }

    /// The classes that occur.
    pub fn classes(&self) -> BTreeSet<u32> {
        self.counts.keys().flatten().flatten().copied().collect()
    }

    /// The classes that occur, sorted by how many boxes are missed, found where there is nothing,
    /// or confused with another class, most first; equal ones by their number of boxes.
    pub fn worst(&self) -> Vec<u32> {
        let sums = self.sums_by_class();
        let mut classes: Vec<u32> = sums.keys().copied().collect();
        classes.sort_by_key(|class| std::cmp::Reverse(sums[class]));
        classes
    }

    /// For each class the number of wrong boxes, and of all in which it occurs.
    fn sums_by_class(&self) -> BTreeMap<u32, [u64; 2]> {
        let mut sums: BTreeMap<u32, [u64; 2]> = BTreeMap::new();
        for (&[found, truth], &count) in &self.counts {
            for class in BTreeSet::from([found, truth]).into_iter().flatten() {
                let [wrong, all] = sums.entry(class).or_default();
                *wrong += if found == truth { 0 } else { count };
                *all += count;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{bbox, found, sheet, there};
    use super::*;

    #[test]
    fn every_box_is_counted_once() {
        let (a, b) = (bbox(0.0, 0.0, 10.0, 10.0), bbox(50.0, 0.0, 10.0, 10.0));
        let nowhere = bbox(90.0, 90.0, 5.0, 5.0);
        let seen = vec![
            found(1, a, 0.9),
            found(0, a, 0.8),
            found(1, nowhere, 0.9),
            found(0, b, 0.1),
        ];
        let confusion = Confusion::new(
            &[sheet(vec![there(0, a), there(1, b)], seen)],
            &Default::default(),
        );
        let expected = [
            [Some(1), Some(0)],
            [Some(0), None],
            [Some(1), None],
            [None, Some(1)],
        ];
        let expected = expected.map(|classes| (classes, 1));
        assert_eq!(confusion.counts, BTreeMap::from(expected));
        assert_eq!(
            (confusion.classes().len(), confusion.worst()),
            (2, vec![1, 0])
        );
    }
}
