//! Detections that are hard to score: none, no truth, all equal, a hundred thousand.

use super::{HardCase, Outcome};
use petcomp::Result;
use petcomp::eval::{
    Confusion, ConfusionOptions, Definition, Detection, EvalImage, GroundTruth, bootstrap, coco,
    curves, evaluate, iou,
};
use petcomp::geom::BBox;

/// Number of boxes in the largest case.
const MOST_BOXES: usize = 100_000;
/// Precision of a perfect detector by YOLOv5's trapezoidal rule, whose curve ends at precision 0.
const PERFECT_YOLO: f64 = 0.995;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = Vec::new();
    for scores in [YOLO_SCORES, COCO_SCORES] {
        cases.extend(scores.cases());
    }
    cases.extend([
        HardCase::new(
            "coco: 100 000 boxes in one image",
            "all found; COCO looks at 100 detections",
            "recall 0.001, so that 1 of 101 samples (at recall 0) has precision 1: 1/101, to 1e-9",
            score_crowded_image,
        ),
        HardCase::new(
            "yolov5: 2000 boxes in one image",
            "all found, all with the same confidence",
            format!("mAP {PERFECT_YOLO}, to 1e-9"),
            score_one_image,
        ),
        HardCase::new(
            "coco: equal confidences, half of them wrong",
            "100 true positives, then 100 false positives, all with confidence 0.5",
            "equal ones keep their order, the true ones first: mAP 1, to 1e-9",
            score_half_right,
        ),
        HardCase::new(
            "interval of no images",
            "a bootstrap of 100 rounds without images",
            "0 from 0 to 0; no curve",
            score_no_images,
        ),
        HardCase::new(
            "confusion: 300 boxes in one place",
            "300 equal true boxes and 300 equal detections of one class",
            "300 pairs, nothing missed, no false alarm",
            count_confusion,
        ),
        HardCase::new(
            "overlap of boxes of 1e150 pixels",
            "one half of the other; areas of 1e300",
            "intersection over union 1/2, to 1e-12; for infinite ones a number, not NaN",
            overlap_huge_boxes,
        ),
    ]);
    Ok(cases)
}

/// A definition of the score, and the score of a perfect detector.
#[derive(Clone, Copy)]
struct ScoreCases {
    name: &'static str,
    definition: Definition,
    perfect: f64,
}

const YOLO_SCORES: ScoreCases = ScoreCases {
    name: "yolov5",
    definition: Definition::Yolov5,
    perfect: PERFECT_YOLO,
};
const COCO_SCORES: ScoreCases = ScoreCases {
    name: "coco",
    definition: Definition::Coco,
    perfect: 1.0,
};

impl ScoreCases {
    fn cases(self) -> impl Iterator<Item = HardCase> {
        let none = WITHOUT_MATCHES.map(|input| self.scored(input, 0.0));
        let all = ALL_FOUND.map(|input| self.scored(input, self.perfect));
        none.into_iter().chain(all)
    }

    fn scored(self, (what, input, images): Input, expected: f64) -> HardCase {
        let name = format!("{}: {what}", self.name);
        let expectation = format!("mAP {expected}, to 1e-9");
        HardCase::new(name, input, expectation, move || {
            Ok(compare_map(&images(), self.definition, expected))
        })
    }
}

/// What is special about some images, a description of them, and their generator.
type Input = (&'static str, &'static str, fn() -> Vec<EvalImage>);

const WITHOUT_MATCHES: [Input; 4] = [
    ("nothing at all", "no image", Vec::new),
    ("no predictions", "10 boxes to find", || {
        vec![grid_image(10, 0, equal_confidence)]
    }),
    ("no truth", "10 detections, nothing to find", || {
        vec![grid_image(0, 10, equal_confidence)]
    }),
    (
        "boxes without area",
        "points detected at the true points",
        image_of_points,
    ),
];

const ALL_FOUND: [Input; 6] = [
    (
        "equal confidences",
        "100 boxes, all found, all with 0.5",
        || vec![grid_image(100, 100, equal_confidence)],
    ),
    (
        "confidences of 0",
        "100 boxes, all found, all with 0",
        || vec![grid_image(100, 100, |_| 0.0)],
    ),
    ("confidences of 1e-300", "100 boxes, all found", || {
        vec![grid_image(100, 100, |i| 1e-300 * (i + 1) as f64)]
    }),
    ("one box", "found", || {
        vec![grid_image(1, 1, equal_confidence)]
    }),
    (
        "a detection twice",
        "1 box, detected twice",
        image_with_duplicate,
    ),
    ("100 000 boxes in 1000 images", "all found", || {
        vec![grid_image(100, 100, falling_confidence); MOST_BOXES / 100]
    }),
];

fn compare_map(images: &[EvalImage], definition: Definition, expected: f64) -> Outcome {
    let map = evaluate(images, definition, &[]).map();
    Outcome::near(map, expected, 1e-9, "")
}

fn image_with_duplicate() -> Vec<EvalImage> {
    let mut one = grid_image(1, 1, equal_confidence);
    one.found.push(Detection {
        confidence: 0.4,
        ..one.found[0]
    });
    vec![one]
}

fn equal_confidence(_: usize) -> f64 {
    0.5
}

fn falling_confidence(i: usize) -> f64 {
    1.0 / (i + 1) as f64
}

/// The `i`-th box of 10 x 10 pixels in rows of 100.
fn grid_box(i: usize) -> BBox {
    let (x, y) = (20.0 * (i % 100) as f64, 20.0 * (i / 100) as f64);
    BBox {
        x0: x,
        y0: y,
        x1: x + 10.0,
        y1: y + 10.0,
    }
}

/// Boxes side by side: the first `truths` are true, the first `found` are found.
fn grid_image(truths: usize, found: usize, confidence: fn(usize) -> f64) -> EvalImage {
    let truth = (0..truths).map(|i| GroundTruth::new(0, grid_box(i)));
    let found = (0..found).map(|i| Detection::new(0, grid_box(i), confidence(i)));
    EvalImage {
        found: found.collect(),
        ..EvalImage::new("", truth.collect())
    }
}

fn image_of_points() -> Vec<EvalImage> {
    let mut image = grid_image(3, 3, equal_confidence);
    for truth in &mut image.truth {
        *truth = GroundTruth::new(0, corner_of(truth.bbox));
    }
    for found in &mut image.found {
        *found = Detection::new(0, corner_of(found.bbox), found.confidence);
    }
    vec![image]
}

fn corner_of(bbox: BBox) -> BBox {
    BBox {
        x1: bbox.x0,
        y1: bbox.y0,
        ..bbox
    }
}

fn score_crowded_image() -> Result<Outcome> {
    let image = grid_image(MOST_BOXES, 200, falling_confidence);
    let map = coco(&[image], &[]).scores.map();
    Ok(Outcome::near(map, 1.0 / 101.0, 1e-9, ""))
}

fn score_one_image() -> Result<Outcome> {
    let image = grid_image(2000, 2000, equal_confidence);
    Ok(compare_map(&[image], Definition::Yolov5, PERFECT_YOLO))
}

fn score_half_right() -> Result<Outcome> {
    let mut image = grid_image(50, 50, equal_confidence);
    let wrong: Vec<Detection> = image.found.iter().map(moved_away).collect();
    image.found.extend(wrong);
    Ok(compare_map(&[image], Definition::Coco, 1.0))
}

fn moved_away(found: &Detection) -> Detection {
    let mut moved = *found;
    moved.bbox.x0 += 1e4;
    moved.bbox.x1 += 1e4;
    moved
}

fn score_no_images() -> Result<Outcome> {
    let interval = bootstrap(&[], Definition::Coco, 100, 1);
    let found = [interval.low, interval.value, interval.high];
    let curves = curves(&[]).classes.len();
    Ok(Outcome::new(
        format!("{found:?}, {curves} curves"),
        found == [0.0; 3] && curves == 0,
    ))
}

fn count_confusion() -> Result<Outcome> {
    let mut image = grid_image(300, 300, equal_confidence);
    image.truth.iter_mut().for_each(|t| t.bbox = grid_box(0));
    image.found.iter_mut().for_each(|f| f.bbox = grid_box(0));
    let counts = Confusion::new(&[image], &ConfusionOptions::default()).counts;
    Ok(Outcome::new(
        format!("{counts:?}"),
        counts.into_iter().eq([([Some(0), Some(0)], 300)]),
    ))
}

fn overlap_huge_boxes() -> Result<Outcome> {
    let [whole, half, endless] = [1e150, 0.5e150, f64::INFINITY].map(box_of_width);
    let (of_half, of_endless) = (iou(&whole, &half), iou(&endless, &endless));
    Ok(Outcome::new(
        format!("{of_half}, for infinite ones {of_endless}"),
        (of_half - 0.5).abs() < 1e-12 && !of_endless.is_nan(),
    ))
}

fn box_of_width(x1: f64) -> BBox {
    BBox {
        x0: 0.0,
        y0: 0.0,
        x1,
        y1: 1e150,
    }
}
