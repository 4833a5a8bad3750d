//! Which class is taken for which.

use super::overlap::iou;
use super::{FoundBox, Sheet};
use serde::{Deserialize, Serialize};

/// Counts of found (rows) against true (columns) classes; the last row and column are the background.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    /// `counts[found][true]`, one more of each than there are classes.
    pub counts: Vec<Vec<u64>>,
}

/// Which detections are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConfusionOptions {
    /// Those surer than this. Default: 0.25, YOLOv5's.
    pub confidence: f64,
    /// They name a box that they overlap by more than this. Default: 0.45, YOLOv5's.
    pub iou: f64,
}

impl Default for ConfusionOptions {
    fn default() -> Self {
        Self { confidence: 0.25, iou: 0.45 }
    }
}

impl Confusion {
    /// Counts over all images, whatever the classes of two boxes that overlap.
    ///
    /// Pairs are made from the greatest overlap down. Classes beyond `classes` are left out.
    pub fn new(sheets: &[Sheet], classes: usize, options: &ConfusionOptions) -> Self {
        let mut confusion = Self { counts: vec![vec![0; classes + 1]; classes + 1] };
        sheets.iter().for_each(|sheet| confusion.add(sheet, classes, options));
        confusion
    }

    fn add(&mut self, sheet: &Sheet, background: usize, options: &ConfusionOptions) {
        let known = |class: u32| (class as usize) < background;
        let truth: Vec<_> = sheet.truth.iter().filter(|t| known(t.class)).collect();
        let found: Vec<&FoundBox> =
            sheet.found.iter().filter(|f| known(f.class) && f.confidence > options.confidence).collect();
        let mut pairs: Vec<(f64, usize, usize)> = (0..truth.len())
            .flat_map(|t| (0..found.len()).map(move |f| (t, f)))
            .map(|(t, f)| (iou(&truth[t].bbox, &found[f].bbox), t, f))
            .filter(|pair| pair.0 > options.iou)
            .collect();
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut named, mut names) = (vec![false; truth.len()], vec![false; found.len()]);
        for (_, t, f) in pairs {
            if !named[t] && !names[f] {
                (named[t], names[f]) = (true, true);
                self.counts[found[f].class as usize][truth[t].class as usize] += 1;
            }
        }
        let missed = truth.iter().zip(named).filter(|(_, named)| !named);
        missed.for_each(|(t, _)| self.counts[background][t.class as usize] += 1);
        let alarms = found.iter().zip(names).filter(|(_, names)| !names);
        alarms.for_each(|(f, _)| self.counts[f.class as usize][background] += 1);
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
        let seen = vec![found(1, a, 0.9), found(0, a, 0.8), found(1, nowhere, 0.9), found(0, b, 0.1)];
        let confusion = Confusion::new(&[sheet(vec![there(0, a), there(1, b)], seen)], 2, &Default::default());
        assert_eq!(confusion.counts, [[0, 0, 1], [1, 0, 1], [0, 1, 0]]);
    }
}
