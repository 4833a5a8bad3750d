//! Paths that several parts of a dataset need.

use crate::dataset::Part;
use crate::error::{Error, Result};
use crate::io;
use std::path::{Path, PathBuf};

/// The folder that a file lies in; empty for a bare name.
pub(super) fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

pub(super) fn absolute_path(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|e| Error::file(path, e))
}

/// Creates a folder for each part below a folder of the dataset.
pub(super) fn create_part_folders(folder: &Path, kind: &str) -> Result<()> {
    Part::ALL
        .iter()
        .try_for_each(|part| io::create_folder(folder.join(kind).join(part.name())))
}
