//! The measurements as tables, charts and Markdown.

use super::{GoldenRow, RenderReportOptions, RenderRow};
use crate::columns::{Column, number_or_empty, table_from, table_of};
use petcomp::Quality;
use petcomp::diff::Likeness;
use petcomp::plot::{Axis, Chart, Curve, Table};

const TITLES: [&str; 9] = [
    "program",
    "setting",
    "CPU s",
    "RMSE to Cycles",
    "bias",
    "SSIM",
    "FLIP",
    "RMSE to quadrature",
    "times faster than Cycles at that RMSE",
];

/// The measurements as a table.
pub(super) fn table(rows: &[RenderRow]) -> Table {
    let lines = rows.iter().map(|row| row.table_line(speed_up(row, rows)));
    table_from(TITLES, lines)
}

impl RenderRow {
    fn table_line(&self, speed_up: Option<f64>) -> [String; 9] {
        let (cycles, quadrature) = (self.cycles, self.quadrature);
        [
            self.program.clone(),
            self.setting.clone(),
            format!("{:.4}", self.cpu_seconds),
            number_or_empty(cycles.map(|l| l.rmse), 5),
            number_or_empty(cycles.map(|l| l.bias), 6),
            number_or_empty(cycles.and_then(|l| l.ssim), 5),
            number_or_empty(cycles.map(|l| l.flip), 4),
            number_or_empty(quadrature.map(|l| l.rmse), 5),
            number_or_empty(speed_up, 0),
        ]
    }

    fn log_error_and_time(&self) -> Option<[f64; 2]> {
        Some([libm::log(self.cycles?.rmse), libm::log(self.cpu_seconds)])
    }
}

/// Ratio of the other program's time for the same error to ours, interpolated log-log between its
/// pictures; none beyond its last one.
pub(super) fn speed_up(row: &RenderRow, rows: &[RenderRow]) -> Option<f64> {
    let error = row.cycles?.rmse;
    if !row.is_petcomp() {
        return None;
    }
    let others = rows.iter().filter(|r| !r.is_petcomp());
    let mut curve: Vec<_> = others.filter_map(RenderRow::log_error_and_time).collect();
    curve.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let time = interpolated_time(&curve, libm::log(error))?;
    Some(libm::exp(time) / row.cpu_seconds)
}

/// The time at which a falling curve of errors and times has an error.
fn interpolated_time(curve: &[[f64; 2]], error: f64) -> Option<f64> {
    let mut pairs = curve.windows(2).map(|pair| [pair[0], pair[1]]);
    let [[more, before], [less, after]] = pairs.find(|[a, b]| a[0] >= error && error >= b[0])?;
    let part = (more - error) / (more - less);
    Some(before + part * (after - before))
}

/// A measure of likeness that is 0 for equal pictures.
type ErrorMeasure = fn(&Likeness) -> f64;

const ERROR_MEASURES: [(&str, ErrorMeasure); 3] = [
    ("RMSE, scene-linear", |l| l.rmse),
    ("FLIP", |l| l.flip),
    ("1 - SSIM", |l| l.ssim.map_or(f64::NAN, |ssim| 1.0 - ssim)),
];

/// RMSE, FLIP and 1 - SSIM against CPU seconds, both programs' curves in each.
pub(super) fn charts(rows: &[RenderRow]) -> Vec<Chart> {
    ERROR_MEASURES
        .iter()
        .map(|(title, measure)| error_chart(rows, title, *measure))
        .collect()
}

fn error_chart(rows: &[RenderRow], title: &str, measure: ErrorMeasure) -> Chart {
    let names = program_names(rows);
    let times = rows.iter().map(|row| row.cpu_seconds);
    let all = curve_of(rows, measure, |_| true);
    Chart {
        title: title.into(),
        across: Axis::over_decades("CPU seconds", times),
        up: Axis::over_decades("error", all.iter().map(|p| p[1])),
        defaults: curve_of(rows, measure, |row| {
            row.setting == Quality::default().name()
        }),
        curves: names
            .iter()
            .map(|name| curve_of(rows, measure, |row| row.program == *name))
            .collect(),
        names,
    }
}

fn program_names(rows: &[RenderRow]) -> Vec<String> {
    let mut names: Vec<String> = rows.iter().map(|row| row.program.clone()).collect();
    names.dedup();
    names
}

fn curve_of(
    rows: &[RenderRow],
    measure: ErrorMeasure,
    is_shown: impl Fn(&RenderRow) -> bool,
) -> Curve {
    let shown = rows.iter().filter(|row| is_shown(row));
    shown
        .filter_map(|row| Some([row.cpu_seconds, measure(row.cycles.as_ref()?)]))
        .collect()
}

const GOLDEN_COLUMNS: [Column<GoldenRow>; 6] = [
    ("scene", |r| r.case.clone()),
    ("quality", |r| r.quality.to_owned()),
    ("RMSE", |r| format!("{:.5}", r.likeness.rmse)),
    ("bias", |r| format!("{:+.6}", r.likeness.bias)),
    ("SSIM", |r| number_or_empty(r.likeness.ssim, 5)),
    ("FLIP", |r| format!("{:.4}", r.likeness.flip)),
];

/// The golden scenes as a table: a row per scene and setting.
pub(super) fn golden_table(rows: &[GoldenRow]) -> Table {
    table_of(&GOLDEN_COLUMNS, rows)
}

pub(super) fn markdown(
    rows: &[RenderRow],
    golden: &[GoldenRow],
    options: &RenderReportOptions,
) -> String {
    let ([w, h], scene) = (options.size(), options.scene.display());
    let mut text = format!("# Error of the renderer against run time\n\n{scene}, {w} x {h}\n\n");
    if rows.iter().all(RenderRow::is_petcomp) {
        text += "Cycles' curve is missing: `tests/benches/peers/render.py` generates it.\n\n";
    }
    text += &table(rows).markdown();
    if !golden.is_empty() {
        text += "\n## Golden scenes\n\n";
        text += &golden_table(golden).markdown();
    }
    text
}
