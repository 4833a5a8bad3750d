//! Scale: how long pictures take and how much memory, from few pixels to many, few cards to many,
//! one thread to all; and what that means for a million of them.
//!
//! # Method
//! Every point is a dataset of its own, made by [`generate`](petcomp::dataset::generate) in a
//! process of its own: pictures are rendered, labelled, encoded and written, one to a thread, as in
//! any run. The time of a first picture decides how many more are made, in a few rounds of which
//! the least counts. Seconds are the processor's (`CLOCK_PROCESS_CPUTIME_ID`), so that other
//! programs on the machine disturb little; the rate is by the clock, and memory the most that was
//! ever resident (`VmHWM`). Scenes are made in code, at rest; falling is measured by itself, in
//! this process.

mod fit;
mod forecast;
mod grid;
mod pictures;
mod process;
mod recipe;
mod run;
mod show;

pub use fit::{CostFit, CostModel};
pub use forecast::{Forecast, forecast};
pub use grid::ScaleCase;
pub use recipe::{Estimate, RecipeRecord, RecipeRun, RunSample, run_recipe, write_recipe};
pub use run::run;
pub use show::{charts, tables};

use petcomp::plot::Table;
use petcomp::{Error, Result, io};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Pictures that are forecast.
const FORECAST_PICTURES: f64 = 1e6;
const SECONDS_PER_HOUR: f64 = 3600.0;
const MS_PER_SECOND: f64 = 1e3;
const MB_PER_BYTE: f64 = 1e-6;

/// Options of the report.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleOptions {
    /// The program that measures a point: `PROGRAM scale --case JSON` prints it. Default: the
    /// running one.
    pub program: PathBuf,
    /// About how many seconds of work make a point; at least one picture per thread is made.
    /// Default: 1.
    pub seconds: f64,
    /// Most threads, from 1 in powers of two. Default: one per core.
    pub threads: usize,
}

impl Default for ScaleOptions {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            program: std::env::current_exe().unwrap_or_default(),
            seconds: 1.0,
            threads,
        }
    }
}

/// What a dataset of one kind of picture took.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalePoint {
    /// What was measured.
    pub case: ScaleCase,
    /// Cards over a pixel, the mean over all pixels: deep samples by pixels.
    pub layers: f64,
    /// Pictures made after the first.
    pub pictures: u64,
    /// Seconds of processors per picture.
    pub cpu_seconds: f64,
    /// Pictures a second, by the clock.
    pub rate: f64,
    /// Most memory that the process had, bytes.
    pub peak_bytes: f64,
}

impl ScalePoint {
    fn is_single_threaded(&self) -> bool {
        self.case.threads == 1
    }
}

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleMeasurements {
    /// Points on one thread and on more.
    pub points: Vec<ScalePoint>,
    /// Cards that fall together, and seconds that it takes them.
    pub falls: Vec<(usize, f64)>,
}

impl ScaleMeasurements {
    fn single_threaded(&self) -> Vec<&ScalePoint> {
        self.points
            .iter()
            .filter(|point| point.is_single_threaded())
            .collect()
    }

    /// The default picture on one thread and on more, in their order.
    fn default_pictures(&self) -> Vec<&ScalePoint> {
        self.points
            .iter()
            .filter(|point| point.case.is_default_picture())
            .collect()
    }
}

/// Measures every point of the grid, each in a process of its own; `progress` gets the number of
/// the point and of all points.
///
/// # Errors
/// A program that cannot be run or does not print its point; where the system does not report time
/// and memory of a process (it must have Linux's `/proc`).
pub fn measure(options: &ScaleOptions, progress: impl Fn(u64, u64)) -> Result<ScaleMeasurements> {
    Ok(ScaleMeasurements {
        points: measure_points(options, progress)?,
        falls: grid::FALL_SIZES
            .into_iter()
            .map(|cards| Ok((cards, run::fall_seconds(cards)?)))
            .collect::<Result<_>>()?,
    })
}

fn measure_points(options: &ScaleOptions, progress: impl Fn(u64, u64)) -> Result<Vec<ScalePoint>> {
    let cases = grid::cases(options.threads);
    let mut points = Vec::new();
    for case in &cases {
        progress(points.len() as u64, cases.len() as u64);
        let point = process::run_in_child(&options.program, case, options.seconds)?;
        points.push(point);
    }
    Ok(points)
}

/// Measures and writes `scale.csv`, `scale.md` and charts (SVG) into a folder.
///
/// # Errors
/// As [`measure`]; files that cannot be written.
pub fn write(
    folder: impl AsRef<Path>,
    options: &ScaleOptions,
    progress: impl Fn(u64, u64),
) -> Result<ScaleMeasurements> {
    let folder = folder.as_ref();
    io::create_folder(folder)?;
    let measured = measure(options, progress)?;
    write_tables(folder, &tables(&measured)?)?;
    write_charts(folder, &charts(&measured)?)?;
    Ok(measured)
}

fn write_charts(folder: &Path, charts: &[(String, String)]) -> Result<()> {
    for (i, (svg, _)) in charts.iter().enumerate() {
        io::write_text(folder.join(format!("scale_{}.svg", i + 1)), svg)?;
    }
    Ok(())
}

fn write_tables(folder: &Path, tables: &[(String, Table)]) -> Result<()> {
    let text: String = tables
        .iter()
        .map(|(title, table)| format!("## {title}\n\n{}\n", table.markdown()))
        .collect();
    io::write_text(
        folder.join("scale.md"),
        &format!("# Memory and scale\n\n{text}"),
    )?;
    match tables.first() {
        Some((_, points)) => io::write_text(folder.join("scale.csv"), &points.csv()),
        None => Ok(()),
    }
}

fn missing_error(what: &str) -> Error {
    Error::value("scale", format!("{what}, expected at least one"))
}
