//! The images of a dataset, part by part, and a choice of them: lists that trainers read, without
//! copies.

use crate::dataset::paths::folder_of;
use crate::dataset::yolo_yaml::DataYaml;
use crate::dataset::{Part, SampleRecord};
use crate::error::{Error, Result};
use crate::io;
use std::cmp::Ordering;
use std::path::{Component, Path, PathBuf};

/// Images for training and for validation, in order; none is a copy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listing {
    /// Absolute paths of the images for training.
    pub train: Vec<PathBuf>,
    /// Absolute paths of those for validation.
    pub val: Vec<PathBuf>,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
}

impl Listing {
    /// Reads the `data.yaml` of a folder, whose parts are folders of images (in order of name) or
    /// lists (`.txt`), below its `path:`.
    ///
    /// # Errors
    /// No `data.yaml`; a folder or list that cannot be read.
    pub fn read(folder: &Path) -> Result<Self> {
        let folder = whole_path(folder)?;
        let (yaml, _) = DataYaml::read(&io::read_text(folder.join("data.yaml"))?);
        let root = yaml.root(&folder);
        let [train, val] = Part::ALL.map(|part| images_of(&root, yaml.folders(part)));
        Ok(Self {
            train: train?,
            val: val?,
            classes: yaml.names().to_vec(),
        })
    }

    /// All images in order of name: the series as it was taken.
    pub fn series(&self) -> Vec<PathBuf> {
        let mut all = [&self.train[..], &self.val[..]].concat();
        all.sort_by(|a, b| compare_names(a, b));
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

    /// Writes `train.txt`, `val.txt` and `data.yaml`, paths relative to the folder.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        io::create_folder(folder)?;
        let folder = whole_path(folder)?;
        for (part, images) in Part::ALL.into_iter().zip([&self.train, &self.val]) {
            write_list(part, images, &folder)?;
        }
        let yaml = DataYaml::write_with(&self.classes, |part| format!("{part}.txt"));
        io::write_text(folder.join("data.yaml"), &yaml)
    }
}

/// By the file's name, then by its whole path.
fn compare_names(a: &Path, b: &Path) -> Ordering {
    (a.file_name(), a).cmp(&(b.file_name(), b))
}

/// The images of the folders or lists of a part.
fn images_of(root: &Path, parts: &[String]) -> Result<Vec<PathBuf>> {
    let images: Vec<_> = parts
        .iter()
        .map(|part| images_in(&place_of(root, part)))
        .collect::<Result<_>>()?;
    Ok(images.concat())
}

/// Where a folder or list of a part is, for a `data.yaml` with this root.
pub(crate) fn place_of(root: &Path, part: &str) -> PathBuf {
    without_dots(&root.join(part))
}

/// The images of a folder, or those that a list names.
pub(crate) fn images_in(place: &Path) -> Result<Vec<PathBuf>> {
    if is_list(place) {
        listed_images(place)
    } else {
        images_in_folder(place)
    }
}

pub(crate) fn is_list(place: &Path) -> bool {
    place.extension().is_some_and(|e| e == "txt")
}

/// The lines of a list, below its folder.
fn listed_images(list: &Path) -> Result<Vec<PathBuf>> {
    let folder = folder_of(list);
    let text = io::read_text(list)?;
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    Ok(lines.map(|line| without_dots(&folder.join(line))).collect())
}

/// In order of name.
fn images_in_folder(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut images: Vec<PathBuf> = paths.filter(|path| is_image(path)).collect();
    images.sort();
    Ok(images)
}

fn write_list(part: Part, images: &[PathBuf], folder: &Path) -> Result<()> {
    let list = folder.join(format!("{}.txt", part.name()));
    io::write_text(list, &list_of(images, folder))
}

/// Images as lines of a list; trainers take `./` for its folder.
fn list_of(images: &[PathBuf], folder: &Path) -> String {
    images
        .iter()
        .map(|path| format!("./{}\n", io::relative(path, folder).display()))
        .collect()
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

/// A path from the root without `.` and `..`.
pub(crate) fn whole_path(path: &Path) -> Result<PathBuf> {
    Ok(without_dots(&io::absolute(path)?))
}

/// The same path without `.`, and without `..` but for those that lead out of where it begins.
fn without_dots(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for step in path.components() {
        match step {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => drop(plain.pop()),
            step => plain.push(step),
        }
    }
    plain
}

/// Extensions of the images that a listing names.
const IMAGE_EXTENSIONS: [&str; 5] = ["png", "jpg", "jpeg", "tif", "tiff"];

pub(crate) fn is_image(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|e| IMAGE_EXTENSIONS.contains(&e.as_str()))
}

/// What is known of an image: its sidecar.
///
/// # Errors
/// When there is none beside it.
pub(crate) fn record_of(image: &Path) -> Result<SampleRecord> {
    io::read_json(sidecar_of(image))
}

/// Where the sidecar of an image is, if it has one.
pub(crate) fn sidecar_of(image: &Path) -> PathBuf {
    io::with_last_step(image, "images", "scenes").with_extension("json")
}
