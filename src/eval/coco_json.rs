//! Reads truth and detections from COCO JSON.

use super::{Detection, EvalImage, FARTHEST_PX, GroundTruth, Picture, check_confidence};
use crate::error::{Error, Result};
use crate::geom::BBox;
use crate::io;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

#[derive(Deserialize)]
struct CocoDocument {
    images: Vec<ImageRecord>,
    #[serde(default)]
    annotations: Vec<CocoAnnotation>,
    #[serde(default)]
    categories: Vec<CocoCategory>,
}

#[derive(Deserialize)]
struct ImageRecord {
    id: i64,
    #[serde(default)]
    file_name: String,
    /// LVIS identifies its images only by URL.
    #[serde(default)]
    coco_url: String,
    width: Option<f64>,
    height: Option<f64>,
    /// A number or a string.
    video_id: Option<serde_json::Value>,
}

#[derive(Deserialize)]
struct CocoCategory {
    id: i64,
    name: String,
}

#[derive(Deserialize)]
struct CocoAnnotation {
    id: Option<i64>,
    image_id: i64,
    category_id: i64,
    bbox: [f64; 4],
    area: Option<f64>,
    #[serde(default)]
    iscrowd: u8,
}

#[derive(Deserialize)]
struct CocoDetection {
    image_id: i64,
    category_id: i64,
    bbox: [f64; 4],
    score: f64,
}

/// Ground truth in COCO form: the objects to find, and the meaning of ids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CocoTruth {
    /// One per image, in order of their ids.
    pub sheets: Vec<EvalImage>,
    /// Names of the categories, in order of their ids; a class is an index into this list.
    pub classes: Vec<String>,
    /// File name of each image, and its width and height if given.
    pub files: Vec<(String, Option<[f64; 2]>)>,
    images: BTreeMap<i64, usize>,
    categories: BTreeMap<i64, u32>,
}

/// Reads `instances.json`: `images`, `annotations` (`bbox` as x, y, width, height), `categories`.
///
/// # Errors
/// [`Error::File`] for a file that is not such a document; [`Error::Field`] for a duplicate id, an
/// annotation of an unknown image or category, or an invalid box.
pub fn read_coco_truth(path: &Path) -> Result<CocoTruth> {
    CocoTruth::new(&io::read_json_data(path)?).map_err(|e| e.in_file(path))
}

/// Adds detections: a list of `image_id`, `category_id`, `bbox` (x, y, width, height), `score`.
///
/// # Errors
/// Like [`read_coco_truth`], and [`Error::Field`] for a score outside 0 to 1.
pub fn read_coco_results(path: &Path, truth: &mut CocoTruth) -> Result<()> {
    truth
        .add(&io::read_json_data::<Vec<CocoDetection>>(path)?)
        .map_err(|e| e.in_file(path))
}

/// The sheets of documents with truth and detections, for the fuzzers.
#[cfg(feature = "fuzzing")]
pub(crate) fn sheets_of(truth: &str, found: &str) -> Result<Vec<EvalImage>> {
    let mut truth = CocoTruth::new(&io::parse_json(truth)?)?;
    truth.add(&io::parse_json::<Vec<CocoDetection>>(found)?)?;
    Ok(truth.sheets)
}

impl CocoTruth {
    fn new(document: &CocoDocument) -> Result<Self> {
        document.check_annotation_ids()?;
        let mut truth = Self::without_annotations(document)?;
        for (i, annotation) in document.annotations.iter().enumerate() {
            truth
                .add_annotation(annotation)
                .map_err(|e| e.within(&format!("annotations[{i}]")))?;
        }
        Ok(truth)
    }

    fn without_annotations(document: &CocoDocument) -> Result<Self> {
        let images = document.image_places()?;
        let categories = document.category_places()?;
        let records = document.images_at(images.values());
        let names = sheet_names(&records).into_iter();
        let sheets = names.zip(&records).map(|(name, image)| image.sheet(name));
        Ok(Self {
            sheets: sheets.collect(),
            classes: document.category_names(categories.values()),
            files: records.iter().map(|image| image.file()).collect(),
            images: images.keys().copied().zip(0..).collect(),
            categories: categories.into_keys().zip(0..).collect(),
        })
    }

    fn add_annotation(&mut self, annotation: &CocoAnnotation) -> Result<()> {
        let (sheet, class) = self.sheet_mut(annotation.image_id, annotation.category_id)?;
        sheet.truth.push(annotation.to_truth(class)?);
        Ok(())
    }

    fn add(&mut self, found: &[CocoDetection]) -> Result<()> {
        for (i, detection) in found.iter().enumerate() {
            self.add_detection(detection)
                .map_err(|e| e.within(&format!("[{i}]")))?;
        }
        Ok(())
    }

    fn add_detection(&mut self, found: &CocoDetection) -> Result<()> {
        let (sheet, class) = self.sheet_mut(found.image_id, found.category_id)?;
        sheet.found.push(found.to_detection(class)?);
        Ok(())
    }

    /// The sheet of an image, and the class of a category.
    fn sheet_mut(&mut self, image: i64, category: i64) -> Result<(&mut EvalImage, u32)> {
        let place = look_up(&self.images, "image_id", image)?;
        let class = look_up(&self.categories, "category_id", category)?;
        Ok((&mut self.sheets[place], class))
    }

    /// Finds the images: in `folder`, or where COCO and petcomp store them for a document at
    /// `path`. A file name that leads out of a folder is not followed.
    pub fn pictures(&self, path: &Path, folder: Option<&Path>) -> Vec<Option<Picture>> {
        let roots = picture_roots(path, folder);
        let files = self.files.iter();
        files
            .map(|(name, size)| find_picture(&roots, name, *size))
            .collect()
    }
}

/// Folders that may hold the images of `annotations/instances_val2017.json`.
fn image_folders(path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let part = last_word(path);
    [folder.to_path_buf(), folder.join("..")]
        .iter()
        .flat_map(|root| folders_below(root, &part))
        .collect()
}

/// Where the images may be: in the given folder, or near the document.
fn picture_roots(document: &Path, folder: Option<&Path>) -> Vec<PathBuf> {
    match folder {
        Some(folder) => vec![folder.to_path_buf()],
        None => image_folders(document),
    }
}

fn folders_below(root: &Path, part: &str) -> [PathBuf; 4] {
    let images = root.join("images");
    [
        root.to_path_buf(),
        images.clone(),
        root.join(part),
        images.join(part),
    ]
}

/// The part of a file's stem after its last underscore.
fn last_word(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let word = stem.rsplit('_').next();
    word.unwrap_or_default().to_owned()
}

/// The image of this name below one of the folders, and its size if known.
fn find_picture(roots: &[PathBuf], name: &str, size: Option<[f64; 2]>) -> Option<Picture> {
    if !is_below(name) {
        return None;
    }
    let mut paths = roots.iter().map(|root| root.join(name));
    let path = paths.find(|path| path.is_file())?;
    let size = size.or_else(|| stored_size(&path))?;
    Some(Picture { path, size })
}

/// Whether a path stays below the folder that it is joined to.
fn is_below(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    parts.all(|part| matches!(part, Component::Normal(_)))
}

fn stored_size(path: &Path) -> Option<[f64; 2]> {
    let header = io::read_header(path).ok()?;
    Some([header.width as f64, header.height as f64])
}

/// Positions in the document by id, in order of the ids; not those without an id.
fn places(list: &str, ids: impl Iterator<Item = Option<i64>>) -> Result<BTreeMap<i64, usize>> {
    let mut places = BTreeMap::new();
    for (i, id) in ids.enumerate() {
        let Some(id) = id else { continue };
        if let Some(first) = places.insert(id, i) {
            return Err(repeated_id(list, i, id, first));
        }
    }
    Ok(places)
}

fn repeated_id(list: &str, i: usize, id: i64, first: usize) -> Error {
    let what = format!("{id}, the same as {list}[{first}], expected a unique id");
    Error::value(format!("{list}[{i}].id"), what)
}

fn look_up<T: Copy>(places: &BTreeMap<i64, T>, field: &str, id: i64) -> Result<T> {
    let place = places.get(&id).copied();
    place.ok_or_else(|| Error::value(field, format!("{id}, expected one listed in the truth")))
}

impl ImageRecord {
    fn file(&self) -> (String, Option<[f64; 2]>) {
        (self.listed_name().to_owned(), self.size())
    }

    /// An empty sheet.
    fn sheet(&self, name: String) -> EvalImage {
        let video = self.video_id.as_ref().map(ToString::to_string);
        EvalImage {
            group: video.unwrap_or_default(),
            ..EvalImage::new(name, Vec::new())
        }
    }

    fn listed_name(&self) -> &str {
        match self.file_name.as_str() {
            "" => self.coco_url.rsplit('/').next().unwrap_or_default(),
            name => name,
        }
    }

    fn size(&self) -> Option<[f64; 2]> {
        let [width, height] = [self.width?, self.height?];
        (width >= 1.0 && height >= 1.0).then_some([width, height])
    }

    /// The file's name without folder and extension; the id for an image without a file.
    fn stem(&self) -> String {
        match Path::new(self.listed_name()).file_stem() {
            Some(stem) => stem.to_string_lossy().into_owned(),
            None => self.id.to_string(),
        }
    }

    /// The path with folder and extension.
    fn whole_path(&self) -> String {
        match self.listed_name() {
            "" => self.id.to_string(),
            name => name.to_owned(),
        }
    }

    /// The path with its folder, without extension.
    fn path(&self) -> String {
        let folder = Path::new(self.listed_name()).parent();
        let path = folder.unwrap_or(Path::new("")).join(self.stem());
        path.to_string_lossy().into_owned()
    }
}

/// Names of the images: their file names, with folders and extensions if only those distinguish
/// them.
fn sheet_names(records: &[&ImageRecord]) -> Vec<String> {
    let named = |name: fn(&ImageRecord) -> String| -> Vec<String> {
        records.iter().map(|image| name(image)).collect()
    };
    let ways = [named(ImageRecord::stem), named(ImageRecord::path)];
    let told_apart = ways.into_iter().find(|names| are_distinct(names));
    told_apart.unwrap_or_else(|| named(ImageRecord::whole_path))
}

fn are_distinct(names: &[String]) -> bool {
    names.iter().collect::<BTreeSet<_>>().len() == names.len()
}

fn corners([x, y, w, h]: [f64; 4]) -> Result<BBox> {
    let bbox = BBox {
        x0: x,
        y0: y,
        x1: x + w,
        y1: y + h,
    };
    if is_near(&bbox) && w >= 0.0 && h >= 0.0 {
        return Ok(bbox);
    }
    Err(impossible_box([x, y, w, h]))
}

fn area_of([_, _, w, h]: [f64; 4]) -> f64 {
    w * h
}

fn is_near(b: &BBox) -> bool {
    let sides = [b.x0, b.y0, b.x1, b.y1];
    sides.iter().all(|v| v.abs() <= FARTHEST_PX)
}

fn impossible_box(bbox: [f64; 4]) -> Error {
    let what = format!(
        "{bbox:?}, expected x, y, width and height of at least 0, all within {FARTHEST_PX} pixels"
    );
    Error::value("bbox", what)
}

impl CocoAnnotation {
    fn to_truth(&self, class: u32) -> Result<GroundTruth> {
        let box_area = area_of(self.bbox);
        Ok(GroundTruth {
            class,
            bbox: corners(self.bbox)?,
            box_area,
            area: self.area.unwrap_or(box_area),
            crowd: self.iscrowd != 0,
        })
    }
}

impl CocoDetection {
    fn to_detection(&self, class: u32) -> Result<Detection> {
        let bbox = corners(self.bbox)?;
        check_confidence(self.score).map_err(|what| Error::value("score", what))?;
        Ok(Detection {
            class,
            bbox,
            box_area: area_of(self.bbox),
            confidence: self.score,
        })
    }
}

impl CocoDocument {
    fn image_places(&self) -> Result<BTreeMap<i64, usize>> {
        places("images", self.images.iter().map(|image| Some(image.id)))
    }

    fn category_places(&self) -> Result<BTreeMap<i64, usize>> {
        places("categories", self.categories.iter().map(|c| Some(c.id)))
    }

    /// pycocotools would count the last annotation of an id in place of all others with it.
    fn check_annotation_ids(&self) -> Result<()> {
        places("annotations", self.annotations.iter().map(|a| a.id)).map(drop)
    }

    fn images_at<'a>(&self, places: impl Iterator<Item = &'a usize>) -> Vec<&ImageRecord> {
        places.map(|&i| &self.images[i]).collect()
    }

    fn category_names<'a>(&self, places: impl Iterator<Item = &'a usize>) -> Vec<String> {
        places.map(|&i| self.categories[i].name.clone()).collect()
    }
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
        assert_eq!(
            truth
                .sheets
                .iter()
                .map(|s| s.image.as_str())
                .collect::<Vec<_>>(),
            ["a", "x"]
        );
        let b = truth.sheets[1].truth[0];
        assert_eq!((b.class, b.area, b.crowd, b.bbox.x1), (1, 6.5, true, 4.0));
        assert_eq!(truth.sheets[0].truth[0].area, 4.0);
    }

    #[test]
    fn images_are_called_by_as_much_of_their_paths_as_tells_them_apart() {
        let names = |files: [&str; 2]| {
            let [first, second] = files;
            let text = TRUTH.replace("b/x.png", second).replace("a.png", first);
            let truth = CocoTruth::new(&io::parse_json(&text).unwrap()).unwrap();
            truth.sheets.into_iter().map(|sheet| sheet.image).collect()
        };
        let named: [Vec<String>; 3] = [
            ["cam0/1.png", "cam1/2.png"],
            ["cam0/1.png", "cam1/1.png"],
            ["1.png", "1.jpg"],
        ]
        .map(names);
        assert_eq!(
            named,
            [["1", "2"], ["cam0/1", "cam1/1"], ["1.png", "1.jpg"]]
        );
    }

    #[test]
    fn images_of_one_video_are_a_group() {
        let groups = |more: &str| -> Vec<String> {
            let text = TRUTH.replace("\"width\": 9", more);
            let truth = CocoTruth::new(&io::parse_json(&text).unwrap()).unwrap();
            truth.sheets.into_iter().map(|sheet| sheet.group).collect()
        };
        assert_eq!(groups(r#""video_id": 0"#), ["", "0"]);
        assert_eq!(groups(r#""video_id": null"#), ["", ""]);
    }

    #[test]
    fn what_cannot_be_is_named_with_its_place() {
        let truth = |from: &str, to: &str| {
            let document =
                io::parse_json(&TRUTH.replace(from, to)).and_then(|d| CocoTruth::new(&d));
            document.unwrap_err().to_string()
        };
        assert_eq!(
            truth("\"id\": 3,", "\"id\": 7,"),
            "images[1].id: 7, the same as images[0], expected a unique id"
        );
        assert_eq!(
            truth("\"id\": 2,", "\"id\": 1,"),
            "annotations[1].id: 1, the same as annotations[0], expected a unique id"
        );
        assert!(
            truth("[1, 2, 3, 4]", "[1, 2, -3, 4]")
                .starts_with("annotations[0].bbox: [1.0, 2.0, -3.0, 4.0], expected x")
        );
        assert!(truth("[0, 0, 2, 2]", "[0, 0, 2, 1e300]").contains("within 1000000000 pixels"));
        assert!(truth("\"image_id\": 3", "\"image_id\": \"3\"").contains("expected an integer"));
        assert!(
            truth("\"iscrowd\": 1", "\"iscrowd\": 256")
                .contains("expected an integer from 0 to 255")
        );
    }

    #[test]
    fn annotations_need_no_ids() {
        let text = TRUTH.replace("\"id\": 1, ", "").replace("\"id\": 2, ", "");
        let truth = CocoTruth::new(&io::parse_json(&text).unwrap()).unwrap();
        assert!(truth.sheets.iter().all(|sheet| sheet.truth.len() == 1));
    }

    #[test]
    fn boxes_are_as_large_as_their_sides_are_told() {
        let text = TRUTH.replace("[0, 0, 2, 2]", "[293.09, 189.23, 80, 80]");
        let mut truth = CocoTruth::new(&io::parse_json(&text).unwrap()).unwrap();
        // Computed from its corners, one would be a hair too small for the medium range, the other
        // a hair less than half of the truth.
        let found = r#"[{"image_id": 3, "category_id": 10, "bbox": [0.3, 0.3, 32, 32], "score": 0.9},
            {"image_id": 3, "category_id": 10, "bbox": [293.09, 189.23, 80, 40], "score": 0.5}]"#;
        let found: Vec<CocoDetection> = io::parse_json(found).unwrap();
        truth.add(&found).unwrap();
        let scores = crate::eval::coco(&truth.sheets, &[]);
        // As in pycocotools: found at the first of ten thresholds, after one false positive.
        assert!((scores.scores.classes[0].ap[0] - 0.5).abs() < 1e-12);
        assert!((scores.ap_by_area[1].unwrap() - 0.05).abs() < 1e-12);
    }

    #[test]
    fn pictures_are_looked_for_where_coco_has_them_and_nowhere_else() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("annotations/instances_val.json");
        for file in [
            "annotations/instances_val.json",
            "images/val/b/x.png",
            "a.png",
        ] {
            std::fs::create_dir_all(root.path().join(file).parent().unwrap()).unwrap();
            std::fs::write(
                root.path().join(file),
                TRUTH.replace("a.png", "../../a.png"),
            )
            .unwrap();
        }
        let found = read_coco_truth(&path).unwrap().pictures(&path, None);
        // Neither the one above the folder, nor the one whose size is unknown.
        assert_eq!(found, [None, None]);
        let sized = TRUTH.replace("\"width\": 9", "\"width\": 9, \"height\": 6");
        let truth = CocoTruth::new(&io::parse_json(&sized).unwrap()).unwrap();
        let picture = truth.pictures(&path, None)[1].clone().unwrap();
        assert!(picture.path.ends_with("images/val/b/x.png") && picture.size == [9.0, 6.0]);
    }

    #[test]
    fn detections_of_unknown_images_are_named() {
        let (_keep, path) = file(TRUTH);
        let mut truth = read_coco_truth(&path).unwrap();
        let (_keep, path) =
            file(r#"[{"image_id": 8, "category_id": 10, "bbox": [0, 0, 2, 2], "score": 0.5}]"#);
        let said = read_coco_results(&path, &mut truth)
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("[0].image_id: 8, expected one listed in the truth"),
            "{said}"
        );
    }

    #[test]
    fn a_score_that_is_no_confidence_is_named() {
        let read = |score: f64| {
            let mut truth = CocoTruth::new(&io::parse_json(TRUTH).unwrap()).unwrap();
            let found = |score| CocoDetection {
                image_id: 3,
                category_id: 10,
                bbox: [0.0, 0.0, 2.0, 2.0],
                score,
            };
            truth.add(&[found(0.5), found(score)])
        };
        for (score, named) in [(87.5, "87.5"), (-2.0, "-2"), (f64::NAN, "NaN")] {
            let said = read(score).unwrap_err().to_string();
            let expected = format!("[1].score: {named}, expected a confidence, 0 to 1");
            assert_eq!(said, expected);
        }
        assert!([0.0, 1.0].into_iter().all(|score| read(score).is_ok()));
    }
}
