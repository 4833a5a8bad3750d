//! A detector against the truth: tables, curves and one page; several runs with their spread.

use super::{Page, Table};
use crate::error::Result;
use crate::eval::{
    self, CocoScores, Confusion, Definition, Interval, Scores, Sheet, THRESHOLDS, Tags, bootstrap, thresholds,
};
use crate::io;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What one training found.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its name: the folder or file of its predictions.
    pub name: String,
    /// Images with truth and detections.
    pub sheets: Vec<Sheet>,
}

/// What is asked of the report.
#[derive(Clone, Debug, PartialEq)]
pub struct EvalReportOptions {
    /// Names of the classes; unnamed ones are called by number.
    pub classes: Vec<String>,
    /// Light, camera position, ..: scores are told for each.
    pub tags: Tags,
    /// Rounds of the bootstrap over images. Default: 200.
    pub rounds: usize,
    /// Where its draws come from. Default: 0.
    pub seed: u64,
}

impl Default for EvalReportOptions {
    fn default() -> Self {
        Self { classes: Vec::new(), tags: Tags::default(), rounds: 200, seed: 0 }
    }
}

/// The scores of one run: `metrics.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// The run.
    pub run: String,
    /// Number of images.
    pub images: usize,
    /// mAP@0.5:0.95 as YOLOv5 has it, with its interval over images.
    pub map: Interval,
    /// By the definition of YOLOv5.
    pub yolov5: Scores,
    /// By the definition of COCO.
    pub coco: CocoScores,
}

/// Mean of several runs and how far they scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Number of runs.
    pub runs: usize,
    /// Their mean.
    pub mean: f64,
    /// Sample standard deviation; 0 for a single run.
    pub std: f64,
    /// Range of the mean by bootstrap over the runs.
    pub interval: Interval,
}

impl Spread {
    /// Over the values of runs; the interval comes from 2000 draws of the runs with replacement.
    pub fn of(values: &[f64], seed: u64) -> Self {
        const ROUNDS: u64 = 2000;
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        let resampled = |k| {
            let times = eval::drawn(values.len(), seed, k);
            values.iter().zip(times).map(|(v, t)| v * f64::from(t)).sum::<f64>() / n
        };
        let interval = eval::interval(mean, (0..ROUNDS).map(resampled).collect());
        Self { runs: values.len(), mean, std: if n > 1.0 { (squares / (n - 1.0)).sqrt() } else { 0.0 }, interval }
    }
}

impl Metrics {
    /// Scores of a run by both definitions.
    pub fn of(run: &Run, options: &EvalReportOptions) -> Self {
        Self {
            run: run.name.clone(),
            images: run.sheets.len(),
            map: bootstrap(&run.sheets, Definition::Yolov5, options.rounds, options.seed),
            yolov5: eval::yolov5(&run.sheets, &[]),
            coco: eval::coco(&run.sheets, &[]),
        }
    }
}

/// Evaluates runs and writes `metrics.json` (one run) or `NAME.json` each, `scores.csv`, `classes.csv`, `factors.csv`,
/// the pictures of the first run as SVG, and everything as one page, `eval.html`.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for what cannot be written.
pub fn write(folder: &Path, runs: &[Run], options: &EvalReportOptions) -> Result<Vec<Metrics>> {
    let all: Vec<Metrics> = runs.iter().map(|run| Metrics::of(run, options)).collect();
    io::create_folder(folder)?;
    for (i, metrics) in all.iter().enumerate() {
        let name = if all.len() == 1 { "metrics.json".into() } else { format!("{}-{}.json", i + 1, metrics.run) };
        io::write_json(folder.join(name), metrics)?;
    }
    let tables = [
        ("scores", "Scores", scores_table(&all, options)),
        ("classes", "Classes", classes_table(&all, options)),
        ("factors", "Factors", factors_table(runs, options)),
    ];
    let mut page = Page::new("Detections against the truth");
    for (name, title, table) in tables.iter().filter(|(.., table)| !table.rows.is_empty()) {
        io::write_text(folder.join(format!("{name}.csv")), &table.csv())?;
        page.heading(title).table(table);
    }
    for (name, caption, svg) in runs.first().map(|run| pictures(run, options)).into_iter().flatten() {
        io::write_text(folder.join(format!("{name}.svg")), &svg)?;
        page.chart(&svg, caption);
    }
    io::write_text(folder.join("eval.html"), &page.document())?;
    Ok(all)
}

/// A row per run, and one over all where there are several.
pub fn scores_table(all: &[Metrics], options: &EvalReportOptions) -> Table {
    let mut table = Table::new(["run", "images", "definition", "mAP@0.5", "mAP@0.75", "mAP@0.5:0.95", "95 % interval"]);
    for m in all {
        let yolov5 = format!("{} to {}", share(m.map.low), share(m.map.high));
        for (name, scores, interval) in [("yolov5", &m.yolov5, yolov5), ("coco", &m.coco.scores, String::new())] {
            let [half, strict] = [0, 5].map(|t| share(scores.map_at(t)));
            table.push([&m.run, &m.images.to_string(), name, &half, &strict, &share(scores.map()), &interval]);
        }
    }
    if all.len() > 1 {
        let spread = Spread::of(&all.iter().map(|m| m.yolov5.map()).collect::<Vec<_>>(), options.seed);
        let interval = format!("{} to {}", share(spread.interval.low), share(spread.interval.high));
        let mean = format!("{} +- {}", share(spread.mean), share(spread.std));
        table.push(["mean +- std", &format!("{} runs", spread.runs), "yolov5", "", "", &mean, &interval]);
    }
    table
}

/// Average precision per class and threshold by the definition of YOLOv5.
pub fn classes_table(all: &[Metrics], options: &EvalReportOptions) -> Table {
    let columns = ["run", "class", "objects", "precision", "recall", "AP@0.5:0.95"].map(String::from);
    let at = thresholds().map(|t| format!("AP@{t:.2}"));
    let mut table = Table { columns: columns.into_iter().chain(at).collect(), rows: Vec::new() };
    for (m, class) in all.iter().flat_map(|m| m.yolov5.classes.iter().map(move |class| (m, class))) {
        let name = options.classes.get(class.class as usize).cloned().unwrap_or_else(|| class.class.to_string());
        let numbers = [class.precision, class.recall, class.mean()].into_iter().chain(class.ap).map(share);
        table.push([m.run.clone(), name, class.truths.to_string()].into_iter().chain(numbers));
    }
    table
}

/// mAP per level of every factor; empty without tags.
pub fn factors_table(runs: &[Run], options: &EvalReportOptions) -> Table {
    let mut table = Table::new(["run", "factor", "level", "images", "yolov5 mAP@0.5:0.95", "coco mAP@0.5:0.95"]);
    for (i, factor) in options.tags.factors.iter().enumerate() {
        for (level, run) in options.tags.levels(i).into_iter().flat_map(|level| runs.iter().map(move |r| (level, r))) {
            let inside = |s: &&Sheet| options.tags.of(&s.image, i) == Some(level);
            let sheets: Vec<Sheet> = run.sheets.iter().filter(inside).cloned().collect();
            let [ours, theirs] =
                [Definition::Yolov5, Definition::Coco].map(|d| share(eval::evaluate(&sheets, d, &[]).map()));
            table.push([&run.name, factor, level, &sheets.len().to_string(), &ours, &theirs]);
        }
    }
    table
}

/// Name, caption and SVG of each picture of a run.
fn pictures(run: &Run, options: &EvalReportOptions) -> [(&'static str, &'static str, String); 3] {
    let curves = eval::curves(&run.sheets);
    let most = run.sheets.iter().flat_map(|s| s.truth.iter().map(|t| t.class as usize + 1)).max().unwrap_or(0);
    let confusion = Confusion::new(&run.sheets, most.max(options.classes.len()), &Default::default());
    [
        ("precision_recall", "Precision over recall.", eval::precision_recall_picture(&curves, &options.classes)),
        ("f1", "F1 over confidence.", eval::f1_picture(&curves, &options.classes)),
        (
            "confusion",
            "Which class is taken for which; detections surer than 0.25 that overlap a box by more than 0.45.",
            eval::confusion_picture(&confusion, &options.classes),
        ),
    ]
}

fn share(value: f64) -> String {
    format!("{value:.4}")
}

const _: () = assert!(THRESHOLDS > 5, "mAP@0.75 is the sixth threshold");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::{FoundBox, TrueBox};
    use crate::label::BBox;

    fn run(name: &str, confidence: f64) -> Run {
        let bbox = BBox { x0: 0.0, y0: 0.0, x1: 50.0, y1: 40.0 };
        let truth = TrueBox { class: 0, bbox, area: 2000.0, crowd: false };
        let sheet = |image: &str, found: &[f64]| Sheet {
            image: image.into(),
            truth: vec![truth],
            found: found.iter().map(|&confidence| FoundBox { class: 0, bbox, confidence }).collect(),
        };
        Run { name: name.into(), sheets: vec![sheet("a", &[confidence]), sheet("b", &[])] }
    }

    #[test]
    fn one_run_gives_metrics_tables_and_a_page() {
        let folder = tempfile::tempdir().unwrap();
        let options = EvalReportOptions { classes: vec!["cap".into()], ..Default::default() };
        write(folder.path(), &[run("best", 0.9)], &options).unwrap();
        let metrics: Metrics = io::read_json(folder.path().join("metrics.json")).unwrap();
        assert_eq!((metrics.images, metrics.yolov5.classes[0].truths), (2, 2));
        let page = io::read_text(folder.path().join("eval.html")).unwrap();
        assert!(page.contains("mAP@0.5:0.95") && page.matches("<svg").count() == 3);
        assert!(!folder.path().join("factors.csv").exists());
    }

    #[test]
    fn several_runs_give_mean_and_spread() {
        let spread = Spread::of(&[1.0, 2.0, 3.0], 0);
        assert_eq!((spread.runs, spread.mean, spread.std), (3, 2.0, 1.0));
        assert!(spread.interval.low >= 1.0 && spread.interval.high <= 3.0 && spread.interval.low < 2.0);
        assert_eq!(Spread::of(&[0.5], 0).std, 0.0);
    }
}
