//! `petcomp eval`: evaluates detections against ground truth.

use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::print;
use crate::values::{check_companion, count, parse_pixel_size};
use petcomp::Error;
use petcomp::dataset::EvalTruth;
use petcomp::eval::page::{self, EvalReportOptions, Metrics, Run};
use petcomp::eval::{ConfusionOptions, Tags, read_tags};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// Predictions of one or more runs, then the ground truth: folders of YOLO labels (`class cx cy
    /// w h confidence`, optionally followed by a track id) or COCO JSON. The ground truth may also
    /// be a list of images (.txt), or a folder with a data.yaml and no labels: its validation
    /// images
    #[arg(required = true, num_args = 2.., value_names = ["PREDICTIONS", "TRUTH"])]
    paths: Vec<PathBuf>,
    /// CSV with a header `image,light,..` that tags the ground-truth images, for scores per factor
    #[arg(long, value_name = "CSV")]
    tags: Option<PathBuf>,
    /// Names of the classes in order; by default those of a data.yaml or a COCO file
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    classes: Vec<String>,
    /// Width and height of all images, pixels, for YOLO labels without images next to them
    #[arg(long, value_name = "WxH", value_parser = parse_pixel_size)]
    size: Option<[u32; 2]>,
    /// Folder of the images, if not next to the COCO document or where YOLO has them; used to show
    /// errors and for the size of YOLO's boxes
    #[arg(long, value_name = "FOLDER")]
    images: Option<PathBuf>,
    /// Confidence, 0 to 1, above which detections count in the confusion matrix and as errors
    #[arg(long, value_name = "CONFIDENCE", default_value_t = ConfusionOptions::default().confidence, value_parser = parse_confidence)]
    confidence: f64,
    /// Maximum number of false positives, and of false negatives, shown on the page
    #[arg(short = 'n', long, value_name = "N", default_value_t = EvalReportOptions::default().shown)]
    most: usize,
    /// Bootstrap rounds over images (sequences of a belt or video), at most 100000; with fewer than
    /// 40 there is no confidence interval
    #[arg(long, value_name = "N", default_value_t = EvalReportOptions::default().rounds, value_parser = count(0..=100_000))]
    rounds: usize,
    /// Seed of the bootstrap
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for metrics.json, tables (CSV), plots (SVG) and the page eval.html
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: Option<PathBuf>,
}

fn parse_confidence(text: &str) -> Result<f64, String> {
    let confidence = text.parse::<f64>().ok();
    let confidence = confidence.filter(|value| (0.0..=1.0).contains(value));
    confidence.ok_or_else(|| "expected a number from 0 to 1".into())
}

pub(crate) fn run(args: &EvalArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let mut options = args.report_options();
    args.check_options()?;
    args.check_inputs_stay()?;
    let runs = args.read_runs(&mut options)?;
    options.tags = args.tags_of(&runs)?;
    let metrics = args.measure(&runs, &options)?;
    args.warn_of_empty_truth(&metrics);
    print_scores(&metrics, &options, global);
    print_factors(&runs, &options);
    if let Some(folder) = &args.output {
        global.print_look_at(&folder.join("eval.html"));
    }
    Ok(())
}

fn print_scores(metrics: &[Metrics], options: &EvalReportOptions, global: &GlobalArgs) {
    print::text(page::scores_table(metrics).markdown());
    let (classes, others) = page::classes_in_brief(metrics, options);
    print::text(classes.markdown());
    if others > 0 {
        global.print_status(format_args!(
            "the classes with the lowest AP; for the {others} others, -o FOLDER writes classes.csv"
        ));
    }
}

fn print_factors(runs: &[Run], options: &EvalReportOptions) {
    let factors = page::factors_table(runs, options);
    if !factors.rows.is_empty() {
        print::text(factors.markdown());
    }
}

impl EvalArgs {
    fn report_options(&self) -> EvalReportOptions {
        EvalReportOptions {
            classes: self.classes.clone(),
            rounds: self.rounds,
            seed: self.seed,
            confusion: ConfusionOptions {
                confidence: self.confidence,
                ..Default::default()
            },
            shown: self.most,
            ..Default::default()
        }
    }

    /// Predictions of the runs.
    fn predictions(&self) -> &[PathBuf] {
        let split = self.paths.split_last();
        split.map(|(_, runs)| runs).unwrap_or_default()
    }

    /// Fails for an option that the ground truth does not need, and for a missing folder of
    /// pictures.
    fn check_options(&self) -> petcomp::Result<()> {
        let truth = self.paths.last();
        let is_yolo = truth.is_some_and(|truth| !EvalTruth::is_coco(truth));
        let yolo = "a folder of YOLO labels as TRUTH: COCO files contain the sizes";
        check_companion("--size", self.size.is_some(), yolo, is_yolo)?;
        match self.images.as_ref().filter(|folder| !folder.is_dir()) {
            None => Ok(()),
            Some(folder) => Err(Error::file(
                folder,
                "no such folder, expected the folder of the images",
            )),
        }
    }

    /// Fails if a file of the evaluation would replace one of its inputs.
    fn check_inputs_stay(&self) -> petcomp::Result<()> {
        let Some(folder) = &self.output else {
            return Ok(());
        };
        let inputs = self.paths.iter().chain(&self.tags);
        page::check_inputs_stay(inputs, folder, &page::run_names(self.predictions()))
    }

    /// Tags of the ground truth's images, which are the same for all runs.
    fn tags_of(&self, runs: &[Run]) -> petcomp::Result<Tags> {
        match (&self.tags, runs) {
            (Some(path), [run, ..]) => read_tags(path, &run.sheets),
            _ => Ok(Tags::default()),
        }
    }

    /// Scores of the runs, written if an output is given.
    fn measure(&self, runs: &[Run], options: &EvalReportOptions) -> petcomp::Result<Vec<Metrics>> {
        match &self.output {
            Some(folder) => page::write(folder, runs, options),
            None => Ok(runs.iter().map(|run| Metrics::of(run, options)).collect()),
        }
    }

    fn warn_of_empty_truth(&self, metrics: &[Metrics]) {
        if let Some(truth) = self.paths.last() {
            page::warn_of_empty_truth(truth, metrics);
        }
    }

    /// Reads all runs; sets the names of classes and the pictures of the ground truth in the
    /// options.
    fn read_runs(&self, options: &mut EvalReportOptions) -> anyhow::Result<Vec<Run>> {
        let Some(truth) = self.paths.last() else {
            anyhow::bail!("expected PREDICTIONS TRUTH");
        };
        let truth = EvalTruth::read(truth, self.images.as_deref(), self.size)?;
        let (predictions, mut runs) = (self.predictions(), Vec::new());
        for (path, name) in predictions.iter().zip(page::run_names(predictions)) {
            let sheets = truth.with_detections(path)?;
            runs.push(Run { name, sheets });
        }
        truth.describe(options)?;
        Ok(runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_confidence_is_a_share() {
        assert_eq!(parse_confidence("0.25"), Ok(0.25));
        let bad = ["25", "-0.1", "nan", "x"].into_iter();
        assert!(bad.map(parse_confidence).all(|parsed| parsed.is_err()));
    }
}
