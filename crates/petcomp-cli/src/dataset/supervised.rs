//! A supervised run: it shows its progress, stops when interrupted, and needs confirmation before
//! it takes hours.

use crate::global::GlobalArgs;
use crate::interruption::interruption;
use petcomp::Error;
use petcomp::dataset::{self, DatasetCounts, LongRun, Pipeline, Plan, Progress, RunPace};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How often the remaining time is estimated.
const ESTIMATE_INTERVAL: Duration = Duration::from_millis(500);

/// Whether a job may take very long.
#[derive(clap::Args)]
pub(crate) struct LongRunConsent {
    /// Continue a job that would take more than an hour; without this, it stops with an estimate
    /// after its first images
    #[arg(long)]
    yes: bool,
}

/// Generates the dataset, showing progress; stops between two pictures when interrupted, or when
/// the first ones show that it will take longer than an hour without the user's consent.
pub(crate) fn generate_supervised(
    pipeline: &Pipeline,
    plan: &Plan,
    consent: &LongRunConsent,
    global: &GlobalArgs,
) -> anyhow::Result<DatasetCounts> {
    for idle in pipeline.idle_keys() {
        log::warn!("{idle}");
    }
    let display = global.start_progress("pictures");
    let watch = RunWatch::new();
    let (made, long_run) = watch.over(!consent.yes, || {
        dataset::generate(
            plan,
            |k| pipeline.sample(plan.seed, k),
            &|progress| {
                display.update(progress.done, progress.count);
                watch.note(progress);
            },
            interruption(),
        )
    });
    match (made, long_run) {
        (Err(Error::Interrupted { what }), Some(long)) => {
            anyhow::bail!("this would take {long}; add --yes to continue ({what})")
        }
        (made, _) => Ok(made?),
    }
}

/// Estimates during a run how long it will take.
struct RunWatch {
    threads: usize,
    /// None until the run is about to generate pictures: the time for opening a large folder does
    /// not count.
    pace: Mutex<Option<RunPace>>,
}

impl RunWatch {
    fn new() -> Self {
        Self {
            threads: rayon::current_num_threads(),
            pace: Mutex::new(None),
        }
    }

    fn note(&self, progress: Progress) {
        let now = Instant::now();
        let mut pace = self.pace();
        let pace = pace.get_or_insert_with(|| RunPace::new(self.threads, progress, now));
        pace.note(progress, now);
    }

    fn pace(&self) -> MutexGuard<'_, Option<RunPace>> {
        self.pace.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Runs the job and, if `is_limited`, stops it when it would take too long; also returns the
    /// estimate.
    fn over<T>(&self, is_limited: bool, job: impl FnOnce() -> T) -> (T, Option<LongRun>) {
        std::thread::scope(|scope| {
            // Dropped when the job ends, even by a panic.
            let (running, end) = mpsc::channel();
            let watching = is_limited.then(|| scope.spawn(move || self.stop_long_run(&end)));
            let made = job();
            drop(running);
            let long_run = watching.and_then(|watching| watching.join().ok().flatten());
            (made, long_run)
        })
    }

    /// Runs until the job ends; stops the job if it will take longer than an hour, and returns how
    /// long.
    fn stop_long_run(&self, end: &Receiver<()>) -> Option<LongRun> {
        while end.recv_timeout(ESTIMATE_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            let long_run = self.estimate();
            if long_run.is_some() {
                interruption().store(true, Ordering::Relaxed);
                return long_run;
            }
        }
        None
    }

    fn estimate(&self) -> Option<LongRun> {
        let pace = *self.pace();
        pace?.long_run(Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_panics_ends() {
        let (ended, end) = mpsc::channel::<()>();
        std::thread::spawn(move || {
            let _ended = ended;
            RunWatch::new().over(true, || panic!("on purpose"))
        });
        let outcome = end.recv_timeout(Duration::from_secs(60));
        assert_eq!(outcome, Err(RecvTimeoutError::Disconnected));
    }
}
