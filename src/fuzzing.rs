//! Entry points of the fuzzers in `fuzz/`: each takes any bytes and must return. Not part of the
//! library's interface.

use crate::{camera, dataset, eval, io};

/// A label file, solved where it can be read.
pub fn label(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    if let Ok(label) = io::parse_json::<camera::Label>(text) {
        let _ = camera::solve(&label, &camera::SolveOptions::default());
    }
}

/// A recipe, checked where it can be read.
pub fn recipe(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    if let Ok(config) = io::parse_toml::<dataset::DatasetConfig>(text) {
        let _ = config.scene.check();
    }
}

/// The journal of a dataset.
pub fn journal(bytes: &[u8]) {
    let _ = dataset::journal_lines(bytes, false);
}

/// The response of an OpenImageIO worker.
#[cfg(feature = "oiio")]
pub fn worker(bytes: &[u8]) {
    let _ = io::is_worker_response(bytes);
}

/// The first bytes of a picture.
pub fn header(bytes: &[u8]) {
    let _ = io::header_of(bytes);
}

/// A `data.yaml`.
pub fn data_yaml(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let (yaml, _) = dataset::DataYaml::read(text);
    let _ = (yaml.class_count(), yaml.root(std::path::Path::new("a")));
}

/// What stands between the truth and the detections that the functions below take.
pub const BETWEEN: &str = "\n===\n";

/// A file of YOLO labels and one of detections, scored where they can be read.
pub fn yolo_labels(bytes: &[u8]) {
    let Some((truth, found)) = two(bytes) else {
        return;
    };
    if let Ok(sheet) = eval::yolo_sheet(truth, found, [640, 480]) {
        score(&[sheet]);
    }
}

/// COCO documents of truth and detections, scored where they can be read.
pub fn coco(bytes: &[u8]) {
    let Some((truth, found)) = two(bytes) else {
        return;
    };
    if let Ok(sheets) = eval::coco_sheets(truth, found) {
        score(&sheets);
    }
}

fn two(bytes: &[u8]) -> Option<(&str, &str)> {
    std::str::from_utf8(bytes).ok()?.split_once(BETWEEN)
}

/// Everything that is made of truth and detections.
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
