//! Makes a dataset, many samples at a time, in a folder that survives any interruption.

use crate::dataset::journal::{Journal, Line};
use crate::dataset::{Entry, Obstructed, Report, Sample, Split, Writer, folder};
use crate::error::{Error, Result};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A dataset to make.
pub struct Plan {
    /// Where; made if it is not there.
    pub folder: PathBuf,
    /// Number of samples.
    pub count: u64,
    /// Seed, as it is told in the files; the samples come from the closure.
    pub seed: u64,
    /// Everything else that decides what a sample is: a run into a folder that was made from another is refused.
    pub recipe: serde_json::Value,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
    /// Which samples are for validation.
    pub split: Split,
    /// What happens to the labels of objects that something lies over.
    pub obstructed: Obstructed,
    /// The files to write, in this order.
    pub writers: Vec<Box<dyn Writer>>,
}

impl Plan {
    /// Hash of everything but the seed that decides what a sample is.
    pub fn recipe_hash(&self) -> String {
        format!("{:08x}", crc32fast::hash(self.recipe.to_string().as_bytes()))
    }
}

/// How far [`generate`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples in the folder, those of an earlier run included.
    pub done: u64,
    /// Samples asked for.
    pub count: u64,
    /// Samples made by this run.
    pub made: u64,
}

/// Makes the samples `0..count` that are not in the folder yet and returns what the folder then holds.
///
/// `make(k)` gives sample `k`; it is called from several threads, for each `k` at most once, in no fixed order, and must
/// depend on nothing but `k`. `progress` is called once at the start and after each sample, one call at a time. Once
/// `stop` is true, samples in hand are finished and no more are begun.
///
/// The files depend on the plan alone: not on threads, order, time, or how often the run was interrupted. As many samples
/// are in memory as the current rayon pool has threads; each works on its own, since pictures beside each other keep
/// processors busier than rows of one picture.
///
/// # Errors
/// [`Error::Interrupted`] after a stop; the first error of `make` or of a writer, in order of `k` among those in hand;
/// a folder that is a file, holds something else, was made from another plan (the message names the field), or is being
/// written by another run. In every case the folder stays valid, and the same call continues it.
pub fn generate(
    plan: &Plan,
    make: impl Fn(u64) -> Result<Sample> + Sync,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<Report> {
    let _lock = folder::claim(plan)?;
    let journal = Journal::open(&plan.folder)?;
    let missing: Vec<u64> = (0..plan.count).filter(|&k| !journal.has(k)).collect();
    let books = Mutex::new(Books { journal, made: 0, failure: None });
    let run = Run { plan, recipe_hash: plan.recipe_hash(), make, progress, stop, books };
    run.tell(&run.books());
    run.work(&missing)?;
    run.finish()
}

/// What the threads of one run share.
struct Run<'a, F> {
    plan: &'a Plan,
    recipe_hash: String,
    make: F,
    progress: &'a (dyn Fn(Progress) + Sync),
    stop: &'a AtomicBool,
    books: Mutex<Books>,
}

/// What is done, and what went wrong first (in order of number).
struct Books {
    journal: Journal,
    made: u64,
    failure: Option<(u64, Error)>,
}

impl<F: Fn(u64) -> Result<Sample> + Sync> Run<'_, F> {
    /// Makes samples until there are none left or there is a reason to stop.
    fn work(&self, missing: &[u64]) -> Result<()> {
        let threads = rayon::current_num_threads();
        let workers = threads.min(missing.len());
        let pool = |_| rayon::ThreadPoolBuilder::new().num_threads(threads / workers.max(1)).build();
        let pools: std::result::Result<Vec<_>, _> = (0..workers).map(pool).collect();
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

    /// Makes and writes one sample, then enters it in the books.
    fn one(&self, k: u64) {
        let line = (self.make)(k).and_then(|sample| self.write(k, &sample));
        let mut books = self.books();
        match line.and_then(|line| books.journal.add(line)) {
            Ok(()) => {
                books.made += 1;
                self.tell(&books);
            }
            Err(e) if books.failure.as_ref().is_none_or(|(first, _)| k < *first) => books.failure = Some((k, e)),
            Err(_) => {}
        }
    }

    fn write(&self, k: u64, sample: &Sample) -> Result<Line> {
        check(sample, self.plan.classes.len())?;
        let Plan { folder, seed, classes, .. } = self.plan;
        let labelled = self.plan.obstructed.labelled(&sample.labels, classes.len());
        let part = self.plan.split.part(k, self.plan.count);
        let recipe_hash = &self.recipe_hash;
        let entry = Entry { k, seed: *seed, classes, recipe_hash, part, sample, labelled: &labelled };
        let mut files = Vec::new();
        for writer in &self.plan.writers {
            files.extend(writer.write(folder, &entry)?);
        }
        Line::of(&entry, folder, &files)
    }

    fn tell(&self, books: &Books) {
        let done = books.journal.count(self.plan.count);
        (self.progress)(Progress { done, count: self.plan.count, made: books.made });
    }

    fn books(&self) -> MutexGuard<'_, Books> {
        // A thread that panicked left the books as they were: every entry is one step.
        self.books.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn finish(self) -> Result<Report> {
        let plan = self.plan;
        let books = self.books.into_inner().unwrap_or_else(PoisonError::into_inner);
        let lines = books.journal.close(plan.count)?;
        if let Some((k, error)) = books.failure {
            log::warn!("sample {k} failed; {} of {} samples are in {}", lines.len(), plan.count, plan.folder.display());
            return Err(error);
        }
        if (lines.len() as u64) < plan.count {
            let (done, count, folder) = (lines.len(), plan.count, plan.folder.display());
            return Err(Error::Interrupted {
                what: format!("{done} of {count} samples are in {folder}; the same command goes on"),
            });
        }
        let samples: Vec<_> = lines.iter().map(Line::written).collect();
        plan.writers.iter().try_for_each(|writer| writer.finish(&plan.folder, &plan.classes, &samples))?;
        Ok(Report::of(&lines, &plan.classes, plan.count, books.made))
    }
}

/// Meets what the writers take for granted.
fn check(sample: &Sample, classes: usize) -> Result<()> {
    let (w, h) = sample.frame.size();
    let [lw, lh] = sample.labels.image;
    if (w, h) != (lw as usize, lh as usize) {
        return Err(Error::value("labels.image", format!("{lw} x {lh}, but the picture has {w} x {h}")));
    }
    match sample.labels.objects.iter().position(|object| object.class as usize >= classes) {
        Some(i) => {
            let class = sample.labels.objects[i].class;
            Err(Error::value(format!("labels.objects[{i}].class"), format!("{class}, but there are {classes} classes")))
        }
        None => Ok(()),
    }
}
