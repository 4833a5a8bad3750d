//! Estimates the time for the rest of a run from its pace since its first pictures.

use crate::dataset::Progress;
use std::fmt;
use std::time::{Duration, Instant};

/// A run that takes longer should be confirmed first.
const LONG_RUN: Duration = Duration::from_secs(3600);
/// Minimum time of measurement before the rest is estimated.
const MIN_ELAPSED: Duration = Duration::from_secs(5);
/// The same during the first pictures, for which photos are read: reading takes less than this.
const MIN_FIRST_ELAPSED: Duration = Duration::from_secs(60);

/// The pace of a run. The first picture of each thread is excluded once it is made.
#[derive(Clone, Copy, Debug)]
pub struct RunPace {
    threads: u64,
    last: Progress,
    /// Start of the measurement, and the number of pictures made by then.
    since: (Instant, u64),
    /// Whether the first pictures are made.
    is_warm: bool,
}

impl RunPace {
    /// The pace of a run on `threads` threads that is about to make its first picture.
    pub fn new(threads: usize, progress: Progress, now: Instant) -> Self {
        Self {
            threads: threads.max(1) as u64,
            last: progress,
            since: (now, progress.made),
            is_warm: false,
        }
    }

    /// Records the current progress of the run.
    pub fn note(&mut self, progress: Progress, now: Instant) {
        self.last = progress;
        if !self.is_warm && progress.made >= self.threads {
            self.is_warm = true;
            self.since = (now, progress.made);
        }
    }

    /// The run, if its pace so far suggests that the rest takes longer than an hour.
    ///
    /// Once each thread has made a picture, the rest is proportional; before that, every picture is
    /// assumed to take at least as long as those still being made.
    pub fn long_run(&self, now: Instant) -> Option<LongRun> {
        let (began, before) = self.since;
        let elapsed = now.saturating_duration_since(began);
        let made = self.last.made.saturating_sub(before);
        let left = self.last.count.saturating_sub(self.last.done);
        let run = LongRun::of(left, made, elapsed, self.threads);
        let min_elapsed = match self.is_warm {
            true => MIN_ELAPSED,
            false => MIN_FIRST_ELAPSED,
        };
        (elapsed >= min_elapsed && run.seconds > LONG_RUN.as_secs_f64()).then_some(run)
    }
}

/// A run that would take longer than an hour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongRun {
    /// Expected remaining time, seconds.
    pub seconds: f64,
    /// Pictures that remain.
    pub left: u64,
    /// Mean time between two pictures so far, seconds.
    pub each: f64,
    /// Whether the time is only a lower bound: fewer pictures than threads are finished.
    pub at_least: bool,
}

impl LongRun {
    /// The rest of a run that made this many pictures in this time.
    fn of(left: u64, made: u64, elapsed: Duration, threads: u64) -> Self {
        let at_least = made < threads;
        let each = elapsed.as_secs_f64() / if at_least { threads } else { made } as f64;
        Self {
            seconds: each * left as f64,
            left,
            each,
            at_least,
        }
    }
}

impl fmt::Display for LongRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let about = if self.at_least { "at least" } else { "about" };
        let (time, left, each) = (in_words(self.seconds), self.left, self.each);
        write!(
            f,
            "{about} {time} for {left} pictures, one every {each:.2} s"
        )
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

    /// A run on two threads, into a folder that has some pictures of an earlier one.
    struct TestRun {
        began: Instant,
        pace: RunPace,
        earlier: u64,
        count: u64,
    }

    impl TestRun {
        fn new(earlier: u64, count: u64) -> Self {
            let began = Instant::now();
            let progress = Progress {
                done: earlier,
                count,
                made: 0,
            };
            Self {
                began,
                pace: RunPace::new(2, progress, began),
                earlier,
                count,
            }
        }

        /// Has made this many pictures after this many seconds.
        fn note(mut self, made: u64, seconds: f64) -> Self {
            let progress = Progress {
                done: self.earlier + made,
                count: self.count,
                made,
            };
            let now = self.at(seconds);
            self.pace.note(progress, now);
            self
        }

        fn at(&self, seconds: f64) -> Instant {
            self.began + Duration::from_secs_f64(seconds)
        }

        /// The message after this many seconds.
        fn told(&self, seconds: f64) -> Option<String> {
            let run = self.pace.long_run(self.at(seconds));
            run.map(|run| run.to_string())
        }
    }

    #[test]
    fn the_rest_is_in_proportion_to_what_was_made_since_the_first_pictures() {
        // Two that take 20 s, since they read large photos, and 20 a second from then on.
        let cold = |count| {
            let run = TestRun::new(0, count).note(2, 20.0);
            run.note(102, 25.0)
        };
        assert_eq!(cold(30_102).told(25.0), None);
        assert_eq!(
            cold(100_102).told(25.0).as_deref(),
            Some("about 1.4 hours for 100000 pictures, one every 0.05 s")
        );
        assert_eq!(
            cold(30_000_102).told(25.0).as_deref(),
            Some("about 17 days for 30000000 pictures, one every 0.05 s")
        );
    }

    #[test]
    fn what_an_earlier_run_made_took_none_of_the_time() {
        let run = TestRun::new(5_000, 6_000).note(2, 1.0).note(12, 11.0);
        assert_eq!(run.told(11.0), None);
    }

    #[test]
    fn a_first_picture_without_end_is_noticed_and_one_that_reads_photos_is_not() {
        assert_eq!(TestRun::new(0, 24).told(250.0), None);
        assert_eq!(
            TestRun::new(0, 24).told(400.0).as_deref(),
            Some("at least 1.3 hours for 24 pictures, one every 200.00 s")
        );
        assert_eq!(TestRun::new(0, 30_000).note(1, 10.0).told(50.0), None);
    }

    #[test]
    fn nothing_is_said_too_soon_or_of_a_finished_run() {
        let begun = TestRun::new(0, 10_000_000).note(2, 1.0);
        assert_eq!(begun.note(3, 2.0).told(5.0), None);
        assert_eq!(TestRun::new(0, 24).note(24, 40_000.0).told(50_000.0), None);
    }
}
