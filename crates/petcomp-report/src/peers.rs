//! Other programs that do the same, measured beside petcomp in one run: `tests/benches/peers/<stage>.py` writes what is read
//! here, `make peers` runs them.

use super::{Diagram, Point};
use petcomp::io;
use petcomp::plot::Table;
use petcomp::plot::three;
use petcomp::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// Our own name among the programs.
const OURS: &str = "petcomp";
/// The setting that is compared with.
const DEFAULT: &str = "default";

/// One stage, by several programs.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerComparison {
    /// Which stage.
    pub stage: String,
    /// What is processed, with its size.
    pub input: String,
    /// What the error is, with its unit.
    pub error: String,
    /// What results are held against.
    pub reference: String,
    /// Threads that each program may use.
    #[serde(default)]
    pub threads: Option<u32>,
    /// What the seconds are.
    #[serde(default)]
    pub clock: String,
    /// What was measured.
    #[serde(default)]
    pub points: Vec<PeerPoint>,
    /// Programs that could not be run here.
    #[serde(default)]
    pub absent: Vec<Absent>,
}

/// A program at a setting.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerPoint {
    /// Its name.
    pub program: String,
    /// Its version.
    pub version: String,
    /// What was set.
    pub setting: String,
    /// How it was run.
    #[serde(default)]
    pub command: String,
    /// Its error; nothing where there is nothing to hold it against.
    pub error: Option<f64>,
    /// Median of its run times, seconds.
    pub seconds: f64,
    /// How many runs that is the median of.
    #[serde(default)]
    pub runs: u32,
    /// The setting of petcomp that does the same; empty = its default.
    #[serde(default)]
    pub beside: String,
}

/// A program that could not be run, and why.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Absent {
    /// Its name.
    pub program: String,
    /// Why it could not be run.
    pub why: String,
}

/// Reads every comparison (`*.json`) of a folder, by file name; none where there is no such folder.
///
/// # Errors
/// A file that is no comparison.
pub fn read(folder: &Path) -> Result<Vec<PeerComparison>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
    paths.sort();
    paths.iter().map(io::read_json).collect()
}

impl PeerComparison {
    /// Error against time, a curve for each program; what has no error is not in it.
    pub fn diagram(&self) -> Diagram {
        let point = |m: &PeerPoint| {
            let curve = format!("{} {}", m.program, m.version);
            Some(Point::new(curve, m.setting.clone(), m.seconds, m.error?))
        };
        let threads = self
            .threads
            .map_or(String::new(), |n| format!("; threads: {n}"));
        Diagram {
            file: format!("peers_{}", file_name(&self.stage)),
            title: format!("{}: petcomp and other programs", self.stage),
            input: format!("{}{threads}", self.input),
            error: self.error.clone(),
            cost: if self.clock.is_empty() {
                "seconds, median".into()
            } else {
                self.clock.clone()
            },
            reference: self.reference.clone(),
            points: self.points.iter().filter_map(point).collect(),
            apart: true,
            ..Diagram::default()
        }
    }

    /// Our point that another is set beside: the one that it names, or our default, or else our first.
    fn ours(&self, other: &PeerPoint) -> Option<&PeerPoint> {
        let ours = || self.points.iter().filter(|m| m.program == OURS);
        let named = ours().find(|m| !other.beside.is_empty() && m.setting == other.beside);
        named
            .or_else(|| ours().find(|m| m.setting.contains(DEFAULT)))
            .or_else(|| ours().next())
    }

    /// Programs that are not in it, in words; nothing where all are.
    pub fn missing(&self) -> String {
        self.absent
            .iter()
            .map(|a| format!("Not here: {} ({}). ", a.program, a.why))
            .collect::<String>()
            .trim_end()
            .into()
    }
}

/// A stage's name as a file may be called.
fn file_name(stage: &str) -> String {
    stage
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() {
                c.to_ascii_lowercase()
            } else {
                '_'
            }
        })
        .collect()
}

/// Every program beside petcomp's default: how many times its seconds and its error.
pub fn ratios(comparisons: &[PeerComparison]) -> Table {
    let mut table = Table::new([
        "stage",
        "program",
        "setting",
        "seconds",
        "times petcomp's",
        "error",
        "times petcomp's error",
        "runs",
    ]);
    for comparison in comparisons {
        for m in &comparison.points {
            let ours = comparison.ours(m);
            let seconds = ours.map(|ours| m.seconds / ours.seconds);
            let error = ours.and_then(|ours| Some(m.error? / ours.error?));
            let number = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or(String::new(), three);
            table.push([
                comparison.stage.clone(),
                format!("{} {}", m.program, m.version),
                m.setting.clone(),
                three(m.seconds),
                number(seconds),
                number(m.error),
                number(error),
                m.runs.to_string(),
            ]);
        }
    }
    table
}

/// The exact command of every point.
pub fn commands(comparisons: &[PeerComparison]) -> Table {
    let mut table = Table::new(["stage", "program", "setting", "command"]);
    for comparison in comparisons {
        for m in &comparison.points {
            table.push([
                comparison.stage.clone(),
                format!("{} {}", m.program, m.version),
                m.setting.clone(),
                m.command.clone(),
            ]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = r#"{"stage": "matte", "input": "a photo", "error": "MAE", "reference": "the truth", "threads": 1,
        "points": [
            {"program": "petcomp", "version": "0.1.0", "setting": "fast", "command": "petcomp a", "error": 0.5, "seconds": 1.0, "runs": 5},
            {"program": "petcomp", "version": "0.1.0", "setting": "default", "command": "petcomp b", "error": 0.1, "seconds": 2.0, "runs": 5},
            {"program": "Slow", "version": "3", "setting": "all", "command": "slow", "error": 0.2, "seconds": 8.0, "runs": 5},
            {"program": "Blind", "version": "1", "setting": "all", "command": "blind", "error": null, "seconds": 4.0, "runs": 5}],
        "absent": [{"program": "Gone", "why": "no package"}]}"#;

    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        io::write_text(folder.path().join("matte.json"), TWO).unwrap();
        io::write_text(folder.path().join("notes.txt"), "not a comparison").unwrap();
        folder
    }

    #[test]
    fn programs_stand_beside_our_default() {
        let found = read(folder().path()).unwrap();
        let ratios = ratios(&found);
        assert_eq!(
            (ratios.rows[2][4].as_str(), ratios.rows[2][6].as_str()),
            ("4.00", "2.00")
        );
        assert_eq!(
            (ratios.rows[1][4].as_str(), ratios.rows[3][6].as_str()),
            ("1.00", "")
        );
        let diagram = found[0].diagram();
        assert_eq!(diagram.points.len(), 3, "what has no error has no place");
        assert_eq!(diagram.cost, "seconds, median");
        assert_eq!(found[0].missing(), "Not here: Gone (no package).");
        assert_eq!(commands(&found).rows[2][3], "slow");
    }

    #[test]
    fn a_program_may_name_the_setting_that_does_the_same() {
        let mut found = read(folder().path()).unwrap();
        found[0].points[2].beside = "fast".into();
        assert_eq!(ratios(&found).rows[2][4], "8.00");
    }

    #[test]
    fn a_folder_that_is_not_there_holds_nothing() {
        assert_eq!(read(Path::new("nowhere at all")).unwrap(), []);
    }

    #[test]
    fn a_damaged_file_is_named() {
        let folder = folder();
        io::write_text(folder.path().join("bad.json"), "{").unwrap();
        assert!(
            read(folder.path())
                .unwrap_err()
                .to_string()
                .contains("bad.json")
        );
    }
}
