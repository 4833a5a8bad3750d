//! Files that are read and files that are written: never the same.

use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// No file is read and written, and none is written twice, under whatever names.
///
/// # Errors
/// [`Error::File`] for the first file that would be.
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

/// One path for every name of a file that is there.
pub(crate) fn real_path(path: &Path) -> PathBuf {
    let real = path.canonicalize().or_else(|_| std::path::absolute(path));
    real.unwrap_or_else(|_| path.to_owned())
}
