//! One run over a dataset's folder: many samples at a time, each entered in the journal when its files are there.

use crate::dataset::folder;
use crate::dataset::journal::Journal;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::times::Times;
use crate::dataset::{DatasetCounts, Plan, SampleRange};
use crate::error::{Error, Result};
use crate::io;
use crate::work;
use std::sync::atomic::{AtomicBool, Ordering};
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

/// Most samples that a dataset may have: a number above is a slip of the finger, and no sum of counts can overflow.
const MOST_SAMPLES: u64 = 1_000_000_000;

/// Fails for a number of samples that nobody can mean.
pub(super) fn check_count(count: u64) -> Result<()> {
    match count <= MOST_SAMPLES {
        true => Ok(()),
        false => Err(Error::value(
            "count",
            format!("{count} samples, expected at most {MOST_SAMPLES}"),
        )),
    }
}

/// Writes the samples of a plan that are not in its folder yet and returns what the folder then holds; `write` puts the
/// files of a sample in their places.
pub(super) fn run(
    plan: &Plan,
    write: impl Fn(u64) -> Result<(JournalLine, Times)> + Sync,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    check_count(plan.count)?;
    let _lock = folder::claim(plan)?;
    plan.inputs.keep(&plan.folder);
    let journal = Journal::open(&plan.folder)?;
    let again = matches!(plan.range, SampleRange::One(_));
    // One sample is made again whatever the number of the others.
    let count = if again {
        plan.count.max(journal.end())
    } else {
        plan.count
    };
    nothing_beyond(&journal, count, plan)?;
    let done = journal.count(count, |k| plan.range.contains(k));
    let asked = plan.range.count_below(count);
    let missing = if again {
        asked
    } else {
        asked.saturating_sub(done)
    };
    let next = Mutex::new(plan.range.below(count));
    let progressed = Progress {
        done,
        count: asked,
        made: 0,
    };
    let books = Mutex::new(Books {
        journal,
        progressed,
        times: Times::default(),
        failure: None,
    });
    let run = Run {
        plan,
        count,
        write,
        progress,
        stop,
        books,
        began: Instant::now(),
    };
    run.tell(&run.books());
    run.work(missing, || {
        let mut next = next.lock().unwrap_or_else(PoisonError::into_inner);
        next.find(|&k| again || !run.books().journal.has(k))
    })?;
    run.finish()
}

/// Fails where the folder holds more than is asked for: trainers read all that is there.
fn nothing_beyond(journal: &Journal, count: u64, plan: &Plan) -> Result<()> {
    let end = journal.end();
    if end <= count {
        return Ok(());
    }
    let what = format!(
        "has image {}, but only {count} are asked for: ask for at least {end}, or begin a new folder (`petcomp dataset \
         subset` lists a part of one)",
        end - 1
    );
    Err(Error::file(&plan.folder, what))
}

/// What the threads of one run share.
struct Run<'a, F> {
    plan: &'a Plan,
    /// Samples of the whole dataset.
    count: u64,
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

impl<F: Fn(u64) -> Result<(JournalLine, Times)> + Sync> Run<'_, F> {
    /// Makes samples until `next` has none, of the `missing` ones, or there is a reason to stop.
    fn work(&self, missing: u64, next: impl Fn() -> Option<u64> + Sync) -> Result<()> {
        let threads = rayon::current_num_threads();
        let workers = threads.min(usize::try_from(missing).unwrap_or(threads));
        let pool = |_| work::pool(threads / workers.max(1));
        let pools: std::io::Result<Vec<_>> = (0..workers).map(pool).collect();
        let pools = pools.map_err(|e| Error::value("threads", e))?;
        let take = || if self.goes_on() { next() } else { None };
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
            Err(e) if books.failure.as_ref().is_none_or(|(first, _)| k < *first) => {
                books.failure = Some((k, e))
            }
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
    fn finish(self) -> Result<DatasetCounts> {
        let (plan, count, wall) = (self.plan, self.count, self.began.elapsed());
        let Books {
            journal,
            progressed: Progress { made, .. },
            times,
            failure,
        } = self
            .books
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        io::sync(&plan.folder);
        times.append(&plan.folder, made, wall);
        let (done, asked) = (
            journal.count(count, |k| plan.range.contains(k)),
            plan.range.count_below(count),
        );
        let state = format!(
            "{done} of {asked} samples are in {}; the same command goes on",
            plan.folder.display()
        );
        let closed = journal.close(count);
        if let Some((k, error)) = failure {
            log::warn!("sample {k} failed; {state}");
            return Err(error);
        }
        let lines = closed?;
        if done < asked {
            return Err(Error::Interrupted { what: state });
        }
        if lines.len() as u64 == count {
            let samples: Vec<_> = lines.iter().map(JournalLine::written).collect();
            plan.writers
                .iter()
                .try_for_each(|writer| writer.finish(&plan.folder, &plan.classes, &samples))?;
        }
        Ok(DatasetCounts::new(&lines, plan, count, made))
    }
}

impl Books {
    fn enter(&mut self, line: JournalLine, times: Times) -> Result<()> {
        let Progress { done, count, made } = self.progressed;
        let new = u64::from(!self.journal.has(line.k));
        self.journal.add(line)?;
        self.progressed = Progress {
            done: done + new,
            count,
            made: made + 1,
        };
        self.times += times;
        Ok(())
    }
}
