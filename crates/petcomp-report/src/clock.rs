//! CPU time of work on one thread.

use super::statistics::quantile;
use petcomp::{Error, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};
use rustix::time::{ClockId, clock_gettime};
use std::hint::black_box;

const SECONDS_PER_NANOSECOND: f64 = 1e-9;

/// CPU seconds used by this process, all its threads together.
///
/// Unlike wall-clock time, it does not depend on the other load of the machine (except through
/// caches and clock rates).
pub(super) fn cpu_seconds() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * SECONDS_PER_NANOSECOND
}

/// Shorter work is repeated when it is timed, seconds: otherwise the clock's resolution and caches
/// would show.
const MIN_TIMED_SECONDS: f64 = 2e-3;
/// Maximum number of repetitions.
const MOST_REPEATS: f64 = 1000.0;

/// The result of `work`, and the median CPU seconds of `runs` runs (at least 1) on one thread, so
/// that times can be compared.
///
/// # Errors
/// The first error of `work`; a thread that cannot be started.
pub(super) fn timed<T: Send>(runs: usize, work: impl Fn() -> Result<T> + Sync) -> Result<(T, f64)> {
    let one = single_thread()?;
    let (made, first) = seconds_of(|| one.install(&work));
    let made = made?;
    let repeats = repeats_for(first);
    let mut times = vec![first];
    for _ in 1..runs {
        let (repeated, seconds) = seconds_of(|| one.install(|| repeat(repeats, &work)));
        repeated?;
        times.push(seconds / repeats as f64);
    }
    Ok((made, quantile(times, 0.5)))
}

fn seconds_of<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = cpu_seconds();
    let made = work();
    (made, cpu_seconds() - start)
}

fn single_thread() -> Result<ThreadPool> {
    ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|e| Error::value("threads", e))
}

/// How often work of so many seconds is repeated to be timed.
fn repeats_for(seconds: f64) -> usize {
    let repeats = MIN_TIMED_SECONDS / seconds.max(f64::MIN_POSITIVE);
    repeats.clamp(1.0, MOST_REPEATS) as usize
}

fn repeat<T>(times: usize, work: impl Fn() -> Result<T>) -> Result<()> {
    for _ in 0..times {
        drop(black_box(work()?));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_time_and_comes_back() {
        let sum = || Ok((0..2_000_000_u64).fold(0, |a, b| std::hint::black_box(a ^ b)));
        let (made, seconds) = timed(3, sum).unwrap();
        assert_eq!(made, (0..2_000_000_u64).fold(0, |a, b| a ^ b));
        assert!(seconds > 0.0);
    }

    #[test]
    fn the_first_error_ends_it() {
        assert!(timed(3, || Err::<(), _>(Error::value("x", "wrong"))).is_err());
    }
}
