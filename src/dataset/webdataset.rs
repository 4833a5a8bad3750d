//! Samples in tar archives that are read from front to back: WebDataset.

use crate::dataset::{Entry, Part, Writer, Written};
use crate::error::{Error, Result};
use crate::io;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes `webdataset/{train,val}-NNNNNN.tar`, each with the files of so many samples in order of
/// number.
///
/// Files of a sample are called by its number: `000012.png`, `000012.json`; where two writers have
/// one of the same kind, the later one's is called `000012.FOLDER.json` after its folder. There is
/// no empty archive. Times and owners are zero, so the same samples give the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WebDataset {
    /// Samples in an archive, at least 1. Default: 500.
    pub samples: usize,
}

impl Default for WebDataset {
    fn default() -> Self {
        Self { samples: 500 }
    }
}

/// Its folder.
const KIND: &str = "webdataset";

/// Everyone may read, the owner may write.
const FILE_MODE: u32 = 0o644;

impl Writer for WebDataset {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "webdataset": self })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        if self.samples == 0 {
            return Err(Error::value(
                "labels.webdataset.samples",
                "0, expected at least 1",
            ));
        }
        io::create_folder(folder.join(KIND))
    }

    fn write(&self, _folder: &Path, _entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        Ok(Vec::new())
    }

    fn for_trainers(&self) -> Vec<PathBuf> {
        Part::ALL.map(|part| archive(Path::new(""), part, 0)).into()
    }

    fn finish(&self, folder: &Path, _classes: &[String], samples: &[Written]) -> Result<()> {
        for part in Part::ALL {
            let of_part = samples.iter().filter(|sample| sample.part == part);
            let of_part: Vec<_> = of_part.collect();
            self.write_archives(folder, part, &of_part)?;
        }
        Ok(())
    }
}

impl WebDataset {
    fn write_archives(&self, folder: &Path, part: Part, samples: &[&Written]) -> Result<()> {
        let archives = samples.chunks(self.samples.max(1));
        let count = archives.len();
        for (i, samples) in archives.enumerate() {
            io::write_through(&archive(folder, part, i), |out| pack(out, folder, samples))?;
        }
        remove_archives_from(folder, part, count)
    }
}

fn archive(folder: &Path, part: Part, i: usize) -> PathBuf {
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

/// Removes the archives of a dataset that had more samples before.
fn remove_archives_from(folder: &Path, part: Part, first: usize) -> Result<()> {
    for i in first.. {
        let path = archive(folder, part, i);
        if !path.exists() {
            break;
        }
        std::fs::remove_file(&path).map_err(|e| Error::file(&path, e))?;
    }
    Ok(())
}

/// The files of a sample and their names in an archive.
fn named(sample: &Written) -> Vec<(String, &Path)> {
    let mut named: Vec<(String, &Path)> = Vec::new();
    for file in &sample.files {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        let mut name = format!("{:06}.{extension}", sample.k);
        if named.iter().any(|(known, _)| *known == name) {
            let kind = file.iter().next().unwrap_or_default().to_string_lossy();
            name = format!("{:06}.{kind}.{extension}", sample.k);
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
        assert_eq!(names, ["000007.png", "000007.json", "000007.coco.json"]);
    }
}
