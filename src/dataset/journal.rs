//! The journal: which samples of a dataset are finished.
//!
//! A sample exists if and only if its line is intact and its files have the size given in the line.
//! Lines are added in the order in which samples finish; [`Journal::close`] sorts them by number,
//! so a finished folder does not show how it was made.
//!
//! # After a power cut
//! Files are not synced to disk one by one but with those of [`UNSYNCED_LINES`] samples at once,
//! and before lines are sorted. So at most the last that many lines may refer to files that were
//! lost or torn; a resumed run compares those by checksum, and syncs what a killed one left in
//! memory. A sample that already has a line is the exception: each of its files is synced before it
//! replaces the old one; otherwise that line would be mistaken for theirs.

use crate::dataset::Inputs;
use crate::dataset::folder::{self, JOURNAL};
use crate::dataset::journal_line::JournalLine;
use crate::error::{Error, Result};
use crate::io::{self, Syncing};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

/// Maximum number of lines, the last ones, whose files may not be synced yet.
const UNSYNCED_LINES: usize = 256;

/// An open journal.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    lines: BTreeMap<u64, JournalLine>,
    /// How the system syncs the files of many samples.
    syncing: Syncing,
    /// Lines whose files may not be synced yet.
    unsynced: usize,
    /// Whether the disk lost something: the system reports that only once.
    has_lost: bool,
}

impl Journal {
    /// Opens the journal of a folder, or starts one. Lines that are torn, or whose files are
    /// missing, are dropped.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(JOURNAL);
        let file = io::open_own(&path)?;
        let syncing = sync(&file, &path)?;
        let read = read_journal(&file, &path, false)?;
        let count = read.len();
        warn_of_damage(&read, &path, "their samples are generated again");
        let lines = lines_with_files(undamaged(read).collect(), folder);
        if lines.len() < count {
            // Otherwise new lines would push those to be dropped out of what the next run compares.
            write_lines(&path, lines.values())?;
        }
        let mut file = io::open_own(&path)?;
        end_last_line(&mut file).map_err(|e| Error::file(&path, e))?;
        Ok(Self {
            path,
            file,
            lines,
            syncing,
            unsynced: 0,
            has_lost: false,
        })
    }

    /// Whether sample `k` is finished.
    pub(crate) fn has(&self, k: u64) -> bool {
        self.lines.contains_key(&k)
    }

    /// One more than the number of the last finished sample.
    pub(crate) fn end(&self) -> u64 {
        self.lines
            .keys()
            .next_back()
            .map_or(0, |k| k.saturating_add(1))
    }

    /// How the files of sample `k` are synced.
    pub(crate) fn syncing(&self, k: u64) -> Syncing {
        if self.has(k) {
            return Syncing::Alone;
        }
        self.syncing
    }

    /// Adds a finished sample.
    pub(crate) fn add(&mut self, line: JournalLine) -> Result<()> {
        if self.unsynced == UNSYNCED_LINES {
            self.sync()?;
        }
        let written = self.file.write_all(line.text().as_bytes());
        written.map_err(|e| Error::file(&self.path, e))?;
        self.unsynced += 1;
        self.lines.insert(line.k, line);
        Ok(())
    }

    /// Number of requested samples below `count` that are finished.
    pub(crate) fn count(&self, count: u64, wanted: impl Fn(u64) -> bool) -> u64 {
        self.lines
            .range(..count)
            .filter(|(k, _)| wanted(**k))
            .count() as u64
    }

    /// Sorts the lines and returns those of the samples below `count`.
    pub(crate) fn close(mut self, count: u64) -> Result<Vec<JournalLine>> {
        self.sync()?;
        write_lines(&self.path, self.lines.values())?;
        self.lines.split_off(&count);
        Ok(self.lines.into_values().collect())
    }

    /// Syncs the files of all samples. After a loss, lines stay in the order in which they were
    /// added.
    fn sync(&mut self) -> Result<()> {
        if self.has_lost {
            let what = "the disk lost some of the last samples";
            return Err(Error::file(&self.path, what));
        }
        sync(&self.file, &self.path).inspect_err(|_| self.has_lost = true)?;
        self.unsynced = 0;
        Ok(())
    }
}

/// Syncs the files of all samples; returns how the system can do that.
fn sync(journal: &File, path: &Path) -> Result<Syncing> {
    match io::sync_file_system(journal) {
        Ok(true) => Ok(Syncing::Together),
        Ok(false) => Ok(Syncing::Alone),
        Err(e) => {
            let what = format!(
                "the last samples cannot be synced to the disk: {e}; rerun the same command to check them and resume"
            );
            Err(Error::file(path, what))
        }
    }
}

/// Terminates an unterminated last line; otherwise the next one would be read as a part of it.
fn end_last_line(file: &mut File) -> std::io::Result<()> {
    let mut last = *b"\n";
    if file.metadata()?.len() > 0 {
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
    }
    if last != *b"\n" {
        file.write_all(b"\n")?;
    }
    Ok(())
}

/// The lines whose files are present, by number.
fn lines_with_files(known: Vec<JournalLine>, folder: &Path) -> BTreeMap<u64, JournalLine> {
    let synced = known.len().saturating_sub(UNSYNCED_LINES);
    let held: Vec<JournalLine> = known
        .into_par_iter()
        .enumerate()
        .filter(|(i, line)| line.has_files(folder, *i < synced))
        .map(|(_, line)| line)
        .collect();
    keyed_by_number(held)
}

/// The last line for each number.
fn keyed_by_number(lines: impl IntoIterator<Item = JournalLine>) -> BTreeMap<u64, JournalLine> {
    lines.into_iter().map(|line| (line.k, line)).collect()
}

/// Compares the files of a dataset with what was written and marks samples that differ to be
/// generated again; returns how many samples are good and how many the next run generates again.
/// That run also rereads every input file.
///
/// # Errors
/// A folder that holds no dataset, one that an older petcomp started, or one that a run is writing.
pub fn repair(folder: &Path) -> Result<(usize, usize)> {
    let _lock = folder::reclaim(folder)?;
    Inputs::forget(folder);
    let path = folder.join(JOURNAL);
    // Created if missing: a run may have ended before its first sample.
    let file = io::open_own(&path)?;
    sync(&file, &path)?;
    let read = read_journal(&file, &path, false)?;
    let all = read.len();
    let lines = by_number(read);
    let good: Vec<&JournalLine> = lines
        .par_iter()
        .filter(|line| line.has_same_bytes(folder))
        .collect();
    write_lines(&path, good.iter().copied())?;
    Ok((good.len(), all - good.len()))
}

/// The intact lines of a folder's journal, in order of number.
pub(crate) fn lines_of(folder: &Path) -> Result<Vec<JournalLine>> {
    let read = numbered_lines(folder)?;
    warn_of_damage(&read, &folder.join(JOURNAL), "left out");
    Ok(by_number(read))
}

/// Number of samples that a folder's journal lists; 0 without a journal.
pub(crate) fn count_listed(folder: &Path) -> u64 {
    numbered_lines(folder).map_or(0, |read| by_number(read).len() as u64)
}

/// The files of the samples that a folder's journal lists.
///
/// # Errors
/// [`Error::File`] for a folder without a journal.
pub fn listed_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let lines = undamaged(numbered_lines(folder)?);
    let files = lines.flat_map(|line| line.written().files);
    Ok(files.map(|file| folder.join(file)).collect())
}

/// Lines by their number in the file, from 1: the content of each, or what is wrong with it.
pub(crate) type NumberedLines = Vec<(usize, std::result::Result<JournalLine, String>)>;

/// Every line of a folder's journal.
pub(crate) fn numbered_lines(folder: &Path) -> Result<NumberedLines> {
    let path = io::inside(folder, JOURNAL)?;
    let is_older = folder::is_older(folder)?;
    let file = File::open(&path).map_err(|e| Error::file(&path, e))?;
    read_journal(&file, &path, is_older)
}

fn read_journal(file: &File, path: &Path, is_older: bool) -> Result<NumberedLines> {
    read_lines(BufReader::new(file), is_older).map_err(|e| Error::file(path, e))
}

/// The undamaged lines, in the order of the file.
fn undamaged(read: NumberedLines) -> impl Iterator<Item = JournalLine> {
    read.into_iter().filter_map(|(_, line)| line.ok())
}

/// The undamaged lines, in order of number; for each number the last.
fn by_number(read: NumberedLines) -> Vec<JournalLine> {
    keyed_by_number(undamaged(read)).into_values().collect()
}

fn warn_of_damage(read: &NumberedLines, path: &Path, consequence: &str) {
    let damaged = read.iter().filter(|(_, line)| line.is_err()).count();
    if damaged > 0 {
        log::warn!("{}: {damaged} damaged lines, {consequence}", path.display());
    }
}

/// Maximum length of a line of a journal: a sample has a handful of files.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// The lines of a journal; `is_older` also accepts lines without a checksum.
pub(crate) fn read_lines(mut from: impl BufRead, is_older: bool) -> std::io::Result<NumberedLines> {
    let mut lines = Vec::new();
    for i in 1.. {
        let text = read_line(&mut from, i)?;
        if text.is_empty() {
            break;
        }
        let text = text.trim_ascii();
        if !text.is_empty() {
            lines.push((i, JournalLine::parse(text, is_older)));
        }
    }
    Ok(lines)
}

/// The next line with its end; empty at the end of the file.
fn read_line(from: &mut impl BufRead, i: usize) -> std::io::Result<Vec<u8>> {
    let mut text = Vec::new();
    let mut limited = from.by_ref().take(MAX_LINE_BYTES);
    limited.read_until(b'\n', &mut text)?;
    if text.len() as u64 == MAX_LINE_BYTES {
        let what = format!("line {i} is longer than {MAX_LINE_BYTES} bytes, expected a journal");
        return Err(std::io::Error::other(what));
    }
    Ok(text)
}

/// Rewrites a journal.
fn write_lines<'a>(path: &Path, mut lines: impl Iterator<Item = &'a JournalLine>) -> Result<()> {
    io::write_through(path, |out| {
        lines.try_for_each(|line| out.write_all(line.text().as_bytes()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_os = "linux")]
    use crate::dataset::journal_line::test_line;

    /// Other systems sync each file by itself.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_forgotten_sample_has_no_line_and_one_that_has_is_put_on_the_disk_first() {
        let dir = tempfile::tempdir().unwrap();
        let mut journal = Journal::open(dir.path()).unwrap();
        journal.add(test_line(0, &[])).unwrap();
        journal.add(test_line(1, &["labels/lost.txt"])).unwrap();
        let journal = Journal::open(dir.path()).unwrap();
        assert_eq!([0, 1].map(|k| journal.has(k)), [true, false]);
        let syncing = [0, 1].map(|k| journal.syncing(k));
        assert_eq!(syncing, [Syncing::Alone, Syncing::Together]);
        assert_eq!(lines_of(dir.path()).unwrap().len(), 1);
    }

    #[test]
    fn a_line_without_an_end_is_no_journal() {
        let zeros = std::io::repeat(0).take(MAX_LINE_BYTES + 1);
        let refused = read_lines(BufReader::new(zeros), false).unwrap_err();
        assert!(refused.to_string().contains("line 1 is longer than"));
    }
}
