//! What an earlier evaluation left in the folder: files that this one does not write would be
//! mistaken for its own.

use super::Metrics;
use crate::error::{Error, Result};
use crate::io;
use std::fs::DirEntry;
use std::path::Path;

/// The metrics of a single run.
pub(super) const METRICS: &str = "metrics.json";

/// Removes the metrics of runs except those with these names.
pub(super) fn remove_metrics(folder: &Path, kept: &[String]) -> Result<()> {
    for path in io::entries(folder)?.iter().map(DirEntry::path) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_kept = kept.iter().any(|kept| *kept == name);
        if !is_kept && are_metrics(&name, &path) {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Whether an evaluation wrote a file, judged by its name and content.
fn are_metrics(name: &str, path: &Path) -> bool {
    let run = numbered_run(name);
    let is_ours = |metrics: Metrics| run.is_none_or(|run| run == file_part(&metrics.run));
    (name == METRICS || run.is_some()) && io::read_json(path).is_ok_and(is_ours)
}

/// A run's name as part of a file name.
pub(super) fn file_part(run: &str) -> String {
    run.replace(['/', '\\'], "_")
}

/// The run of one of several metrics files: of `2-NAME.json`.
fn numbered_run(name: &str) -> Option<&str> {
    let (number, run) = name.strip_suffix(".json")?.split_once('-')?;
    // A copy that the user named by a year or a date does not match.
    number.parse::<u8>().is_ok().then_some(run)
}

/// Removes a table with this header line.
pub(super) fn remove_table(path: &Path, titles: &str) -> Result<()> {
    match io::read_text(path) {
        Ok(text) if text.starts_with(titles) => remove(path),
        _ => Ok(()),
    }
}

fn remove(path: &Path) -> Result<()> {
    std::fs::remove_file(path).map_err(|e| Error::file(path, format!("cannot be removed: {e}")))
}
