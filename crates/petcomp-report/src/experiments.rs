//! Our trainings beside the paper's.

use petcomp::eval::page::{Metrics, Spread};
use petcomp::io;
use petcomp::plot::{Page, Table};
use petcomp::train::{Updates, batches_per_epoch};
use petcomp::{Error, Result};
use serde::Deserialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;
use std::path::Path;

/// How many models each value of the paper is the mean of.
const PAPER_RUNS: usize = 6;
/// Images, batch and epochs of the paper: real, synthetic, batch, epochs.
const PAPER_TRAINING: [u64; 4] = [1624, 4000, 32, 300];
/// What the paper gives as epochs for equally many updates: synthetic, real.
const PAPER_EPOCHS: [u64; 2] = [423, 1035];

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
pub fn paper() -> Vec<PaperRow> {
    let paper: Paper = toml::from_str(include_str!("paper.toml"))
        .expect("the table is part of this program and tested");
    paper.rows
}

/// Means and spreads of our runs by key (`combined/all`), from `RUNS/KEY/RUN/metrics.json` as `petcomp eval` writes it;
/// mAP@0.5:0.95 in percent, by the definition of YOLOv5.
///
/// # Errors
/// [`Error::File`] for a folder that cannot be read or without any run.
pub fn runs(folder: &Path) -> Result<BTreeMap<String, Vec<f64>>> {
    let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for row in paper() {
        let Ok(entries) = std::fs::read_dir(folder.join(&row.key)) else {
            continue;
        };
        let mut files: Vec<_> = entries
            .flatten()
            .map(|e| e.path().join("metrics.json"))
            .filter(|p| p.is_file())
            .collect();
        files.sort();
        for file in files {
            let metrics: Metrics = io::read_json(&file)?;
            found
                .entry(row.key.clone())
                .or_default()
                .push(100.0 * metrics.yolov5.map());
        }
    }
    if found.is_empty() {
        let what = "no runs, expected KEY/RUN/metrics.json with a KEY such as combined/all";
        return Err(Error::file(folder, what));
    }
    Ok(found)
}

/// Chance of a difference of means at least as large, if there were none; none where a spread is unknown or zero.
///
/// # Method
/// [Welch 1947], two-sided, from mean, sample standard deviation and number.
///
/// [Welch 1947]: https://doi.org/10.1093/biomet/34.1-2.28
pub fn welch(a: [f64; 2], n: usize, b: [f64; 2], m: usize) -> Option<f64> {
    let share = |std: f64, n: usize| std * std / n as f64;
    let (va, vb) = (share(a[1], n), share(b[1], m));
    if n < 2 || m < 2 || va + vb <= 0.0 {
        return None;
    }
    let freedom = (va + vb) * (va + vb) / (va * va / (n - 1) as f64 + vb * vb / (m - 1) as f64);
    let t = (a[0] - b[0]).abs() / (va + vb).sqrt();
    StudentsT::new(0.0, 1.0, freedom)
        .ok()
        .map(|d| 2.0 * d.sf(t))
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
    for row in paper() {
        let theirs = row.mean.map(|mean| [mean, row.std.unwrap_or(0.0)]);
        let told = match (row.mean, row.std) {
            (Some(mean), Some(std)) => format!("{mean:.1} +- {std:.1}"),
            (Some(mean), None) => format!("{mean:.1}"),
            _ => String::new(),
        };
        let spread = ours
            .get(&row.key)
            .map(|values| Spread::from_values(values, 0));
        let against_paper = spread
            .zip(theirs)
            .and_then(|(s, b)| welch([s.mean, s.std], s.runs, b, PAPER_RUNS));
        let base = format!("{}/all", row.key.split('/').next().unwrap_or_default());
        let all = ours
            .get(&base)
            .filter(|_| base != row.key)
            .map(|values| Spread::from_values(values, 0));
        let against_all = spread
            .zip(all)
            .and_then(|(s, b)| welch([s.mean, s.std], s.runs, [b.mean, b.std], b.runs));
        let word = |text: Option<String>| text.unwrap_or_default();
        table.push([
            row.key.clone(),
            row.text.clone(),
            row.place.clone(),
            told,
            word(spread.map(|s| format!("{:.1} +- {:.1}", s.mean, s.std))),
            word(spread.map(|s| format!("{:.1} to {:.1}", s.interval.low, s.interval.high))),
            word(spread.map(|s| s.runs.to_string())),
            word(
                spread
                    .zip(row.mean)
                    .map(|(s, mean)| format!("{:.2}", s.mean / mean)),
            ),
            word(against_paper.map(|p| format!("{p:.3}"))),
            word(against_all.map(|p| format!("{p:.3}"))),
        ]);
    }
    table
}

/// How many epochs of each source alone make as many updates as both together.
pub fn updates_table(real: u64, synthetic: u64, batch: u64, epochs: u64) -> Table {
    let mut table = Table::new([
        "images",
        "batches an epoch",
        "updates",
        "epochs for as many updates",
        "paper",
    ]);
    let both = Updates::new(real + synthetic, batch, epochs);
    let row = |name: &str, images, paper: String| {
        let batches = batches_per_epoch(images, batch);
        [
            format!("{name}: {images}"),
            batches.to_string(),
            (batches * epochs).to_string(),
            format!("{:.1}", both.epochs_of(batches)),
            paper,
        ]
    };
    let is_papers = [real, synthetic, batch, epochs] == PAPER_TRAINING;
    let paper = |epochs: u64| {
        if is_papers {
            epochs.to_string()
        } else {
            String::new()
        }
    };
    table.push(row("both", real + synthetic, paper(epochs)));
    table.push(row("synthetic", synthetic, paper(PAPER_EPOCHS[0])));
    table.push(row("real", real, paper(PAPER_EPOCHS[1])));
    table
}

/// Reads the runs and writes `experiments.csv`, `experiments.md`, `updates.csv` and `experiments.html`.
///
/// # Errors
/// As [`runs`], and [`Error::File`] for what cannot be written.
pub fn write(folder: &Path, of: &Path) -> Result<Table> {
    let table = table(&runs(of)?);
    let [real, synthetic, batch, epochs] = PAPER_TRAINING;
    let updates = updates_table(real, synthetic, batch, epochs);
    io::create_folder(folder)?;
    io::write_text(folder.join("experiments.csv"), &table.csv())?;
    io::write_text(folder.join("experiments.md"), &table.markdown())?;
    io::write_text(folder.join("updates.csv"), &updates.csv())?;
    let mut page = Page::new("Our trainings beside the paper's");
    page.text(
        "mAP@0.5:0.95 in percent, by the definition of YOLOv5. p: Welch's test of equal means.",
    )
    .table(&table);
    page.heading("Equally many updates").table(&updates);
    io::write_text(folder.join("experiments.html"), &page.document())?;
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_table_reads_and_has_its_best_row() {
        let rows = paper();
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
        let table = updates_table(1624, 4000, 32, 300);
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
            runs(folder.path())
                .unwrap_err()
                .to_string()
                .contains("expected KEY/RUN/metrics.json")
        );
    }
}
