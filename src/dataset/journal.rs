//! The journal: which samples of a dataset are finished.
//!
//! A sample exists if and only if its line is whole and its files have the size that the line says. Lines are added in
//! the order in which samples finish; [`Journal::close`] puts them in order of number, so a finished folder does not tell
//! how it was made.
//!
//! A line is a JSON object whose last key, `crc32`, is the checksum of the bytes before it: a line that was torn or edited
//! counts as not there, and its sample is made again. Lines of datasets that were begun before there were checksums are
//! read as they are, by what reads only.

use crate::dataset::folder::{self, IDENTITY};
use crate::dataset::{Entry, Inputs, Obstructed, Part, Plan, Written};
use crate::error::{Error, Result};
use crate::io::{self, Checksum};
use crate::label::knotted;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

/// Name of the journal in a dataset's folder.
pub const JOURNAL: &str = "index.jsonl";

/// What the journal says of one finished sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Line {
    /// Its number.
    pub(crate) k: u64,
    /// Its part.
    pub(crate) part: Part,
    /// Objects of each class in the picture (of the class they are labelled as, if they are), and how many have a label.
    pub(crate) classes: Vec<[u32; 2]>,
    /// Objects that something lies over.
    #[serde(default)]
    pub(crate) obstructed: u32,
    /// Objects that lie over each other in a circle.
    pub(crate) knotted: u32,
    /// Scenes thrown away.
    pub(crate) retries: u32,
    /// Its files.
    pub(crate) files: Vec<Finished>,
}

/// A finished file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Finished {
    /// Below the dataset's folder, with `/` between folders.
    pub(crate) path: String,
    /// Its size.
    pub(crate) bytes: u64,
    /// CRC-32 of its bytes.
    pub(crate) crc32: u32,
}

impl Line {
    /// The line of a sample whose files have just been written.
    pub(crate) fn of(entry: &Entry<'_>, folder: &Path, files: &[PathBuf]) -> Result<Self> {
        let objects = &entry.sample.labels.objects;
        let mut classes = vec![[0; 2]; entry.classes.len()];
        for object in objects {
            let label = entry
                .labelled
                .iter()
                .find(|label| label.object.id == object.id);
            let count = &mut classes[label.map_or(object.class, |label| label.class) as usize];
            count[0] += 1;
            count[1] += u32::from(label.is_some());
        }
        Ok(Self {
            k: entry.k,
            part: entry.part,
            classes,
            obstructed: objects.iter().filter(|object| !object.is_topmost()).count() as u32,
            knotted: knotted(objects).len() as u32,
            retries: entry.sample.rejected.len() as u32,
            files: files
                .iter()
                .map(|path| Finished::of(folder, path))
                .collect::<Result<_>>()?,
        })
    }

    /// What a writer needs to know to join it with others.
    pub(crate) fn written(&self) -> Written {
        let files = self
            .files
            .iter()
            .map(|file| file.path.split('/').collect())
            .collect();
        Written {
            k: self.k,
            part: self.part,
            files,
        }
    }

    /// The sample's file in a folder of the dataset: `images/`.
    ///
    /// # Errors
    /// When it has none, or none that lies in the dataset.
    pub(crate) fn file(&self, folder: &Path, kind: &str) -> Result<PathBuf> {
        let file = self.files.iter().find(|file| file.path.starts_with(kind));
        let file =
            file.ok_or_else(|| Error::file(folder, format!("sample {} has no {kind}", self.k)))?;
        io::inside(folder, &file.path)
    }

    /// Every file is there with its very bytes.
    fn is_whole(&self, folder: &Path) -> bool {
        self.files.iter().all(|file| file.differs(folder).is_none())
    }

    /// Every file is there in its full size.
    fn holds(&self, folder: &Path) -> bool {
        self.files
            .iter()
            .all(|file| file.length(folder) == Some(file.bytes))
    }
}

impl Finished {
    /// Reads the file back: what counts is what is on the disk.
    pub(crate) fn of(folder: &Path, path: &Path) -> Result<Self> {
        let Checksum { bytes, crc32 } = Checksum::of(io::inside(folder, path)?)?;
        let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
        Ok(Self {
            path: names.join("/"),
            bytes,
            crc32,
        })
    }

    /// What it was when it was written.
    pub(crate) fn checksum(&self) -> Checksum {
        Checksum {
            bytes: self.bytes,
            crc32: self.crc32,
        }
    }

    /// Its length now; none where it is not there.
    fn length(&self, folder: &Path) -> Option<u64> {
        io::length_inside(folder, &self.path).ok()
    }

    /// How the file on the disk differs from this.
    pub(crate) fn differs(&self, folder: &Path) -> Option<String> {
        let Self { path, bytes, crc32 } = self;
        match self.length(folder) {
            None => Some(format!("{path} is missing")),
            Some(length) if length != *bytes => {
                Some(format!("{path} has {length} bytes, expected {bytes}"))
            }
            Some(_) => match Self::of(folder, Path::new(path)) {
                Ok(found) if found.crc32 == *crc32 => None,
                Ok(_) => Some(format!("{path} has other bytes than when it was written")),
                Err(e) => Some(e.to_string()),
            },
        }
    }

    /// Fails where the path is none of a sample's: outside of the folder, hidden, or a file of the dataset as a whole.
    fn check(&self) -> std::result::Result<(), String> {
        io::below("", &self.path).map_err(|e| e.to_string())?;
        let is_hidden = self.path.split('/').any(|step| step.starts_with('.'));
        if is_hidden || [JOURNAL, IDENTITY].contains(&self.path.as_str()) {
            return Err(format!(
                "file: \"{}\", expected a file of a sample",
                self.path
            ));
        }
        Ok(())
    }
}

/// Lines whose files may not be on the disk yet: a run brings everything there at least this often.
const UNSURE: usize = 2 * 256;

/// An open journal.
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    lines: BTreeMap<u64, Line>,
}

impl Journal {
    /// Opens the journal of a folder, or starts one. Lines that are torn, or whose files are not there, are forgotten.
    ///
    /// What was written last may not have reached the disk when a machine went down: the files of the last lines are
    /// compared by checksum.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(JOURNAL);
        let fail = |e: std::io::Error| Error::file(&path, e);
        let mut file = io::open_own(&path)?;
        let read = read(BufReader::new(&file), false).map_err(fail)?;
        let damaged = read.iter().filter(|(_, line)| line.is_err()).count();
        if damaged > 0 {
            log::warn!(
                "{}: {damaged} lines are damaged; their samples are made again",
                path.display()
            );
        }
        let known: Vec<Line> = read.into_iter().filter_map(|(_, line)| line.ok()).collect();
        let last = known.len().saturating_sub(UNSURE);
        let holds = |(i, line): &(usize, Line)| {
            if *i < last {
                line.holds(folder)
            } else {
                line.is_whole(folder)
            }
        };
        let held: Vec<_> = known.into_par_iter().enumerate().filter(holds).collect();
        let lines = held.into_iter().map(|(_, line)| (line.k, line)).collect();
        if is_cut(&file).map_err(fail)? {
            file.write_all(b"\n").map_err(fail)?;
        }
        Ok(Self { path, file, lines })
    }

    /// Sample `k` is finished.
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

    /// Adds a finished sample.
    pub(crate) fn add(&mut self, line: Line) -> Result<()> {
        let text = line_text(&line);
        self.file
            .write_all(text.as_bytes())
            .map_err(|e| Error::file(&self.path, e))?;
        self.lines.insert(line.k, line);
        Ok(())
    }

    /// Number of finished samples below `count` that are wanted.
    pub(crate) fn count(&self, count: u64, wanted: impl Fn(u64) -> bool) -> u64 {
        self.lines
            .range(..count)
            .filter(|(k, _)| wanted(**k))
            .count() as u64
    }

    /// Puts the lines in order and returns those of the samples below `count`.
    pub(crate) fn close(mut self, count: u64) -> Result<Vec<Line>> {
        write(&self.path, self.lines.values())?;
        self.lines.split_off(&count);
        Ok(self.lines.into_values().collect())
    }
}

/// The last line has no end: what follows would be taken for a part of it.
fn is_cut(mut file: &File) -> std::io::Result<bool> {
    if file.metadata()?.len() == 0 {
        return Ok(false);
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut last)?;
    Ok(last != *b"\n")
}

/// Looks whether the files of a dataset are as they were written, and has those made again that are not: returns how many
/// samples are good and how many the next run makes again. That run also reads every input file anew.
///
/// # Errors
/// A folder that holds no dataset, one that an older petcomp began, or one that a run is writing.
pub fn repair(folder: &Path) -> Result<(usize, usize)> {
    let _lock = folder::reclaim(folder)?;
    Inputs::forget(folder);
    let path = folder.join(JOURNAL);
    // Made where it is not there: a run may have ended before its first sample.
    let file = io::open_own(&path)?;
    let read = read(BufReader::new(file), false).map_err(|e| Error::file(&path, e))?;
    let all = read.len();
    let lines: BTreeMap<u64, Line> = read
        .into_iter()
        .filter_map(|(_, line)| line.ok())
        .map(|l| (l.k, l))
        .collect();
    let lines: Vec<Line> = lines.into_values().collect();
    let whole: Vec<&Line> = lines
        .par_iter()
        .filter(|line| line.is_whole(folder))
        .collect();
    write(&path, whole.iter().copied())?;
    Ok((whole.len(), all - whole.len()))
}

/// The whole lines of a folder's journal, in order of number.
pub(crate) fn lines_of(folder: &Path) -> Result<Vec<Line>> {
    let read = numbered_lines_of(folder)?;
    let damaged = read.iter().filter(|(_, line)| line.is_err()).count();
    if damaged > 0 {
        log::warn!(
            "{}: {damaged} lines are damaged and left out",
            folder.join(JOURNAL).display()
        );
    }
    let lines: BTreeMap<u64, Line> = read
        .into_iter()
        .filter_map(|(_, line)| line.ok())
        .map(|l| (l.k, l))
        .collect();
    Ok(lines.into_values().collect())
}

/// Lines by their place in the file, from 1: what each says, or what is wrong with it.
pub(crate) type NumberedLines = Vec<(usize, std::result::Result<Line, String>)>;

/// Every line of a folder's journal.
pub(crate) fn numbered_lines_of(folder: &Path) -> Result<NumberedLines> {
    let path = io::inside(folder, JOURNAL)?;
    let is_older = folder::is_older(folder)?;
    let fail = |e: std::io::Error| Error::file(&path, e);
    read(BufReader::new(File::open(&path).map_err(fail)?), is_older).map_err(fail)
}

/// Longest line of a journal, bytes: a sample has a handful of files.
const LONGEST_LINE: u64 = 1 << 20;

/// The lines of a journal; `is_older` says that lines without a checksum are taken as well.
pub(crate) fn read(mut from: impl BufRead, is_older: bool) -> std::io::Result<NumberedLines> {
    let mut lines = Vec::new();
    for i in 1.. {
        let mut text = Vec::new();
        if from
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut text)?
            == 0
        {
            break;
        }
        if text.len() as u64 == LONGEST_LINE {
            return Err(std::io::Error::other(format!(
                "line {i} is longer than {LONGEST_LINE} bytes, expected a journal"
            )));
        }
        let text = text.trim_ascii();
        if !text.is_empty() {
            lines.push((i, parse(text, is_older)));
        }
    }
    Ok(lines)
}

/// A line, if it is as it was written.
fn parse(text: &[u8], is_older: bool) -> std::result::Result<Line, String> {
    let line: Line = match unsealed(text) {
        Some((body, crc32)) if crc32fast::hash(body) == crc32 => {
            serde_json::from_slice(&[body, b"}"].concat())
        }
        Some(_) => return Err("has other bytes than when it was written".into()),
        None if is_older => serde_json::from_slice(text),
        None => return Err("has no checksum, or is torn".into()),
    }
    .map_err(|e| e.to_string())?;
    line.files.iter().try_for_each(Finished::check)?;
    Ok(line)
}

/// Where a line's checksum stands.
const SEAL: &str = ",\"crc32\":";

/// The part of a line that its checksum is of, and the checksum.
fn unsealed(text: &[u8]) -> Option<(&[u8], u32)> {
    let (body, crc32) = std::str::from_utf8(text)
        .ok()?
        .strip_suffix('}')?
        .rsplit_once(SEAL)?;
    Some((body.as_bytes(), crc32.parse().ok()?))
}

fn line_text(line: &Line) -> String {
    let json = serde_json::to_string(line).expect("numbers, strings and lists are JSON");
    let body = &json[..json.len() - 1];
    format!("{body}{SEAL}{}}}\n", crc32fast::hash(body.as_bytes()))
}

/// Writes a journal anew.
fn write<'a>(path: &Path, lines: impl Iterator<Item = &'a Line>) -> Result<()> {
    let mut lines = lines;
    io::write_through(path, |out| {
        lines.try_for_each(|line| out.write_all(line_text(line).as_bytes()))
    })
}

/// What a dataset holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DatasetCounts {
    /// Images asked for.
    pub asked: u64,
    /// Images in the folder.
    pub images: u64,
    /// Of these, images for validation.
    pub val: u64,
    /// Images made by this run; the others were there.
    pub made: u64,
    /// Objects in the images, labelled or not.
    pub objects: u64,
    /// Objects that have a label.
    pub labelled: u64,
    /// Objects that something lies over, labelled or not.
    pub obstructed: u64,
    /// Objects in which others lie over each other in a circle: none of them is on top.
    pub knotted: u64,
    /// Scenes that were drawn and thrown away.
    pub retries: u64,
    /// The same by class, in order.
    pub classes: Vec<ClassCount>,
    /// What became of the labels of objects that something lies over.
    pub policy: Obstructed,
    /// Files below the folder that trainers are given, as far as they are there.
    pub for_trainers: Vec<PathBuf>,
}

/// Objects of one class.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassCount {
    /// Name of the class.
    pub name: String,
    /// Objects in the images, labelled or not.
    pub objects: u64,
    /// Objects that have a label.
    pub labelled: u64,
}

impl DatasetCounts {
    /// Objects that got no label.
    pub fn dropped(&self) -> u64 {
        self.objects.saturating_sub(self.labelled)
    }

    /// Counts what the lines of a plan's journal say.
    pub(crate) fn of(lines: &[Line], plan: &Plan, asked: u64, made: u64) -> Self {
        let class = |(i, name): (usize, &String)| {
            let counts = lines.iter().filter_map(|line| line.classes.get(i));
            let [objects, labelled] = counts.fold([0; 2], |[a, b], &[c, d]| {
                [a + u64::from(c), b + u64::from(d)]
            });
            ClassCount {
                name: name.clone(),
                objects,
                labelled,
            }
        };
        let classes: Vec<_> = plan.classes.iter().enumerate().map(class).collect();
        let for_trainers = plan.writers.iter().flat_map(|writer| writer.for_trainers());
        Self {
            asked,
            images: lines.len() as u64,
            val: lines.iter().filter(|line| line.part == Part::Val).count() as u64,
            made,
            objects: classes.iter().map(|c| c.objects).sum(),
            labelled: classes.iter().map(|c| c.labelled).sum(),
            obstructed: lines.iter().map(|line| u64::from(line.obstructed)).sum(),
            knotted: lines.iter().map(|line| u64::from(line.knotted)).sum(),
            retries: lines.iter().map(|line| u64::from(line.retries)).sum(),
            classes,
            policy: plan.obstructed,
            for_trainers: for_trainers
                .filter(|path| plan.folder.join(path).exists())
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Line {
        let file = Finished {
            path: "labels/val/000000.txt".into(),
            bytes: 3,
            crc32: 7,
        };
        let classes = vec![[2, 1], [1, 0]];
        Line {
            k: 0,
            part: Part::Val,
            classes,
            obstructed: 2,
            knotted: 0,
            retries: 0,
            files: vec![file],
        }
    }

    /// The lines of a text that are whole.
    fn whole(text: &str, is_older: bool) -> Vec<Line> {
        read(text.as_bytes(), is_older)
            .unwrap()
            .into_iter()
            .filter_map(|(_, line)| line.ok())
            .collect()
    }

    /// A line with another body and the checksum of that.
    fn resealed(text: &str, from: &str, to: &str) -> String {
        let (body, _) = unsealed(text.trim().as_bytes()).unwrap();
        let body = std::str::from_utf8(body).unwrap().replace(from, to);
        format!("{body}{SEAL}{}}}\n", crc32fast::hash(body.as_bytes()))
    }

    #[test]
    fn a_line_reads_back_and_an_edited_one_does_not() {
        let text = line_text(&line());
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
        assert_eq!(
            whole(older, true),
            [Line {
                obstructed: 0,
                ..line()
            }]
        );
        assert_eq!(whole(older, false), []);
    }

    #[test]
    fn a_line_names_files_of_its_sample_alone() {
        let text = line_text(&line());
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
            assert_eq!(
                whole(&resealed(&text, "labels/val/000000.txt", bad), false),
                [],
                "{bad}"
            );
        }
        assert_eq!(
            whole(
                &resealed(&text, "labels/val/000000.txt", "labels/val/0.txt"),
                false
            )
            .len(),
            1
        );
    }

    #[test]
    fn counts_that_no_picture_has_are_refused() {
        let text = line_text(&line());
        assert_eq!(
            whole(
                &resealed(&text, "[[2,1]", "[[18446744073709551615,1]"),
                false
            ),
            []
        );
    }

    #[test]
    fn a_line_without_an_end_is_no_journal() {
        let zeros = std::io::repeat(0).take(LONGEST_LINE + 1);
        assert!(
            read(BufReader::new(zeros), false)
                .unwrap_err()
                .to_string()
                .contains("line 1 is longer than")
        );
    }
}
