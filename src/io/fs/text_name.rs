//! Names of files in lists and documents, which are text.

use crate::error::{Error, Result};
use std::path::Path;

/// A path as a list or a document names it.
///
/// # Errors
/// [`Error::File`] for one that is not UTF-8: with other letters it would be another file's.
pub fn path_text(path: &Path) -> Result<&str> {
    path.to_str().ok_or_else(|| not_text(path))
}

/// The name of a file without folder and extension; the folders may have any names.
///
/// # Errors
/// As [`path_text`].
pub(crate) fn stem_text(path: &Path) -> Result<&str> {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_str().ok_or_else(|| not_text(path))
}

fn not_text(path: &Path) -> Error {
    Error::file(path, "a name that is not UTF-8, expected one that is")
}
