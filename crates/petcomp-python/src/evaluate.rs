//! Detections against the truth.

use crate::document::text;
use crate::errors::to_python;
use crate::work;
use petcomp::dataset::EvalTruth;
use petcomp::eval::page::{self, EvalReportOptions, Metrics, Run};
use petcomp::eval::{Detection, EvalImage, GroundTruth, check_confidence};
use petcomp::geom::BBox;
use petcomp::{Error, Result};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::slice;

/// What is asked of the scores: names of the classes, rounds of the bootstrap, its seed.
type Question = (Vec<String>, usize, u64);

/// As on the command line.
const MOST_ROUNDS: usize = 100_000;

fn options_of((classes, rounds, seed): Question) -> Result<EvalReportOptions> {
    if rounds > MOST_ROUNDS {
        let what = format!("{rounds}, expected 0 to {MOST_ROUNDS}");
        return Err(Error::value("rounds", what));
    }
    Ok(EvalReportOptions {
        classes,
        rounds,
        seed,
        ..EvalReportOptions::default()
    })
}

/// Scores predictions in files, as in `metrics.json`; writes the full report if given a folder.
#[pyfunction]
pub(crate) fn evaluate_files(
    py: Python<'_>,
    predictions: PathBuf,
    truth: PathBuf,
    size: Option<[u32; 2]>,
    images: Option<PathBuf>,
    output: Option<PathBuf>,
    question: Question,
) -> PyResult<String> {
    work::run(py, move || {
        let truth = TruthFiles {
            path: &truth,
            images: images.as_deref(),
            size,
        };
        scores_of(
            &predictions,
            &truth,
            output.as_deref(),
            options_of(question)?,
        )
    })
}

fn scores_of(
    predictions: &Path,
    truth_files: &TruthFiles<'_>,
    output: Option<&Path>,
    mut options: EvalReportOptions,
) -> Result<String> {
    let name = page::run_name(predictions);
    if let Some(folder) = output {
        let inputs = [predictions, truth_files.path];
        page::check_inputs_stay(inputs, folder, slice::from_ref(&name))?;
    }
    let truth = truth_files.read()?;
    let sheets = truth.with_detections(predictions)?;
    truth.describe(&mut options)?;
    let run = Run { name, sheets };
    let metrics = match output {
        Some(folder) => page::write(folder, slice::from_ref(&run), &options)?,
        None => vec![Metrics::of(&run, &options)],
    };
    page::warn_of_empty_truth(truth_files.path, &metrics);
    metrics_json(&metrics[0], &options)
}

/// Where the truth is, the folder of its images if they are elsewhere, and the size of all images
/// that YOLO labels need without them.
struct TruthFiles<'a> {
    path: &'a Path,
    images: Option<&'a Path>,
    size: Option<[u32; 2]>,
}

impl TruthFiles<'_> {
    fn read(&self) -> Result<EvalTruth> {
        let Self { path, images, size } = *self;
        if size.is_some() && EvalTruth::is_coco(path) {
            let what =
                "given without a folder of YOLO labels as truth: COCO files contain the sizes";
            return Err(Error::value("size", what));
        }
        EvalTruth::read(path, images, size)
    }
}

fn metrics_json(metrics: &Metrics, options: &EvalReportOptions) -> Result<String> {
    text(&serde_json::json!({
        "classes": options.classes,
        "metrics": metrics,
    }))
}

/// What is in a picture and what was found in it: class and box of each, and whether it is to be
/// ignored, or how sure it is.
type Sheet = (Vec<(u32, [f64; 4], bool)>, Vec<(u32, [f64; 4], f64)>);

/// Scores predictions in memory.
#[pyfunction]
pub(crate) fn evaluate_boxes(
    py: Python<'_>,
    sheets: Vec<Sheet>,
    question: Question,
) -> PyResult<String> {
    check_boxes(&sheets).map_err(to_python)?;
    work::run(py, move || {
        let options = options_of(question)?;
        let sheets = sheets
            .iter()
            .enumerate()
            .map(|(i, sheet)| sheet_of(i, sheet));
        let run = Run {
            name: "predictions".into(),
            sheets: sheets.collect(),
        };
        metrics_json(&Metrics::of(&run, &options), &options)
    })
}

/// Boxes within so many pixels have areas and overlaps that are numbers.
const FARTHEST_PX: f64 = 1e9;

fn check_boxes(sheets: &[Sheet]) -> Result<()> {
    for (i, (truth, found)) in sheets.iter().enumerate() {
        let truth = truth.iter().map(|(_, bbox, _)| bbox);
        for bbox in truth.chain(found.iter().map(|(_, bbox, _)| bbox)) {
            check_box(i, bbox)?;
        }
        found
            .iter()
            .try_for_each(|(_, _, score)| check_confidence(*score))
            .map_err(|what| Error::value(format!("predictions[{i}].scores"), what))?;
    }
    Ok(())
}

fn check_box(image: usize, bbox: &[f64; 4]) -> Result<()> {
    let [x0, y0, x1, y1] = bbox;
    let within = bbox.iter().all(|side| side.abs() <= FARTHEST_PX);
    if within && x0 <= x1 && y0 <= y1 {
        return Ok(());
    }
    let what = format!("{bbox:?}, expected x0 <= x1 and y0 <= y1, pixels");
    Err(Error::value(format!("boxes of image {image}"), what))
}

fn sheet_of(i: usize, (truth, found): &Sheet) -> EvalImage {
    let truth = truth.iter().map(|&(class, bbox, crowd)| GroundTruth {
        crowd,
        ..GroundTruth::new(class, bbox_of(bbox))
    });
    let found = found
        .iter()
        .map(|&(class, bbox, confidence)| Detection::new(class, bbox_of(bbox), confidence));
    EvalImage {
        found: found.collect(),
        ..EvalImage::new(format!("{i:06}"), truth.collect())
    }
}

fn bbox_of([x0, y0, x1, y1]: [f64; 4]) -> BBox {
    BBox { x0, y0, x1, y1 }
}
