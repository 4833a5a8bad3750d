//! How much work a picture may take, and a flag that stops it.
#![cfg_attr(
    not(feature = "settle"),
    allow(dead_code, reason = "only falls take work")
)]

use crate::error::{Error, Result};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that is never set.
static NEVER_STOPPED: AtomicBool = AtomicBool::new(false);

/// The work left for one picture, and a flag that stops it.
///
/// Work is counted, not timed: whether a picture is rejected must not depend on the machine.
#[derive(Debug)]
pub struct Allowance<'a> {
    most: u64,
    left: Cell<u64>,
    /// Attempts that ran out of time.
    timed_out: Cell<u32>,
    stop: &'a AtomicBool,
}

impl Allowance<'static> {
    /// An allowance of this much work.
    pub fn new(most: u64) -> Self {
        Self {
            most,
            left: Cell::new(most),
            timed_out: Cell::new(0),
            stop: &NEVER_STOPPED,
        }
    }
}

impl<'a> Allowance<'a> {
    /// The same, stopped when the flag becomes true.
    pub fn stopped_by(self, stop: &'a AtomicBool) -> Self {
        Self { stop, ..self }
    }

    /// Subtracts some work from what is left.
    ///
    /// # Errors
    /// [`Error::Interrupted`] once the flag is true; [`Error::Unsettled`] where less is left.
    pub(crate) fn take(&self, work: u64) -> Result<()> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Error::Interrupted {
                what: "while objects fell".into(),
            });
        }
        let left = self.left.get().checked_sub(work);
        self.left.set(left.unwrap_or(0));
        left.map(|_| ()).ok_or_else(|| self.spent())
    }

    /// Fails if the work still to come certainly exceeds what is left.
    ///
    /// # Errors
    /// [`Error::Unsettled`]; nothing is left then.
    pub(crate) fn check(&self, work: f64) -> Result<()> {
        if work <= self.left.get() as f64 {
            return Ok(());
        }
        self.left.set(0);
        Err(self.spent())
    }

    /// How much work was done.
    pub fn taken(&self) -> u64 {
        self.most - self.left.get()
    }

    /// Counts an attempt that ran out of time.
    pub(crate) fn add_timed_out(&self) {
        self.timed_out.set(self.timed_out.get() + 1);
    }

    /// Whether nothing is left.
    pub(crate) fn is_spent(&self) -> bool {
        self.left.get() == 0
    }

    /// The error for a picture that needs too much work.
    pub(crate) fn spent(&self) -> Error {
        let what = format!(
            "no rest within the work of one picture, {} (settle.most_work): expected fewer objects, a larger surface or \
             longer steps{}",
            self.most,
            self.told_timed_out()
        );
        Error::Unsettled { what }
    }

    /// The rest of a message where attempts ran out of time.
    fn told_timed_out(&self) -> String {
        match self.timed_out.get() {
            0 => String::new(),
            count => {
                format!("; attempts in which something still moved at settle.time_limit: {count}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_taken_until_none_is_left() {
        let allowance = Allowance::new(10);
        assert!(allowance.take(4).is_ok() && allowance.taken() == 4);
        assert!(allowance.take(6).is_ok() && allowance.is_spent());
        let message = allowance.take(1).unwrap_err().to_string();
        assert!(
            message.starts_with("settle: no rest within the work of one picture, 10 "),
            "{message}"
        );
    }

    #[test]
    fn attempts_that_lacked_time_are_told() {
        let allowance = Allowance::new(10);
        assert!(!allowance.spent().to_string().contains("settle.time_limit"));
        allowance.add_timed_out();
        allowance.add_timed_out();
        let message = allowance.spent().to_string();
        assert!(message.ends_with("at settle.time_limit: 2"), "{message}");
    }

    #[test]
    fn more_than_is_left_leaves_nothing() {
        let allowance = Allowance::new(10);
        assert!(allowance.take(u64::MAX).is_err() && allowance.is_spent());
    }

    #[test]
    fn a_flag_ends_it_whatever_is_left() {
        let stop = AtomicBool::new(false);
        let allowance = Allowance::new(10).stopped_by(&stop);
        assert!(allowance.take(1).is_ok());
        stop.store(true, Ordering::Relaxed);
        assert!(matches!(allowance.take(1), Err(Error::Interrupted { .. })));
    }
}
