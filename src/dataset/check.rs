//! Would trainers take this dataset? Every fault, with its place.

use crate::dataset::Part;
use crate::dataset::journal::{Finished, JOURNAL, Line};
use crate::dataset::yolo::LEAST_SIDE_PX;
use crate::dataset::yolo_yaml::DataYaml;
use crate::error::{Error, Result};
use crate::io;
use crate::pixel::PremulRgba;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Something that a trainer would refuse, drop or take for something else.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fault {
    /// The file, below the dataset's folder.
    pub path: PathBuf,
    /// Its line, from 1, where the fault is in one.
    pub line: Option<usize>,
    /// What is wrong, and what was expected.
    pub what: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.line.map_or(String::new(), |n| format!("{n}:"));
        write!(f, "{}:{line} {}", self.path.display(), self.what)
    }
}

/// What [`check`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Everything that is wrong, in order of file and line; empty for a good dataset.
    pub faults: Vec<Fault>,
    /// Images looked at.
    pub images: usize,
    /// Rows of label files for each class, in order.
    pub rows: Vec<usize>,
}

/// Checks a YOLO dataset as YOLOv5 and Ultralytics do on loading it, and more strictly where they only warn.
///
/// * `data.yaml` has `train`, `val` and names, as many as `nc` says, and its folders exist and hold images;
/// * every image decodes to its end and has sides of at least 10 pixels; no two have the same bytes;
/// * every image has a label file and every label file an image;
/// * rows have 5 columns (or, in files of outlines, 7 or more, an odd number), a whole class number below `nc`, shares in
///   0..1, sides above 0, and no twin in the same file;
/// * where there is a journal, the files it names have the sizes and checksums that it says, and it names every image.
///
/// # Errors
/// When `folder` is not a folder that can be listed. Everything else is a [`Fault`].
pub fn check(folder: &Path) -> Result<Checked> {
    if !folder.is_dir() {
        return Err(Error::file(folder, "no such folder, expected a dataset"));
    }
    let mut all = Findings { folder, faults: Vec::new() };
    let yaml = all.data_yaml();
    let mut images = Vec::new();
    for part in Part::ALL {
        images.extend(all.images(yaml.folder(part)));
    }
    let looked: Vec<_> = images.par_iter().map(|image| look(folder, image, yaml.classes())).collect();
    let mut rows = vec![0; yaml.classes().unwrap_or(0)];
    let mut same: BTreeMap<(u64, u32), &Path> = BTreeMap::new();
    for (image, look) in images.iter().zip(&looked) {
        all.faults.extend(look.faults.iter().cloned());
        look.classes.iter().for_each(|&class| rows[class] += 1);
        if let Some(twin) = look.bytes.and_then(|bytes| same.insert(bytes, image)) {
            all.add(image, None, format!("the same bytes as {}", twin.display()));
        }
    }
    all.orphans(&images, &yaml);
    all.journal(&images);
    all.faults.sort();
    Ok(Checked { faults: all.faults, images: images.len(), rows })
}

/// Faults found so far.
struct Findings<'a> {
    folder: &'a Path,
    faults: Vec<Fault>,
}

impl Findings<'_> {
    fn add(&mut self, path: impl AsRef<Path>, line: Option<usize>, what: impl Into<String>) {
        self.faults.push(fault(path, line, what));
    }

    fn data_yaml(&mut self) -> DataYaml {
        let name = "data.yaml";
        match io::read_text(self.folder.join(name)) {
            Err(e) => {
                self.add(name, None, self.short(&e));
                DataYaml::default()
            }
            Ok(text) => {
                let (yaml, faults) = DataYaml::read(&text);
                faults.into_iter().for_each(|(line, what)| self.add(name, line, what));
                yaml
            }
        }
    }

    /// The images of a part, in order of name.
    fn images(&mut self, part: Option<&str>) -> Vec<PathBuf> {
        let Some(part) = part else { return Vec::new() };
        let found: Vec<_> = list(self.folder, part).into_iter().filter(|path| is_image(path)).collect();
        if found.is_empty() {
            self.add(part, None, "no images, expected at least one");
        }
        found
    }

    /// Label files that belong to no image.
    fn orphans(&mut self, images: &[PathBuf], yaml: &DataYaml) {
        let wanted: BTreeSet<_> = images.iter().map(|image| label_of(image)).collect();
        for part in Part::ALL.iter().filter_map(|&part| yaml.folder(part)) {
            let labels = label_of(&Path::new(part).join("x"));
            let labels = labels.parent().unwrap_or(Path::new("")).to_string_lossy().into_owned();
            let texts =
                list(self.folder, &labels).into_iter().filter(|path| path.extension().is_some_and(|e| e == "txt"));
            for orphan in texts.filter(|path| !wanted.contains(path)) {
                self.add(orphan, None, "no image of this name");
            }
        }
    }

    /// Compares the journal, where there is one, with what is there.
    fn journal(&mut self, images: &[PathBuf]) {
        let Ok(text) = std::fs::read_to_string(self.folder.join(JOURNAL)) else { return };
        let mut named = BTreeSet::new();
        let mut lines = Vec::new();
        for (i, line) in text.lines().enumerate() {
            match serde_json::from_str::<Line>(line) {
                Err(e) => self.add(JOURNAL, Some(i + 1), format!("not a line of a journal: {e}")),
                Ok(line) => {
                    named.extend(line.files.iter().map(|file| PathBuf::from(&file.path)));
                    lines.push((i + 1, line));
                }
            }
        }
        let wrong = lines.par_iter().flat_map_iter(|(i, line)| line.files.iter().map(move |file| (*i, file)));
        let wrong: Vec<_> = wrong.filter_map(|(i, file)| differs(self.folder, file).map(|what| (i, what))).collect();
        wrong.into_iter().for_each(|(i, what)| self.add(JOURNAL, Some(i), what));
        for image in images.iter().filter(|image| !named.contains(*image)) {
            self.add(image, None, format!("not in {JOURNAL}"));
        }
    }

    /// What an error says, without the path that a fault names anyway.
    fn short(&self, e: &Error) -> String {
        short(self.folder, e)
    }
}

fn fault(path: impl AsRef<Path>, line: Option<usize>, what: impl Into<String>) -> Fault {
    Fault { path: path.as_ref().into(), line, what: what.into() }
}

fn short(folder: &Path, e: &Error) -> String {
    let said = e.to_string();
    match e {
        Error::File { what, .. } => what.clone(),
        _ => said.replace(&format!("{}/", folder.display()), ""),
    }
}

/// Files of a folder below the dataset's, in order of name; none where it cannot be listed.
fn list(folder: &Path, below: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join(below)) else { return Vec::new() };
    let files = entries.flatten().filter(|e| e.path().is_file()).map(|e| Path::new(below).join(e.file_name()));
    let mut files: Vec<_> = files.collect();
    files.sort();
    files
}

fn is_image(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|e| ["png", "jpg", "jpeg", "tif", "tiff"].contains(&e.as_str()))
}

/// The label file of an image, where trainers look for it: the last folder `images` becomes `labels`.
fn label_of(image: &Path) -> PathBuf {
    let parts: Vec<_> = image.iter().collect();
    let last = parts.iter().rposition(|part| *part == "images");
    let renamed = parts.iter().enumerate().map(|(i, part)| if Some(i) == last { "labels".as_ref() } else { *part });
    renamed.collect::<PathBuf>().with_extension("txt")
}

/// What one image and its labels are like.
#[derive(Default)]
struct Look {
    faults: Vec<Fault>,
    /// Class of each good row.
    classes: Vec<usize>,
    /// Size and checksum of the image's file.
    bytes: Option<(u64, u32)>,
}

fn look(folder: &Path, image: &Path, class_count: Option<usize>) -> Look {
    let mut look = Look::default();
    match io::read::<PremulRgba>(folder.join(image)) {
        Err(e) => look.faults.push(fault(image, None, short(folder, &e))),
        Ok(picture) if picture.width().min(picture.height()) < LEAST_SIDE_PX as usize => {
            let (w, h) = picture.size();
            look.faults.push(fault(image, None, format!("{w} x {h} pixels, expected at least {LEAST_SIDE_PX} a side")));
        }
        Ok(_) => {}
    }
    look.bytes = Finished::of(folder, image).ok().map(|file| (file.bytes, file.crc32));
    let label = label_of(image);
    match std::fs::read_to_string(folder.join(&label)) {
        Err(_) => {
            look.faults.push(fault(label, None, format!("missing or not text, but there is {}", image.display())))
        }
        Ok(text) => look.rows(&label, &text, class_count),
    }
    look
}

impl Look {
    fn rows(&mut self, label: &Path, text: &str, class_count: Option<usize>) {
        let rows: Vec<(usize, Vec<&str>)> =
            text.lines().enumerate().map(|(i, line)| (i + 1, line.split_whitespace().collect())).collect();
        let rows: Vec<_> = rows.into_iter().filter(|(_, row): &(_, Vec<_>)| !row.is_empty()).collect();
        // As the trainers do: one long row makes it a file of outlines.
        let outlines = rows.iter().any(|(_, row)| row.len() > 6);
        let mut known: Vec<Vec<f64>> = Vec::new();
        for (i, row) in rows {
            match numbers(&row, outlines, class_count) {
                Err(what) => self.faults.push(fault(label, Some(i), what)),
                Ok(values) if known.contains(&values) => {
                    self.faults.push(fault(label, Some(i), "the same row stands above"));
                }
                Ok(values) => {
                    self.classes.extend(class_count.map(|_| values[0] as usize));
                    known.push(values);
                }
            }
        }
    }
}

/// The numbers of a row, or what is wrong with it.
fn numbers(row: &[&str], outlines: bool, class_count: Option<usize>) -> std::result::Result<Vec<f64>, String> {
    match (outlines, row.len()) {
        (false, 5) => {}
        (true, n) if n >= 7 && n % 2 == 1 => {}
        (false, n) => return Err(format!("{n} columns, expected 5")),
        (true, n) => {
            return Err(format!("{n} columns, expected a class and at least 3 pairs as in the file's other rows"));
        }
    }
    let number = |text: &&str| text.parse::<f64>().map_err(|_| format!("\"{text}\", expected a number"));
    let values: Vec<f64> = row.iter().map(number).collect::<std::result::Result<_, _>>()?;
    let class = row[0].parse::<usize>().map_err(|_| format!("class {}, expected a whole number from 0", row[0]))?;
    if let Some(count) = class_count.filter(|&count| class >= count) {
        return Err(format!("class {class}, but data.yaml has {count} classes, from 0"));
    }
    if let Some(text) = row[1..].iter().zip(&values[1..]).find(|(_, v)| !(0.0..=1.0).contains(*v)).map(|(t, _)| t) {
        return Err(format!("{text}, expected a share of the image, 0 to 1"));
    }
    if !outlines && (values[3] <= 0.0 || values[4] <= 0.0) {
        return Err(format!("a box of {} x {}, expected sides above 0", row[3], row[4]));
    }
    Ok(values)
}

/// How a file differs from what the journal says of it.
fn differs(folder: &Path, said: &Finished) -> Option<String> {
    match Finished::of(folder, Path::new(&said.path)) {
        Err(_) => Some(format!("{} is missing", said.path)),
        Ok(found) if found.bytes != said.bytes => {
            Some(format!("{} has {} bytes, expected {}", said.path, found.bytes, said.bytes))
        }
        Ok(found) if found.crc32 != said.crc32 => {
            Some(format!("{} has other bytes than when it was written", said.path))
        }
        Ok(_) => None,
    }
}
