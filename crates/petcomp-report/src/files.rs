//! The files of a report.

use petcomp::{Result, io};
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// Writes texts into a folder, which is created if necessary.
///
/// # Errors
/// Files that cannot be written.
pub(crate) fn write_texts<const N: usize>(folder: &Path, files: [(&str, &str); N]) -> Result<()> {
    io::create_folder(folder)?;
    for (name, text) in files {
        io::write_text(folder.join(name), text)?;
    }
    Ok(())
}

/// The files `*.json` of a folder, sorted.
pub(crate) fn json_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = io::entries(folder)?;
    let mut paths: Vec<PathBuf> = entries.iter().map(DirEntry::path).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
    paths.sort();
    Ok(paths)
}
