//! A run under supervision: it shows its progress, stops when interrupted, and asks before it takes
//! hours.

use crate::global::GlobalArgs;
use crate::interruption::interruption;
use petcomp::Error;
use petcomp::dataset::{self, DatasetCounts, LongRun, Pipeline, Plan, Progress};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

/// How often the time that the rest will take is estimated.
const ESTIMATE_INTERVAL: Duration = Duration::from_millis(500);

/// Whether a job may take very long.
#[derive(clap::Args)]
pub(crate) struct LongRunConsent {
    /// Go on with a job that would take more than an hour; without, it stops with an estimate
    /// after its first pictures
    #[arg(long)]
    yes: bool,
}

/// Makes the dataset, showing progress, and stops between two pictures when interrupted, or when
/// the first ones show that it takes longer than an hour and nobody has agreed to that.
pub(crate) fn generate_supervised(
    pipeline: &Pipeline,
    plan: &Plan,
    consent: &LongRunConsent,
    global: &GlobalArgs,
) -> anyhow::Result<DatasetCounts> {
    let display = global.start_progress("pictures");
    let watch = RunWatch::default();
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
            anyhow::bail!("this would take {long}; say --yes to go on ({what})")
        }
        (made, _) => Ok(made?),
    }
}

/// Estimates beside a run how long it will take.
#[derive(Default)]
struct RunWatch {
    last: Mutex<Option<Progress>>,
    is_done: AtomicBool,
}

impl RunWatch {
    fn note(&self, progress: Progress) {
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    }

    /// Runs the job and, where that is asked for, stops it when it would take too long; returns the
    /// estimate, too.
    fn over<T>(&self, is_limited: bool, job: impl FnOnce() -> T) -> (T, Option<LongRun>) {
        std::thread::scope(|scope| {
            let watching = is_limited.then(|| scope.spawn(|| self.stop_long_run()));
            let made = job();
            self.is_done.store(true, Ordering::Relaxed);
            (made, watching.and_then(join_now))
        })
    }

    /// Stops the run when it is going to take longer than an hour, and returns how long.
    fn stop_long_run(&self) -> Option<LongRun> {
        let began = Instant::now();
        while !self.is_done.load(Ordering::Relaxed) {
            let long_run = self.estimate(began);
            if long_run.is_some() {
                interruption().store(true, Ordering::Relaxed);
                return long_run;
            }
            std::thread::park_timeout(ESTIMATE_INTERVAL);
        }
        None
    }

    fn estimate(&self, began: Instant) -> Option<LongRun> {
        let progress = *self.last.lock().unwrap_or_else(PoisonError::into_inner);
        LongRun::of(&progress?, began.elapsed(), rayon::current_num_threads())
    }
}

fn join_now(watching: ScopedJoinHandle<'_, Option<LongRun>>) -> Option<LongRun> {
    watching.thread().unpark();
    watching.join().ok().flatten()
}
