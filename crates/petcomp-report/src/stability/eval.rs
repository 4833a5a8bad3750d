//! Detections that are hard to score: none, no truth, all equal, a hundred thousand.

use super::{HardCase, Outcome};
use petcomp::Result;
use petcomp::eval::{
    Confusion, ConfusionOptions, Definition, Detection, EvalImage, GroundTruth, Scores, bootstrap,
    coco, curves, evaluate, iou,
};
use petcomp::geom::BBox;

/// Boxes of the largest case.
const MANY: usize = 100_000;
/// Precision of a detector that makes no error, by YOLOv5's trapezoid, whose curve ends at precision 0.
const PERFECT_YOLO: f64 = 0.995;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases = Vec::new();
    for (name, definition, perfect) in [
        ("yolov5", Definition::Yolov5, PERFECT_YOLO),
        ("coco", Definition::Coco, 1.0),
    ] {
        cases.extend([
            scored(
                name,
                definition,
                "nothing at all",
                "no image",
                0.0,
                Vec::new,
            ),
            scored(
                name,
                definition,
                "no predictions",
                "10 boxes to find",
                0.0,
                || vec![sheet(10, 0, equal)],
            ),
            scored(
                name,
                definition,
                "no truth",
                "10 detections, nothing to find",
                0.0,
                || vec![sheet(0, 10, equal)],
            ),
            scored(
                name,
                definition,
                "boxes without area",
                "points found where points are",
                0.0,
                points,
            ),
            scored(
                name,
                definition,
                "equal confidences",
                "100 boxes, all found, all of 0.5",
                perfect,
                || vec![sheet(100, 100, equal)],
            ),
            scored(
                name,
                definition,
                "confidences of 0",
                "100 boxes, all found, all of 0",
                perfect,
                || vec![sheet(100, 100, |_| 0.0)],
            ),
            scored(
                name,
                definition,
                "confidences of 1e-300",
                "100 boxes, all found",
                perfect,
                || vec![sheet(100, 100, |i| 1e-300 * (i + 1) as f64)],
            ),
            scored(name, definition, "one box", "found", perfect, || {
                vec![sheet(1, 1, equal)]
            }),
            scored(
                name,
                definition,
                "a detection twice",
                "1 box, named twice",
                perfect,
                || {
                    let mut one = sheet(1, 1, equal);
                    one.found.push(Detection {
                        confidence: 0.4,
                        ..one.found[0]
                    });
                    vec![one]
                },
            ),
            scored(
                name,
                definition,
                "100 000 boxes in 1000 images",
                "all found",
                perfect,
                || {
                    (0..MANY / 100)
                        .map(|_| sheet(100, 100, |i| 1.0 / (i + 1) as f64))
                        .collect()
                },
            ),
        ]);
    }
    cases.extend([
        crowded(),
        one_image(),
        half_right(),
        no_images(),
        confusion(),
        huge_boxes(),
    ]);
    Ok(cases)
}

fn equal(_: usize) -> f64 {
    0.5
}

/// Boxes of 10 x 10 pixels side by side, so many true, so many found in the same places.
fn sheet(truths: usize, found: usize, confidence: fn(usize) -> f64) -> EvalImage {
    let place = |i: usize| {
        let (x, y) = (20.0 * (i % 100) as f64, 20.0 * (i / 100) as f64);
        BBox {
            x0: x,
            y0: y,
            x1: x + 10.0,
            y1: y + 10.0,
        }
    };
    let truth = (0..truths)
        .map(|i| GroundTruth {
            class: 0,
            bbox: place(i),
            area: 100.0,
            crowd: false,
        })
        .collect();
    let found = (0..found)
        .map(|i| Detection {
            class: 0,
            bbox: place(i),
            confidence: confidence(i),
        })
        .collect();
    EvalImage {
        image: String::new(),
        truth,
        found,
    }
}

fn points() -> Vec<EvalImage> {
    let mut sheet = sheet(3, 3, equal);
    sheet
        .truth
        .iter_mut()
        .for_each(|t| (t.bbox.x1, t.bbox.y1, t.area) = (t.bbox.x0, t.bbox.y0, 0.0));
    sheet
        .found
        .iter_mut()
        .for_each(|f| (f.bbox.x1, f.bbox.y1) = (f.bbox.x0, f.bbox.y0));
    vec![sheet]
}

fn scored(
    name: &str,
    definition: Definition,
    what: &str,
    input: &str,
    expected: f64,
    sheets: impl Fn() -> Vec<EvalImage> + Send + Sync + 'static,
) -> HardCase {
    let promise = format!("mAP {expected}, to 1e-9");
    HardCase::new(format!("{name}: {what}"), input, promise, move || {
        Ok(Outcome::near(
            Scores::map(&evaluate(&sheets(), definition, &[])),
            expected,
            1e-9,
            "",
        ))
    })
}

fn crowded() -> HardCase {
    HardCase::new(
        "coco: 100 000 boxes in one image",
        "all found; COCO looks at 100 detections",
        "recall 0.001, so that 1 of 101 readings (at recall 0) finds precision 1: 1/101, to 1e-9",
        || {
            let scores = coco(&[sheet(MANY, 200, |i| 1.0 / (i + 1) as f64)], &[]).scores;
            Ok(Outcome::near(scores.map(), 1.0 / 101.0, 1e-9, ""))
        },
    )
}

fn one_image() -> HardCase {
    HardCase::new(
        "yolov5: 2000 boxes in one image",
        "all found, all of one confidence",
        format!("mAP {PERFECT_YOLO}, to 1e-9"),
        || {
            Ok(Outcome::near(
                evaluate(&[sheet(2000, 2000, equal)], Definition::Yolov5, &[]).map(),
                PERFECT_YOLO,
                1e-9,
                "",
            ))
        },
    )
}

fn half_right() -> HardCase {
    HardCase::new(
        "coco: equal confidences, half of them wrong",
        "100 found rightly, then 100 where nothing is, all of 0.5",
        "equal ones keep their order, the right ones first: mAP 1, to 1e-9",
        || {
            let mut half = sheet(50, 50, equal);
            let away = |f: &Detection| Detection {
                bbox: BBox {
                    x0: f.bbox.x0 + 1e4,
                    x1: f.bbox.x1 + 1e4,
                    ..f.bbox
                },
                ..*f
            };
            let wrong: Vec<Detection> = half.found.iter().map(away).collect();
            half.found.extend(wrong);
            Ok(Outcome::near(
                evaluate(&[half], Definition::Coco, &[]).map(),
                1.0,
                1e-9,
                "",
            ))
        },
    )
}

fn no_images() -> HardCase {
    HardCase::new(
        "interval of no images",
        "a bootstrap of 100 rounds over nothing",
        "0 from 0 to 0; no curve",
        || {
            let interval = bootstrap(&[], Definition::Coco, 100, 1);
            let (found, curves) = (
                [interval.low, interval.value, interval.high],
                curves(&[]).classes.len(),
            );
            Ok(Outcome::new(
                format!("{found:?}, {curves} curves"),
                found == [0.0; 3] && curves == 0,
            ))
        },
    )
}

fn confusion() -> HardCase {
    HardCase::new(
        "confusion: 300 boxes in one place",
        "300 equal true boxes and 300 equal detections of one class",
        "300 pairs, nothing missed, no false alarm",
        || {
            let mut sheet = sheet(300, 300, equal);
            let place = sheet.truth[0].bbox;
            sheet.truth.iter_mut().for_each(|t| t.bbox = place);
            sheet.found.iter_mut().for_each(|f| f.bbox = place);
            let counts = Confusion::new(&[sheet], &ConfusionOptions::default()).counts;
            Ok(Outcome::new(
                format!("{counts:?}"),
                counts.into_iter().eq([([Some(0), Some(0)], 300)]),
            ))
        },
    )
}

fn huge_boxes() -> HardCase {
    HardCase::new(
        "overlap of boxes of 1e150 pixels",
        "one half of the other; areas of 1e300",
        "intersection over union 1/2, to 1e-12; of infinite ones a number, not NaN",
        || {
            let whole = BBox {
                x0: 0.0,
                y0: 0.0,
                x1: 1e150,
                y1: 1e150,
            };
            let half = BBox {
                x1: 0.5e150,
                ..whole
            };
            let endless = BBox {
                x1: f64::INFINITY,
                ..whole
            };
            let (found, of_endless) = (iou(&whole, &half), iou(&endless, &endless));
            Ok(Outcome::new(
                format!("{found}, of infinite ones {of_endless}"),
                (found - 0.5).abs() < 1e-12 && !of_endless.is_nan(),
            ))
        },
    )
}
