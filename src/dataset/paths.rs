//! Paths that several parts of a dataset need.

use crate::dataset::Part;
use crate::error::Result;
use crate::io;
use std::path::Path;

/// The folder of a file; empty for a bare name.
pub(super) fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// The path of a file or folder that a recipe in some folder names.
pub(super) fn seen_from(folder: &Path, path: &Path) -> Result<String> {
    let seen = io::relative_on_disk(path, folder)?;
    io::path_text(&seen).map(str::to_owned)
}

/// Creates a folder for each part below a folder of the dataset.
pub(super) fn create_part_folders(folder: &Path, kind: &str) -> Result<()> {
    Part::ALL
        .iter()
        .try_for_each(|part| io::create_folder(folder.join(kind).join(part.name())))
}

/// Deletes those of the files below a folder that exist.
pub(super) fn remove_files(
    folder: &Path,
    files: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<()> {
    let mut files = files.into_iter();
    files.try_for_each(|file| io::remove_if_exists(&folder.join(file)))
}
