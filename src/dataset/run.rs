//! One run over a dataset's folder: many samples at a time, each entered in the journal when its files are there.

use crate::dataset::folder;
use crate::dataset::journal::{Journal, Line};
use crate::dataset::times::Times;
use crate::dataset::{Numbers, Plan, Report};
use crate::error::{Error, Result};
use crate::io;
use crate::work;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Samples between two calls that bring everything to the disk.
const SYNC_EVERY: u64 = 256;

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples in the folder, those of an earlier run included.
    pub done: u64,
    /// Samples asked for.
    pub count: u64,
    /// Samples made by this run.
    pub made: u64,
}

/// Writes the samples of a plan that are not in its folder yet and returns what the folder then holds; `write` puts the
/// files of a sample in their places.
pub(super) fn run(
    plan: &Plan,
    write: impl Fn(u64) -> Result<(Line, Times)> + Sync,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<Report> {
    let _lock = folder::claim(plan)?;
    let journal = Journal::open(&plan.folder)?;
    let wanted = (0..plan.count).filter(|&k| plan.numbers.contains(k));
    let again = matches!(plan.numbers, Numbers::One(_));
    let missing: Vec<u64> = wanted.filter(|&k| again || !journal.has(k)).collect();
    let asked = (0..plan.count).filter(|&k| plan.numbers.contains(k)).count() as u64;
    let done = journal.count(plan.count, |k| plan.numbers.contains(k));
    let progressed = Progress { done, count: asked, made: 0 };
    let books = Mutex::new(Books { journal, progressed, times: Times::default(), failure: None });
    let run = Run { plan, write, progress, stop, books, began: Instant::now() };
    run.tell(&run.books());
    run.work(&missing)?;
    run.finish()
}

/// What the threads of one run share.
struct Run<'a, F> {
    plan: &'a Plan,
    write: F,
    progress: &'a (dyn Fn(Progress) + Sync),
    stop: &'a AtomicBool,
    books: Mutex<Books>,
    began: Instant,
}

/// What is done, and what went wrong first (in order of number).
struct Books {
    journal: Journal,
    progressed: Progress,
    times: Times,
    failure: Option<(u64, Error)>,
}

impl<F: Fn(u64) -> Result<(Line, Times)> + Sync> Run<'_, F> {
    /// Makes samples until there are none left or there is a reason to stop.
    fn work(&self, missing: &[u64]) -> Result<()> {
        let threads = rayon::current_num_threads();
        let workers = threads.min(missing.len());
        let pool = |_| work::pool(threads / workers.max(1));
        let pools: std::io::Result<Vec<_>> = (0..workers).map(pool).collect();
        let pools = pools.map_err(|e| Error::value("threads", e))?;
        let next = AtomicUsize::new(0);
        let take = || missing.get(next.fetch_add(1, Ordering::Relaxed)).copied().filter(|_| self.goes_on());
        std::thread::scope(|scope| {
            for pool in &pools {
                scope.spawn(|| pool.install(|| std::iter::from_fn(take).for_each(|k| self.one(k))));
            }
        });
        Ok(())
    }

    fn goes_on(&self) -> bool {
        !self.stop.load(Ordering::Relaxed) && self.books().failure.is_none()
    }

    /// Writes one sample, then enters it in the books.
    fn one(&self, k: u64) {
        let written = (self.write)(k);
        let mut books = self.books();
        match written.and_then(|(line, times)| books.enter(line, times)) {
            Ok(()) => {
                self.tell(&books);
                let due = books.progressed.made.is_multiple_of(SYNC_EVERY);
                drop(books);
                if due {
                    io::sync(&self.plan.folder);
                }
            }
            // Not this sample's fault: it is made by the run that goes on.
            Err(Error::Interrupted { .. }) if self.stop.load(Ordering::Relaxed) => {}
            Err(e) if books.failure.as_ref().is_none_or(|(first, _)| k < *first) => books.failure = Some((k, e)),
            Err(_) => {}
        }
    }

    fn tell(&self, books: &Books) {
        (self.progress)(books.progressed);
    }

    fn books(&self) -> MutexGuard<'_, Books> {
        // A thread that panicked left the books as they were: every entry is one step.
        self.books.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Closes the books, whatever happened, then says what did.
    fn finish(self) -> Result<Report> {
        let (plan, wall) = (self.plan, self.began.elapsed());
        let Books { journal, progressed: Progress { made, .. }, times, failure } =
            self.books.into_inner().unwrap_or_else(PoisonError::into_inner);
        io::sync(&plan.folder);
        times.append(&plan.folder, made, wall);
        let closed = journal.close(plan.count);
        if let Some((k, error)) = failure {
            let (count, folder) = (plan.count, plan.folder.display());
            log::warn!("sample {k} failed; {} and the same command goes on", done_of(&closed, count, &folder));
            return Err(error);
        }
        let lines = closed?;
        let there = |k: &u64| lines.binary_search_by_key(k, |line| line.k).is_ok();
        if (0..plan.count).filter(|&k| plan.numbers.contains(k)).any(|k| !there(&k)) {
            let (done, count, folder) = (lines.len(), plan.count, plan.folder.display());
            return Err(Error::Interrupted {
                what: format!("{done} of {count} samples are in {folder}; the same command goes on"),
            });
        }
        if lines.len() as u64 == plan.count {
            let samples: Vec<_> = lines.iter().map(Line::written).collect();
            plan.writers.iter().try_for_each(|writer| writer.finish(&plan.folder, &plan.classes, &samples))?;
        }
        Ok(Report::of(&lines, &plan.classes, plan.count, made))
    }
}

fn done_of(closed: &Result<Vec<Line>>, count: u64, folder: &impl std::fmt::Display) -> String {
    match closed {
        Ok(lines) => format!("{} of {count} samples are in {folder}", lines.len()),
        Err(_) => format!("those before are in {folder}"),
    }
}

impl Books {
    fn enter(&mut self, line: Line, times: Times) -> Result<()> {
        let Progress { done, count, made } = self.progressed;
        let new = u64::from(!self.journal.has(line.k));
        self.journal.add(line)?;
        self.progressed = Progress { done: done + new, count, made: made + 1 };
        self.times += times;
        Ok(())
    }
}
