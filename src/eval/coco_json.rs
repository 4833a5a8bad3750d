//! Reads truth and detections from COCO JSON.

use super::{FoundBox, Sheet, TrueBox};
use crate::error::{Error, Result};
use crate::io;
use crate::label::BBox;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Deserialize)]
struct Document {
    images: Vec<ImageRecord>,
    #[serde(default)]
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct ImageRecord {
    id: i64,
    #[serde(default)]
    file_name: String,
}

#[derive(Deserialize)]
struct Category {
    id: i64,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: i64,
    category_id: i64,
    bbox: [f64; 4],
    area: Option<f64>,
    #[serde(default)]
    iscrowd: u8,
}

#[derive(Deserialize)]
struct Detection {
    image_id: i64,
    category_id: i64,
    bbox: [f64; 4],
    score: f64,
}

/// Truth in COCO form: what is to be found, and what its numbers mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CocoTruth {
    /// One per image, in order of their ids.
    pub sheets: Vec<Sheet>,
    /// Names of the categories, in order of their ids; a class is a place in this list.
    pub classes: Vec<String>,
    images: BTreeMap<i64, usize>,
    categories: BTreeMap<i64, u32>,
}

/// Reads `instances.json`: `images`, `annotations` (`bbox` as x, y, width, height), `categories`.
///
/// # Errors
/// [`Error::File`] for a file that is not such a document; [`Error::Field`] for an annotation of an unknown image or
/// category.
pub fn read_coco_truth(path: &Path) -> Result<CocoTruth> {
    let document: Document = io::read_json_data(path)?;
    let mut truth = CocoTruth::new(&document);
    for (i, a) in document.annotations.iter().enumerate() {
        let bbox = corners(a.bbox);
        let area = a.area.unwrap_or(a.bbox[2] * a.bbox[3]);
        let (image, class) =
            truth.place(a.image_id, a.category_id).map_err(|e| e.within(&format!("annotations[{i}]")).in_file(path))?;
        truth.sheets[image].truth.push(TrueBox { class, bbox, area, crowd: a.iscrowd != 0 });
    }
    Ok(truth)
}

/// Adds detections: a list of `image_id`, `category_id`, `bbox` (x, y, width, height), `score`.
///
/// # Errors
/// As [`read_coco_truth`].
pub fn read_coco_results(path: &Path, truth: &mut CocoTruth) -> Result<()> {
    let found: Vec<Detection> = io::read_json_data(path)?;
    for (i, d) in found.iter().enumerate() {
        let (image, class) =
            truth.place(d.image_id, d.category_id).map_err(|e| e.within(&format!("[{i}]")).in_file(path))?;
        truth.sheets[image].found.push(FoundBox { class, bbox: corners(d.bbox), confidence: d.score });
    }
    Ok(())
}

impl CocoTruth {
    fn new(document: &Document) -> Self {
        let images: BTreeMap<i64, &ImageRecord> = document.images.iter().map(|image| (image.id, image)).collect();
        let categories: BTreeMap<i64, &Category> = document.categories.iter().map(|c| (c.id, c)).collect();
        let sheet = |(id, image): (&i64, &&ImageRecord)| {
            let stem = Path::new(&image.file_name).file_stem().map(|n| n.to_string_lossy().into_owned());
            Sheet { image: stem.unwrap_or_else(|| id.to_string()), ..Sheet::default() }
        };
        Self {
            sheets: images.iter().map(sheet).collect(),
            classes: categories.values().map(|c| c.name.clone()).collect(),
            images: images.keys().copied().zip(0..).collect(),
            categories: categories.keys().copied().zip(0..).collect(),
        }
    }

    fn place(&self, image: i64, category: i64) -> Result<(usize, u32)> {
        let unknown = |at: &str, id| Error::value(at, format!("{id}, expected one that the truth lists"));
        let image = *self.images.get(&image).ok_or_else(|| unknown("image_id", image))?;
        let class = *self.categories.get(&category).ok_or_else(|| unknown("category_id", category))?;
        Ok((image, class))
    }
}

fn corners([x, y, w, h]: [f64; 4]) -> BBox {
    BBox { x0: x, y0: y, x1: x + w, y1: y + h }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUTH: &str = r#"{"images": [{"id": 7, "file_name": "b/x.png", "width": 9}, {"id": 3, "file_name": "a.png"}],
        "categories": [{"id": 20, "name": "cap"}, {"id": 10, "name": "label"}],
        "annotations": [{"id": 1, "image_id": 7, "category_id": 20, "bbox": [1, 2, 3, 4], "area": 6.5, "iscrowd": 1},
                        {"id": 2, "image_id": 3, "category_id": 10, "bbox": [0, 0, 2, 2]}]}"#;

    fn file(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        std::fs::write(&path, text).unwrap();
        (folder, path)
    }

    #[test]
    fn images_and_categories_are_in_order_of_their_ids() {
        let (_keep, path) = file(TRUTH);
        let truth = read_coco_truth(&path).unwrap();
        assert_eq!(truth.classes, ["label", "cap"]);
        assert_eq!(truth.sheets.iter().map(|s| s.image.as_str()).collect::<Vec<_>>(), ["a", "x"]);
        let b = truth.sheets[1].truth[0];
        assert_eq!((b.class, b.area, b.crowd, b.bbox.x1), (1, 6.5, true, 4.0));
        assert_eq!(truth.sheets[0].truth[0].area, 4.0);
    }

    #[test]
    fn detections_of_unknown_images_are_named() {
        let (_keep, path) = file(TRUTH);
        let mut truth = read_coco_truth(&path).unwrap();
        let (_keep, path) = file(r#"[{"image_id": 8, "category_id": 10, "bbox": [0, 0, 2, 2], "score": 0.5}]"#);
        let said = read_coco_results(&path, &mut truth).unwrap_err().to_string();
        assert!(said.contains("[0].image_id: 8, expected one that the truth lists"), "{said}");
    }
}
