//! Samples in tar archives that are read sequentially: WebDataset.

use crate::dataset::{Entry, Part, Writer, Written};
use crate::error::{Error, Result};
use crate::io;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Writes `webdataset/{train,val}-NNNNNN.tar`, each with the files of a span of numbers: at the
/// default of 500, number 2 holds the samples 1000 to 1499; those for training and those for
/// validation are separate.
///
/// Files of a sample are named by its number: `000000012.png`, `000000012.json`; if two writers
/// have one of the same kind, the later one's is named `000000012.FOLDER.json` after its folder.
/// There is no empty archive. Times and owners are zero, so the same samples give the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WebDataset {
    /// Numbers per archive, at least 1. Default: 500.
    pub samples: u64,
}

impl Default for WebDataset {
    fn default() -> Self {
        Self { samples: 500 }
    }
}

/// Its folder.
const KIND: &str = "webdataset";

/// Everyone may read; the owner may write.
const FILE_MODE: u32 = 0o644;

impl Writer for WebDataset {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "webdataset": self })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        self.check()?;
        io::create_folder(folder.join(KIND))
    }

    fn write(&self, _folder: &Path, _entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }

    fn for_trainers(&self) -> Vec<PathBuf> {
        Part::ALL.map(|part| archive(Path::new(""), part, 0)).into()
    }

    fn reopen(&self, folder: &Path) -> Result<()> {
        let none = BTreeSet::new();
        let mut parts = Part::ALL.into_iter();
        parts.try_for_each(|part| remove_archives_but(&none, folder, part))
    }

    fn finish(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Result<()> {
        Part::ALL
            .into_iter()
            .try_for_each(|part| self.write_archives(folder, part, samples))
    }

    /// Archives hold no checksums of their files' content.
    fn changed(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Vec<PathBuf> {
        let mut counts = BTreeMap::new();
        for sample in samples {
            let path = archive(Path::new(""), sample.part, self.number_of(sample));
            *counts.entry(path).or_default() += 1;
        }
        let changed = counts
            .into_iter()
            .filter(|(path, samples)| !is_whole(&folder.join(path), *samples));
        changed.map(|(path, _)| path).collect()
    }
}

impl WebDataset {
    pub(super) fn check(&self) -> Result<()> {
        match self.samples {
            0 => Err(Error::value(
                "labels.webdataset.samples",
                "0, expected at least 1",
            )),
            _ => Ok(()),
        }
    }

    /// The first number of an archive, and that of the next one, in a dataset of `count`.
    pub(super) fn span(&self, archive: u64, count: u64) -> (u64, u64) {
        let first = archive.saturating_mul(self.samples);
        (first, first.saturating_add(self.samples).min(count))
    }

    fn write_archives(&self, folder: &Path, part: Part, samples: &[Written]) -> Result<()> {
        let of_part = samples.iter().filter(|sample| sample.part == part);
        let of_part: Vec<_> = of_part.collect();
        let mut kept = BTreeSet::new();
        for samples in of_part.chunk_by(|a, b| self.number_of(a) == self.number_of(b)) {
            let path = archive(folder, part, self.number_of(samples[0]));
            write_archive(&path, folder, samples)?;
            kept.insert(path);
        }
        remove_archives_but(&kept, folder, part)
    }

    fn number_of(&self, sample: &Written) -> u64 {
        sample.k / self.samples
    }
}

/// Writes an archive of samples whose files are in a folder.
pub(super) fn write_archive(path: &Path, folder: &Path, samples: &[&Written]) -> Result<()> {
    io::write_through(path, |out| pack(out, folder, samples))
}

/// Whether an archive has this many samples and ends after the last of their files.
pub(super) fn is_whole(path: &Path, samples: u64) -> bool {
    path.is_file() && samples_in(path).is_ok_and(|found| found == Some(samples))
}

/// Number of samples in an archive; none if its end is missing.
fn samples_in(path: &Path) -> std::io::Result<Option<u64>> {
    let file = File::open(path)?;
    let bytes = file.metadata()?.len();
    let (mut keys, mut end) = (BTreeSet::new(), 0);
    for entry in tar::Archive::new(file).entries_with_seek()? {
        let entry = entry?;
        end = end_of(&entry);
        keys.insert(key_of(&entry.path_bytes()).to_vec());
    }
    // Two blocks of zeros.
    let is_complete = bytes == end.saturating_add(2 * BLOCK_BYTES);
    Ok(is_complete.then_some(keys.len() as u64))
}

/// Block size of tar archives.
const BLOCK_BYTES: u64 = 512;

fn end_of(entry: &tar::Entry<'_, impl Read>) -> u64 {
    let blocks = entry.size().div_ceil(BLOCK_BYTES);
    let bytes = blocks.saturating_mul(BLOCK_BYTES);
    entry.raw_file_position().saturating_add(bytes)
}

/// The common start of the names of a sample's files.
fn key_of(name: &[u8]) -> &[u8] {
    name.split(|&byte| byte == b'.').next().unwrap_or(name)
}

/// Path of an archive of a dataset.
pub(super) fn archive(folder: &Path, part: Part, i: u64) -> PathBuf {
    folder
        .join(KIND)
        .join(format!("{}-{i:06}.tar", part.name()))
}

fn pack(out: &mut dyn Write, folder: &Path, samples: &[&Written]) -> std::io::Result<()> {
    let mut tar = tar::Builder::new(out);
    for sample in samples {
        for (name, file) in named(sample) {
            let file = open_inside(folder, file)?;
            let mut header = header_of(&file)?;
            tar.append_data(&mut header, name, file)?;
        }
    }
    tar.finish()
}

fn open_inside(folder: &Path, file: &Path) -> std::io::Result<File> {
    let file = io::inside(folder, file).map_err(std::io::Error::other)?;
    File::open(&file).map_err(|e| std::io::Error::other(Error::file(&file, e)))
}

/// Without owner and time, so that the same files give the same archive.
fn header_of(file: &File) -> std::io::Result<tar::Header> {
    let mut header = tar::Header::new_ustar();
    header.set_size(file.metadata()?.len());
    header.set_mode(FILE_MODE);
    header.set_mtime(0);
    Ok(header)
}

/// Removes the archives of a dataset that had other samples before.
fn remove_archives_but(kept: &BTreeSet<PathBuf>, folder: &Path, part: Part) -> Result<()> {
    let folder = folder.join(KIND);
    for entry in io::entries(&folder)? {
        let path = entry.path();
        if is_archive(&entry.file_name().to_string_lossy(), part) && !kept.contains(&path) {
            std::fs::remove_file(&path).map_err(|e| Error::file(&path, e))?;
        }
    }
    Ok(())
}

fn is_archive(name: &str, part: Part) -> bool {
    name.starts_with(&format!("{}-", part.name())) && name.ends_with(".tar")
}

/// Digits of a sample's number: enough to keep names in order up to the largest dataset.
const KEY_DIGITS: usize = 9;

/// The files of a sample and their names in an archive.
fn named(sample: &Written) -> Vec<(String, &Path)> {
    let mut named: Vec<(String, &Path)> = Vec::new();
    for file in &sample.files {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        let key = format!("{:0KEY_DIGITS$}", sample.k);
        let mut name = format!("{key}.{extension}");
        if named.iter().any(|(known, _)| *known == name) {
            let kind = file.iter().next().unwrap_or_default().to_string_lossy();
            name = format!("{key}.{kind}.{extension}");
        }
        named.push((name, file));
    }
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_one_kind_get_names_of_their_own() {
        let files = [
            "images/val/000007.png",
            "scenes/val/000007.json",
            "coco/val/000007.json",
        ]
        .map(PathBuf::from);
        let sample = Written {
            k: 7,
            part: Part::Val,
            files: files.to_vec(),
        };
        let names: Vec<_> = named(&sample).into_iter().map(|(name, _)| name).collect();
        assert_eq!(
            names,
            ["000000007.png", "000000007.json", "000000007.coco.json"]
        );
    }
}
