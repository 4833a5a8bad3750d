//! Errors of the methods as tables and as a chart.

use super::{MatteRow, MattingMethod, MethodSummary, Score};
use crate::columns::{Column, number_or_empty, table_of};
use petcomp::plot::{Axis, Chart, Table};

const SUMMARY_COLUMNS: [Column<MethodSummary>; 15] = [
    ("method", |s| s.method.name().to_owned()),
    ("MAE lit (F+VB)", |s| format!("{:.5}", s.score.mae_lit)),
    ("PSNR, dB", |s| format!("{:.1}", s.score.psnr_lit)),
    ("MAE shaded (F+TB)", |s| {
        format!("{:.5}", s.score.mae_shaded)
    }),
    ("PSNR, dB", |s| format!("{:.1}", s.score.psnr_shaded)),
    ("SAD, 1000 px", |s| format!("{:.2}", s.score.sad)),
    ("MSE", |s| format!("{:.5}", s.score.mse)),
    ("gradient, 1000", |s| format!("{:.2}", s.score.gradient)),
    ("residue", |s| format!("{:.5}", s.score.residue)),
    ("outline IoU, median", |s| format!("{:.4}", s.score.iou)),
    ("box, 95 %, px", |s| format!("{:.2}", s.score.box_px)),
    ("box within 2 px", |s| {
        format!("{:.0} %", 100.0 * s.box_within_2_px)
    }),
    ("silently wrong", |s| s.silently_wrong.to_string()),
    ("no cut-out", |s| s.failed.to_string()),
    ("time, ms", |s| format!("{:.0}", s.time_ms)),
];

/// The table method x error x time.
pub(super) fn table(summaries: &[MethodSummary]) -> Table {
    table_of(&SUMMARY_COLUMNS, summaries)
}

const DETAIL_COLUMNS: [Column<MatteRow>; 14] = [
    ("photo", |r| r.photo.clone()),
    ("method", |r| r.method.name().to_owned()),
    ("mae_lit", |r| r.error_cell(|s| s.mae_lit)),
    ("psnr_lit", |r| r.error_cell(|s| s.psnr_lit)),
    ("mae_shaded", |r| r.error_cell(|s| s.mae_shaded)),
    ("psnr_shaded", |r| r.error_cell(|s| s.psnr_shaded)),
    ("sad", |r| r.error_cell(|s| s.sad)),
    ("mse", |r| r.error_cell(|s| s.mse)),
    ("gradient", |r| r.error_cell(|s| s.gradient)),
    ("residue", |r| r.error_cell(|s| s.residue)),
    ("iou", |r| r.error_cell(|s| s.iou)),
    ("box_px", |r| r.error_cell(|s| s.box_px)),
    ("time_ms", |r| format!("{:.1}", r.time_ms)),
    ("warnings", |r| r.warnings.join("; ")),
];

impl MatteRow {
    /// One of its errors; empty without a cut-out.
    fn error_cell(&self, error: fn(&Score) -> f64) -> String {
        number_or_empty(self.score.as_ref().map(error), 6)
    }
}

/// Every photo with every method.
pub(super) fn details(rows: &[MatteRow]) -> Table {
    table_of(&DETAIL_COLUMNS, rows)
}

/// Error against run time, a point per method: over backgrounds lit independently, and in the
/// object's own shadow.
pub(super) fn chart(summaries: &[MethodSummary]) -> String {
    let lit = error_chart(summaries, "new background, lit independently", |s| {
        s.mae_lit
    });
    let shaded = error_chart(summaries, "new background, shaded by the object", |s| {
        s.mae_shaded
    });
    Chart::row(&[lit, shaded])
}

fn error_chart(summaries: &[MethodSummary], title: &str, error: fn(&Score) -> f64) -> Chart {
    let points = summaries.iter().map(|s| [s.time_ms, error(&s.score)]);
    let physical = summaries
        .iter()
        .zip(points.clone())
        .filter(|(s, _)| s.method == MattingMethod::Physical);
    Chart {
        title: title.into(),
        names: summaries.iter().map(|s| s.method.name().into()).collect(),
        across: time_axis(summaries),
        up: error_axis(summaries),
        defaults: physical.map(|(_, point)| point).collect(),
        curves: points.map(|point| vec![point]).collect(),
    }
}

fn time_axis(summaries: &[MethodSummary]) -> Axis {
    let times = summaries.iter().map(|s| s.time_ms);
    Axis::over_decades("run time per photo, one thread, ms", times)
}

/// The same for both charts.
fn error_axis(summaries: &[MethodSummary]) -> Axis {
    let errors = summaries
        .iter()
        .flat_map(|s| [s.score.mae_lit, s.score.mae_shaded]);
    Axis::over_decades("mean absolute error, linear light", errors)
}
