//! Where the time of a run goes.

use crate::error::{Error, Result};
use crate::io;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

/// Name of the file that records how long each run took: specific to the machine and the day, and
/// no part of the dataset.
pub(crate) const RUNS: &str = ".runs.jsonl";

/// Time that samples took, by stage: summed over samples, not wall time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Drawing, falling and coming to rest, exposure.
    pub settle: Duration,
    /// Casting rays and composing the picture.
    pub render: Duration,
    /// Labels.
    pub label: Duration,
    /// Encoding and writing files.
    pub write: Duration,
}

/// A line of the file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunTimes {
    /// Number of samples made.
    pub(crate) made: u64,
    /// Number of threads that made them.
    pub(crate) threads: usize,
    /// Wall time, seconds.
    pub(crate) wall_s: f64,
    /// Seconds of all threads, by stage.
    pub(crate) settle_s: f64,
    pub(crate) render_s: f64,
    pub(crate) label_s: f64,
    pub(crate) write_s: f64,
}

impl std::ops::AddAssign for Times {
    fn add_assign(&mut self, other: Self) {
        self.settle += other.settle;
        self.render += other.render;
        self.label += other.label;
        self.write += other.write;
    }
}

impl Times {
    /// Adds a line to the folder's list of runs. It is only a note, so a full disk is no error.
    pub(crate) fn append(&self, folder: &Path, made: u64, wall: Duration) {
        if made > 0
            && let Err(e) = RunTimes::new(self, made, wall).append(&folder.join(RUNS))
        {
            log::warn!("{e}");
        }
    }
}

impl RunTimes {
    fn new(times: &Times, made: u64, wall: Duration) -> Self {
        Self {
            made,
            threads: rayon::current_num_threads(),
            wall_s: wall.as_secs_f64(),
            settle_s: times.settle.as_secs_f64(),
            render_s: times.render.as_secs_f64(),
            label_s: times.label.as_secs_f64(),
            write_s: times.write.as_secs_f64(),
        }
    }

    fn append(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string(self).map_err(|e| Error::file(path, e))?;
        let mut file = io::open_own(path)?;
        let written = file.write_all((text + "\n").as_bytes());
        written.map_err(|e| Error::file(path, e))
    }
}

/// The runs that wrote a folder.
pub(crate) fn runs_of(folder: &Path) -> Vec<RunTimes> {
    let text = io::inside(folder, RUNS).and_then(io::read_text);
    let text = text.unwrap_or_default();
    let lines = text.lines().map(serde_json::from_str);
    lines.filter_map(|line| line.ok()).collect()
}

/// The result of a closure, and how long it took.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let began = Instant::now();
    let done = work();
    (done, began.elapsed())
}
