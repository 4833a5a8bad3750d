//! Stability: every stage on stiff and extreme input, checked against a known result.
//!
//! The expected result is a closed form, a conservation law, the limit of easier neighbours, or an
//! error that names its cause; it is never a previous output. A case that panics, or that fails
//! unexpectedly, becomes a failed row, and the others still run.

mod bottle;
mod camera;
mod case;
mod composite;
mod dataset;
mod eval;
mod io;
mod keyer;
mod label;
mod light;
mod matte;
mod memory;
mod render;
mod render_light;
mod settle;
mod staged;

pub use case::{HardCase, Outcome};

use crate::columns::{Column, table_from, table_of};
use crate::files::write_texts;
use petcomp::plot::Table;
use petcomp::{Error, Result};
use std::path::Path;

/// Creates the cases of a stage.
type Cases = fn() -> Result<Vec<HardCase>>;

/// The stages with cases, in the order of the data.
const STAGES: &[(&str, Cases)] = &[
    ("matte", matte::cases),
    ("camera", camera::cases),
    ("settle", settle::cases),
    ("light", light::cases),
    ("render", render::cases),
    ("composite", composite::cases),
    ("label", label::cases),
    ("dataset", dataset::cases),
    ("io", io::cases),
    ("eval", eval::cases),
];

/// Result of a case.
pub struct CaseResult {
    /// The stage under test.
    pub stage: &'static str,
    /// The case.
    pub case: HardCase,
    /// Its outcome.
    pub outcome: Outcome,
    /// Run time, milliseconds.
    wall_ms: f64,
}

const COLUMNS: [Column<CaseResult>; 7] = [
    ("stage", |r| r.stage.into()),
    ("case", |r| r.case.name.clone()),
    ("input", |r| r.case.input.clone()),
    ("expectation", |r| r.case.expectation.clone()),
    ("result", |r| r.outcome.measured.clone()),
    ("pass", |r| {
        String::from(if r.outcome.passed { "pass" } else { "FAIL" })
    }),
    ("time ms", |r| format!("{:.1}", r.wall_ms)),
];

/// Names of the stages with cases.
fn stages() -> impl Iterator<Item = &'static str> {
    STAGES.iter().map(|(name, _)| *name)
}

/// The cases of one stage, or of all (an empty name), each with its stage's name.
///
/// # Errors
/// [`Error::Value`] for a stage that has none.
pub fn cases(stage: &str) -> Result<Vec<(&'static str, HardCase)>> {
    let mut all = Vec::new();
    for (name, cases) in STAGES {
        if stage.is_empty() || *name == stage {
            all.extend(cases()?.into_iter().map(|case| (*name, case)));
        }
    }
    if all.is_empty() {
        let names = stages().collect::<Vec<_>>().join(", ");
        let message = format!("\"{stage}\", expected one of {names}");
        return Err(Error::value("stage", message));
    }
    Ok(all)
}

/// Runs every case of a stage, or of all (an empty name); `progress` is given the number of
/// finished cases and of all cases.
pub(crate) fn measure(stage: &str, progress: impl Fn(u64, u64)) -> Result<Vec<CaseResult>> {
    Ok(run_cases(cases(stage)?, progress))
}

/// Runs cases one after another.
fn run_cases(cases: Vec<(&'static str, HardCase)>, progress: impl Fn(u64, u64)) -> Vec<CaseResult> {
    let count = cases.len() as u64;
    let numbered = (0..).zip(cases);
    numbered
        .map(|(i, (stage, case))| {
            progress(i, count);
            case.run_timed(stage)
        })
        .collect()
}

/// Cases as a table, a row each.
pub(crate) fn table(rows: &[CaseResult]) -> Table {
    table_of(&COLUMNS, rows)
}

/// Number of cases of each stage, and of those that pass.
pub(crate) fn summary(rows: &[CaseResult]) -> Table {
    let stages = rows.chunk_by(|a, b| a.stage == b.stage);
    let lines = stages.map(|rows| {
        let passed = rows.iter().filter(|row| row.outcome.passed).count();
        let [cases, pass, fail] = [rows.len(), passed, rows.len() - passed].map(|n| n.to_string());
        [rows[0].stage.into(), cases, pass, fail]
    });
    table_from(["stage", "cases", "pass", "fail"], lines)
}

/// Runs the cases of a stage, or of all (an empty name), and writes `stability.csv` and
/// `stability.md` into a folder.
///
/// # Errors
/// As [`cases`]; files that cannot be written. A case that fails is a row, not an error.
pub fn write(folder: &Path, stage: &str, progress: impl Fn(u64, u64)) -> Result<Vec<CaseResult>> {
    let rows = measure(stage, progress)?;
    let table = table(&rows);
    let text = format!("{}\n{}", summary(&rows).markdown(), table.markdown());
    let files = [("stability.csv", &*table.csv()), ("stability.md", &text)];
    write_texts(folder, files)?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_stage_is_reported_with_the_known_ones() {
        let message = cases("physics")
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default();
        assert!(
            message.starts_with("stage: \"physics\", expected one of "),
            "{message}"
        );
    }

    #[test]
    fn every_stage_has_cases_and_their_names_are_their_own() {
        for stage in stages() {
            let names: Vec<String> = cases(stage)
                .unwrap()
                .into_iter()
                .map(|(_, case)| case.name)
                .collect();
            let distinct: std::collections::BTreeSet<&String> = names.iter().collect();
            assert!(
                !names.is_empty() && distinct.len() == names.len(),
                "{stage}: {names:?}"
            );
        }
    }

    #[test]
    fn a_case_that_panics_or_fails_is_a_row_that_failed() {
        let cases = [
            (
                "a",
                HardCase::new("panics", "", "", || panic!("index 3 of 2")),
            ),
            (
                "a",
                HardCase::new("errs", "", "", || Err(Error::value("size", "0"))),
            ),
            (
                "b",
                HardCase::new("good", "", "", || Ok(Outcome::near(1.0, 1.0, 0.0, "m"))),
            ),
        ];
        let rows = run_cases(cases.into(), |_, _| ());
        assert_eq!(
            rows.iter()
                .map(|row| row.outcome.passed)
                .collect::<Vec<_>>(),
            [false, false, true]
        );
        assert!(
            rows[0].outcome.measured.contains("index 3 of 2")
                && rows[1].outcome.measured.contains("size: 0")
        );
        assert_eq!(
            table(&rows).rows[2][4..6],
            ["1 m".to_string(), "pass".to_string()]
        );
    }
}
