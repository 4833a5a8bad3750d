//! Other programs for the same task, measured next to petcomp in one run:
//! `tests/benches/peers/<stage>.py` writes what is read here, `make peers` runs them.

use super::files::json_files;
use super::{Diagram, Point};
use petcomp::plot::{Table, three};
use petcomp::{Result, io};
use serde::Deserialize;
use std::path::Path;

/// The name of petcomp among the programs.
const OURS: &str = "petcomp";
/// The setting to compare with.
const DEFAULT: &str = "default";

/// One stage in several programs.
#[derive(Debug, PartialEq, Deserialize)]
pub(crate) struct PeerComparison {
    stage: String,
    /// The input, with its size.
    input: String,
    /// Name of the error, with its unit.
    error: String,
    /// Reference that results are compared with.
    reference: String,
    /// Threads that each program may use.
    #[serde(default)]
    threads: Option<u32>,
    /// Meaning of the seconds.
    #[serde(default)]
    clock: String,
    #[serde(default)]
    points: Vec<PeerPoint>,
    /// Programs that could not be run here.
    #[serde(default)]
    absent: Vec<Absent>,
}

/// A program at a setting.
#[derive(Debug, PartialEq, Deserialize)]
struct PeerPoint {
    program: String,
    version: String,
    /// The setting.
    setting: String,
    /// Its command.
    #[serde(default)]
    command: String,
    /// Its error; none if there is no reference.
    error: Option<f64>,
    /// Median of its run times, seconds.
    seconds: f64,
    /// Number of runs of that median.
    #[serde(default)]
    runs: u32,
    /// The corresponding setting of petcomp; empty for its default.
    #[serde(default)]
    beside: String,
}

/// A program that could not be run, and why.
#[derive(Debug, PartialEq, Deserialize)]
struct Absent {
    program: String,
    why: String,
}

/// Reads every comparison (`*.json`) of a folder, by file name; none if there is no such folder.
pub(crate) fn read_comparisons(folder: &Path) -> Result<Vec<PeerComparison>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    json_files(folder)?.iter().map(io::read_json).collect()
}

impl PeerPoint {
    /// The program with its version.
    fn name(&self) -> String {
        format!("{} {}", self.program, self.version)
    }

    /// Its point in a diagram; none without an error.
    fn point(&self) -> Option<Point> {
        let setting = self.setting.clone();
        Some(Point::new(self.name(), setting, self.seconds, self.error?))
    }
}

impl PeerComparison {
    /// Error against time, a curve per program; points without an error are left out.
    pub(crate) fn diagram(&self) -> Diagram {
        Diagram {
            file: format!("peers_{}", file_name(&self.stage)),
            title: format!("{}: petcomp and other programs", self.stage),
            input: self.input_with_threads(),
            error: self.error.clone(),
            cost: self.clock_or_default().into(),
            reference: self.reference.clone(),
            points: self.points.iter().filter_map(PeerPoint::point).collect(),
            apart: true,
            ..Diagram::default()
        }
    }

    fn input_with_threads(&self) -> String {
        let threads = self.threads.map(|n| format!("; threads: {n}"));
        format!("{}{}", self.input, threads.unwrap_or_default())
    }

    fn clock_or_default(&self) -> &str {
        if self.clock.is_empty() {
            "seconds, median"
        } else {
            &self.clock
        }
    }

    /// Our point to compare another one with: the one that it names, else our default, else our
    /// first.
    fn our_counterpart(&self, other: &PeerPoint) -> Option<&PeerPoint> {
        let ours: Vec<_> = self.points.iter().filter(|m| m.program == OURS).collect();
        let named = ours
            .iter()
            .find(|m| !other.beside.is_empty() && m.setting == other.beside);
        let default = ours.iter().find(|m| m.setting.contains(DEFAULT));
        named.or(default).or(ours.first()).copied()
    }

    /// A program compared with petcomp: ratios of seconds and of error.
    fn ratio_cells(&self, m: &PeerPoint) -> [String; 8] {
        let ours = self.our_counterpart(m);
        let seconds = ours.map(|ours| m.seconds / ours.seconds);
        let error = ours.and_then(|ours| Some(m.error? / ours.error?));
        [
            self.stage.clone(),
            m.name(),
            m.setting.clone(),
            three(m.seconds),
            number_or_empty(seconds),
            number_or_empty(m.error),
            number_or_empty(error),
            m.runs.to_string(),
        ]
    }

    /// Sentence about missing programs; empty if there are none.
    pub(crate) fn missing(&self) -> String {
        if self.absent.is_empty() {
            return String::new();
        }
        let absent = self.absent.iter();
        let sentences = absent.map(|a| format!(" Not available: {} ({}).", a.program, a.why));
        format!("{}:{}", self.stage, sentences.collect::<String>())
    }
}

/// A stage's name as a file name.
fn file_name(stage: &str) -> String {
    let lower = stage.to_ascii_lowercase();
    lower.replace(|c: char| !c.is_ascii_alphanumeric(), "_")
}

fn number_or_empty(number: Option<f64>) -> String {
    number
        .filter(|v| v.is_finite())
        .map_or(String::new(), three)
}

/// Every program compared with petcomp's default: ratios of seconds and of error.
pub(crate) fn ratios(comparisons: &[PeerComparison]) -> Table {
    let mut table = Table::new([
        "stage",
        "program",
        "setting",
        "seconds",
        "times petcomp's time",
        "error",
        "times petcomp's error",
        "runs",
    ]);
    for comparison in comparisons {
        let points = comparison.points.iter();
        points.for_each(|m| table.push(comparison.ratio_cells(m)));
    }
    table
}

/// The exact command of every point.
pub(crate) fn commands(comparisons: &[PeerComparison]) -> Table {
    let mut table = Table::new(["stage", "program", "setting", "command"]);
    for comparison in comparisons {
        for m in &comparison.points {
            table.push([&comparison.stage, &m.name(), &m.setting, &m.command]);
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
        let found = read_comparisons(folder().path()).unwrap();
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
        assert_eq!(
            found[0].missing(),
            "matte: Not available: Gone (no package)."
        );
        assert_eq!(commands(&found).rows[2][3], "slow");
    }

    #[test]
    fn a_program_may_name_the_setting_that_does_the_same() {
        let mut found = read_comparisons(folder().path()).unwrap();
        found[0].points[2].beside = "fast".into();
        assert_eq!(ratios(&found).rows[2][4], "8.00");
    }

    #[test]
    fn a_folder_that_is_not_there_holds_nothing() {
        assert_eq!(read_comparisons(Path::new("nowhere at all")).unwrap(), []);
    }

    #[test]
    fn a_damaged_file_is_named() {
        let folder = folder();
        io::write_text(folder.path().join("bad.json"), "{").unwrap();
        assert!(
            read_comparisons(folder.path())
                .unwrap_err()
                .to_string()
                .contains("bad.json")
        );
    }
}
