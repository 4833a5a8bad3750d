//! A stiff or extreme case of a stage, and its outcome.

use super::CaseResult;
use petcomp::Result;
use std::any::Any;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// A stiff or extreme case of a stage.
pub struct HardCase {
    /// What is extreme about the input.
    pub name: String,
    /// The input.
    pub input: String,
    /// The expected result, and why.
    pub expectation: String,
    /// Whether it takes seconds or gigabytes, or is known to fail: such cases run only for the
    /// report, not in every test run.
    pub report_only: bool,
    run: Box<dyn Fn() -> Result<Outcome> + Send + Sync>,
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The measured value, with its unit, or the message of an error.
    pub measured: String,
    /// Whether it meets the expectation.
    pub passed: bool,
}

impl HardCase {
    /// A fast case.
    pub fn new(
        name: impl Into<String>,
        input: impl Into<String>,
        expectation: impl Into<String>,
        run: impl Fn() -> Result<Outcome> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            input: input.into(),
            expectation: expectation.into(),
            report_only: false,
            run: Box::new(run),
        }
    }

    /// A case in which `attempt` must fail with an error whose message contains `cause`.
    pub fn refused<T>(
        name: impl Into<String>,
        input: impl Into<String>,
        cause: &'static str,
        attempt: impl Fn() -> Result<T> + Send + Sync + 'static,
    ) -> Self {
        let expectation = format!("rejected with \"{cause}\"");
        Self::new(name, input, expectation, move || {
            Ok(Outcome::refused(attempt(), cause))
        })
    }

    /// The same, run only for the report.
    pub fn for_the_report(self) -> Self {
        Self {
            report_only: true,
            ..self
        }
    }

    /// Runs it; a panic or an error is an outcome that failed.
    pub fn outcome(&self) -> Outcome {
        match catch_unwind(AssertUnwindSafe(&self.run)) {
            Ok(Ok(outcome)) => outcome,
            Ok(Err(error)) => Outcome::failed(format!("error: {error}")),
            Err(panic) => Outcome::failed(format!("panic: {}", panic_message(&*panic))),
        }
    }

    pub(super) fn run_timed(self, stage: &'static str) -> CaseResult {
        let start = Instant::now();
        let outcome = self.outcome();
        CaseResult {
            stage,
            case: self,
            outcome,
            wall_ms: start.elapsed().as_secs_f64() * 1e3,
        }
    }
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("without a message")
}

impl Outcome {
    /// What was measured and whether it meets the expectation.
    pub fn new(measured: impl Display, passed: bool) -> Self {
        Self {
            measured: measured.to_string(),
            passed,
        }
    }

    /// A measured value or message that cannot meet any expectation.
    pub fn failed(measured: impl Display) -> Self {
        Self::new(measured, false)
    }

    /// A number that must not differ from `expected` by more than `tolerance`.
    pub fn near(value: f64, expected: f64, tolerance: f64, unit: &str) -> Self {
        Self::new(
            with_unit(value, unit),
            (value - expected).abs() <= tolerance,
        )
    }

    /// A ratio of two numbers that must be 1 to within `tolerance`.
    pub fn ratio(value: f64, expected: f64, tolerance: f64) -> Self {
        Self::near(value / expected, 1.0, tolerance, "of it")
    }

    /// A number of things that must be exactly `expected`.
    pub fn count(found: usize, expected: usize, unit: &str) -> Self {
        Self::near(found as f64, expected as f64, 0.0, unit)
    }

    /// A number of things that must be zero.
    pub fn none(found: usize, unit: &str) -> Self {
        Self::count(found, 0, unit)
    }

    /// A number that must not exceed `limit`.
    pub fn at_most(value: f64, limit: f64, unit: &str) -> Self {
        Self::new(with_unit(value, unit), value <= limit)
    }

    /// An error that must occur, with a message that contains `cause`.
    pub fn refused<T>(result: Result<T>, cause: &str) -> Self {
        let Err(error) = result else {
            return Self::failed("no error");
        };
        let message = error.to_string();
        Self::new(format!("rejected: {message}"), message.contains(cause))
    }
}

/// A number with its significant digits, and its unit.
fn with_unit(value: f64, unit: &str) -> String {
    let number = readable(value);
    if unit.is_empty() {
        number
    } else {
        format!("{number} {unit}")
    }
}

/// Plain digits if they are few, an exponent otherwise.
fn readable(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        trimmed(format!("{value:.6}"))
    } else {
        format!("{value:.3e}")
    }
}

fn trimmed(number: String) -> String {
    number.trim_end_matches('0').trim_end_matches('.').into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::Error;

    #[test]
    fn numbers_are_shown_with_the_digits_that_matter() {
        let shown = [0.0, 0.25, 65504.0, 1.5e-9, f64::NAN].map(|v| with_unit(v, "px"));
        assert_eq!(
            shown,
            ["0 px", "0.25 px", "65504 px", "1.500e-9 px", "NaN px"]
        );
    }

    #[test]
    fn nan_is_never_near_and_never_small() {
        assert!(
            !Outcome::near(f64::NAN, 1.0, 1.0, "").passed
                && !Outcome::at_most(f64::NAN, 1.0, "").passed
        );
    }

    #[test]
    fn a_refusal_must_name_the_cause() {
        let refusal = || Result::<()>::Err(Error::value("size", "0, expected more"));
        assert!(
            Outcome::refused(refusal(), "size").passed
                && !Outcome::refused(refusal(), "camera").passed
        );
        assert!(!Outcome::refused(Ok(()), "").passed);
    }
}
