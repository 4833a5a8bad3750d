//! `petcomp eval`: detections against the truth.

use crate::common::{Common, count};
use crate::print;
use petcomp::dataset::YoloSet;
use petcomp::eval::page::{self, EvalReportOptions, Run};
use petcomp::eval::{
    ConfusionOptions, EvalImage, Tags, read_coco_results, read_coco_truth, read_tags,
    read_yolo_detections, read_yolo_truth,
};
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
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Where the images of a COCO document are, if not beside it; for pictures of mistakes
    #[arg(long, value_name = "FOLDER")]
    images: Option<PathBuf>,
    /// Detections surer than this count in the confusion and as mistakes
    #[arg(long, value_name = "CONFIDENCE", default_value_t = ConfusionOptions::default().confidence)]
    confidence: f64,
    /// Most pictures of false alarms, and of misses, on the page
    #[arg(short = 'n', long, value_name = "N", default_value_t = EvalReportOptions::default().shown)]
    most: usize,
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
    let (truth, predictions) = args
        .paths
        .split_last()
        .ok_or_else(|| anyhow::anyhow!("expected PREDICTIONS TRUTH"))?;
    let mut options = EvalReportOptions {
        classes: args.classes.clone(),
        tags: args
            .tags
            .as_deref()
            .map_or_else(|| Ok(Tags::default()), read_tags)?,
        rounds: args.rounds,
        seed: args.seed,
        confusion: ConfusionOptions {
            confidence: args.confidence,
            ..Default::default()
        },
        shown: args.most,
        pictures: Vec::new(),
    };
    let runs: Vec<Run> = predictions
        .iter()
        .map(|path| {
            Ok(Run {
                name: name(path),
                sheets: sheets(path, truth, args, &mut options)?,
            })
        })
        .collect::<anyhow::Result<_>>()?;
    let metrics = match &args.output {
        Some(folder) => page::write(folder, &runs, &options)?,
        None => runs
            .iter()
            .map(|run| page::Metrics::of(run, &options))
            .collect(),
    };
    print::text(page::scores_table(&metrics, &options).markdown());
    let (classes, others) = page::classes_in_brief(&metrics, &options);
    print::text(classes.markdown());
    if others > 0 {
        common.say(format_args!(
            "the classes with the lowest AP; {others} others: -o FOLDER writes classes.csv"
        ));
    }
    let factors = page::factors_table(&runs, &options);
    if !factors.rows.is_empty() {
        print::text(factors.markdown());
    }
    if let Some(folder) = &args.output {
        common.say(format_args!(
            "look at {}",
            folder.join("eval.html").display()
        ));
    }
    Ok(())
}

/// Truth and detections; the options hear of names of classes and of pictures.
fn sheets(
    found: &Path,
    truth: &Path,
    args: &Args,
    options: &mut EvalReportOptions,
) -> anyhow::Result<Vec<EvalImage>> {
    let classes = &mut options.classes;
    if truth.extension().is_some_and(|e| e == "json") {
        let mut all = read_coco_truth(truth)?;
        read_coco_results(found, &mut all)?;
        if classes.is_empty() {
            classes.clone_from(&all.classes);
        }
        options.pictures = all.pictures(truth, args.images.as_deref());
        return Ok(all.sheets);
    }
    let mut all = read_yolo_truth(truth, args.size)?;
    read_yolo_detections(found, &mut all)?;
    if classes.is_empty() {
        // labels/val of a dataset lie two folders below its data.yaml.
        let set = truth
            .parent()
            .and_then(Path::parent)
            .and_then(|folder| YoloSet::open(folder).ok());
        *classes = set.map(|set| set.classes).unwrap_or_default();
    }
    options.pictures = all.pictures;
    Ok(all.sheets)
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let expected = || format!("\"{text}\", expected WIDTHxHEIGHT as in 640x480");
    let (w, h) = text.split_once(['x', ',']).ok_or_else(expected)?;
    let side = |side: &str| {
        side.trim()
            .parse()
            .ok()
            .filter(|&side| side > 0)
            .ok_or_else(expected)
    };
    Ok([side(w)?, side(h)?])
}

fn name(path: &Path) -> String {
    path.file_stem().map_or_else(
        || path.display().to_string(),
        |n| n.to_string_lossy().into_owned(),
    )
}
