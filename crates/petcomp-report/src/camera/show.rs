//! What was measured as CSV, Markdown and charts.

use super::{CameraRow, NOISES_PX, SolveMethod};
use crate::statistics::quantile;
use petcomp::plot::{Axis, Chart, Curve};

/// Tilts that run time is plotted for, degrees.
const TIMED_TILTS_DEG: [f64; 3] = [5.0, 20.0, 45.0];
/// Digits that count.
const SIGNIFICANT_DIGITS: usize = 3;
const CSV_TITLES: &str = "lens,noise_px,tilt_deg,method,views,failed,focal_median_percent,focal_95_percent,\
    height_median_px,height_95_px,time_us\n";

pub(super) fn csv(rows: &[CameraRow]) -> String {
    CSV_TITLES.to_owned() + &rows.iter().map(CameraRow::csv_line).collect::<String>()
}

impl CameraRow {
    fn csv_line(&self) -> String {
        let kind = format!("{},{},{}", self.lens.name(), self.noise_px, self.tilt_deg);
        let method = self.method.name().replace(", ", " of ");
        let ([focal, focal_95], [height, height_95]) = (self.focal_percent, self.height_px);
        format!(
            "{kind},{method},{},{},{focal:.5},{focal_95:.5},{height:.5},{height_95:.5},{:.2}\n",
            self.views, self.failed, self.time_us
        )
    }

    fn is_same_camera(&self, other: &Self) -> bool {
        (self.lens, self.noise_px) == (other.lens, other.noise_px)
    }

    fn focal_cell(&self) -> String {
        let [median, most] = self.focal_percent.map(three);
        format!(" {median} / {most} |")
    }

    fn median_focal_percent(&self) -> f64 {
        self.focal_percent[0]
    }

    fn median_height_px(&self) -> f64 {
        self.height_px[0]
    }

    fn time_and_focal_error(&self) -> [f64; 2] {
        [self.time_us, self.median_focal_percent()]
    }
}

/// A table per kind of camera and noise: a line per tilt, a column per method.
pub(super) fn markdown(rows: &[CameraRow]) -> String {
    let tables = rows.chunk_by(CameraRow::is_same_camera);
    "# Error of the camera solver\n\nFocal length, error in %: median / 95 %. Below: median run time per photo.\n"
        .to_owned()
        + &tables.map(markdown_table).collect::<String>()
}

fn markdown_table(rows: &[CameraRow]) -> String {
    let lines: String = rows
        .chunk_by(|a, b| a.tilt_deg == b.tilt_deg)
        .map(markdown_line)
        .collect();
    let times = SolveMethod::ALL.map(|method| format!(" {} |", three(median_time(rows, method))));
    format!(
        "{}{lines}| us |{}\n",
        markdown_head(&rows[0]),
        times.concat()
    )
}

fn markdown_head(row: &CameraRow) -> String {
    let names = SolveMethod::ALL
        .map(|m| format!(" {} |", m.name()))
        .concat();
    let rule = " --- |".repeat(SolveMethod::ALL.len() + 1);
    let (lens, noise_px) = (row.lens.name(), row.noise_px);
    format!("\n## {lens} camera, corners to {noise_px} px\n\n| tilt |{names}\n|{rule}\n")
}

/// All methods at one tilt.
fn markdown_line(rows: &[CameraRow]) -> String {
    let cells: String = rows.iter().map(CameraRow::focal_cell).collect();
    format!("| {} |{cells}\n", rows[0].tilt_deg)
}

fn median_time(rows: &[CameraRow], method: SolveMethod) -> f64 {
    let own = rows.iter().filter(|row| row.method == method);
    quantile(own.map(|row| row.time_us), 0.5)
}

/// Three digits that count, but two decimals at most.
pub(super) fn three(value: f64) -> String {
    let whole_digits = if value >= 1.0 {
        (libm::floor(libm::log10(value)) as usize).saturating_add(1)
    } else {
        1
    };
    format!(
        "{value:.*}",
        SIGNIFICANT_DIGITS.saturating_sub(whole_digits)
    )
}

/// The charts of one lens as SVG, with their names.
pub(super) fn charts(rows: &[CameraRow]) -> [(&'static str, String); 3] {
    let focal = TiltChart {
        rows,
        title: "focal length, median error, %",
        error: CameraRow::median_focal_percent,
    };
    let height = TiltChart {
        rows,
        title: "50 mm up, median error, px",
        error: CameraRow::median_height_px,
    };
    [
        ("tilt", focal.svg()),
        ("height", height.svg()),
        ("time", time_charts(rows)),
    ]
}

/// An error against tilt: a chart per noise, a curve per method.
struct TiltChart<'a> {
    rows: &'a [CameraRow],
    title: &'static str,
    error: fn(&CameraRow) -> f64,
}

impl TiltChart<'_> {
    fn svg(&self) -> String {
        Chart::row(&NOISES_PX.map(|noise_px| self.chart(noise_px)))
    }

    fn chart(&self, noise_px: f64) -> Chart {
        let errors = self.rows.iter().map(self.error);
        Chart {
            title: format!("corners to {noise_px} px"),
            names: SolveMethod::ALL.map(SolveMethod::name).into(),
            across: tilt_axis(),
            up: Axis::over_decades(self.title, errors),
            curves: SolveMethod::ALL
                .map(|method| self.curve(noise_px, method))
                .into(),
            defaults: Vec::new(),
        }
    }

    fn curve(&self, noise_px: f64, method: SolveMethod) -> Curve {
        self.rows
            .iter()
            .filter(|row| row.noise_px == noise_px && row.method == method)
            .map(|row| [row.tilt_deg, (self.error)(row)])
            .collect()
    }
}

fn tilt_axis() -> Axis {
    Axis {
        title: "tilt, degrees".into(),
        range: [0.0, 80.0],
        logarithmic: false,
    }
}

/// A chart per tilt, a curve per noise along the methods.
fn time_charts(rows: &[CameraRow]) -> String {
    Chart::row(&TIMED_TILTS_DEG.map(|tilt_deg| time_chart(rows, tilt_deg)))
}

fn time_chart(rows: &[CameraRow], tilt_deg: f64) -> Chart {
    let seen: Vec<&CameraRow> = rows.iter().filter(|r| r.tilt_deg == tilt_deg).collect();
    Chart {
        title: format!("tilt {tilt_deg} degrees: closed form, 1 to 5 steps, full, joint"),
        names: NOISES_PX
            .map(|noise| format!("corners to {noise} px"))
            .into(),
        across: time_axis(rows),
        up: focal_axis(rows),
        curves: NOISES_PX
            .map(|noise| time_curve(&seen, |row| row.noise_px == noise))
            .into(),
        defaults: time_curve(&seen, |row| row.method == SolveMethod::Whole),
    }
}

fn time_axis(rows: &[CameraRow]) -> Axis {
    let times = rows.iter().map(|row| row.time_us);
    Axis::over_decades("run time per photo, microseconds", times)
}

fn focal_axis(rows: &[CameraRow]) -> Axis {
    let errors = rows.iter().map(CameraRow::median_focal_percent);
    Axis::over_decades("focal length, median error, %", errors)
}

fn time_curve(rows: &[&CameraRow], is_shown: impl Fn(&CameraRow) -> bool) -> Curve {
    let shown = rows.iter().filter(|row| is_shown(row));
    shown.map(|row| row.time_and_focal_error()).collect()
}
