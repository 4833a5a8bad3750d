//! A YOLO dataset on disk, of petcomp's or of the user's own: which images, which classes.

use crate::dataset::Part;
use crate::dataset::listing::{images_in, place_of};
use crate::dataset::yolo_yaml::DataYaml;
use crate::error::{Error, Result};
use crate::eval::label_of;
use crate::io;
use std::path::{Path, PathBuf};

/// Images and classes of a YOLO dataset.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct YoloSet {
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Images to learn from, in order of name or as listed.
    pub train: Vec<PathBuf>,
    /// Images to choose the best model by.
    pub val: Vec<PathBuf>,
}

impl YoloSet {
    /// Reads what `FOLDER/data.yaml` names: folders of images, or text files that list them, a line
    /// each, relative to the list; all relative to its `path:`, which is relative to the folder.
    ///
    /// # Errors
    /// [`Error::File`] for a missing `data.yaml`, one without classes, or a part without images.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join("data.yaml");
        let (yaml, problems) = DataYaml::read(&io::read_text(&path)?);
        if let Some((line, what)) = problems.into_iter().next() {
            return Err(yaml_problem(&path, line, &what));
        }
        let root = yaml.root(folder);
        let [train, val] = Part::ALL.map(|part| images_of(&root, yaml.folders(part)));
        Ok(Self {
            classes: yaml.names().to_vec(),
            train: train?,
            val: val?,
        })
    }

    /// The label file of an image: its path with the last `images` replaced by `labels`.
    pub fn label_of(image: &Path) -> PathBuf {
        label_of(image)
    }
}

/// The images of the folders or lists of a part, at least one in each.
fn images_of(root: &Path, parts: &[String]) -> Result<Vec<PathBuf>> {
    let mut images = Vec::new();
    for part in parts {
        let place = place_of(root, part);
        let found = images_in(&place)?;
        if found.is_empty() {
            return Err(Error::file(place, "no images, expected at least one"));
        }
        images.extend(found);
    }
    Ok(images)
}

fn yaml_problem(path: &Path, line: Option<usize>, what: &str) -> Error {
    let line = line.map(|n| format!("line {n}: ")).unwrap_or_default();
    Error::file(path, format!("{line}{what}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(yaml: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for part in ["images/train", "images/val"] {
            std::fs::create_dir_all(folder.path().join(part)).unwrap();
        }
        for image in [
            "images/train/b.png",
            "images/train/a.jpg",
            "images/train/note.md",
            "images/val/c.png",
        ] {
            std::fs::write(folder.path().join(image), "").unwrap();
        }
        std::fs::write(folder.path().join("some.txt"), "./images/val/c.png\n\n").unwrap();
        std::fs::write(folder.path().join("data.yaml"), yaml).unwrap();
        folder
    }

    #[test]
    fn folders_and_lists_of_images_are_read() {
        let set = folder("train: images/train\nval: some.txt\nnames: [cap]\n");
        let read = YoloSet::open(set.path()).unwrap();
        assert_eq!(
            read.train,
            ["images/train/a.jpg", "images/train/b.png"].map(|p| set.path().join(p))
        );
        assert_eq!(
            (read.val, read.classes),
            (
                vec![set.path().join("images/val/c.png")],
                vec!["cap".into()]
            )
        );
    }

    #[test]
    fn a_part_without_images_is_named() {
        let set = folder("path: images\ntrain: train\nval: nowhere\nnames: [cap]\n");
        let said = YoloSet::open(set.path()).unwrap_err().to_string();
        assert!(said.contains("nowhere"), "{said}");
    }

    #[test]
    fn the_last_images_of_a_path_becomes_labels() {
        let label = YoloSet::label_of(Path::new("/images/set/images/train/a.b.png"));
        assert_eq!(label, Path::new("/images/set/labels/train/a.b.txt"));
    }
}
