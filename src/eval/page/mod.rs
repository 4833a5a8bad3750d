//! A detector compared with the ground truth: tables, curves and one page; several runs with their
//! spread.

mod earlier;
mod map_estimate;
mod mistakes;
mod run_names;
mod spread;

pub use map_estimate::{MapEstimate, MapRange};
pub use run_names::{run_name, run_names};
pub use spread::Spread;

use crate::error::Result;
use crate::eval::{
    self, ClassScores, CocoScores, Confusion, ConfusionOptions, Definition, EvalImage, Matches,
    Picture, Scores, THRESHOLDS, Tags, thresholds,
};
use crate::io;
use crate::plot::{Page, Table};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The result of one training run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its name: the folder or file of its predictions, with parent folders if necessary.
    pub name: String,
    /// Images with ground truth and detections.
    pub sheets: Vec<EvalImage>,
}

/// What to report.
#[derive(Clone, Debug, PartialEq)]
pub struct EvalReportOptions {
    /// Names of the classes; unnamed ones are shown by number.
    pub classes: Vec<String>,
    /// Light, camera position, ..: scores are reported for each.
    pub tags: Tags,
    /// Rounds of the bootstrap over images, or their sequences; fewer than 40 give no interval.
    /// Default: 200.
    pub rounds: usize,
    /// Seed of its draws. Default: 0.
    pub seed: u64,
    /// Which detections the confusion matrix and the mistakes consider. Default: as in YOLOv5.
    pub confusion: ConfusionOptions,
    /// The pictures of the sheets, one each or none at all, to show mistakes.
    pub pictures: Vec<Option<Picture>>,
    /// Maximum number of pictures of mistakes of each kind on the page. Default: 24.
    pub shown: usize,
}

impl EvalReportOptions {
    /// The picture of a sheet, if it was found.
    fn picture(&self, sheet: usize) -> Option<&Picture> {
        self.pictures.get(sheet)?.as_ref()
    }
}

impl Default for EvalReportOptions {
    fn default() -> Self {
        Self {
            classes: Vec::new(),
            tags: Tags::default(),
            rounds: 200,
            seed: 0,
            confusion: ConfusionOptions::default(),
            pictures: Vec::new(),
            shown: 24,
        }
    }
}

/// The scores of one run: `metrics.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// The run.
    pub run: String,
    /// Number of images.
    pub images: usize,
    /// Number of [groups](EvalImage::group) of the images, where a single image counts as one; none
    /// if all images are single.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sequences: Option<usize>,
    /// mAP@0.5:0.95 as defined by YOLOv5, with its interval over images, or over their sequences.
    pub map: MapEstimate,
    /// By the definition of YOLOv5.
    pub yolov5: Scores,
    /// By the definition of COCO.
    pub coco: CocoScores,
}

impl Metrics {
    /// Scores of a run by both definitions.
    pub fn of(run: &Run, options: &EvalReportOptions) -> Self {
        let matches = Matches::new(&run.sheets, Definition::Yolov5);
        let is_grouped = run.sheets.iter().any(|sheet| !sheet.group.is_empty());
        Self {
            run: run.name.clone(),
            images: run.sheets.len(),
            sequences: is_grouped.then(|| matches.group_count()),
            map: MapEstimate::new(&matches, &run.sheets, options),
            yolov5: matches.scores(&[]),
            coco: eval::coco(&run.sheets, &[]),
        }
    }

    fn scores_row(&self, definition: &str, scores: &Scores, interval: String) -> [String; 7] {
        let [half, strict] = [0, 5].map(|t| share(scores.map_at(t)));
        [
            self.run.clone(),
            self.images.to_string(),
            definition.to_owned(),
            half,
            strict,
            share(scores.map()),
            interval,
        ]
    }

    /// The scores of a class; none for one that is not in the truth.
    fn class(&self, class: u32) -> Option<&ClassScores> {
        let classes = &self.yolov5.classes;
        classes
            .binary_search_by_key(&class, |c| c.class)
            .ok()
            .map(|i| &classes[i])
    }

    /// The number of classes that are in the truth.
    fn count_scored(&self, classes: &[u32]) -> usize {
        let scored = classes.iter().filter(|class| self.class(**class).is_some());
        scored.count()
    }
}

/// Evaluates runs and writes `metrics.json` (one run) or a `NAME.json` each, `scores.csv`,
/// `classes.csv`, `factors.csv`, for the first run `confusion.csv`, `mistakes.csv` and its charts
/// as SVG, and everything as one page, `eval.html`, with pictures of its worst mistakes.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for a file that cannot be written.
pub fn write(folder: &Path, runs: &[Run], options: &EvalReportOptions) -> Result<Vec<Metrics>> {
    let all: Vec<Metrics> = runs.iter().map(|run| Metrics::of(run, options)).collect();
    io::create_folder(folder)?;
    write_metrics(folder, &all)?;
    let page = write_parts(folder, runs, &all, options)?;
    io::write_text(folder.join("eval.html"), &page.document())?;
    Ok(all)
}

/// Writes the tables and pictures as files, and the page that shows them.
fn write_parts(
    folder: &Path,
    runs: &[Run],
    all: &[Metrics],
    options: &EvalReportOptions,
) -> Result<Page> {
    let first = runs.first().map_or(&[][..], |run| &run.sheets[..]);
    let confusion = Confusion::new(first, &options.confusion);
    let shown = shown_classes(all, &confusion);
    let mut page = Page::new("Detections against the truth");
    let [scores, factors] = [scores_table(all), factors_table(runs, options)];
    add_table(&mut page, folder, "Scores", "scores.csv", [&scores; 2])?;
    add_classes(&mut page, folder, all, &shown, options)?;
    add_table(&mut page, folder, "Factors", "factors.csv", [&factors; 2])?;
    if let Some(run) = runs.first() {
        add_run(folder, &mut page, run, &confusion, &shown, options)?;
    }
    Ok(page)
}

fn add_classes(
    page: &mut Page,
    folder: &Path,
    all: &[Metrics],
    shown: &[u32],
    options: &EvalReportOptions,
) -> Result<()> {
    let title = classes_title(all, shown);
    let tables = [
        &classes_table(all, options),
        &classes_among(all, options, shown),
    ];
    add_table(page, folder, &title, "classes.csv", tables)
}

/// Writes `metrics.json` for one run, or `1-NAME.json` and so on for several, and removes those of
/// an earlier evaluation.
fn write_metrics(folder: &Path, all: &[Metrics]) -> Result<()> {
    let runs: Vec<&str> = all.iter().map(|metrics| metrics.run.as_str()).collect();
    let names = metrics_names(&runs);
    for (name, metrics) in names.iter().zip(all) {
        io::write_json(folder.join(name), metrics)?;
    }
    earlier::remove_metrics(folder, &names)
}

fn metrics_names(runs: &[&str]) -> Vec<String> {
    match runs {
        [_] => vec![earlier::METRICS.into()],
        _ => (1..)
            .zip(runs)
            .map(|(i, run)| format!("{i}-{}.json", earlier::file_part(run)))
            .collect(),
    }
}

/// Fails if a file that [`write`] creates in its folder for runs of these names would replace one
/// of its inputs.
///
/// # Errors
/// [`Error::File`](crate::Error::File) for the first such file.
pub fn check_inputs_stay(
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    folder: &Path,
    runs: &[String],
) -> Result<()> {
    let runs: Vec<&str> = runs.iter().map(String::as_str).collect();
    let written = file_names(&runs).into_iter();
    io::check_distinct(inputs, written.map(|name| folder.join(name)))
}

/// Warns if no run could find anything because the truth is empty.
pub fn warn_of_empty_truth(truth: &Path, runs: &[Metrics]) {
    let is_empty = |metrics: &Metrics| metrics.yolov5.classes.is_empty();
    if runs.iter().all(is_empty) {
        let truth = truth.display();
        log::warn!("{truth}: no objects, so there is nothing to find in any image");
    }
}

/// Names of the files that [`write`] may make in its folder for runs of these names.
fn file_names(runs: &[&str]) -> Vec<String> {
    let names = FILES.into_iter().map(String::from);
    names.chain(metrics_names(runs)).collect()
}

/// The files of each evaluation, in addition to the metrics.
const FILES: [&str; 9] = [
    "scores.csv",
    "classes.csv",
    "factors.csv",
    "confusion.csv",
    "mistakes.csv",
    "precision_recall.svg",
    "f1.svg",
    "confusion.svg",
    "eval.html",
];

/// Writes a table that is not empty, and adds its visible part to the page; for an empty one, that
/// of an earlier evaluation is removed.
fn add_table(
    page: &mut Page,
    folder: &Path,
    title: &str,
    file: &str,
    [table, shown]: [&Table; 2],
) -> Result<()> {
    let path = folder.join(file);
    if table.rows.is_empty() {
        return earlier::remove_table(&path, &table.csv());
    }
    io::write_text(path, &table.csv())?;
    page.heading(title).beginning(shown, MAX_SHOWN_ROWS, file);
    Ok(())
}

/// Maximum number of classes on the page and on a terminal; the tables (CSV) have all of them.
const MAX_SHOWN_CLASSES: usize = 50;

/// Maximum number of rows of a table on the page.
const MAX_SHOWN_ROWS: usize = 200;

/// The charts, the confusion and the mistakes of a run.
fn add_run(
    folder: &Path,
    page: &mut Page,
    run: &Run,
    confusion: &Confusion,
    shown: &[u32],
    options: &EvalReportOptions,
) -> Result<()> {
    for (name, caption, svg) in pictures(run, confusion, shown, options) {
        io::write_text(folder.join(format!("{name}.svg")), &svg)?;
        page.chart(&svg, &caption);
    }
    let counts = confusion_table(confusion, options);
    io::write_text(folder.join("confusion.csv"), &counts.csv())?;
    add_mistakes(folder, page, run, options)
}

fn add_mistakes(
    folder: &Path,
    page: &mut Page,
    run: &Run,
    options: &EvalReportOptions,
) -> Result<()> {
    let mistakes = eval::mistakes(&run.sheets, &options.confusion);
    let table = mistakes::table(run, &mistakes, options);
    io::write_text(folder.join("mistakes.csv"), &table.csv())?;
    mistakes::add_to(page, run, &mistakes, options);
    Ok(())
}

/// All classes in order; if there are too many, those with the most mistakes, in that order.
fn shown_classes(all: &[Metrics], confusion: &Confusion) -> Vec<u32> {
    let known: BTreeSet<u32> = scored_classes(all).chain(confusion.classes()).collect();
    if known.len() <= MAX_SHOWN_CLASSES {
        return known.into_iter().collect();
    }
    let worst = confusion.worst().into_iter();
    worst.take(MAX_SHOWN_CLASSES).collect()
}

/// The classes in the truth of the runs, run by run.
fn scored_classes(all: &[Metrics]) -> impl Iterator<Item = u32> {
    let scored = all.iter().flat_map(|metrics| &metrics.yolov5.classes);
    scored.map(|class| class.class)
}

fn classes_title(all: &[Metrics], shown: &[u32]) -> String {
    let count = all.first().map_or(0, |m| m.yolov5.classes.len());
    let seen = all.first().map_or(0, |m| m.count_scored(shown));
    match count - seen {
        0 => "Classes".into(),
        others => format!(
            "Classes: the {seen} with the most mistakes; {others} others are in classes.csv"
        ),
    }
}

fn confusion_table(confusion: &Confusion, options: &EvalReportOptions) -> Table {
    let mut table = Table::new(["found", "true", "count"]);
    for (classes, count) in &confusion.counts {
        let [found, truth] = classes.map(|class| class_title(class, options));
        table.push([found, truth, count.to_string()]);
    }
    table
}

fn class_title(class: Option<u32>, options: &EvalReportOptions) -> String {
    match class {
        Some(class) => eval::class_name(class, &options.classes),
        None => "background".into(),
    }
}

/// One row per run, and a summary row if there are several.
pub fn scores_table(all: &[Metrics]) -> Table {
    let mut table = Table::new([
        "run",
        "images",
        "definition",
        "mAP@0.5",
        "mAP@0.75",
        "mAP@0.5:0.95",
        "95 % interval",
    ]);
    for metrics in all {
        let interval = interval_text(metrics);
        table.push(metrics.scores_row("yolov5", &metrics.yolov5, interval));
        table.push(metrics.scores_row("coco", &metrics.coco.scores, String::new()));
    }
    if all.len() > 1 {
        let maps: Vec<f64> = all.iter().map(|m| m.yolov5.map()).collect();
        table.push(spread_row(&Spread::from_values(&maps)));
    }
    table
}

/// The row with the spread of the mAP by YOLOv5's definition.
fn spread_row(spread: &Spread) -> [String; 7] {
    // The normal distribution is unbounded, a mAP is not.
    let interval = spread
        .interval
        .map(|interval| range_text(interval.low.max(0.0), interval.high.min(1.0)));
    [
        "mean +- std".into(),
        format!("{} runs", spread.runs),
        "yolov5".into(),
        String::new(),
        String::new(),
        format!("{} +- {}", share(spread.mean), share(spread.std)),
        interval.map_or_else(String::new, |range| range + " over runs"),
    ]
}

/// Empty if there is no interval.
fn interval_text(metrics: &Metrics) -> String {
    let Some(MapRange { low, high }) = metrics.map.range else {
        return String::new();
    };
    let over = match metrics.sequences {
        Some(_) => "sequences",
        None => "images",
    };
    format!("{} over {over}", range_text(low, high))
}

fn range_text(low: f64, high: f64) -> String {
    format!("{} to {}", share(low), share(high))
}

/// Average precision per class and threshold by the definition of YOLOv5.
pub fn classes_table(all: &[Metrics], options: &EvalReportOptions) -> Table {
    let classes: BTreeSet<u32> = scored_classes(all).collect();
    classes_among(all, options, &Vec::from_iter(classes))
}

/// The same for a terminal: if there are too many classes, those with the lowest average precision,
/// and how many others there are.
pub fn classes_in_brief(all: &[Metrics], options: &EvalReportOptions) -> (Table, usize) {
    let order = classes_by_precision(all);
    let others = order.len().saturating_sub(MAX_SHOWN_CLASSES);
    let mut shown: Vec<u32> = order.into_iter().take(MAX_SHOWN_CLASSES).collect();
    if others == 0 {
        shown.sort_unstable();
    }
    (classes_among(all, options, &shown), others)
}

/// The classes, sorted by their lowest average precision in any run.
fn classes_by_precision(all: &[Metrics]) -> Vec<u32> {
    let mut order: Vec<(u32, f64)> = lowest_precisions(all).into_iter().collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    order.into_iter().map(|(class, _)| class).collect()
}

/// The lowest average precision of each class in any run.
fn lowest_precisions(all: &[Metrics]) -> BTreeMap<u32, f64> {
    let mut lowest = BTreeMap::new();
    for class in all.iter().flat_map(|m| &m.yolov5.classes) {
        let least = lowest.entry(class.class).or_insert(f64::INFINITY);
        *least = least.min(class.mean());
    }
    lowest
}

fn classes_among(all: &[Metrics], options: &EvalReportOptions, classes: &[u32]) -> Table {
    let mut table = Table {
        columns: class_columns(),
        rows: Vec::new(),
    };
    for metrics in all {
        for class in classes.iter().filter_map(|&class| metrics.class(class)) {
            table.push(class_row(&metrics.run, class, options));
        }
    }
    table
}

fn class_columns() -> Vec<String> {
    let columns = [
        "run",
        "class",
        "objects",
        "precision",
        "recall",
        "AP@0.5:0.95",
    ];
    let thresholds = thresholds().map(|t| format!("AP@{t:.2}"));
    let columns = columns.map(String::from).into_iter();
    columns.chain(thresholds).collect()
}

fn class_row(run: &str, class: &ClassScores, options: &EvalReportOptions) -> Vec<String> {
    let scores = [class.precision, class.recall, class.mean()];
    let name = name_or_number(class.class, options);
    [run.to_owned(), name, class.truths.to_string()]
        .into_iter()
        .chain(scores.into_iter().chain(class.ap).map(share))
        .collect()
}

fn name_or_number(class: u32, options: &EvalReportOptions) -> String {
    let name = options.classes.get(class as usize).cloned();
    name.unwrap_or_else(|| class.to_string())
}

/// mAP per level of each factor; empty without tags.
pub fn factors_table(runs: &[Run], options: &EvalReportOptions) -> Table {
    let mut table = Table::new([
        "run",
        "factor",
        "level",
        "images",
        "yolov5 mAP@0.5:0.95",
        "coco mAP@0.5:0.95",
    ]);
    let tags = &options.tags;
    if !tags.factors.is_empty() {
        let matches: Vec<[Matches; 2]> = runs.iter().map(match_both).collect();
        for i in 0..tags.factors.len() {
            add_factor(&mut table, runs, &matches, tags, i);
        }
    }
    table
}

/// A row for each level of a factor and each run.
fn add_factor(table: &mut Table, runs: &[Run], matches: &[[Matches; 2]], tags: &Tags, i: usize) {
    for level in tags.levels(i) {
        for (run, matches) in runs.iter().zip(matches) {
            let weights = level_weights(run, tags, i, level);
            let [images, yolov5, coco] = weighted_scores(matches, &weights);
            table.push([&run.name, &tags.factors[i], level, &images, &yolov5, &coco]);
        }
    }
}

/// Number of images, and their mAP by both definitions; empty if there is nothing to find.
fn weighted_scores(matches: &[Matches; 2], weights: &[u32]) -> [String; 3] {
    let images = weights.iter().filter(|weight| **weight > 0).count();
    let [yolov5, coco] = matches.each_ref().map(|m| m.map_if_any(weights));
    let [yolov5, coco] = [yolov5, coco].map(|map| map.map_or_else(String::new, share));
    [images.to_string(), yolov5, coco]
}

/// The detections of a run matched by both definitions.
fn match_both(run: &Run) -> [Matches; 2] {
    [Definition::Yolov5, Definition::Coco].map(|d| Matches::new(&run.sheets, d))
}

/// 1 for each image with a level of a factor, 0 for the others.
fn level_weights(run: &Run, tags: &Tags, factor: usize, level: &str) -> Vec<u32> {
    run.sheets
        .iter()
        .map(|sheet| u32::from(tags.of(&sheet.image, factor) == Some(level)))
        .collect()
}

/// Name, caption and SVG of each chart of a run.
fn pictures(
    run: &Run,
    confusion: &Confusion,
    shown: &[u32],
    options: &EvalReportOptions,
) -> [(&'static str, String, String); 3] {
    let (curves, names) = (eval::curves(&run.sheets), &options.classes);
    let few = describe_curves(curves.classes.len());
    [
        (
            "precision_recall",
            format!("Precision over recall.{few}"),
            eval::precision_recall_picture(&curves, names, shown),
        ),
        (
            "f1",
            format!("F1 over confidence.{few}"),
            eval::f1_picture(&curves, names, shown),
        ),
        (
            "confusion",
            describe_confusion(&options.confusion),
            eval::confusion_picture(confusion, names, shown),
        ),
    ]
}

/// Which classes have a curve, if not all do.
fn describe_curves(classes: usize) -> String {
    let most = eval::MAX_CURVES;
    if classes > most {
        format!(" The mean of {classes} classes, and {most} single classes.")
    } else {
        String::new()
    }
}

fn describe_confusion(ConfusionOptions { confidence, iou }: &ConfusionOptions) -> String {
    format!(
        "Found class by true class, for detections with a confidence above {confidence} and an IoU above {iou}. \
         Shades are shares of a column. All counts are in confusion.csv."
    )
}

fn share(value: f64) -> String {
    format!("{value:.4}")
}

const _: () = assert!(THRESHOLDS > 5, "mAP@0.75 is the sixth threshold");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::tests::bbox;
    use crate::eval::{Detection, GroundTruth};

    fn run(name: &str, confidence: f64) -> Run {
        let bbox = bbox(0.0, 0.0, 50.0, 40.0);
        let truth = GroundTruth::new(0, bbox);
        let sheet = |image: &str, found: &[f64]| EvalImage {
            found: found
                .iter()
                .map(|&confidence| Detection::new(0, bbox, confidence))
                .collect(),
            ..EvalImage::new(image, vec![truth])
        };
        Run {
            name: name.into(),
            sheets: vec![sheet("a", &[confidence]), sheet("b", &[])],
        }
    }

    #[test]
    fn one_run_gives_metrics_tables_and_a_page() {
        let folder = tempfile::tempdir().unwrap();
        let options = EvalReportOptions {
            classes: vec!["cap".into()],
            ..Default::default()
        };
        write(folder.path(), &[run("best", 0.9)], &options).unwrap();
        let files = std::fs::read_dir(folder.path()).unwrap().flatten();
        let names = file_names(&["best"]);
        assert!(files.map(|file| file.file_name()).all(|file| {
            let file = file.to_string_lossy();
            names.iter().any(|name| *name == file)
        }));
        let metrics: Metrics = io::read_json(folder.path().join("metrics.json")).unwrap();
        assert_eq!((metrics.images, metrics.yolov5.classes[0].truths), (2, 2));
        let page = io::read_text(folder.path().join("eval.html")).unwrap();
        assert!(page.contains("mAP@0.5:0.95") && page.matches("<svg").count() == 3);
        assert!(!folder.path().join("factors.csv").exists());
    }

    /// Tags of the images of a run.
    fn with_tags(text: &str, run: &Run) -> EvalReportOptions {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        EvalReportOptions {
            tags: eval::read_tags(file.path(), &run.sheets).unwrap(),
            ..Default::default()
        }
    }

    #[test]
    fn files_of_an_earlier_evaluation_go_and_those_of_the_user_stay() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let there = |names: &[&str]| names.iter().filter(|name| at(name).exists()).count();
        let (runs, untagged) = (
            [run("p", 0.9), run("x/q", 0.8)],
            EvalReportOptions::default(),
        );
        let tagged = with_tags("image,light\na,dim\n", &runs[0]);
        write(folder.path(), &runs, &tagged).unwrap();
        let numbered = ["1-p.json", "2-x_q.json", "factors.csv"];
        assert_eq!(there(&numbered), 3);
        std::fs::copy(at("1-p.json"), at("1-best.json")).unwrap();
        std::fs::write(at("3-notes.json"), "{}").unwrap();
        write(folder.path(), &runs[..1], &untagged).unwrap();
        assert_eq!(there(&numbered), 0);
        std::fs::write(at("factors.csv"), "image,light\n").unwrap();
        write(folder.path(), &runs, &untagged).unwrap();
        assert_eq!(there(&["metrics.json"]), 0);
        assert_eq!(there(&["1-best.json", "3-notes.json", "factors.csv"]), 3);
    }

    fn with_rounds(rounds: usize) -> EvalReportOptions {
        EvalReportOptions {
            rounds,
            ..Default::default()
        }
    }

    #[test]
    fn an_interval_says_over_what_and_there_is_none_of_a_few_rounds() {
        let cells = |runs: &[Run], rounds| {
            let options = with_rounds(rounds);
            let all: Vec<Metrics> = runs.iter().map(|run| Metrics::of(run, &options)).collect();
            let rows = scores_table(&all).rows.into_iter();
            rows.map(|row| row[6].clone()).collect::<Vec<String>>()
        };
        let runs = [run("p", 0.9), run("q", 0.8)];
        assert!(cells(&runs[..1], 200)[0].ends_with(" over images"));
        assert_eq!(cells(&runs[..1], 1), ["", ""]);
        assert!(cells(&runs, 0)[4].ends_with(" over runs"));
        let [mut belt, _] = runs;
        belt.sheets[0].group = "7".into();
        assert!(cells(&[belt.clone()], 200)[0].ends_with(" over sequences"));
        belt.sheets[1].group = "7".into();
        assert_eq!(cells(&[belt], 200)[0], "");
    }

    #[test]
    fn metrics_have_no_interval_where_nothing_tells_of_other_images() {
        let measured = |run: &Run, rounds| Metrics::of(run, &with_rounds(rounds));
        let two = run("p", 0.9);
        assert!(measured(&two, 40).map.range.is_some());
        let [mut one, mut lone, mut bare] = [(); 3].map(|()| two.clone());
        one.sheets.truncate(1);
        lone.sheets[1].truth.clear();
        for sheet in &mut bare.sheets {
            sheet.truth.clear();
        }
        for (run, rounds) in [
            (&two, 0),
            (&two, 39),
            (&one, 200),
            (&lone, 200),
            (&bare, 200),
        ] {
            let metrics = measured(run, rounds);
            let document = serde_json::to_value(&metrics).unwrap();
            let value = metrics.map.value;
            assert_eq!(document["map"], serde_json::json!({"value": value}));
            assert_eq!(interval_text(&metrics), "");
            assert_eq!(
                serde_json::from_value::<Metrics>(document).unwrap(),
                metrics
            );
        }
    }

    #[test]
    fn a_level_with_nothing_to_find_has_no_score() {
        let mut tagged = run("p", 0.9);
        tagged.sheets.push(EvalImage::new("c", vec![]));
        let options = with_tags("image,light\na,dim\nc,dark\n", &tagged);
        let table = factors_table(&[tagged], &options);
        assert_eq!(table.rows[0], ["p", "light", "dark", "1", "", ""]);
        assert_eq!(table.rows[1][..5], ["p", "light", "dim", "1", "0.9950"]);
    }
}
