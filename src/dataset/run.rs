//! One run over a dataset's folder: many samples at a time, each entered in the journal once its
//! files are present.

use crate::dataset::folder;
use crate::dataset::journal::Journal;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::times::Times;
use crate::dataset::{DatasetCounts, Plan, SampleRange};
use crate::error::{Error, Result};
use crate::io::Syncing;
use crate::work;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Progress of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Samples in the folder, including those of earlier runs.
    pub done: u64,
    /// Samples requested.
    pub count: u64,
    /// Samples made by this run.
    pub made: u64,
}

impl Progress {
    /// The progress of a run that is about to begin.
    fn so_far(journal: &Journal, plan: &Plan, count: u64) -> Self {
        Self {
            done: journal.count(count, |k| plan.range.contains(k)),
            count: plan.range.count_below(count),
            made: 0,
        }
    }

    fn is_done(&self) -> bool {
        self.done >= self.count
    }

    pub(super) fn describe(&self, folder: &Path) -> String {
        let (done, asked, folder) = (self.done, self.count, folder.display());
        format!("{done} of {asked} samples are in {folder}; rerun the same command to resume")
    }

    /// The progress of a run of which another one is a part.
    pub(super) fn with(self, part: Self) -> Self {
        Self {
            done: self.done + part.done,
            count: self.count,
            made: self.made + part.made,
        }
    }

    /// Counts a sample that was made.
    fn add(&mut self, is_new: bool) {
        self.done += u64::from(is_new);
        self.made += 1;
    }
}

/// Receives the progress of a run.
pub(super) type Report<'a> = &'a (dyn Fn(Progress) + Sync);

/// Maximum number of samples of a dataset: a larger number is a typing error, and no sum of counts
/// can overflow.
const MAX_SAMPLES: u64 = 1_000_000_000;

/// Fails for an implausible number of samples.
pub(super) fn check_count(count: u64) -> Result<()> {
    match count <= MAX_SAMPLES {
        true => Ok(()),
        false => Err(Error::value(
            "count",
            format!("{count} samples, expected at most {MAX_SAMPLES}"),
        )),
    }
}

/// Writes the missing samples of a plan and returns what the folder then holds; `write` writes the
/// files of a sample, synced as it is told.
pub(super) fn run(
    plan: &Plan,
    write: impl Fn(u64, Syncing) -> Result<(JournalLine, Times)> + Sync,
    progress: Report,
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    check_count(plan.count)?;
    plan.range.check(plan.count)?;
    let _lock = folder::claim(plan)?;
    plan.inputs.keep(&plan.folder);
    let journal = Journal::open(&plan.folder)?;
    let count = expected_count(plan, &journal);
    check_nothing_beyond(&journal, count, plan)?;
    let state = RunState::new(journal, plan, count);
    if !state.progress.is_done() {
        part_samples(plan)?;
    }
    let run = DatasetRun {
        plan,
        count,
        write,
        progress,
        stop,
        state: Mutex::new(state),
        began: Instant::now(),
    };
    run.report(&run.state());
    run.make_all()?;
    run.finish()
}

/// A single sample can be generated again whatever the number of the others.
fn expected_count(plan: &Plan, journal: &Journal) -> u64 {
    match plan.range {
        SampleRange::One(_) => plan.count.max(journal.end()),
        _ => plan.count,
    }
}

/// One thread pool for each sample in progress.
fn worker_pools(missing: u64) -> Result<Vec<rayon::ThreadPool>> {
    let threads = rayon::current_num_threads();
    let workers = threads.min(usize::try_from(missing).unwrap_or(threads));
    let pools = (0..workers).map(|_| work::pool(threads / workers.max(1)));
    let pools: std::io::Result<Vec<_>> = pools.collect();
    pools.map_err(|e| Error::value("threads", e))
}

/// Fails if the folder holds more than was requested: trainers read everything in it.
fn check_nothing_beyond(journal: &Journal, count: u64, plan: &Plan) -> Result<()> {
    let end = journal.end();
    if end <= count {
        return Ok(());
    }
    let what = format!(
        "has image {}, but only {count} are requested: request at least {end}, or use a new folder (`petcomp dataset subset` lists a part of one)",
        end - 1
    );
    Err(Error::file(&plan.folder, what))
}

/// State shared by the threads of one run.
struct DatasetRun<'a, F> {
    plan: &'a Plan,
    /// Samples of the whole dataset.
    count: u64,
    write: F,
    progress: Report<'a>,
    stop: &'a AtomicBool,
    state: Mutex<RunState>,
    began: Instant,
}

/// What is done, and the failure with the lowest number.
struct RunState {
    journal: Journal,
    progress: Progress,
    times: Times,
    failure: Option<(u64, Error)>,
}

impl<F: Fn(u64, Syncing) -> Result<(JournalLine, Times)> + Sync> DatasetRun<'_, F> {
    /// Generates samples until `next` has none, of the `missing` ones, or there is a reason to
    /// stop.
    fn work(&self, missing: u64, next: impl Fn() -> Option<u64> + Sync) -> Result<()> {
        let pools = worker_pools(missing)?;
        std::thread::scope(|scope| {
            for pool in &pools {
                scope.spawn(|| {
                    pool.install(|| {
                        while let Some(k) = self.goes_on().then(&next).flatten() {
                            self.make_one(k);
                        }
                    });
                });
            }
        });
        Ok(())
    }

    /// Maximum number of samples to generate.
    fn missing(&self, again: bool) -> u64 {
        let Progress { done, count, .. } = self.state().progress;
        if again {
            count
        } else {
            count - done.min(count)
        }
    }

    /// Generates every missing sample, or a single requested one in any case.
    fn make_all(&self) -> Result<()> {
        let again = matches!(self.plan.range, SampleRange::One(_));
        let next = Mutex::new(self.plan.range.below(self.count));
        self.work(self.missing(again), || {
            let mut next = next.lock().unwrap_or_else(PoisonError::into_inner);
            next.find(|&k| again || !self.state().journal.has(k))
        })
    }

    fn goes_on(&self) -> bool {
        !self.stop.load(Ordering::Relaxed) && self.state().failure.is_none()
    }

    /// Writes one sample, then enters it in the state.
    fn make_one(&self, k: u64) {
        let syncing = self.state().journal.syncing(k);
        let written = (self.write)(k, syncing);
        let mut state = self.state();
        match written.and_then(|(line, times)| state.enter(line, times)) {
            Ok(()) => self.report(&state),
            // Not this sample's fault: a resumed run will generate it.
            Err(Error::Interrupted { .. }) if self.stop.load(Ordering::Relaxed) => {}
            Err(error) => state.fail(k, error),
        }
    }

    fn report(&self, state: &RunState) {
        (self.progress)(state.progress);
    }

    fn state(&self) -> MutexGuard<'_, RunState> {
        // A panic in a thread leaves the state consistent: every entry is one step.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Closes the state in any case, then returns the result.
    fn finish(self) -> Result<DatasetCounts> {
        let (plan, count, wall) = (self.plan, self.count, self.began.elapsed());
        let state = self.state.into_inner();
        let state = state.unwrap_or_else(PoisonError::into_inner);
        let made = state.progress.made;
        state.times.append(&plan.folder, made, wall);
        let lines = state.close(plan, count)?;
        if lines.len() as u64 == count {
            join_samples(plan, &lines)?;
        }
        Ok(DatasetCounts::new(&lines, plan, count, made))
    }
}

/// Deletes the files that hold many samples: they would not include those that are added.
fn part_samples(plan: &Plan) -> Result<()> {
    let mut writers = plan.writers.iter();
    writers.try_for_each(|writer| writer.reopen(&plan.folder))
}

/// Writes the files that hold many samples.
fn join_samples(plan: &Plan, lines: &[JournalLine]) -> Result<()> {
    let samples: Vec<_> = lines.iter().map(JournalLine::written).collect();
    plan.writers
        .iter()
        .try_for_each(|writer| writer.finish(&plan.folder, &plan.classes, &samples))
}

impl RunState {
    /// The state before a run's first sample.
    fn new(journal: Journal, plan: &Plan, count: u64) -> Self {
        Self {
            progress: Progress::so_far(&journal, plan, count),
            journal,
            times: Times::default(),
            failure: None,
        }
    }

    /// Keeps the error of the sample with the lowest number.
    fn fail(&mut self, k: u64, error: Error) {
        if self.failure.as_ref().is_none_or(|(first, _)| k < *first) {
            self.failure = Some((k, error));
        }
    }

    /// Sorts the journal and returns its lines.
    ///
    /// # Errors
    /// The error of the sample that failed; fewer samples than requested.
    fn close(self, plan: &Plan, count: u64) -> Result<Vec<JournalLine>> {
        let now = Progress::so_far(&self.journal, plan, count);
        let closed = self.journal.close(count);
        if let Some((k, error)) = self.failure {
            log::warn!("sample {k} failed; {}", now.describe(&plan.folder));
            return Err(error);
        }
        let lines = closed?;
        if !now.is_done() {
            let what = now.describe(&plan.folder);
            return Err(Error::Interrupted { what });
        }
        Ok(lines)
    }

    fn enter(&mut self, line: JournalLine, times: Times) -> Result<()> {
        let is_new = !self.journal.has(line.k);
        self.journal.add(line)?;
        self.progress.add(is_new);
        self.times += times;
        Ok(())
    }
}
