//! The mAP of a run, and where that of other images may lie.

use super::EvalReportOptions;
use crate::eval::{EvalImage, Interval, Matches};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// mAP@0.5:0.95 of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapEstimate {
    /// Of the images as they are.
    pub value: f64,
    /// Its interval; none of fewer than 40 rounds, nor of fewer than two images, or sequences, that
    /// show something to be found: these tell of no others.
    #[serde(flatten)]
    pub range: Option<MapRange>,
}

/// An interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapRange {
    /// Its lower end: the 2.5 % quantile of the resampled values.
    pub low: f64,
    /// Its upper end: the 97.5 % quantile.
    pub high: f64,
}

/// Of fewer rounds less than one is to be expected beyond either end of an interval.
const MIN_ROUNDS: usize = 40;

impl MapEstimate {
    /// Of matched images.
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

/// How many images, or sequences of them, show something to be found.
fn count_groups_with_objects(matches: &Matches, sheets: &[EvalImage]) -> usize {
    let groups = sheets.iter().zip(matches.groups());
    let shown = groups.filter(|(sheet, _)| sheet.truth.iter().any(|truth| !truth.crowd));
    let shown: BTreeSet<usize> = shown.map(|(_, &group)| group).collect();
    shown.len()
}
