//! A line of the journal: what is known of a finished sample, sealed by a checksum.
//!
//! A line is a JSON object whose last key, `crc32`, is the checksum of the bytes before it: a line
//! that was torn or edited is ignored, and its sample is generated again. Lines of datasets that
//! were started before there were checksums are accepted as they are, by read-only functions.

use crate::dataset::folder::{IDENTITY, JOURNAL};
use crate::dataset::{Entry, Part, Written};
use crate::error::{Error, Result};
use crate::io::{self, Checksum};
use crate::label::cyclic_overlaps;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What the journal records of one finished sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JournalLine {
    /// Its number.
    pub(crate) k: u64,
    /// Its part.
    pub(crate) part: Part,
    /// Objects of each class in the picture (of the class they are labelled as, if they are), and
    /// how many have a label that is not to be ignored.
    pub(crate) classes: Vec<[u32; 2]>,
    /// Objects that something covers.
    #[serde(default)]
    pub(crate) obstructed: u32,
    /// Objects in cyclic overlap.
    pub(crate) knotted: u32,
    /// Number of rejected scenes.
    pub(crate) retries: u32,
    /// Its files.
    pub(crate) files: Vec<WrittenFile>,
}

/// A finished file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenFile {
    /// Below the dataset's folder, with `/` between folders.
    pub(crate) path: String,
    /// Its size.
    pub(crate) bytes: u64,
    /// CRC-32 of its bytes.
    pub(crate) crc32: u32,
}

impl JournalLine {
    /// The line of a sample whose files have just been written.
    pub(crate) fn new(entry: &Entry<'_>, folder: &Path, files: &[PathBuf]) -> Result<Self> {
        let objects = &entry.sample.labels.objects;
        let obstructed = objects.iter().filter(|object| !object.is_topmost());
        let files = files
            .iter()
            .map(|path| WrittenFile::read_back(folder, path));
        Ok(Self {
            k: entry.k,
            part: entry.part,
            classes: count_by_class(entry),
            obstructed: obstructed.count() as u32,
            knotted: cyclic_overlaps(objects).len() as u32,
            retries: entry.sample.rejected_scenes() as u32,
            files: files.collect::<Result<_>>()?,
        })
    }

    /// Reads a line if it is unchanged since it was written; `is_older` also accepts lines without
    /// a checksum.
    pub(crate) fn parse(text: &[u8], is_older: bool) -> std::result::Result<Self, String> {
        let line = without_seal(text, is_older)?;
        let line: Self = serde_json::from_slice(&line).map_err(|e| e.to_string())?;
        line.files.iter().try_for_each(WrittenFile::check_path)?;
        Ok(line)
    }

    /// Its text with the checksum and the line end.
    pub(crate) fn text(&self) -> String {
        let json = serde_json::to_string(self).expect("numbers, strings and lists are JSON");
        let body = &json[..json.len() - 1];
        format!("{body}{SEAL}{}}}\n", crc32fast::hash(body.as_bytes()))
    }

    /// What a writer needs to join it with others.
    pub(crate) fn written(&self) -> Written {
        Written {
            k: self.k,
            part: self.part,
            files: self.files.iter().map(WrittenFile::local_path).collect(),
        }
    }

    /// The sample's file in a folder of the dataset (`images/`), as recorded in the journal.
    ///
    /// # Errors
    /// If it has none, or none that is in the dataset.
    pub(crate) fn file_name(&self, folder: &Path, kind: &str) -> Result<&str> {
        let Some(file) = self.files.iter().find(|file| file.path.starts_with(kind)) else {
            let what = format!("sample {} has no {kind}", self.k);
            return Err(Error::file(folder, what));
        };
        io::inside(folder, &file.path)?;
        Ok(&file.path)
    }

    /// The path of that file.
    ///
    /// # Errors
    /// As [`file_name`](Self::file_name).
    pub(crate) fn file(&self, folder: &Path, kind: &str) -> Result<PathBuf> {
        io::inside(folder, self.file_name(folder, kind)?)
    }

    /// Whether every file is present with exactly the recorded bytes.
    pub(crate) fn has_same_bytes(&self, folder: &Path) -> bool {
        let mut files = self.files.iter();
        files.all(|file| file.difference(folder).is_none())
    }

    /// Whether every file is present: with its full size if it is certainly synced, else with
    /// exactly the recorded bytes.
    pub(crate) fn has_files(&self, folder: &Path, is_synced: bool) -> bool {
        if !is_synced {
            return self.has_same_bytes(folder);
        }
        let mut files = self.files.iter();
        files.all(|file| file.length(folder) == Some(file.bytes))
    }
}

/// For each class its objects in the picture, and how many of them have a label that is not to be
/// ignored (YOLO has no labels to be ignored).
fn count_by_class(entry: &Entry<'_>) -> Vec<[u32; 2]> {
    let mut classes = vec![[0; 2]; entry.classes.len()];
    for object in &entry.sample.labels.objects {
        let label = entry.label_of(object.id);
        let class = label.map_or(object.class, |label| label.class);
        let count = &mut classes[class as usize];
        count[0] += 1;
        count[1] += u32::from(label.is_some_and(|label| !label.ignored));
    }
    classes
}

impl WrittenFile {
    /// Its path below the dataset's folder, in this system's notation.
    fn local_path(&self) -> PathBuf {
        self.path.split('/').collect()
    }

    /// Reads the file back: what counts is what is on the disk.
    pub(crate) fn read_back(folder: &Path, path: &Path) -> Result<Self> {
        let Checksum { bytes, crc32 } = Checksum::from_file(io::inside(folder, path)?)?;
        let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
        Ok(Self {
            path: names.join("/"),
            bytes,
            crc32,
        })
    }

    /// Its checksum when it was written.
    pub(crate) fn checksum(&self) -> Checksum {
        Checksum {
            bytes: self.bytes,
            crc32: self.crc32,
        }
    }

    /// Its length now; none if it is missing.
    fn length(&self, folder: &Path) -> Option<u64> {
        io::length_inside(folder, &self.path).ok()
    }

    /// How the file on the disk differs from this.
    pub(crate) fn difference(&self, folder: &Path) -> Option<String> {
        let Self { path, bytes, .. } = self;
        match self.length(folder) {
            None => Some(format!("{path} is missing")),
            Some(length) if length == *bytes => self.changed_content(folder),
            Some(length) => Some(format!("{path} has {length} bytes, expected {bytes}")),
        }
    }

    fn changed_content(&self, folder: &Path) -> Option<String> {
        let path = &self.path;
        match Self::read_back(folder, Path::new(path)) {
            Ok(found) if found.crc32 == self.crc32 => None,
            Ok(_) => Some(format!("{path} has changed since it was written")),
            Err(e) => Some(e.to_string()),
        }
    }

    /// Fails if the path cannot be a sample's: outside the folder, hidden, or a file of the dataset
    /// as a whole.
    fn check_path(&self) -> std::result::Result<(), String> {
        io::below("", &self.path).map_err(|e| e.to_string())?;
        let path = self.path.as_str();
        let is_hidden = path.split('/').any(|step| step.starts_with('.'));
        if is_hidden || [JOURNAL, IDENTITY].contains(&path) {
            return Err(format!("file: \"{path}\", expected a file of a sample"));
        }
        Ok(())
    }
}

/// What precedes a line's checksum.
const SEAL: &str = ",\"crc32\":";

/// The line without its seal, if the checksum matches its bytes; lines of older datasets have no
/// seal.
fn without_seal(text: &[u8], is_older: bool) -> std::result::Result<Vec<u8>, String> {
    match split_seal(text) {
        Some((body, crc32)) if crc32fast::hash(body) == crc32 => Ok([body, b"}"].concat()),
        Some(_) => Err("has changed since it was written".into()),
        None if is_older => Ok(text.to_vec()),
        None => Err("has no checksum, or is truncated".into()),
    }
}

/// The part of a line that its checksum covers, and the checksum.
fn split_seal(text: &[u8]) -> Option<(&[u8], u32)> {
    let (body, crc32) = std::str::from_utf8(text)
        .ok()?
        .strip_suffix('}')?
        .rsplit_once(SEAL)?;
    Some((body.as_bytes(), crc32.parse().ok()?))
}

/// A line of a sample with these files.
#[cfg(test)]
pub(crate) fn test_line(k: u64, files: &[&str]) -> JournalLine {
    let files = files.iter().map(|path| WrittenFile {
        path: (*path).into(),
        bytes: 3,
        crc32: 7,
    });
    JournalLine {
        k,
        part: Part::Train,
        classes: Vec::new(),
        obstructed: 0,
        knotted: 0,
        retries: 0,
        files: files.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> JournalLine {
        JournalLine {
            part: Part::Val,
            classes: vec![[2, 1], [1, 0]],
            obstructed: 2,
            ..test_line(0, &["labels/val/000000.txt"])
        }
    }

    /// The intact lines of a text.
    fn whole(text: &str, is_older: bool) -> Vec<JournalLine> {
        text.lines()
            .filter_map(|line| JournalLine::parse(line.as_bytes(), is_older).ok())
            .collect()
    }

    /// A line with another body and the checksum of that.
    fn resealed(text: &str, from: &str, to: &str) -> String {
        let (body, _) = split_seal(text.trim().as_bytes()).unwrap();
        let body = std::str::from_utf8(body).unwrap().replace(from, to);
        format!("{body}{SEAL}{}}}\n", crc32fast::hash(body.as_bytes()))
    }

    #[test]
    fn a_line_reads_back_and_an_edited_one_does_not() {
        let text = line().text();
        assert_eq!(whole(&text, false), [line()]);
        for (from, to) in [
            ("\"val\"", "\"train\""),
            ("[[2,1]", "[[2,2]"),
            ("{\"path\"", " {\"path\""),
            ("\"k\":0", "\"k\":1"),
        ] {
            assert_eq!(whole(&text.replace(from, to), false), [], "{from}");
        }
        for end in 0..text.len() - 1 {
            assert_eq!(whole(&text[..end], false), [], "cut at {end}");
        }
    }

    #[test]
    fn lines_of_older_datasets_have_no_checksum() {
        let older = r#"{"k":0,"part":"val","classes":[[2,1],[1,0]],"knotted":0,"retries":0,"files":[{"path":"labels/val/000000.txt","bytes":3,"crc32":7}]}"#;
        let expected = JournalLine {
            obstructed: 0,
            ..line()
        };
        assert_eq!(whole(older, true), [expected]);
        assert_eq!(whole(older, false), []);
    }

    #[test]
    fn a_line_names_files_of_its_sample_alone() {
        let text = line().text();
        let renamed = |name| whole(&resealed(&text, "labels/val/000000.txt", name), false);
        for bad in [
            "../evil.sh",
            "/etc/passwd",
            "a/../../b",
            ".lock",
            "labels/.x",
            "index.jsonl",
            "dataset.json",
            "",
        ] {
            assert_eq!(renamed(bad), [], "{bad}");
        }
        assert_eq!(renamed("labels/val/0.txt").len(), 1);
    }

    #[test]
    fn counts_that_no_picture_has_are_refused() {
        let text = line().text();
        let odd = resealed(&text, "[[2,1]", "[[18446744073709551615,1]");
        assert_eq!(whole(&odd, false), []);
    }
}
