//! The images that a folder holds or a list names, and the files next to an image.

use crate::dataset::SampleRecord;
use crate::dataset::paths::folder_of;
use crate::error::Result;
use crate::eval::is_image;
use crate::io;
use std::path::{Component, Path, PathBuf};

/// Path of a folder or list of a part, for a `data.yaml` with this root.
///
/// Roboflow's is `../train/images` although `train` is next to the file: if the path does not
/// exist, Ultralytics ignores the first `../`, and so do we.
pub(crate) fn place_of(root: &Path, part: &str) -> PathBuf {
    let place = without_dots(&root.join(part));
    match part.strip_prefix("../") {
        Some(rest) if !place.exists() => without_dots(&root.join(rest)),
        _ => place,
    }
}

/// The images below a folder, or those that a list names.
pub(crate) fn images_in(place: &Path) -> Result<Vec<PathBuf>> {
    if is_list(place) {
        listed_images(place)
    } else {
        io::files_below(place, is_image, usize::MAX)
    }
}

pub(crate) fn is_list(place: &Path) -> bool {
    place.extension().is_some_and(|e| e == "txt")
}

/// The lines of a list, below its folder.
fn listed_images(list: &Path) -> Result<Vec<PathBuf>> {
    let folder = folder_of(list);
    let text = io::read_text(list)?;
    let lines = io::lines(&text)
        .map(str::trim)
        .filter(|line| !line.is_empty());
    Ok(lines.map(|line| without_dots(&folder.join(line))).collect())
}

/// A path from the root without `.` and `..`.
pub(crate) fn whole_path(path: &Path) -> Result<PathBuf> {
    Ok(without_dots(&io::absolute(path)?))
}

/// The same path without `.`, and without `..` except for those that lead out of its starting
/// point.
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

/// What is known of an image: its sidecar.
///
/// # Errors
/// If there is none next to it.
pub(crate) fn record_of(image: &Path) -> Result<SampleRecord> {
    io::read_json(sidecar_of(image))
}

/// Path of an image's sidecar, if it has one.
pub(crate) fn sidecar_of(image: &Path) -> PathBuf {
    io::with_last_step(image, "images", "scenes").with_extension("json")
}
