//! Counts, added up for the job that requested them.
//!
//! # Why separate threads
//! A value returned by every function would have to pass through filters, levels of detail computed
//! on demand and file readers, which return their results to whoever asks first. A global sum would
//! mix scenes that are generated concurrently. So a job that is counted runs on its own threads,
//! each of which knows where to add; two jobs share no thread and hence no sum. Sums of integers do
//! not depend on their order, and work that racing threads may do twice is counted where the result
//! is kept, so the numbers are the same at any thread count. Counting never affects an output byte.

use super::Kind;
use std::cell::RefCell;
use std::ops::Index;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Allocations of at least this many bytes are counted as large.
pub const LARGE_BYTES: usize = 1 << 20;

/// How much of each kind was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work([u64; Kind::ALL.len()]);

impl Index<Kind> for Work {
    type Output = u64;

    fn index(&self, kind: Kind) -> &u64 {
        &self.0[kind as usize]
    }
}

/// Sums that threads add to.
#[derive(Debug, Default)]
struct Tally([AtomicU64; Kind::ALL.len()]);

impl Tally {
    fn work(&self) -> Work {
        Work(std::array::from_fn(|i| self.0[i].load(Ordering::Relaxed)))
    }
}

thread_local! {
    /// The job that this thread adds to; none on most.
    static CURRENT_TALLY: RefCell<Option<Arc<Tally>>> = const { RefCell::new(None) };
}

/// Runs a job on as many threads as the current pool has, and returns what it did.
///
/// A job inside another job adds nothing to the outer one. Threads that the job starts itself are
/// not counted, except those of this library.
///
/// # Errors
/// When the system provides no threads.
pub fn counted<T: Send>(job: impl FnOnce() -> T + Send) -> std::io::Result<(T, Work)> {
    let tally = Arc::new(Tally::default());
    let done = pool_for(Some(tally.clone()), rayon::current_num_threads())?.install(job);
    // A job ends when all its parts have ended.
    Ok((done, tally.work()))
}

/// A pool whose threads add to this thread's job.
pub fn pool(threads: usize) -> std::io::Result<rayon::ThreadPool> {
    pool_for(CURRENT_TALLY.with_borrow(Clone::clone), threads)
}

fn pool_for(tally: Option<Arc<Tally>>, threads: usize) -> std::io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler(move |_| CURRENT_TALLY.set(tally.clone()))
        .build()
        .map_err(std::io::Error::other)
}

/// Adds to the work of this thread's job.
#[inline]
pub(crate) fn add(kind: Kind, count: u64) {
    add_all([(kind, count)]);
}

/// Adds several kinds of work.
#[inline]
pub(crate) fn add_all<const N: usize>(counts: [(Kind, u64); N]) {
    CURRENT_TALLY.with_borrow(|current| {
        let Some(tally) = current else { return };
        for (kind, count) in counts {
            tally.0[kind as usize].fetch_add(count, Ordering::Relaxed);
        }
    });
}

/// For the allocator of a program that counts: this many bytes were requested at once.
///
/// Small requests cost one comparison. Never allocates.
#[inline]
pub fn allocated(bytes: usize) {
    if bytes >= LARGE_BYTES {
        // A thread that is ending no longer has one.
        let _ = CURRENT_TALLY.try_with(|tally| {
            if let Ok(Some(tally)) = tally.try_borrow().as_deref() {
                tally.0[Kind::LargeAllocations as usize].fetch_add(1, Ordering::Relaxed);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    fn job(n: u64) -> u64 {
        (0..n).into_par_iter().for_each(|_| add(Kind::Filters, 2));
        n
    }

    #[test]
    fn every_thread_of_a_job_is_counted() {
        let (done, work) = counted(|| job(1000)).unwrap();
        assert_eq!(
            (done, work[Kind::Filters], work[Kind::Masks]),
            (1000, 2000, 0)
        );
    }

    #[test]
    fn jobs_side_by_side_are_not_mixed() {
        let works: Vec<_> = (0..8_u64)
            .into_par_iter()
            .map(|k| counted(|| job(10 * k)).unwrap().1)
            .collect();
        assert!(
            works
                .iter()
                .zip(0..)
                .all(|(work, k)| work[Kind::Filters] == 20 * k)
        );
    }

    #[test]
    fn nothing_is_counted_outside_of_a_job() {
        let _ = counted(|| job(10)).unwrap();
        job(10);
        let (_, work) = counted(|| ()).unwrap();
        assert_eq!(work, Work::default());
    }

    #[test]
    fn pools_that_a_job_opens_are_counted() {
        let (_, work) = counted(|| pool(2).unwrap().install(|| job(7))).unwrap();
        assert_eq!(work[Kind::Filters], 14);
        let (_, work) = counted(|| counted(|| job(7)).unwrap()).unwrap();
        assert_eq!(work, Work::default(), "a job inside adds to its own tally");
    }

    #[test]
    fn large_allocations_are_counted_and_small_ones_are_not() {
        let (_, work) =
            counted(|| [LARGE_BYTES - 1, LARGE_BYTES, usize::MAX].map(allocated)).unwrap();
        // The program's own allocator may also count; here there is none.
        assert_eq!(work[Kind::LargeAllocations], 2);
    }
}
