//! Where the time of a job goes, for the log: shown by `petcomp -vv asset add ...` and `petcomp -vv
//! dataset generate ...`.

use std::fmt;
use std::time::{Duration, Instant};

/// Measures the time of a job's stages, one after the other. It affects no result.
pub(crate) struct Stopwatch {
    stages: Vec<(&'static str, Duration)>,
    last: Instant,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self {
            stages: Vec::new(),
            last: Instant::now(),
        }
    }

    /// Ends a stage; the next one begins.
    pub(crate) fn lap(&mut self, stage: &'static str) {
        let now = Instant::now();
        self.stages.push((stage, now - self.last));
        self.last = now;
    }

    /// The time of a finished stage.
    #[cfg(feature = "pipeline")]
    pub(crate) fn took(&self, stage: &str) -> Duration {
        let laps = self.stages.iter().filter(|(name, _)| *name == stage);
        laps.map(|(_, took)| *took).sum()
    }

    /// Logs the times of a job's stages.
    pub(crate) fn log(&self, job: impl fmt::Display) {
        log::debug!("{job}: {self}");
    }
}

impl fmt::Display for Stopwatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self
            .stages
            .iter()
            .map(|(_, took)| *took)
            .sum::<Duration>()
            .as_secs_f64();
        write!(f, "{:.1} ms", 1e3 * whole)?;
        for (i, (stage, took)) in self.stages.iter().enumerate() {
            let (mark, seconds) = (if i == 0 { ':' } else { ',' }, took.as_secs_f64());
            write!(
                f,
                "{mark} {stage} {:.1} ({:.0} %)",
                1e3 * seconds,
                100.0 * seconds / whole.max(f64::MIN_POSITIVE)
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_shown_with_their_shares() {
        let stages = vec![
            ("read", Duration::from_millis(30)),
            ("write", Duration::from_millis(90)),
        ];
        let watch = Stopwatch {
            stages,
            last: Instant::now(),
        };
        assert_eq!(
            watch.to_string(),
            "120.0 ms: read 30.0 (25 %), write 90.0 (75 %)"
        );
        assert_eq!(
            Stopwatch {
                stages: vec![],
                ..watch
            }
            .to_string(),
            "0.0 ms"
        );
    }

    #[test]
    fn a_lap_takes_the_time_since_the_last_one() {
        let mut watch = Stopwatch::start();
        std::thread::sleep(Duration::from_millis(200));
        watch.lap("slept");
        watch.lap("woke");
        assert!(
            watch.stages[0].1 >= Duration::from_millis(200)
                && watch.stages[1].1 < watch.stages[0].1
        );
    }

    #[cfg(feature = "pipeline")]
    #[test]
    fn a_stage_that_came_twice_took_both_times() {
        let laps = [("read", 30), ("write", 90), ("read", 5)];
        let watch = Stopwatch {
            stages: laps
                .map(|(stage, ms)| (stage, Duration::from_millis(ms)))
                .to_vec(),
            last: Instant::now(),
        };
        assert_eq!(watch.took("read"), Duration::from_millis(35));
        assert_eq!(watch.took("eat"), Duration::ZERO);
    }
}
