//! Stability: every stage on stiff and extreme input, checked against a known result.
//!
//! The expected result is a closed form, a conservation law, the limit of easier neighbours, or an
//! error that names its cause; it is never what came out before. A case that panics, or that fails
//! where it should not, becomes a failed row, and the others still run.

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

use crate::files::write_texts;
use petcomp::plot::Table;
use petcomp::{Error, Result};
use std::path::Path;

/// Makes the cases of a stage.
type Cases = fn() -> Result<Vec<HardCase>>;

/// The stages that have cases, in the order of the data.
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

/// How a case ended.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseResult {
    /// The stage under test.
    pub stage: &'static str,
    /// What is extreme about the input.
    pub name: String,
    /// What goes in.
    pub input: String,
    /// What must come out.
    pub expectation: String,
    /// What came out, and whether it meets the expectation.
    pub outcome: Outcome,
    /// Run time, milliseconds.
    pub wall_ms: f64,
}

impl CaseResult {
    fn cells(&self) -> [String; 7] {
        [
            self.stage.into(),
            self.name.clone(),
            self.input.clone(),
            self.expectation.clone(),
            self.outcome.measured.clone(),
            if self.outcome.passed { "pass" } else { "FAIL" }.into(),
            format!("{:.1}", self.wall_ms),
        ]
    }
}

/// Names of the stages that have cases.
pub fn stages() -> impl Iterator<Item = &'static str> {
    STAGES.iter().map(|(name, _)| *name)
}

/// The cases of one stage, or of all (an empty name), each with its stage's name.
///
/// # Errors
/// [`Error::Value`] for a stage that has none.
pub fn cases(stage: &str) -> Result<Vec<(&'static str, HardCase)>> {
    let mut all = Vec::new();
    for (name, cases) in selected_stages(stage)? {
        all.extend(cases()?.into_iter().map(|case| (*name, case)));
    }
    Ok(all)
}

fn selected_stages(stage: &str) -> Result<Vec<&'static (&'static str, Cases)>> {
    let selected: Vec<_> = STAGES
        .iter()
        .filter(|(name, _)| stage.is_empty() || *name == stage)
        .collect();
    if selected.is_empty() {
        return Err(unknown_stage(stage));
    }
    Ok(selected)
}

fn unknown_stage(stage: &str) -> Error {
    let names = stages().collect::<Vec<_>>().join(", ");
    Error::value("stage", format!("\"{stage}\", expected one of {names}"))
}

/// Runs every case of every stage; `progress` is given the number of finished cases and of all
/// cases.
///
/// # Errors
/// None that a caller can cause: cases are made in code.
pub fn measure(progress: impl Fn(u64, u64)) -> Result<Vec<CaseResult>> {
    Ok(run_cases(&cases("")?, progress))
}

/// Runs cases one after another; `progress` is given the number of finished cases and of all cases.
pub fn run_cases(
    cases: &[(&'static str, HardCase)],
    progress: impl Fn(u64, u64),
) -> Vec<CaseResult> {
    let numbered = cases.iter().enumerate();
    numbered
        .map(|(i, (stage, case))| {
            progress(i as u64, cases.len() as u64);
            case.run_timed(stage)
        })
        .collect()
}

/// Cases as a table, a row each.
pub fn table(rows: &[CaseResult]) -> Table {
    let mut table = Table::new([
        "stage",
        "case",
        "input",
        "expectation",
        "result",
        "pass",
        "time ms",
    ]);
    rows.iter().for_each(|row| table.push(row.cells()));
    table
}

/// How many cases each stage has and how many of them pass.
pub fn summary(rows: &[CaseResult]) -> Table {
    let mut table = Table::new(["stage", "cases", "pass", "fail"]);
    for stage in stages() {
        let [cases, passed] = case_counts(rows, stage);
        if cases > 0 {
            let counts = [cases, passed, cases - passed].map(|n| n.to_string());
            table.push(std::iter::once(stage.into()).chain(counts));
        }
    }
    table
}

/// How many cases a stage has and how many of them pass.
fn case_counts(rows: &[CaseResult], stage: &str) -> [usize; 2] {
    let of_stage: Vec<_> = rows.iter().filter(|row| row.stage == stage).collect();
    let passed = of_stage.iter().filter(|row| row.outcome.passed).count();
    [of_stage.len(), passed]
}

/// Runs the cases of a stage, or of all (an empty name), and writes `stability.csv` and
/// `stability.md` into a folder.
///
/// # Errors
/// As [`cases`]; files that cannot be written. A case that fails is a row, not an error.
pub fn write(folder: &Path, stage: &str, progress: impl Fn(u64, u64)) -> Result<Vec<CaseResult>> {
    let rows = run_cases(&cases(stage)?, progress);
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
        let rows = run_cases(&cases, |_, _| ());
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
