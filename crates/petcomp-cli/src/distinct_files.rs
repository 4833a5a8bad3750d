//! Files that are read and files that are written: never the same.

use anyhow::Result;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Fails on the first file that is read and would be written over, or that would be written twice.
pub(crate) fn check_distinct(
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    targets: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<()> {
    let inputs = inputs.into_iter().map(|input| real_path(input.as_ref()));
    let inputs: BTreeSet<PathBuf> = inputs.collect();
    let mut written = BTreeSet::new();
    for target in targets {
        let target = target.as_ref();
        let (path, shown) = (real_path(target), target.display());
        anyhow::ensure!(
            !inputs.contains(&path),
            "{shown}: is read and would be written over"
        );
        anyhow::ensure!(written.insert(path), "{shown}: two files would go here");
    }
    Ok(())
}

/// One path for every name of a file that is there.
fn real_path(path: &Path) -> PathBuf {
    let real = path.canonicalize().or_else(|_| std::path::absolute(path));
    real.unwrap_or_else(|_| path.to_owned())
}
