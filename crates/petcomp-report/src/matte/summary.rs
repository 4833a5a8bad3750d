//! Errors of a method over all photos.

use super::{GOOD_BOX_PX, GOOD_IOU, MatteRow, MattingMethod, Score};
use crate::statistics::{mean_of, quantile};

/// Errors of a method over all photos.
pub(super) struct MethodSummary {
    pub(super) method: MattingMethod,
    /// Means, except for the median of the outline's overlap and of the time, and the 95 % quantile
    /// of the box.
    pub(super) score: Score,
    /// Photos without a cut-out.
    pub(super) failed: usize,
    /// Share of the photos with a box error of at most 2 pixels.
    pub(super) box_within_2_px: f64,
    /// Photos with a box more than 2 pixels off or an outline with an overlap below 0.95, without a
    /// warning.
    pub(super) silently_wrong: usize,
    /// Median run time, milliseconds.
    pub(super) time_ms: f64,
}

/// Errors over all photos, a row per method.
pub(super) fn summaries(rows: &[MatteRow]) -> Vec<MethodSummary> {
    MattingMethod::ALL
        .into_iter()
        .map(|method| MethodSummary::new(rows, method))
        .collect()
}

impl MethodSummary {
    fn new(rows: &[MatteRow], method: MattingMethod) -> Self {
        let own: Vec<&MatteRow> = rows.iter().filter(|row| row.method == method).collect();
        let scores: Vec<Score> = own.iter().filter_map(|row| row.score).collect();
        Self {
            method,
            score: mean_score(&scores),
            failed: own.len() - scores.len(),
            box_within_2_px: share_of_good_boxes(&scores),
            silently_wrong: own.iter().filter(|row| row.is_silently_wrong()).count(),
            time_ms: quantile(own.iter().map(|row| row.time_ms), 0.5),
        }
    }
}

fn share_of_good_boxes(scores: &[Score]) -> f64 {
    let good = scores.iter().filter(|s| s.box_px <= GOOD_BOX_PX).count();
    good as f64 / scores.len().max(1) as f64
}

impl MatteRow {
    fn is_silently_wrong(&self) -> bool {
        self.warnings.is_empty() && self.score.is_some_and(|score| score.is_wrong())
    }
}

impl Score {
    fn is_wrong(&self) -> bool {
        self.box_px > GOOD_BOX_PX || self.iou < GOOD_IOU
    }
}

/// Means, except for the median of the outline's overlap and the 95 % quantile of the box.
fn mean_score(scores: &[Score]) -> Score {
    Score {
        sad: mean_of(scores, |s| s.sad),
        mse: mean_of(scores, |s| s.mse),
        gradient: mean_of(scores, |s| s.gradient),
        mae_lit: mean_of(scores, |s| s.mae_lit),
        psnr_lit: mean_of(scores, |s| s.psnr_lit),
        mae_shaded: mean_of(scores, |s| s.mae_shaded),
        psnr_shaded: mean_of(scores, |s| s.psnr_shaded),
        residue: mean_of(scores, |s| s.residue),
        iou: quantile(scores.iter().map(|s| s.iou), 0.5),
        box_px: quantile(scores.iter().map(|s| s.box_px), 0.95),
    }
}
