//! `petcomp eval`: detections against the truth.

use crate::common::{Common, count};
use petcomp::dataset::YoloSet;
use petcomp::eval::{Sheet, Tags, read_coco_results, read_coco_truth, read_tags, read_yolo_found, read_yolo_truth};
use petcomp::report::eval::{self, EvalReportOptions, Run};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Predictions of one or more runs, then the truth: folders of YOLO labels (`class cx cy w h confidence`) or COCO JSON
    #[arg(required = true, num_args = 2.., value_names = ["PREDICTIONS", "TRUTH"])]
    paths: Vec<PathBuf>,
    /// CSV with a line `image,light,..` and what each image is: scores per factor
    #[arg(long, value_name = "CSV")]
    tags: Option<PathBuf>,
    /// Names of the classes in order; default: those of a data.yaml or a COCO file
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    classes: Vec<String>,
    /// Width and height of all images in pixels, for YOLO labels without images beside them
    #[arg(long, value_name = "W,H", value_delimiter = ',', num_args = 2)]
    size: Vec<u32>,
    /// Rounds of the bootstrap over images, at most 100000
    #[arg(long, value_name = "N", default_value_t = EvalReportOptions::default().rounds, value_parser = count(0..=100_000))]
    rounds: usize,
    /// Seed of the bootstrap
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for metrics.json, tables (CSV), pictures (SVG) and the page eval.html
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let (truth, predictions) = args.paths.split_last().ok_or_else(|| anyhow::anyhow!("expected PREDICTIONS TRUTH"))?;
    let mut options = EvalReportOptions {
        classes: args.classes.clone(),
        tags: args.tags.as_deref().map_or_else(|| Ok(Tags::default()), read_tags)?,
        rounds: args.rounds,
        seed: args.seed,
    };
    let runs: Vec<Run> = predictions
        .iter()
        .map(|path| Ok(Run { name: name(path), sheets: sheets(path, truth, args, &mut options.classes)? }))
        .collect::<anyhow::Result<_>>()?;
    let metrics = match &args.output {
        Some(folder) => eval::write(folder, &runs, &options)?,
        None => runs.iter().map(|run| eval::Metrics::of(run, &options)).collect(),
    };
    let factors = eval::factors_table(&runs, &options);
    for table in [eval::scores_table(&metrics, &options), eval::classes_table(&metrics, &options), factors] {
        if !table.rows.is_empty() {
            common.say(table.markdown());
        }
    }
    Ok(())
}

fn sheets(found: &Path, truth: &Path, args: &Args, classes: &mut Vec<String>) -> anyhow::Result<Vec<Sheet>> {
    if truth.extension().is_some_and(|e| e == "json") {
        let mut all = read_coco_truth(truth)?;
        read_coco_results(found, &mut all)?;
        if classes.is_empty() {
            classes.clone_from(&all.classes);
        }
        return Ok(all.sheets);
    }
    let size = args.size.first().zip(args.size.get(1)).map(|(&w, &h)| [w, h]);
    let mut all = read_yolo_truth(truth, size)?;
    read_yolo_found(found, &mut all)?;
    if classes.is_empty() {
        // labels/val of a dataset lie two folders below its data.yaml.
        let set = truth.parent().and_then(Path::parent).and_then(|folder| YoloSet::open(folder).ok());
        *classes = set.map(|set| set.classes).unwrap_or_default();
    }
    Ok(all.sheets)
}

fn name(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
