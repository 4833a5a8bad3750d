//! What the rest of a run takes, by what it took so far.

use crate::dataset::Progress;
use std::fmt;
use std::time::Duration;

/// A job that takes longer is one to be asked about first.
const LONG_RUN: Duration = Duration::from_secs(3600);
/// The first seconds of a run are not like the rest: files are read, caches are cold.
const MIN_ELAPSED: Duration = Duration::from_secs(5);

/// A run that would take longer than an hour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongRun {
    /// What it is expected to take yet, seconds.
    pub seconds: f64,
    /// Pictures that are left.
    pub left: u64,
    /// Seconds between two pictures so far.
    pub each: f64,
    /// No picture is finished yet: it takes this long at least.
    pub at_least: bool,
}

impl LongRun {
    /// The run, if what it did on so many threads in this time says that the rest takes longer than
    /// an hour.
    ///
    /// Once each thread has made a picture, the rest is in proportion; before, every picture takes
    /// at least as long as those that are still being made.
    pub fn of(progress: &Progress, elapsed: Duration, threads: usize) -> Option<Self> {
        let left = progress.count.saturating_sub(progress.done);
        let (made, threads) = (progress.made, threads.max(1) as u64);
        let at_least = made < threads;
        if elapsed < MIN_ELAPSED || left == 0 {
            return None;
        }
        let each = elapsed.as_secs_f64() / if at_least { threads } else { made } as f64;
        let run = Self {
            seconds: each * left as f64,
            left,
            each,
            at_least,
        };
        (run.seconds > LONG_RUN.as_secs_f64()).then_some(run)
    }
}

impl fmt::Display for LongRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let about = if self.at_least { "at least" } else { "about" };
        let (time, left, each) = (in_words(self.seconds), self.left, self.each);
        write!(f, "{about} {time} for {left} pictures, one in {each:.2} s")
    }
}

fn in_words(seconds: f64) -> String {
    let hours = seconds / 3600.0;
    if hours < 48.0 {
        format!("{hours:.1} hours")
    } else {
        format!("{:.0} days", hours / 24.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(done: u64, count: u64, made: u64, seconds: u64) -> Option<String> {
        let progress = Progress { done, count, made };
        LongRun::of(&progress, Duration::from_secs(seconds), 2).map(|run| run.to_string())
    }

    #[test]
    fn the_rest_is_in_proportion_to_what_was_made() {
        assert_eq!(
            told(100, 10_100, 100, 50).as_deref(),
            Some("about 1.4 hours for 10000 pictures, one in 0.50 s")
        );
        assert_eq!(
            told(100, 10_000_000, 100, 10).as_deref(),
            Some("about 12 days for 9999900 pictures, one in 0.10 s")
        );
        // What an earlier run made took none of this time.
        assert_eq!(told(5_000, 6_000, 10, 10), None);
    }

    #[test]
    fn a_first_picture_without_end_is_noticed() {
        assert_eq!(told(0, 24, 0, 250), None);
        assert_eq!(
            told(0, 24, 0, 400).as_deref(),
            Some("at least 1.3 hours for 24 pictures, one in 200.00 s")
        );
    }

    #[test]
    fn nothing_is_said_too_soon_or_of_a_finished_run() {
        assert_eq!(told(1, 10_000_000, 1, 4), None);
        assert_eq!(told(24, 24, 24, 40_000), None);
    }
}
