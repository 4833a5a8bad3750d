//! Ensures that no file is both read and written.

use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Fails if a file is both read and written, or written twice, under whatever names.
///
/// # Errors
/// [`Error::File`] for the first such file.
pub fn check_distinct(
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    targets: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<()> {
    let inputs = inputs.into_iter().map(|input| real_path(input.as_ref()));
    let inputs: BTreeSet<PathBuf> = inputs.collect();
    let mut written = BTreeSet::new();
    for target in targets {
        let target = target.as_ref();
        let path = real_path(target);
        if inputs.contains(&path) {
            return Err(Error::file(target, "is an input and would be overwritten"));
        }
        if !written.insert(path) {
            return Err(Error::file(target, "two files would be written here"));
        }
    }
    Ok(())
}

/// The same path for all names of an existing file.
pub(crate) fn real_path(path: &Path) -> PathBuf {
    let real = path.canonicalize().or_else(|_| std::path::absolute(path));
    real.unwrap_or_else(|_| path.to_owned())
}
