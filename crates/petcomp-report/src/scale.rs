//! Scale: how long pictures take and how much memory, from few pixels to many, few cards to many, one thread to all; and
//! what that means for a million of them.
//!
//! # Method
//! Every point is a dataset of its own, made by [`generate`](petcomp::dataset::generate) in a process of its own: pictures
//! are rendered, labelled, encoded and written, one to a thread, as in any run. A first picture tells how many more are
//! worth the time, in a few rounds of which the least counts. Seconds are the processor's (`CLOCK_PROCESS_CPUTIME_ID`), so
//! that other programs on the machine disturb little; the rate is by the clock, and memory the most that was ever resident (`VmHWM`). Scenes are made in
//! code, at rest; falling is measured by itself, in this process.

mod fit;
mod forecast;
mod grid;
mod process;
mod run;
mod show;

pub use fit::{CostFit, CostModel};
pub use forecast::{Forecast, forecast};
pub use grid::ScaleCase;
pub use run::run;
pub use show::{charts, tables};

use petcomp::{Error, Result, io};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Options of the report.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleOptions {
    /// The program that measures a point: `PROGRAM report scale --case JSON` prints it. Default: the running one.
    pub program: PathBuf,
    /// About how many seconds of work make a point; at least one picture per thread is made. Default: 1.
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
    /// What was asked for.
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

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleMeasurements {
    /// Points on one thread and on more.
    pub points: Vec<ScalePoint>,
    /// Cards that fall together, and seconds that it takes them.
    pub falls: Vec<(usize, f64)>,
}

/// Measures every point of the grid, each in a process of its own; `progress` hears of each and of how many there are.
///
/// # Errors
/// A program that cannot be run or does not tell its point; where the system does not tell time and memory of a process
/// (it must have Linux's `/proc`).
pub fn measure(options: &ScaleOptions, progress: impl Fn(u64, u64)) -> Result<ScaleMeasurements> {
    let cases = grid::cases(options.threads);
    let of = |(i, case): (usize, &ScaleCase)| {
        progress(i as u64, cases.len() as u64);
        process::in_a_child(&options.program, case, options.seconds)
    };
    let points = cases.iter().enumerate().map(of).collect::<Result<_>>()?;
    let falls = grid::FALLS
        .iter()
        .map(|&cards| Ok((cards, run::fall_seconds(cards)?)))
        .collect::<Result<_>>()?;
    Ok(ScaleMeasurements { points, falls })
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
    let tables = tables(&measured)?;
    let text = tables
        .iter()
        .map(|(title, table)| format!("## {title}\n\n{}\n", table.markdown()));
    io::write_text(
        folder.join("scale.md"),
        &format!("# Memory and scale\n\n{}", text.collect::<String>()),
    )?;
    if let Some((_, points)) = tables.first() {
        io::write_text(folder.join("scale.csv"), &points.csv())?;
    }
    for (i, (svg, _)) in charts(&measured)?.iter().enumerate() {
        io::write_text(folder.join(format!("scale_{}.svg", i + 1)), svg)?;
    }
    Ok(measured)
}

fn missing(what: &str) -> Error {
    Error::value("scale", format!("{what}, expected at least one"))
}
