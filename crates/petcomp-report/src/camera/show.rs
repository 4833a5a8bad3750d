//! The measurements as CSV, Markdown and charts.

use super::{CameraRow, NOISES_PX, SolveMethod};
use crate::statistics::quantile;
use petcomp::plot::{Axis, Chart, Curve, Table};

/// Tilts for which run time is plotted, degrees.
const TIMED_TILTS_DEG: [f64; 3] = [5.0, 20.0, 45.0];
/// Number of significant digits.
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
        format!("{median} / {most}")
    }

    fn median_focal_percent(&self) -> f64 {
        self.focal_percent[0]
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
    let (lens, noise_px) = (rows[0].lens.name(), rows[0].noise_px);
    let head = format!("\n## {lens} camera, corner noise {noise_px} px\n\n");
    head + &method_table(rows).markdown()
}

fn method_table(rows: &[CameraRow]) -> Table {
    let names = SolveMethod::ALL.map(SolveMethod::name);
    let titles = names.iter().map(String::as_str);
    let mut table = Table::new(std::iter::once("tilt").chain(titles));
    for row in rows.chunk_by(|a, b| a.tilt_deg == b.tilt_deg) {
        let cells = row.iter().map(CameraRow::focal_cell);
        table.push(std::iter::once(row[0].tilt_deg.to_string()).chain(cells));
    }
    let times = SolveMethod::ALL.map(|method| three(median_time(rows, method)));
    table.push(std::iter::once("us".to_owned()).chain(times));
    table
}

fn median_time(rows: &[CameraRow], method: SolveMethod) -> f64 {
    let own = rows.iter().filter(|row| row.method == method);
    quantile(own.map(|row| row.time_us), 0.5)
}

/// A number with three significant digits, but at most two decimals.
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
        title: FOCAL_ERROR,
        error: CameraRow::median_focal_percent,
    };
    let height = TiltChart {
        rows,
        title: "50 mm above the surface, median error, px",
        error: |row| row.height_px[0],
    };
    let time = TIMED_TILTS_DEG.map(|tilt_deg| time_chart(rows, tilt_deg));
    [
        ("tilt", focal.svg()),
        ("height", height.svg()),
        ("time", Chart::row(&time)),
    ]
}

const FOCAL_ERROR: &str = "focal length, median error, %";

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
            title: format!("corner noise {noise_px} px"),
            names: SolveMethod::ALL.map(SolveMethod::name).into(),
            across: Axis {
                title: "tilt, degrees".into(),
                range: [0.0, 80.0],
                logarithmic: false,
            },
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

/// A curve per noise along the methods.
fn time_chart(rows: &[CameraRow], tilt_deg: f64) -> Chart {
    let seen: Vec<&CameraRow> = rows.iter().filter(|r| r.tilt_deg == tilt_deg).collect();
    let times = rows.iter().map(|row| row.time_us);
    let errors = rows.iter().map(CameraRow::median_focal_percent);
    Chart {
        title: format!("tilt {tilt_deg} degrees: closed form, 1 to 5 steps, full, joint"),
        names: NOISES_PX
            .map(|noise| format!("corner noise {noise} px"))
            .into(),
        across: Axis::over_decades("run time per photo, microseconds", times),
        up: Axis::over_decades(FOCAL_ERROR, errors),
        curves: NOISES_PX
            .map(|noise| time_curve(&seen, |row| row.noise_px == noise))
            .into(),
        defaults: time_curve(&seen, |row| row.method == SolveMethod::Whole),
    }
}

fn time_curve(rows: &[&CameraRow], is_shown: impl Fn(&CameraRow) -> bool) -> Curve {
    let shown = rows.iter().filter(|row| is_shown(row));
    shown
        .map(|row| [row.time_us, row.median_focal_percent()])
        .collect()
}
