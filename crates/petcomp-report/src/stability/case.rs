//! A stiff or extreme case of a stage, and what came of it.

use super::CaseResult;
use petcomp::Result;
use std::any::Any;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// A stiff or extreme case of a stage.
pub struct HardCase {
    /// What is extreme about it.
    pub name: String,
    /// What goes in.
    pub input: String,
    /// What must come out, and by what right.
    pub expectation: String,
    /// It takes seconds or gigabytes, or is known to fail: for the report, not for every test run.
    pub report_only: bool,
    run: Box<dyn Fn() -> Result<Outcome> + Send + Sync>,
}

/// What came out of a case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// What was measured, with its unit, or what was said.
    pub measured: String,
    /// Whether that is as it must be.
    pub passed: bool,
}

impl HardCase {
    /// A case that takes little time.
    pub fn new(
        name: impl Into<String>,
        input: impl Into<String>,
        expectation: impl Into<String>,
        run: impl Fn() -> Result<Outcome> + Send + Sync + 'static,
    ) -> Self {
        let (name, input, expectation) = (name.into(), input.into(), expectation.into());
        Self {
            name,
            input,
            expectation,
            report_only: false,
            run: Box::new(run),
        }
    }

    /// The same, left to the report.
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
            Ok(Err(error)) => Outcome::new(format!("error: {error}"), false),
            Err(panic) => Outcome::new(format!("panic: {}", message(&*panic)), false),
        }
    }

    pub(super) fn row(&self, stage: &'static str) -> CaseResult {
        let start = Instant::now();
        let outcome = self.outcome();
        let (name, input, expectation) = (
            self.name.clone(),
            self.input.clone(),
            self.expectation.clone(),
        );
        CaseResult {
            stage,
            name,
            input,
            expectation,
            outcome,
            wall_ms: start.elapsed().as_secs_f64() * 1e3,
        }
    }
}

/// What a panic says.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("without a message")
}

impl Outcome {
    /// What was measured and whether that is as it must be.
    pub fn new(measured: impl Display, passed: bool) -> Self {
        Self {
            measured: measured.to_string(),
            passed,
        }
    }

    /// A number that must not be further than `tolerance` from `expected`.
    pub fn near(value: f64, expected: f64, tolerance: f64, unit: &str) -> Self {
        Self::new(
            with_unit(value, unit),
            (value - expected).abs() <= tolerance,
        )
    }

    /// A number that must not be larger than `limit`.
    pub fn at_most(value: f64, limit: f64, unit: &str) -> Self {
        Self::new(with_unit(value, unit), value <= limit)
    }

    /// An error that must be there and speak of `cause`.
    pub fn refused<T>(result: Result<T>, cause: &str) -> Self {
        match result {
            Ok(_) => Self::new("no error", false),
            Err(error) => Self::new(
                format!("refused: {error}"),
                error.to_string().contains(cause),
            ),
        }
    }
}

/// A number with the digits that it is read by.
fn with_unit(value: f64, unit: &str) -> String {
    let plain = value == 0.0 || (1e-3..1e5).contains(&value.abs());
    let number = if plain {
        trimmed(format!("{value:.6}"))
    } else {
        format!("{value:.3e}")
    };
    if unit.is_empty() {
        number
    } else {
        format!("{number} {unit}")
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
    fn numbers_are_told_with_the_digits_that_matter() {
        let told = [0.0, 0.25, 65504.0, 1.5e-9, f64::NAN].map(|v| with_unit(v, "px"));
        assert_eq!(
            told,
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
