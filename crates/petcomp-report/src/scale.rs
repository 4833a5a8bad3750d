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

pub use grid::ScaleCase;
pub use recipe::{RecipeRun, write_recipe};
pub use run::run;
pub(crate) use show::{charts, tables};

use crate::files::write_texts;
use fit::{CostFit, CostModel};
use forecast::{Forecast, forecast};
use petcomp::plot::Table;
use petcomp::{Error, Result, io};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Pictures that are forecast.
const FORECAST_PICTURES: f64 = 1e6;
const SECONDS_PER_HOUR: f64 = 3600.0;
const MS_PER_SECOND: f64 = 1e3;
const MB_PER_BYTE: f64 = 1e-6;

/// About how many seconds of work make a point.
pub const DEFAULT_SECONDS: f64 = 1.0;

/// Cores of this machine.
pub fn core_count() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
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
pub(crate) struct ScaleMeasurements {
    /// Points on one thread and on more.
    points: Vec<ScalePoint>,
    /// Cards that fall together, and seconds that it takes them.
    falls: Vec<(usize, f64)>,
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

/// Measures every point of the grid, for about this many seconds each but at least one picture per
/// thread, on up to so many threads; `progress` gets the number of the point and of all points.
pub(crate) fn measure(
    seconds: f64,
    threads: usize,
    progress: impl Fn(u64, u64),
) -> Result<ScaleMeasurements> {
    Ok(ScaleMeasurements {
        points: measure_points(seconds, threads, progress)?,
        falls: grid::FALL_SIZES
            .into_iter()
            .map(|cards| Ok((cards, run::fall_seconds(cards)?)))
            .collect::<Result<_>>()?,
    })
}

/// Each in a process of its own, of the running program: `PROGRAM scale --case JSON` prints a
/// point.
fn measure_points(
    seconds: f64,
    threads: usize,
    progress: impl Fn(u64, u64),
) -> Result<Vec<ScalePoint>> {
    let program = std::env::current_exe().unwrap_or_default();
    let cases = grid::cases(threads);
    let mut points = Vec::new();
    for case in &cases {
        progress(points.len() as u64, cases.len() as u64);
        points.push(process::run_in_child(&program, case, seconds)?);
    }
    Ok(points)
}

/// Measures and writes `scale.csv`, `scale.md` and charts (SVG) into a folder; returns the tables
/// with their titles.
///
/// # Errors
/// A program that cannot be run or does not print its point; where the system does not report time
/// and memory of a process (it must have Linux's `/proc`); files that cannot be written.
pub fn write(
    folder: &Path,
    seconds: f64,
    threads: usize,
    progress: impl Fn(u64, u64),
) -> Result<Vec<(String, Table)>> {
    io::create_folder(folder)?;
    let measured = measure(seconds, threads, progress)?;
    let tables = tables(&measured)?;
    let texts = tables
        .iter()
        .map(|(title, table)| format!("## {title}\n\n{}\n", table.markdown()));
    let text = format!("# Memory and scale\n\n{}", texts.collect::<String>());
    write_texts(
        folder,
        [("scale.md", &text), ("scale.csv", &tables[0].1.csv())],
    )?;
    for (i, (svg, _)) in charts(&measured)?.iter().enumerate() {
        io::write_text(folder.join(format!("scale_{}.svg", i + 1)), svg)?;
    }
    Ok(tables)
}

fn missing_error(what: &str) -> Error {
    Error::value("scale", format!("{what}, expected at least one"))
}
