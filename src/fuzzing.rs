//! Entry points of the fuzzers in `fuzz/`: each takes any bytes, must return, and reports whether
//! they could be read. Not part of the library's interface.

use crate::{camera, dataset, eval, io};

/// A label file, solved if readable.
pub fn label(bytes: &[u8]) -> bool {
    let label = text(bytes).and_then(|text| io::parse_json::<camera::Label>(text).ok());
    label.is_some_and(|label| camera::solve(&label, &camera::SolveOptions::default()).is_ok())
}

/// A recipe, checked if readable.
pub fn recipe(bytes: &[u8]) -> bool {
    let config = text(bytes).and_then(|text| io::parse_toml::<dataset::DatasetConfig>(text).ok());
    config.is_some_and(|config| config.scene.check().is_ok())
}

/// A dataset's journal in the old format without line checksums, since no fuzzer would find a valid
/// one.
pub fn journal(bytes: &[u8]) -> bool {
    let lines = dataset::journal_lines(bytes, true);
    lines.is_ok_and(|lines| lines.iter().any(|(_, line)| line.is_ok()))
}

/// The response of an OpenImageIO worker.
#[cfg(feature = "oiio")]
pub fn worker(bytes: &[u8]) -> bool {
    io::is_worker_response(bytes)
}

/// The first bytes of a picture.
pub fn header(bytes: &[u8]) -> bool {
    io::header_of(bytes).is_ok()
}

/// A `data.yaml`.
pub fn data_yaml(bytes: &[u8]) -> bool {
    let Some(text) = text(bytes) else {
        return false;
    };
    let (yaml, problems) = dataset::DataYaml::read(text);
    let _ = yaml.root(std::path::Path::new("a"));
    yaml.class_count().is_some() && problems.is_empty()
}

/// Separates the truth from the detections in the input of the functions below.
pub const BETWEEN: &str = "\n===\n";

/// A file of YOLO labels and one of detections, scored if readable.
pub fn yolo_labels(bytes: &[u8]) -> bool {
    let sheet = two(bytes).and_then(|(truth, found)| {
        let sheet = eval::yolo_sheet(truth, found, [640, 480]);
        sheet.ok()
    });
    sheet.map(|sheet| score(&[sheet])).is_some()
}

/// COCO documents of truth and detections, scored if readable.
pub fn coco(bytes: &[u8]) -> bool {
    let sheets = two(bytes).and_then(|(truth, found)| eval::coco_sheets(truth, found).ok());
    sheets.map(|sheets| score(&sheets)).is_some()
}

fn two(bytes: &[u8]) -> Option<(&str, &str)> {
    text(bytes)?.split_once(BETWEEN)
}

fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

/// Everything computed from truth and detections.
fn score(sheets: &[eval::EvalImage]) {
    let options = eval::ConfusionOptions::default();
    let all = eval::coco(sheets, &[]);
    let scores = [
        all.scores.map(),
        eval::bootstrap(sheets, eval::Definition::Yolov5, 2, 0).value,
    ];
    assert!(
        scores.iter().all(|score| (0.0..=1.0).contains(score)),
        "{scores:?}"
    );
    let confusion = eval::Confusion::new(sheets, &options);
    let shown: Vec<u32> = confusion.worst().into_iter().take(50).collect();
    let charts = [
        eval::confusion_picture(&confusion, &[], &shown),
        eval::f1_picture(&eval::curves(sheets), &[], &shown),
    ];
    assert!(
        charts
            .iter()
            .all(|svg| svg.len() < 200_000 && !svg.contains("NaN"))
    );
    let _ = eval::mistakes(sheets, &options);
}
