//! Progress of a long job: a bar on a terminal, lines in a log.

use crate::print;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ProgressFormat {
    Bar,
    Json,
}

impl ProgressFormat {
    /// How often a line is printed.
    fn interval(self) -> Duration {
        Duration::from_secs(match self {
            Self::Bar => 10,
            Self::Json => 1,
        })
    }
}

/// Shows the progress of a long job, until it is dropped.
pub(crate) struct ProgressDisplay {
    bar: ProgressBar,
    /// Whether the bar is drawn on a terminal; elsewhere there are lines, or nothing.
    is_drawn: bool,
    log: Option<Mutex<ProgressLog>>,
}

impl ProgressDisplay {
    pub(crate) fn new(job: &'static str, quiet: bool, format: ProgressFormat) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let json = format == ProgressFormat::Json;
        let is_logged = json || (!on_terminal && !quiet);
        Self {
            bar: hidden_bar(job),
            is_drawn: on_terminal && !quiet && !json,
            log: is_logged.then(|| Mutex::new(ProgressLog::new(job, format))),
        }
    }

    /// `done` of `total` steps are done; the first call gives those done before.
    pub(crate) fn update(&self, done: u64, total: u64) {
        if self.bar.length() != Some(total) {
            self.restart_bar(done, total);
        }
        self.bar.set_position(done);
        if let Some(Ok(mut log)) = self.log.as_ref().map(Mutex::lock) {
            log.update(done, total);
        }
    }

    fn restart_bar(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
        self.bar.reset_eta();
        if self.is_drawn {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for ProgressDisplay {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A bar without a length yet, which would be drawn full.
fn hidden_bar(job: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}  {per_sec}  {eta} left");
    ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden())
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        .with_message(job)
}

/// Progress as lines on standard error.
struct ProgressLog {
    job: &'static str,
    format: ProgressFormat,
    /// When the job began, and how many steps were already done.
    began: Option<(Instant, u64)>,
    last: Instant,
}

impl ProgressLog {
    fn new(job: &'static str, format: ProgressFormat) -> Self {
        Self {
            job,
            format,
            began: None,
            last: Instant::now(),
        }
    }

    fn update(&mut self, done: u64, total: u64) {
        let is_end = self.began.is_none() || done == total;
        let (began, before) = *self.began.get_or_insert((Instant::now(), done));
        if self.is_due(is_end) {
            self.last = Instant::now();
            let steps = done.saturating_sub(before) as f64;
            self.print(&JobStatus {
                job: self.job,
                done,
                total,
                per_second: steps / began.elapsed().as_secs_f64().max(1e-9),
            });
        }
    }

    /// In JSON there is always a line for the first and the last step.
    fn is_due(&self, is_end: bool) -> bool {
        (self.format == ProgressFormat::Json && is_end)
            || self.last.elapsed() >= self.format.interval()
    }

    fn print(&self, status: &JobStatus) {
        match self.format {
            ProgressFormat::Bar => print::aside(status),
            ProgressFormat::Json => print::aside(status.to_json()),
        }
    }
}

/// The progress and speed of a job.
struct JobStatus {
    job: &'static str,
    done: u64,
    total: u64,
    per_second: f64,
}

impl JobStatus {
    fn seconds_left(&self) -> f64 {
        self.total.saturating_sub(self.done) as f64 / self.per_second
    }

    fn to_json(&self) -> serde_json::Value {
        // JSON has no infinity: values not known yet are null.
        serde_json::json!({
            "job": self.job,
            "done": self.done,
            "of": self.total,
            "per_s": Some(self.per_second).filter(|rate| rate.is_finite()),
            "left_s": Some(self.seconds_left()).filter(|left| left.is_finite()),
        })
    }
}

impl fmt::Display for JobStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} of {}", self.job, self.done, self.total)?;
        if self.per_second > 0.0 {
            let (rate, left) = (self.per_second, self.seconds_left());
            write!(f, ", {rate:.1} a second, {left:.0} s left")?;
        }
        Ok(())
    }
}
