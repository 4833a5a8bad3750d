//! A YOLO dataset on disk, of petcomp's or of the user's own: which images, which classes; and a
//! choice of its images, as lists that trainers read, without copies.

use crate::dataset::Part;
use crate::dataset::listing::{images_in, place_of, whole_path};
use crate::dataset::yolo_yaml::DataYaml;
use crate::error::{Error, Result};
use crate::eval::label_of;
use crate::io;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

/// Images and classes of a YOLO dataset; all paths are absolute.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct YoloSet {
    /// Names of the classes, in order.
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
    /// A part may be empty, and both parts the same, of a set that is still to be split.
    ///
    /// # Errors
    /// [`Error::File`] for a `data.yaml` that is missing or that trainers would not take, a folder
    /// or list that cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let folder = whole_path(folder)?;
        let path = folder.join("data.yaml");
        let (yaml, problems) = DataYaml::read(&io::read_text(&path)?);
        if let Some((line, what)) = problems.into_iter().next() {
            return Err(yaml_problem(&path, line, &what));
        }
        let root = yaml.root(&folder);
        let [train, val] = Part::ALL.map(|part| images_of(&root, yaml.folders(part)));
        Ok(Self {
            classes: yaml.names().to_vec(),
            train: train?,
            val: val?,
        })
    }

    /// The same of a set to train on, whose parts both have images.
    ///
    /// # Errors
    /// Those of [`YoloSet::read`], and [`Error::File`] for a part without images.
    pub fn open(folder: &Path) -> Result<Self> {
        let set = Self::read(folder)?;
        if let Some(part) = Part::ALL.into_iter().find(|&p| set.part(p).is_empty()) {
            let what = format!("{}: no images, expected at least one", part.name());
            return Err(Error::file(folder.join("data.yaml"), what));
        }
        Ok(set)
    }

    fn part(&self, part: Part) -> &[PathBuf] {
        match part {
            Part::Train => &self.train,
            Part::Val => &self.val,
        }
    }

    /// The label file of an image: its path with the last `images` replaced by `labels`.
    pub fn label_of(image: &Path) -> PathBuf {
        label_of(image)
    }

    /// All images in order of name, each once: the series as it was taken.
    pub fn series(&self) -> Vec<PathBuf> {
        let mut all = [&self.train[..], &self.val[..]].concat();
        all.sort_by(|a, b| compare_names(a, b));
        all.dedup();
        all
    }

    /// The first part of the images for training and the first part of those for validation, as the
    /// paper takes 25 % of its photos "from the beginning".
    ///
    /// # Errors
    /// A share that is not in `0..=1`.
    pub fn head(&self, share: f64) -> Result<Self> {
        check_share(share)?;
        Ok(Self {
            train: first_share(&self.train, share),
            val: first_share(&self.val, share),
            classes: self.classes.clone(),
        })
    }

    /// Writes `train.txt`, `val.txt` and `data.yaml`; images below the folder are relative to it.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        io::create_folder(folder)?;
        let folder = whole_path(folder)?;
        for part in Part::ALL {
            let list = folder.join(part.name()).with_extension("txt");
            io::write_text(list, &list_of(self.part(part), &folder))?;
        }
        let yaml = DataYaml::write_with(&self.classes, |part| format!("{part}.txt"));
        io::write_text(folder.join("data.yaml"), &yaml)
    }
}

/// The images of the folders or lists of a part.
fn images_of(root: &Path, parts: &[String]) -> Result<Vec<PathBuf>> {
    let images: Vec<_> = parts
        .iter()
        .map(|part| images_in(&place_of(root, part)))
        .collect::<Result<_>>()?;
    Ok(images.concat())
}

fn yaml_problem(path: &Path, line: Option<usize>, what: &str) -> Error {
    let line = line.map(|n| format!("line {n}: ")).unwrap_or_default();
    Error::file(path, format!("{line}{what}"))
}

/// By the file's name, then by its whole path.
fn compare_names(a: &Path, b: &Path) -> Ordering {
    (a.file_name(), a).cmp(&(b.file_name(), b))
}

fn check_share(share: f64) -> Result<()> {
    if (0.0..=1.0).contains(&share) {
        return Ok(());
    }
    let what = format!("{share}, expected a share, 0 to 1");
    Err(Error::value("head", what))
}

fn first_share(images: &[PathBuf], share: f64) -> Vec<PathBuf> {
    images[..(images.len() as f64 * share).round() as usize].to_vec()
}

/// Images as lines of a list.
fn list_of(images: &[PathBuf], folder: &Path) -> String {
    let lines = images.iter().map(|path| list_line(path, folder));
    lines.collect()
}

/// Trainers take `./` for the list's folder, older ones each `./` of a line, that of `../` too: what
/// lies elsewhere has its whole path.
fn list_line(image: &Path, folder: &Path) -> String {
    match image.strip_prefix(folder) {
        Ok(below) => format!("./{}\n", below.display()),
        Err(_) => format!("{}\n", image.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(yaml: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for part in ["images/train/cam0", "images/val"] {
            std::fs::create_dir_all(folder.path().join(part)).unwrap();
        }
        for image in [
            "images/train/b.png",
            "images/train/a.jpg",
            "images/train/note.md",
            "images/train/cam0/b.webp",
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
            ["a.jpg", "b.png", "cam0/b.webp"].map(|p| set.path().join("images/train").join(p))
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
    fn what_trainers_would_not_take_is_refused() {
        for (yaml, expected) in [
            (
                "train: images/train\nvalid: images/val\nnames: [cap]\n",
                "no val:",
            ),
            (
                "train: images/train\nval: images/val\nnc: 2\nnames: [cap]\n",
                "nc: 2, but",
            ),
            ("path: [", "not YAML"),
        ] {
            let told = YoloSet::read(folder(yaml).path()).unwrap_err().to_string();
            assert!(told.contains(expected), "{told}");
        }
    }

    #[test]
    fn a_folder_that_is_not_beside_the_set_is_one_of_it() {
        let set = folder("train: ../images/train\nval: ../images/val\nnames: [cap]\n");
        let read = YoloSet::open(set.path()).unwrap();
        assert_eq!((read.train.len(), read.val.len()), (3, 1));
    }

    #[test]
    fn images_of_both_parts_are_in_the_series_once() {
        let set = folder("train: images/train\nval: images/train\nnames: [cap]\n");
        let read = YoloSet::read(set.path()).unwrap();
        assert_eq!((read.train.len(), &read.val), (3, &read.train));
        assert_eq!(read.series().len(), 3);
    }

    #[test]
    fn the_last_images_of_a_path_becomes_labels() {
        let label = YoloSet::label_of(Path::new("/images/set/images/train/a.b.png"));
        assert_eq!(label, Path::new("/images/set/labels/train/a.b.txt"));
    }
}
