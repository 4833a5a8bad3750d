//! The mAP of a run, and the range to expect with other images.

use super::EvalReportOptions;
use crate::eval::{EvalImage, Interval, Matches};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// mAP@0.5:0.95 of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapEstimate {
    /// For the actual images.
    pub value: f64,
    /// Its interval; none for fewer than 40 rounds, or fewer than two images, or sequences, with
    /// objects: these allow no statement about others.
    #[serde(flatten)]
    pub range: Option<MapRange>,
}

/// A 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRange {
    /// Its lower end: the 2.5 % quantile of the resampled values.
    pub low: f64,
    /// Its upper end: the 97.5 % quantile.
    pub high: f64,
}

/// With fewer rounds, less than one resampled value is expected beyond either end of an interval.
const MIN_ROUNDS: usize = 40;

impl MapEstimate {
    /// From matched images.
    pub(super) fn new(
        matches: &Matches,
        sheets: &[EvalImage],
        options: &EvalReportOptions,
    ) -> Self {
        let has_range =
            options.rounds >= MIN_ROUNDS && count_groups_with_objects(matches, sheets) > 1;
        Self {
            value: matches.map(&[]),
            range: has_range.then(|| MapRange::new(matches, options)),
        }
    }
}

impl MapRange {
    fn new(matches: &Matches, options: &EvalReportOptions) -> Self {
        let Interval { low, high, .. } = matches.bootstrap(options.rounds, options.seed);
        Self { low, high }
    }
}

/// The number of images, or sequences of them, with objects.
fn count_groups_with_objects(matches: &Matches, sheets: &[EvalImage]) -> usize {
    let groups = sheets.iter().zip(matches.groups());
    let shown = groups.filter(|(sheet, _)| sheet.truth.iter().any(|truth| !truth.crowd));
    let shown: BTreeSet<usize> = shown.map(|(_, &group)| group).collect();
    shown.len()
}
