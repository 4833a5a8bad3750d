//! Our trained models beside the paper's.

use super::files::write_texts;
use petcomp::eval::page::{Metrics, Spread};
use petcomp::io;
use petcomp::plot::{Page, Table};
use petcomp::train::{Updates, batches_per_epoch};
use petcomp::{Error, Result};
use serde::Deserialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How many models each value of the paper is the mean of.
const PAPER_RUNS: usize = 6;
/// Images, batch and epochs of the paper.
const PAPER_TRAINING: PaperTraining = PaperTraining {
    real: 1624,
    synthetic: 4000,
    batch: 32,
    epochs: 300,
};
/// What the paper gives as epochs for equally many updates: synthetic, real.
const PAPER_EPOCHS: [u64; 2] = [423, 1035];

/// The size of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PaperTraining {
    /// Real images.
    pub real: u64,
    /// Synthetic images.
    pub synthetic: u64,
    /// Images of a batch.
    pub batch: u64,
    /// Epochs of both together.
    pub epochs: u64,
}

/// A value of the paper.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperRow {
    /// Folder of the runs that repeat it, below the folder of runs.
    pub key: String,
    /// Table or figure.
    pub place: String,
    /// What was varied.
    pub text: String,
    /// mAP@0.5:0.95, percent; none where only a curve is shown.
    pub mean: Option<f64>,
    /// Standard deviation of six models, percent.
    pub std: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    rows: Vec<PaperRow>,
}

/// The paper's values, in its order.
pub fn paper_rows() -> Vec<PaperRow> {
    let paper: Paper = toml::from_str(include_str!("paper.toml"))
        .expect("the table is part of this program and tested");
    paper.rows
}

/// Means and spreads of our runs by key (`combined/all`), from `RUNS/KEY/RUN/metrics.json` as
/// `petcomp eval` writes it; mAP@0.5:0.95 in percent, by the definition of YOLOv5.
///
/// # Errors
/// [`Error::File`] for a folder that cannot be read or without any run.
pub fn read_runs(folder: &Path) -> Result<BTreeMap<String, Vec<f64>>> {
    let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for row in paper_rows() {
        for file in metrics_files(&folder.join(&row.key)) {
            let percent = read_map_percent(&file)?;
            found.entry(row.key.clone()).or_default().push(percent);
        }
    }
    if found.is_empty() {
        let what = "no runs, expected KEY/RUN/metrics.json with a KEY such as combined/all";
        return Err(Error::file(folder, what));
    }
    Ok(found)
}

/// `RUN/metrics.json` of every run of a folder; none where there is no such folder.
fn metrics_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<_> = entries
        .map(|e| e.path().join("metrics.json"))
        .filter(|p| p.is_file())
        .collect();
    files.sort();
    files
}

fn read_map_percent(file: &Path) -> Result<f64> {
    let metrics: Metrics = io::read_json(file)?;
    Ok(100.0 * metrics.yolov5.map())
}

/// Mean, sample standard deviation and number of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleMoments {
    /// Their mean.
    pub mean: f64,
    /// Their sample standard deviation.
    pub std: f64,
    /// Their number.
    pub n: usize,
}

impl SampleMoments {
    /// The variance of the mean.
    fn variance_of_mean(self) -> f64 {
        self.std * self.std / self.n as f64
    }

    fn freedom(self) -> f64 {
        (self.n - 1) as f64
    }
}

impl From<Spread> for SampleMoments {
    fn from(spread: Spread) -> Self {
        Self {
            mean: spread.mean,
            std: spread.std,
            n: spread.runs,
        }
    }
}

/// Chance of a difference of means at least as large, if there were none; none where a spread is
/// unknown or zero.
///
/// # Method
/// [Welch 1947], two-sided.
///
/// [Welch 1947]: https://doi.org/10.1093/biomet/34.1-2.28
pub fn welch_test(a: SampleMoments, b: SampleMoments) -> Option<f64> {
    let sum = a.variance_of_mean() + b.variance_of_mean();
    if a.n < 2 || b.n < 2 || sum <= 0.0 {
        return None;
    }
    let t = (a.mean - b.mean).abs() / sum.sqrt();
    let distribution = StudentsT::new(0.0, 1.0, welch_freedom(a, b)).ok()?;
    Some(2.0 * distribution.sf(t))
}

/// Degrees of freedom of the difference of two means.
fn welch_freedom(a: SampleMoments, b: SampleMoments) -> f64 {
    let (va, vb) = (a.variance_of_mean(), b.variance_of_mean());
    (va + vb) * (va + vb) / (va * va / a.freedom() + vb * vb / b.freedom())
}

/// Our numbers beside the paper's: a row per value of the paper, ours empty where there is no run.
pub fn table(ours: &BTreeMap<String, Vec<f64>>) -> Table {
    let mut table = Table::new([
        "key",
        "what",
        "where",
        "paper, %",
        "ours, %",
        "95 % of the mean",
        "runs",
        "ours/paper",
        "p (ours = paper)",
        "p (ours = all)",
    ]);
    for row in paper_rows() {
        table.push(row.beside(ours));
    }
    table
}

impl PaperRow {
    /// Cells of this row beside our runs.
    fn beside(&self, ours: &BTreeMap<String, Vec<f64>>) -> [String; 10] {
        let spread = spread_of(ours, &self.key);
        let [own, interval, runs] = spread_cells(spread);
        let against_paper = welch_cell(spread, self.moments());
        let against_all = welch_cell(spread, self.base_moments(ours));
        [
            self.key.clone(),
            self.text.clone(),
            self.place.clone(),
            self.mean_and_std(),
            own,
            interval,
            runs,
            self.ratio_cell(spread),
            against_paper,
            against_all,
        ]
    }

    fn moments(&self) -> Option<SampleMoments> {
        Some(SampleMoments {
            mean: self.mean?,
            std: self.std.unwrap_or(0.0),
            n: PAPER_RUNS,
        })
    }

    /// Of our runs with all that this row leaves out; none for the row of those itself.
    fn base_moments(&self, ours: &BTreeMap<String, Vec<f64>>) -> Option<SampleMoments> {
        let base = format!("{}/all", self.key.split('/').next()?);
        let is_other = base != self.key;
        Some(spread_of(ours, &base).filter(|_| is_other)?.into())
    }

    fn mean_and_std(&self) -> String {
        match (self.mean, self.std) {
            (Some(mean), Some(std)) => format!("{mean:.1} +- {std:.1}"),
            (Some(mean), None) => format!("{mean:.1}"),
            _ => String::new(),
        }
    }

    /// Our mean over the paper's.
    fn ratio_cell(&self, ours: Option<Spread>) -> String {
        let both = ours.zip(self.mean);
        both.map_or(String::new(), |(s, mean)| format!("{:.2}", s.mean / mean))
    }
}

fn spread_of(ours: &BTreeMap<String, Vec<f64>>, key: &str) -> Option<Spread> {
    Some(Spread::from_values(ours.get(key)?))
}

/// Mean and deviation, interval (of two runs or more) and number of runs; empty without runs.
fn spread_cells(spread: Option<Spread>) -> [String; 3] {
    let Some(s) = spread else {
        return Default::default();
    };
    let interval = s.interval.map(|i| format!("{:.1} to {:.1}", i.low, i.high));
    [
        format!("{:.1} +- {:.1}", s.mean, s.std),
        interval.unwrap_or_default(),
        s.runs.to_string(),
    ]
}

fn welch_cell(a: Option<Spread>, b: Option<SampleMoments>) -> String {
    let chance = a.zip(b).and_then(|(a, b)| welch_test(a.into(), b));
    chance.map_or(String::new(), |p| format!("{p:.3}"))
}

/// How many epochs of each source alone make as many updates as both together.
pub fn updates_table(training: PaperTraining) -> Table {
    let mut table = Table::new([
        "images",
        "batches an epoch",
        "updates",
        "epochs for as many updates",
        "paper",
    ]);
    let PaperTraining {
        real,
        synthetic,
        epochs,
        ..
    } = training;
    let [synthetic_epochs, real_epochs] = PAPER_EPOCHS;
    table.push(training.update_cells("both", real + synthetic, epochs));
    table.push(training.update_cells("synthetic", synthetic, synthetic_epochs));
    table.push(training.update_cells("real", real, real_epochs));
    table
}

impl PaperTraining {
    /// Cells of a source with so many images, for which the paper gives so many epochs.
    fn update_cells(&self, name: &str, images: u64, paper_epochs: u64) -> [String; 5] {
        let both = Updates::new(self.real + self.synthetic, self.batch, self.epochs);
        let batches = batches_per_epoch(images, self.batch);
        let papers = (*self == PAPER_TRAINING).then(|| paper_epochs.to_string());
        [
            format!("{name}: {images}"),
            batches.to_string(),
            (batches * self.epochs).to_string(),
            format!("{:.1}", both.epochs_of(batches)),
            papers.unwrap_or_default(),
        ]
    }
}

/// Reads the runs and writes `experiments.csv`, `experiments.md`, `updates.csv` and
/// `experiments.html`.
///
/// # Errors
/// As [`read_runs`], and [`Error::File`] for what cannot be written.
pub fn write(folder: &Path, of: &Path) -> Result<Table> {
    let table = table(&read_runs(of)?);
    let updates = updates_table(PAPER_TRAINING);
    let files = [
        ("experiments.csv", &*table.csv()),
        ("experiments.md", &table.markdown()),
        ("updates.csv", &updates.csv()),
        ("experiments.html", &page(&table, &updates)),
    ];
    write_texts(folder, files)?;
    Ok(table)
}

fn page(table: &Table, updates: &Table) -> String {
    let mut page = Page::new("Our trained models beside the paper's");
    page.text(
        "mAP@0.5:0.95 in percent, by the definition of YOLOv5. p: Welch's test of equal means.",
    )
    .table(table);
    page.heading("Equally many updates").table(updates);
    page.document()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_table_reads_and_has_its_best_row() {
        let rows = paper_rows();
        assert_eq!(
            rows.iter()
                .filter(|row| row.place.contains("Table 1"))
                .count(),
            14
        );
        let best = rows
            .iter()
            .max_by(|a, b| a.mean.partial_cmp(&b.mean).unwrap())
            .unwrap();
        assert_eq!(
            (best.key.as_str(), best.mean),
            ("combined/repeat_selections", Some(32.2))
        );
    }

    /// Value of `scipy.stats.ttest_ind_from_stats(10, 2, 6, 13, 3, 5, equal_var=False)`.
    #[test]
    fn welchs_test_is_that_of_scipy() {
        let welch = |a: [f64; 2], n: usize, b: [f64; 2], m: usize| {
            let moments = |[mean, std]: [f64; 2], n| SampleMoments { mean, std, n };
            welch_test(moments(a, n), moments(b, m))
        };
        let p = welch([10.0, 2.0], 6, [13.0, 3.0], 5).unwrap();
        assert!((p - SCIPY).abs() < 1e-9, "{p}");
        assert_eq!(welch([10.0, 0.0], 6, [13.0, 0.0], 5), None);
        assert_eq!(welch([10.0, 2.0], 1, [13.0, 3.0], 5), None);
    }
    const SCIPY: f64 = 0.09916292868915424;

    #[test]
    fn our_runs_stand_beside_the_papers() {
        let ours = BTreeMap::from([("combined/all".to_string(), vec![30.0, 31.0, 32.0])]);
        let table = table(&ours);
        let row = table
            .rows
            .iter()
            .find(|row| row[0] == "combined/all")
            .unwrap();
        assert_eq!(
            row[3..8],
            ["30.7 +- 2.0", "31.0 +- 1.0", &row[5], "3", "1.01"].map(String::from)
        );
        assert!(row[8].parse::<f64>().unwrap() > 0.5);
    }

    #[test]
    fn updates_are_those_of_the_paper() {
        let table = updates_table(PAPER_TRAINING);
        assert_eq!(
            table.rows[0][1..],
            ["176", "52800", "300.0", "300"].map(String::from)
        );
        assert_eq!(table.rows[1][3..], ["422.4", "423"].map(String::from));
        assert_eq!(table.rows[2][3..], ["1035.3", "1035"].map(String::from));
    }

    #[test]
    fn a_folder_without_runs_says_what_was_expected() {
        let folder = tempfile::tempdir().unwrap();
        assert!(
            read_runs(folder.path())
                .unwrap_err()
                .to_string()
                .contains("expected KEY/RUN/metrics.json")
        );
    }
}
