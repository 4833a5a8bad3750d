//! The journal: which samples of a dataset are finished.
//!
//! A sample exists if and only if its line is whole and its files have the size that the line says. Lines are added in
//! the order in which samples finish; [`Journal::close`] puts them in order of number, so a finished folder does not tell
//! how it was made.

use crate::dataset::{Entry, Part, Written, folder};
use crate::error::{Error, Result};
use crate::io;
use crate::label::knotted;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

/// Name of the journal in a dataset's folder.
pub(crate) const JOURNAL: &str = "index.jsonl";

/// What the journal says of one finished sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Line {
    /// Its number.
    pub(crate) k: u64,
    /// Its part.
    pub(crate) part: Part,
    /// Objects of each class in the picture (of the class they are labelled as, if they are), and how many have a label.
    pub(crate) classes: Vec<[u64; 2]>,
    /// Objects that lie over each other in a circle.
    pub(crate) knotted: u64,
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
        let mut classes = vec![[0; 2]; entry.classes.len()];
        for object in &entry.sample.labels.objects {
            let label = entry.labelled.iter().find(|label| label.object.id == object.id);
            let count = &mut classes[label.map_or(object.class, |label| label.class) as usize];
            count[0] += 1;
            count[1] += u64::from(label.is_some());
        }
        Ok(Self {
            k: entry.k,
            part: entry.part,
            classes,
            knotted: knotted(&entry.sample.labels.objects).len() as u64,
            retries: entry.sample.rejected.len() as u32,
            files: files.iter().map(|path| Finished::of(folder, path)).collect::<Result<_>>()?,
        })
    }

    /// What a writer needs to know to join it with others.
    pub(crate) fn written(&self) -> Written {
        let files = self.files.iter().map(|file| file.path.split('/').collect()).collect();
        Written { k: self.k, part: self.part, files }
    }

    /// Every file is there with its very bytes.
    fn is_whole(&self, folder: &Path) -> bool {
        self.files.iter().all(|file| Finished::of(folder, Path::new(&file.path)).is_ok_and(|found| found == *file))
    }

    /// Every file is there in its full size.
    fn holds(&self, folder: &Path) -> bool {
        self.files.iter().all(|file| std::fs::metadata(folder.join(&file.path)).is_ok_and(|m| m.len() == file.bytes))
    }
}

impl Finished {
    /// Reads the file back: what counts is what is on the disk.
    pub(crate) fn of(folder: &Path, path: &Path) -> Result<Self> {
        let full = folder.join(path);
        let bytes = std::fs::read(&full).map_err(|e| Error::file(&full, e))?;
        let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
        Ok(Self { path: names.join("/"), bytes: bytes.len() as u64, crc32: crc32fast::hash(&bytes) })
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
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(fail)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(fail)?;
        let told: Vec<Line> = read(&text).collect();
        let last = told.len().saturating_sub(UNSURE);
        let holds = |(i, line): &(usize, Line)| if *i < last { line.holds(folder) } else { line.is_whole(folder) };
        let lines = told.into_iter().enumerate().filter(holds).map(|(_, line)| (line.k, line)).collect();
        if text.last().is_some_and(|&end| end != b'\n') {
            log::warn!("{}: the last line is torn; its sample is made again", path.display());
            file.write_all(b"\n").map_err(fail)?;
        }
        Ok(Self { path, file, lines })
    }

    /// Sample `k` is finished.
    pub(crate) fn has(&self, k: u64) -> bool {
        self.lines.contains_key(&k)
    }

    /// Adds a finished sample.
    pub(crate) fn add(&mut self, line: Line) -> Result<()> {
        let text = line_text(&line);
        self.file.write_all(text.as_bytes()).map_err(|e| Error::file(&self.path, e))?;
        self.lines.insert(line.k, line);
        Ok(())
    }

    /// Number of finished samples below `count` that are wanted.
    pub(crate) fn count(&self, count: u64, wanted: impl Fn(u64) -> bool) -> u64 {
        self.lines.range(..count).filter(|(k, _)| wanted(**k)).count() as u64
    }

    /// Puts the lines in order and returns those of the samples below `count`.
    pub(crate) fn close(mut self, count: u64) -> Result<Vec<Line>> {
        let text: String = self.lines.values().map(line_text).collect();
        io::write_text(&self.path, &text)?;
        self.lines.split_off(&count);
        Ok(self.lines.into_values().collect())
    }
}

/// Looks whether the files of a dataset are as they were written, and has those made again that are not: returns how many
/// samples are good and how many the next run makes again.
///
/// # Errors
/// A folder that holds no dataset, or that a run is writing.
pub fn mend(folder: &Path) -> Result<(usize, usize)> {
    let _lock = folder::reclaim(folder)?;
    let lines = lines_of(folder)?;
    let whole: Vec<&Line> = lines.par_iter().filter(|line| line.is_whole(folder)).collect();
    let text: String = whole.iter().map(|line| line_text(line)).collect();
    io::write_text(folder.join(JOURNAL), &text)?;
    Ok((whole.len(), lines.len() - whole.len()))
}

/// The lines of a folder's journal, in order of number.
pub(crate) fn lines_of(folder: &Path) -> Result<Vec<Line>> {
    let path = folder.join(JOURNAL);
    let text = std::fs::read(&path).map_err(|e| Error::file(&path, e))?;
    let lines: BTreeMap<u64, Line> = read(&text).map(|line| (line.k, line)).collect();
    Ok(lines.into_values().collect())
}

/// The whole lines of a journal.
pub(crate) fn read(text: &[u8]) -> impl Iterator<Item = Line> {
    text.split(|&b| b == b'\n').filter_map(|line| serde_json::from_slice(line).ok())
}

fn line_text(line: &Line) -> String {
    let json = serde_json::to_string(line).expect("numbers, strings and lists are JSON");
    json + "\n"
}

/// What a dataset holds.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Report {
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
    /// Objects in which others lie over each other in a circle: none of them is on top.
    pub knotted: u64,
    /// Scenes that were drawn and thrown away.
    pub retries: u64,
    /// The same by class, in order.
    pub classes: Vec<ClassCount>,
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

impl Report {
    /// Objects that got no label because something lies over them.
    pub fn dropped(&self) -> u64 {
        self.objects - self.labelled
    }

    /// Counts what the lines of a journal say.
    pub(crate) fn of(lines: &[Line], names: &[String], asked: u64, made: u64) -> Self {
        let class = |(i, name): (usize, &String)| {
            let counts = lines.iter().filter_map(|line| line.classes.get(i));
            let [objects, labelled] = counts.fold([0; 2], |[a, b], [c, d]| [a + c, b + d]);
            ClassCount { name: name.clone(), objects, labelled }
        };
        let classes: Vec<_> = names.iter().enumerate().map(class).collect();
        Self {
            asked,
            images: lines.len() as u64,
            val: lines.iter().filter(|line| line.part == Part::Val).count() as u64,
            made,
            objects: classes.iter().map(|c| c.objects).sum(),
            labelled: classes.iter().map(|c| c.labelled).sum(),
            knotted: lines.iter().map(|line| line.knotted).sum(),
            retries: lines.iter().map(|line| u64::from(line.retries)).sum(),
            classes,
        }
    }
}
