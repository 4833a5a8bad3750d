//! Average precision against the values of pycocotools and of YOLOv5's own code.

use crate::case::Case;
use crate::color::Tolerance;
use petcomp::eval::{self, Detection, EvalImage, GroundTruth, Scores};
use petcomp::geom::BBox;
use serde::Deserialize;
use std::path::Path;

#[derive(Deserialize)]
struct Boxes {
    images: usize,
    truth: Vec<(usize, u32, f64, f64, f64, f64, u8)>,
    found: Vec<(usize, u32, f64, f64, f64, f64, f64)>,
}

#[derive(Deserialize)]
struct Reference {
    coco: Coco,
    yolov5: Yolov5,
}

#[derive(Deserialize)]
struct Coco {
    /// The twelve numbers; -1 where there is nothing.
    stats: Vec<f64>,
    /// Per class; -1 without truth.
    ap: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Yolov5 {
    classes: Vec<u32>,
    ap: Vec<Vec<f64>>,
    precision: Vec<f64>,
    recall: Vec<f64>,
}

/// Runs the case named by its folder.
pub(crate) fn run(case: &Case) -> Result<(), String> {
    let boxes: Boxes = json(&case.dir.join("boxes.json"))?;
    let reference: Reference = json(&case.dir.join("reference.json"))?;
    let near = Tolerance::of(case, "tolerance")?;
    let sheets = sheets(&boxes);
    coco(&sheets, &reference.coco, near)?;
    yolov5(&sheets, &reference.yolov5, near)
}

fn json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
}

fn sheets(boxes: &Boxes) -> Vec<EvalImage> {
    let mut sheets = vec![EvalImage::default(); boxes.images];
    let bbox = |x, y, w, h| BBox {
        x0: x,
        y0: y,
        x1: x + w,
        y1: y + h,
    };
    for &(i, class, x, y, w, h, crowd) in &boxes.truth {
        sheets[i].truth.push(GroundTruth {
            class,
            bbox: bbox(x, y, w, h),
            box_area: w * h,
            area: w * h,
            crowd: crowd == 1,
        });
    }
    for &(i, class, x, y, w, h, confidence) in &boxes.found {
        sheets[i].found.push(Detection {
            class,
            bbox: bbox(x, y, w, h),
            box_area: w * h,
            confidence,
        });
    }
    sheets
}

fn coco(sheets: &[EvalImage], theirs: &Coco, near: Tolerance) -> Result<(), String> {
    let ours = eval::coco(sheets, &[]);
    let some = |v: Option<f64>| v.unwrap_or(-1.0);
    let over = |value: f64| {
        if ours.scores.classes.is_empty() {
            -1.0
        } else {
            value
        }
    };
    let ap = [
        over(ours.scores.map()),
        over(ours.scores.map_at(0)),
        over(ours.scores.map_at(5)),
    ];
    let rest = ours
        .ap_by_area
        .into_iter()
        .chain(ours.ar_by_count)
        .chain(ours.ar_by_area)
        .map(some);
    near.check("coco stats", ap.into_iter().chain(rest), &theirs.stats)?;
    let there: Vec<(usize, &Vec<f64>)> = theirs
        .ap
        .iter()
        .enumerate()
        .filter(|(_, ap)| ap[0] >= 0.0)
        .collect();
    per_class(
        "coco",
        &ours.scores,
        there.iter().map(|&(c, ap)| (c as u32, ap)),
        near,
    )
}

fn yolov5(sheets: &[EvalImage], theirs: &Yolov5, near: Tolerance) -> Result<(), String> {
    let ours = eval::yolov5(sheets, &[]);
    let aps = theirs.classes.iter().copied().zip(&theirs.ap);
    per_class("yolov5", &ours, aps, near)?;
    let precision = ours.classes.iter().map(|c| c.precision);
    near.check("yolov5 precision", precision, &theirs.precision)?;
    let recall = ours.classes.iter().map(|c| c.recall);
    near.check("yolov5 recall", recall, &theirs.recall)
}

fn per_class<'a>(
    what: &str,
    ours: &Scores,
    theirs: impl Iterator<Item = (u32, &'a Vec<f64>)>,
    near: Tolerance,
) -> Result<(), String> {
    let theirs: Vec<_> = theirs.collect();
    let classes: Vec<u32> = ours.classes.iter().map(|c| c.class).collect();
    if classes != theirs.iter().map(|t| t.0).collect::<Vec<_>>() {
        return Err(format!(
            "{what}: classes {classes:?}, expected {:?}",
            theirs.iter().map(|t| t.0).collect::<Vec<_>>()
        ));
    }
    ours.classes
        .iter()
        .zip(theirs)
        .try_for_each(|(c, (class, ap))| near.check(&format!("{what} class {class}"), c.ap, ap))
}
