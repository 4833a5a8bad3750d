//! Evaluation: how well the boxes of a detector match the ground truth.
//!
//! Two definitions of average precision are in use, and they differ by more than rounding:
//! [`Definition::Yolov5`] integrates a precision curve over 101 points, [`Definition::Coco`]
//! averages 101 samples of it, considers at most 100 detections per image and supports ignored
//! boxes. Both are computed here from the same [`EvalImage`]s, one per image.
//!
//! ```
//! use petcomp::eval::{Definition, Detection, EvalImage, GroundTruth, evaluate};
//! use petcomp::geom::BBox;
//!
//! let bbox = BBox { x0: 10.0, y0: 10.0, x1: 60.0, y1: 40.0 };
//! let mut image = EvalImage::new("000000", vec![GroundTruth::new(0, bbox)]);
//! let shifted = BBox { x0: 12.0, x1: 62.0, ..bbox };
//! image.found.push(Detection::new(0, shifted, 0.9));
//! let scores = evaluate(&[image], Definition::Coco, &[]);
//! // The overlap is 48/52: found at nine of the ten thresholds.
//! assert!((scores.map() - 0.9).abs() < 1e-9);
//! ```

mod average;
mod bootstrap;
mod by_class;
mod coco;
mod coco_json;
mod confusion;
mod curve;
mod known_rows;
mod matches;
mod mistake;
mod overlap;
#[doc(hidden)]
pub mod page;
mod pairing;
mod picture;
mod rank;
mod tag;
mod yolo;
mod yolov5;

#[doc(hidden)]
pub use bootstrap::{Interval, bootstrap};
pub(crate) use bootstrap::{drawn, interval};
#[doc(hidden)]
pub use coco::{CocoScores, coco};
#[doc(hidden)]
pub use coco_json::CocoTruth;
#[cfg(feature = "fuzzing")]
pub(crate) use coco_json::sheets_of as coco_sheets;
pub use coco_json::{read_coco_results, read_coco_truth};
#[doc(hidden)]
pub use confusion::{Confusion, ConfusionOptions};
#[doc(hidden)]
pub use curve::{Curves, curves};
pub(crate) use known_rows::KnownRows;
#[doc(hidden)]
pub use matches::Matches;
#[doc(hidden)]
pub use mistake::{Mistake, MistakeKind, mistakes};
#[doc(hidden)]
pub use overlap::iou;
pub(crate) use picture::class_name;
pub(crate) use picture::{MAX_CURVES, confusion_picture, f1_picture, precision_recall_picture};
#[doc(hidden)]
pub use tag::{Tags, read_tags};
#[doc(hidden)]
pub use yolo::{YoloTruth, label_of, read_yolo_truth_of};
pub(crate) use yolo::{is_class_list, is_image, sheet_of as yolo_sheet};
pub(crate) use yolo::{parse_class, read_pose_truth, read_pose_truth_of};
pub use yolo::{read_yolo_detections, read_yolo_truth};
#[doc(hidden)]
pub use yolov5::yolov5;

use crate::geom::BBox;
use crate::io;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Number of thresholds of the intersection over union: 0.50 to 0.95 in steps of 0.05.
#[doc(hidden)]
pub const THRESHOLDS: usize = 10;

/// A ground-truth box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTruth {
    /// Index into the class list.
    pub class: u32,
    /// Its position, pixels.
    pub bbox: BBox,
    /// Area of the box, square pixels: width times height if the file gives them, since computing
    /// them from corners rounds both.
    pub box_area: f64,
    /// Area that determines its size range, square pixels: that of its mask if it has one.
    pub area: f64,
    /// Whether it counts neither as found nor as missed (COCO's `iscrowd`).
    pub crowd: bool,
}

/// A box that a detector found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Index into the class list.
    pub class: u32,
    /// Its position, pixels.
    pub bbox: BBox,
    /// Like [`GroundTruth::box_area`]; it also determines the size range.
    pub box_area: f64,
    /// Confidence of the detector, 0 to 1; average precision uses only the order.
    pub confidence: f64,
}

impl GroundTruth {
    /// A box to find, with the area of its corners.
    pub fn new(class: u32, bbox: BBox) -> Self {
        let area = overlap::area(&bbox);
        Self {
            class,
            bbox,
            box_area: area,
            area,
            crowd: false,
        }
    }
}

impl Detection {
    /// A box with the area of its corners.
    pub fn new(class: u32, bbox: BBox, confidence: f64) -> Self {
        Self {
            class,
            bbox,
            box_area: overlap::area(&bbox),
            confidence,
        }
    }
}

/// The objects in an image and the detections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvalImage {
    /// Name of the image, without folder and extension.
    pub image: String,
    /// An arbitrary name that the images of one sequence share; empty for a single image.
    pub group: String,
    /// The ground-truth boxes.
    pub truth: Vec<GroundTruth>,
    /// The detections, in any order.
    pub found: Vec<Detection>,
}

impl EvalImage {
    /// An image without detections.
    pub fn new(image: impl Into<String>, truth: Vec<GroundTruth>) -> Self {
        Self {
            image: image.into(),
            group: String::new(),
            truth,
            found: Vec::new(),
        }
    }
}

/// The picture of a sheet, for display.
#[doc(hidden)]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// The file.
    pub path: PathBuf,
    /// Width and height to which the sheet's boxes refer, pixels.
    pub size: [f64; 2],
}

/// Maximum distance of boxes from the picture's corner, pixels: areas and overlaps then stay
/// finite.
const FARTHEST_PX: f64 = 1e9;

/// Which definition of average precision to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Definition {
    /// The trapezoid over 101 interpolated points, as YOLOv5 computes it.
    #[default]
    Yolov5,
    /// The mean of 101 samples of the precision curve, at most 100 detections per image, as
    /// computed by the COCO tools.
    Coco,
}

/// Average precision of one class at every threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassScores {
    /// Index into the class list.
    pub class: u32,
    /// The number of boxes to find.
    pub truths: u64,
    /// Precision and recall at the confidence with the best mean F1 (`yolov5`), at threshold 0.5.
    pub precision: f64,
    /// See [`precision`](Self::precision).
    pub recall: f64,
    /// Average precision per threshold of intersection over union.
    pub ap: [f64; THRESHOLDS],
}

/// Average precisions of all classes that occur in the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Which definition was used.
    pub definition: Definition,
    /// One per class with something to find, in order.
    pub classes: Vec<ClassScores>,
}

impl Scores {
    /// mAP@0.5:0.95: the mean over classes and thresholds; 0 if there is nothing to find.
    pub fn map(&self) -> f64 {
        mean(self.classes.iter().map(ClassScores::mean))
    }

    /// mAP at one threshold, by its index: 0 is mAP@0.5.
    ///
    /// # Panics
    /// When the index is out of range.
    pub fn map_at(&self, threshold: usize) -> f64 {
        mean(self.classes.iter().map(|class| class.ap[threshold]))
    }
}

impl ClassScores {
    /// AP@0.5:0.95.
    pub fn mean(&self) -> f64 {
        mean(self.ap)
    }
}

/// Scores by the given definition; the names of the classes are not needed.
///
/// `weights` gives how often each image counts; if it is empty, each counts once. Detections of
/// equal confidence are ranked in the order of the images, and within an image as given.
///
/// # Panics
/// When `weights` is neither empty nor one per sheet.
pub fn evaluate(sheets: &[EvalImage], definition: Definition, weights: &[u32]) -> Scores {
    Matches::new(sheets, definition).scores(weights)
}

/// 0.50, 0.55 .. 0.95, as computed by NumPy's `linspace`.
#[doc(hidden)]
pub fn thresholds() -> [f64; THRESHOLDS] {
    let step = (0.95 - 0.5) / (THRESHOLDS - 1) as f64;
    std::array::from_fn(|i| {
        if i + 1 == THRESHOLDS {
            0.95
        } else {
            i as f64 * step + 0.5
        }
    })
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0_u32);
    for value in values {
        sum += value;
        count += 1;
    }
    overlap::share(sum, f64::from(count))
}

/// Curves and the best F1 are computed for confidences from 0 to 1.
fn is_confidence(number: f64) -> bool {
    (0.0..=1.0).contains(&number)
}

/// Also fails for percentages, logits and NaN.
///
/// # Errors
/// The number, and what was expected.
#[doc(hidden)]
pub fn check_confidence(number: f64) -> std::result::Result<(), String> {
    if is_confidence(number) {
        return Ok(());
    }
    Err(format!("{number}, expected a confidence, 0 to 1"))
}

/// The lines of a text that are not blank, with their indices.
fn filled_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = io::lines(text).enumerate();
    lines.filter(|(_, line)| !line.trim().is_empty())
}

fn in_line(i: usize, what: &str) -> String {
    format!("line {}: {what}", i + 1)
}

/// # Panics
/// When `weights` is neither empty nor one per sheet.
fn check_weights(weights: &[u32], sheets: usize) {
    assert!(
        weights.is_empty() || weights.len() == sheets,
        "one weight per sheet"
    );
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn bbox(x0: f64, y0: f64, w: f64, h: f64) -> BBox {
        BBox {
            x0,
            y0,
            x1: x0 + w,
            y1: y0 + h,
        }
    }

    pub(crate) fn there(class: u32, bbox: BBox) -> GroundTruth {
        GroundTruth::new(class, bbox)
    }

    pub(crate) fn crowd(class: u32, bbox: BBox) -> GroundTruth {
        GroundTruth {
            crowd: true,
            ..there(class, bbox)
        }
    }

    pub(crate) fn found(class: u32, bbox: BBox, confidence: f64) -> Detection {
        Detection::new(class, bbox, confidence)
    }

    pub(crate) fn sheet(truth: Vec<GroundTruth>, found: Vec<Detection>) -> EvalImage {
        EvalImage {
            found,
            ..EvalImage::new("", truth)
        }
    }

    #[test]
    fn nothing_to_find_scores_nothing() {
        for definition in [Definition::Yolov5, Definition::Coco] {
            assert_eq!(evaluate(&[], definition, &[]).map(), 0.0);
            let false_alarm = sheet(vec![], vec![found(0, bbox(0.0, 0.0, 5.0, 5.0), 0.9)]);
            assert!(evaluate(&[false_alarm], definition, &[]).classes.is_empty());
        }
    }

    #[test]
    fn what_is_found_exactly_scores_one() {
        let b = bbox(10.0, 10.0, 50.0, 40.0);
        let all = [sheet(vec![there(3, b)], vec![found(3, b, 0.2)])];
        assert!((evaluate(&all, Definition::Coco, &[]).map() - 1.0).abs() < 1e-12);
        // The trapezoid ends at precision 0, so the last of 100 intervals counts half.
        assert!((evaluate(&all, Definition::Yolov5, &[]).map() - 0.995).abs() < 1e-12);
    }

    #[test]
    fn an_image_that_counts_twice_is_an_image_that_is_there_twice() {
        let b = bbox(10.0, 10.0, 50.0, 40.0);
        let good = sheet(
            vec![there(0, b)],
            vec![found(0, b, 0.8), found(0, bbox(80.0, 0.0, 9.0, 9.0), 0.9)],
        );
        let bad = sheet(
            vec![there(0, b)],
            vec![found(0, bbox(12.0, 9.0, 50.0, 40.0), 0.7)],
        );
        for definition in [Definition::Yolov5, Definition::Coco] {
            let twice = evaluate(&[good.clone(), good.clone(), bad.clone()], definition, &[]);
            let weighted = evaluate(&[good.clone(), bad.clone()], definition, &[2, 1]);
            assert!(
                (twice.map() - weighted.map()).abs() < 1e-12,
                "{definition:?}"
            );
            let without = evaluate(&[good.clone(), bad.clone()], definition, &[0, 1]);
            assert_eq!(
                without.map(),
                evaluate(std::slice::from_ref(&bad), definition, &[]).map()
            );
        }
    }

    #[test]
    fn thresholds_end_where_they_should() {
        assert_eq!((thresholds()[0], thresholds()[9]), (0.5, 0.95));
    }
}
