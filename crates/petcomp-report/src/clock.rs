//! How long something takes, on one thread.

use petcomp::{Error, Result};
use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds in a second.
const NANO: f64 = 1e-9;

/// CPU seconds that this process has used, all its threads together.
///
/// Unlike the time that passes, it does not depend on what else the machine does (but for caches and clock rates).
pub(super) fn cpu_seconds() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * NANO
}

/// Quicker work than this is timed many times over, seconds: a clock and caches have their say in it.
const SHORT: f64 = 2e-3;
/// So many times at most.
const MOST_REPEATS: f64 = 1000.0;

/// What `work` gives, and the median CPU seconds of `runs` of it (at least 1); one thread, so that times can be compared.
///
/// # Errors
/// The first of `work`; a thread that cannot be had.
pub(super) fn timed<T: Send>(runs: usize, work: impl Fn() -> Result<T> + Sync) -> Result<(T, f64)> {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .map_err(|e| Error::value("threads", e))?;
    let start = cpu_seconds();
    let made = one.install(&work)?;
    let first = cpu_seconds() - start;
    let repeats = (SHORT / first.max(f64::MIN_POSITIVE)).clamp(1.0, MOST_REPEATS) as usize;
    let many =
        || (0..repeats).try_for_each(|_| work().map(|made| drop(std::hint::black_box(made))));
    let mut times = vec![first];
    for _ in 1..runs {
        let start = cpu_seconds();
        one.install(many)?;
        times.push((cpu_seconds() - start) / repeats as f64);
    }
    Ok((made, median(times)))
}

/// The middle one, the upper of two; 0 of nothing.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
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

    #[test]
    fn the_median_is_the_middle_one() {
        assert_eq!(
            (
                median(vec![3.0, 1.0, 2.0]),
                median(vec![1.0, 4.0]),
                median(vec![])
            ),
            (2.0, 4.0, 0.0)
        );
    }
}
