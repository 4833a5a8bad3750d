//! File names in lists and documents, which are text.

use crate::error::{Error, Result};
use std::path::Path;

/// A path as text, for a list or a document.
///
/// # Errors
/// [`Error::File`] if it is not UTF-8: with replaced characters it would name another file.
pub fn path_text(path: &Path) -> Result<&str> {
    path.to_str().ok_or_else(|| not_text(path))
}

/// The name of a file without folder and extension; the folders may have any names.
///
/// # Errors
/// Like [`path_text`].
pub(crate) fn stem_text(path: &Path) -> Result<&str> {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_str().ok_or_else(|| not_text(path))
}

fn not_text(path: &Path) -> Error {
    Error::file(path, "a name that is not UTF-8, expected one that is")
}
