//! Ground truth for detections, however it is named: by labels, by a selection of images, or by a
//! COCO document.

use crate::dataset::YoloSet;
use crate::dataset::listing::{images_in, is_list, whole_path};
use crate::error::{Error, Result};
use crate::eval::page::EvalReportOptions;
use crate::eval::{
    CocoTruth, EvalImage, Picture, YoloTruth, is_class_list, label_of, read_coco_results,
    read_coco_truth, read_pose_truth, read_pose_truth_of, read_yolo_detections,
};
use crate::io;
use std::path::{Path, PathBuf};

/// Ground truth for the detections of any number of runs.
#[derive(Debug)]
pub struct EvalTruth {
    boxes: Boxes,
    pictures: Vec<Option<Picture>>,
}

#[derive(Debug)]
enum Boxes {
    Coco(CocoTruth),
    Yolo {
        truth: YoloTruth,
        /// Names of its classes, if there is a `data.yaml`.
        names: Result<Vec<String>>,
    },
}

impl EvalTruth {
    /// Whether a path is that of a COCO document, judged by its name.
    pub fn is_coco(path: &Path) -> bool {
        path.extension().is_some_and(|e| e == "json")
    }

    /// Reads a COCO document, a folder of YOLO labels, or a selection of images: a list of them
    /// (`.txt`), or a folder with a `data.yaml` and no labels of its own, of which the validation
    /// images count.
    ///
    /// The images are in the folder `images`, by default in the conventional place; `size` is the
    /// width and height of all, pixels, for YOLO labels without images. A selection allows neither.
    ///
    /// # Errors
    /// Those of [`read_coco_truth`] and [`read_yolo_truth`](crate::eval::read_yolo_truth);
    /// [`Error::File`] for a selection by a `data.yaml` with keypoints (a list of such images is
    /// accepted), a list that cannot be read, a selection without images; [`Error::Field`] for one
    /// with `images` or `size`.
    pub fn read(path: &Path, images: Option<&Path>, size: Option<[u32; 2]>) -> Result<Self> {
        if Self::is_coco(path) {
            return Self::of_coco(path, images);
        }
        if is_list(path) && !path.is_dir() {
            check_alone(images, size)?;
            return Self::of_images(path, path, images_in(path)?);
        }
        if is_choice(path)? {
            check_alone(images, size)?;
            let yaml = path.join("data.yaml");
            return Self::of_images(path, &yaml, YoloSet::read(path)?.val);
        }
        if path.is_file() {
            let what = "a file, expected a folder of YOLO labels, a list of images (.txt) or a COCO document (.json)";
            return Err(Error::file(path, what));
        }
        let keypoints = YoloSet::keypoint_numbers_of(path)?;
        let truth = read_pose_truth(path, images, size, keypoints)?;
        Ok(Self::of_yolo(truth, path))
    }

    fn of_coco(path: &Path, images: Option<&Path>) -> Result<Self> {
        let truth = read_coco_truth(path)?;
        Ok(Self {
            pictures: truth.pictures(path, images),
            boxes: Boxes::Coco(truth),
        })
    }

    fn of_images(path: &Path, place: &Path, images: Vec<PathBuf>) -> Result<Self> {
        let keypoints = YoloSet::keypoint_numbers_of(place)?;
        if images.is_empty() {
            let what = "no validation images, expected at least one";
            return Err(Error::file(path, what));
        }
        let images = by_name(images);
        let mut labels = images.iter().map(|image| label_of(image));
        if !labels.any(|label| label.is_file()) {
            let what = "no label files for its images, expected NAME.txt in labels";
            return Err(Error::file(path, what));
        }
        let truth = read_pose_truth_of(&images, keypoints)?;
        Ok(Self::of_yolo(truth, place))
    }

    /// Of labels below the `data.yaml` that names the classes, if there is one.
    fn of_yolo(truth: YoloTruth, place: &Path) -> Self {
        let names = YoloSet::class_names_of(place);
        Self {
            pictures: truth.pictures.clone(),
            boxes: Boxes::Yolo { truth, names },
        }
    }

    /// The images with a run's detections: COCO results, or a folder of YOLO labels with
    /// confidences.
    ///
    /// # Errors
    /// Those of [`read_coco_results`] and [`read_yolo_detections`].
    pub fn with_detections(&self, predictions: &Path) -> Result<Vec<EvalImage>> {
        match &self.boxes {
            Boxes::Coco(truth) => {
                if predictions.is_dir() {
                    let what = "a folder, expected COCO results (.json), since the truth is a COCO document";
                    return Err(Error::file(predictions, what));
                }
                let mut truth = truth.clone();
                read_coco_results(predictions, &mut truth)?;
                Ok(truth.sheets)
            }
            Boxes::Yolo { truth, names } => {
                if predictions.is_file() {
                    let what =
                        "a file, expected a folder of YOLO labels, since the truth has YOLO labels";
                    return Err(Error::file(predictions, what));
                }
                let mut truth = truth.clone();
                read_yolo_detections(predictions, &mut truth)?;
                let named = names.as_ref().map_or(0, Vec::len);
                warn_of_unnamed(predictions, &truth.sheets, named);
                Ok(truth.sheets)
            }
        }
    }

    /// Adds the pictures to a report's options, and the names of the classes if they have none.
    ///
    /// # Errors
    /// [`Error::Value`] for more or fewer names of classes than the truth has.
    pub fn describe(&self, options: &mut EvalReportOptions) -> Result<()> {
        options.pictures.clone_from(&self.pictures);
        if !options.classes.is_empty() {
            return check_names(&options.classes, self.known_names());
        }
        options.classes = self.class_names();
        Ok(())
    }

    /// The names of the classes that a `data.yaml` or a COCO document lists.
    fn known_names(&self) -> &[String] {
        match &self.boxes {
            Boxes::Coco(truth) => &truth.classes,
            Boxes::Yolo { names, .. } => names.as_deref().unwrap_or_default(),
        }
    }

    /// Empty if they are not known.
    fn class_names(&self) -> Vec<String> {
        if let Boxes::Yolo {
            names: Err(error), ..
        } = &self.boxes
        {
            log::warn!("{error}; classes are shown by number");
        }
        self.known_names().to_vec()
    }
}

/// There must be a name for each class whose name is known.
fn check_names(given: &[String], known: &[String]) -> Result<()> {
    if known.is_empty() || given.len() == known.len() {
        return Ok(());
    }
    let what = format!(
        "{} ({}), expected a name for each of the truth's {}: {}",
        given.len(),
        given.join(", "),
        known.len(),
        known.join(", ")
    );
    Err(Error::value("classes", what))
}

/// Whether a folder has a `data.yaml` and no labels: it selects images from elsewhere.
fn is_choice(folder: &Path) -> Result<bool> {
    if !folder.join("data.yaml").is_file() {
        return Ok(false);
    }
    let folder = whole_path(folder)?;
    // A data.yaml that trainers would reject selects nothing.
    let lists = YoloSet::choosing_files(&folder).unwrap_or_default();
    let is_label =
        |path: &Path| is_list(path) && !is_class_list(path) && !lists.iter().any(|l| l == path);
    Ok(io::files_below(&folder, is_label, usize::MAX)?.is_empty())
}

/// A selection names its images, whose files give their sizes.
fn check_alone(images: Option<&Path>, size: Option<[u32; 2]>) -> Result<()> {
    for (name, is_given) in [("images", images.is_some()), ("size", size.is_some())] {
        if is_given {
            let what = "given with a list of images as truth, expected a folder of labels";
            return Err(Error::value(name, what));
        }
    }
    Ok(())
}

/// In the order that a folder of labels would give, each once.
fn by_name(mut images: Vec<PathBuf>) -> Vec<PathBuf> {
    images.sort_by(|a, b| (a.file_stem(), a).cmp(&(b.file_stem(), b)));
    images.dedup();
    images
}

/// Warns of detections of classes that the truth's data.yaml does not name: often both number them
/// differently.
fn warn_of_unnamed(predictions: &Path, sheets: &[EvalImage], named: usize) {
    let classes = sheets.iter().flat_map(|sheet| &sheet.found);
    let unnamed = classes
        .map(|found| found.class as usize)
        .filter(|&class| class >= named);
    if let (1.., Some(highest)) = (named, unnamed.clone().max()) {
        log::warn!(
            "{}: {} detections of classes up to {highest}, but data.yaml names {named}, numbered from 0",
            predictions.display(),
            unnamed.count()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, LinearRgb};

    /// A set of three images and a selection of two of them, side by side.
    fn set_and_choice() -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = root.path().join(name);
            io::create_folder(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let yaml = "train: images/val\nval: images/val\nnames: [cap]\n";
        write("set/data.yaml", yaml);
        write("choice/data.yaml", &yaml.replace("images/val", "val.txt"));
        write(
            "choice/val.txt",
            "../set/images/val/b.png\n../set/images/val/a.png\n",
        );
        write("set/labels/val/a.txt", "0 0.5 0.5 0.5 0.5\n");
        write("found/a.txt", "0 0.5 0.5 0.5 0.5 0.9\n");
        io::create_folder(root.path().join("set/images/val")).unwrap();
        let image = Image::filled(8, 6, LinearRgb::WHITE);
        for name in ["a", "b", "c"] {
            let path = root.path().join("set/images/val").join(name);
            io::write(path.with_extension("png"), &image).unwrap();
        }
        root
    }

    #[test]
    fn a_choice_of_images_is_a_truth() {
        let root = set_and_choice();
        for name in ["choice", "choice/val.txt"] {
            let truth = EvalTruth::read(&root.path().join(name), None, None).unwrap();
            let sheets = truth.with_detections(&root.path().join("found")).unwrap();
            let counts = sheets.iter().map(|sheet| {
                let counts = [sheet.truth.len(), sheet.found.len()];
                (sheet.image.as_str(), counts)
            });
            assert_eq!(Vec::from_iter(counts), [("a", [1, 1]), ("b", [0, 0])]);
            let mut options = EvalReportOptions::default();
            truth.describe(&mut options).unwrap();
            assert_eq!(
                (options.classes, options.pictures.len()),
                (vec!["cap".into()], 2)
            );
        }
    }

    #[test]
    fn each_class_has_one_name() {
        let root = set_and_choice();
        let truth = EvalTruth::read(&root.path().join("choice"), None, None).unwrap();
        let named = |names: &[&str]| {
            let mut options = EvalReportOptions {
                classes: names.iter().copied().map(String::from).collect(),
                ..Default::default()
            };
            truth.describe(&mut options).map(|()| options.classes)
        };
        assert_eq!(named(&["lid"]).unwrap(), ["lid"]);
        assert_eq!(
            named(&["lid", "label"]).unwrap_err().to_string(),
            "classes: 2 (lid, label), expected a name for each of the truth's 1: cap"
        );
    }

    #[test]
    fn files_of_another_kind_are_refused() {
        let root = set_and_choice();
        let told = |refused: Error| refused.to_string();
        let yaml = root.path().join("choice/data.yaml");
        let refused = EvalTruth::read(&yaml, None, None).map(drop).unwrap_err();
        assert!(told(refused).contains("a file, expected a folder of YOLO labels"));
        let truth = EvalTruth::read(&root.path().join("choice"), None, None).unwrap();
        let refused = truth.with_detections(&yaml).unwrap_err();
        assert!(told(refused).contains("a file, expected a folder of YOLO labels"));
    }

    #[test]
    fn labels_with_keypoints_are_boxes_and_no_outlines() {
        let root = set_and_choice();
        let set = root.path().join("set");
        let yaml = "kpt_shape: [1, 3]\nnames: [cap]\n";
        std::fs::write(set.join("data.yaml"), yaml).unwrap();
        let label = "0 0.5 0.5 0.5 0.5 0.1 0.9 2\n";
        std::fs::write(set.join("labels/val/a.txt"), label).unwrap();
        let truth = EvalTruth::read(&set.join("labels/val"), None, None).unwrap();
        let sheets = truth.with_detections(&root.path().join("found")).unwrap();
        assert_eq!(sheets[0].truth[0].bbox, sheets[0].found[0].bbox);
        assert_eq!(sheets[0].truth[0].bbox.x0, 2.0);
        assert_eq!(truth.class_names(), ["cap"]);
    }

    #[test]
    fn what_a_choice_does_not_take_is_refused() {
        let root = set_and_choice();
        let refused = |name: &str, images, size| {
            let told = EvalTruth::read(&root.path().join(name), images, size);
            told.unwrap_err().to_string()
        };
        let told = refused("choice", None, Some([8, 6]));
        assert!(told.starts_with("size: given with a list"), "{told}");
        let told = refused("choice/val.txt", Some(root.path()), None);
        assert!(told.starts_with("images: given with a list"), "{told}");
        let double = "../set/images/val/a.png\n../other/a.png\n";
        std::fs::create_dir(root.path().join("other")).unwrap();
        let [from, to] = ["set/images/val/a.png", "other/a.png"].map(|name| root.path().join(name));
        std::fs::copy(from, to).unwrap();
        std::fs::write(root.path().join("choice/val.txt"), double).unwrap();
        let truth = EvalTruth::read(&root.path().join("choice"), None, None).unwrap();
        let told = truth.with_detections(&root.path().join("found"));
        assert!(
            told.unwrap_err()
                .to_string()
                .contains("a.png: the same name as ")
        );
        let told = refused("set", None, None);
        assert!(told.contains("a dataset (it has data.yaml)"), "{told}");
        std::fs::remove_file(root.path().join("set/labels/val/a.txt")).unwrap();
        let told = refused("choice/val.txt", None, None);
        assert!(told.contains("no label files"), "{told}");
        std::fs::write(root.path().join("choice/val.txt"), "").unwrap();
        let told = refused("choice", None, None);
        assert!(told.contains("choice: no validation images"), "{told}");
    }
}
