//! Would trainers take this dataset? Every fault, with its place.

use crate::dataset::journal::{JOURNAL, numbered_lines_of};
use crate::dataset::listing::is_image;
use crate::dataset::near_duplicates::{NEAR_DUPLICATE_RMS, Thumbnail, nearest};
use crate::dataset::yolo::LEAST_SIDE_PX;
use crate::dataset::yolo_yaml::DataYaml;
use crate::dataset::{Part, YoloSet};
use crate::error::{Error, Result};
use crate::io;
use crate::pixel::PremulRgba;
use crate::plot::Table;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Something that a trainer would refuse, drop or take for something else.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// The file, below the dataset's folder.
    pub path: PathBuf,
    /// Its line, from 1, where the fault is in one.
    pub line: Option<usize>,
    /// What is wrong, and what was expected.
    pub what: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.line.map_or(String::new(), |n| format!("{n}:"));
        write!(f, "{}:{line} {}", self.path.display(), self.what)
    }
}

/// What [`check`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Everything that is wrong, in order of file and line; empty for a good dataset.
    pub faults: Vec<Finding>,
    /// Images looked at.
    pub images: usize,
    /// Rows of label files for each class that has a name, in order.
    pub rows: Vec<usize>,
    /// What stands in each good row of boxes.
    pub boxes: Vec<CheckedBox>,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
}

/// A row of a label file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedBox {
    /// Part that its image belongs to.
    pub part: Part,
    /// Its class.
    pub class: usize,
    /// Width and height as shares of the image's; none of an outline.
    pub sides: Option<[f64; 2]>,
}

/// Boxes with less than this share of the image's width or height are told as small.
const SMALL_SIDE: f64 = 0.01;

/// A class with less than this share of the labels is told as rare.
const RARE: f64 = 0.02;

impl Checked {
    /// For each class its labels in both parts and the sizes of its boxes.
    pub fn balance(&self) -> Table {
        let mut table = Table::new(["class", "train", "val", "share", "box width", "box height"]);
        for class in 0..self.rows.len() {
            let of = |part| {
                self.boxes
                    .iter()
                    .filter(|b| b.class == class && b.part == part)
                    .count()
                    .to_string()
            };
            let share = 100.0 * self.rows[class] as f64 / self.boxes.len().max(1) as f64;
            let [width, height] = [0, 1].map(|side| self.spread(class, side));
            let name = self
                .classes
                .get(class)
                .cloned()
                .unwrap_or_else(|| class.to_string());
            table.push([
                name,
                of(Part::Train),
                of(Part::Val),
                format!("{share:.1} %"),
                width,
                height,
            ]);
        }
        table
    }

    /// Smallest, middle and largest side of a class's boxes, percent of the image.
    fn spread(&self, class: usize, side: usize) -> String {
        let of = self
            .boxes
            .iter()
            .filter(|b| b.class == class)
            .filter_map(|b| b.sides.map(|sides| sides[side]));
        let mut sides: Vec<f64> = of.map(|side| 100.0 * side).collect();
        sides.sort_by(f64::total_cmp);
        match sides.as_slice() {
            [] => "-".into(),
            [low, ..] => format!(
                "{low:.1} / {:.1} / {:.1} %",
                sides[sides.len() / 2],
                sides[sides.len() - 1]
            ),
        }
    }

    /// What is no fault but worth knowing: classes without labels or with few, boxes that are very small.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        for (class, name) in self.classes.iter().enumerate() {
            for part in Part::ALL {
                if !self
                    .boxes
                    .iter()
                    .any(|b| b.class == class && b.part == part)
                {
                    remarks.push(format!("class \"{name}\" has no label in {}", part.name()));
                }
            }
            let rows = self.rows.get(class).copied().unwrap_or(0);
            if rows > 0 && (rows as f64) < RARE * self.boxes.len() as f64 {
                remarks.push(format!(
                    "class \"{name}\" has only {rows} of {} labels",
                    self.boxes.len()
                ));
            }
        }
        let small = |b: &&CheckedBox| {
            b.sides
                .is_some_and(|sides| sides.iter().any(|side| *side < SMALL_SIDE))
        };
        let small = self.boxes.iter().filter(small).count();
        if small > 0 {
            remarks.push(format!(
                "{small} boxes are below {:.0} % of the image's side",
                100.0 * SMALL_SIDE
            ));
        }
        remarks
    }
}

/// Checks a YOLO dataset as YOLOv5 and Ultralytics do on loading it, and more strictly where they only warn.
///
/// * `data.yaml` has `train`, `val` and names, as many as `nc` says, and its folders exist and hold images;
/// * every image decodes to its end and has sides of at least 10 pixels; no two that show something have the same bytes;
/// * no image for validation looks like one for training ([`NEAR_DUPLICATE_RMS`]), unless it shows nothing;
/// * every image has a label file and every label file an image;
/// * rows have 5 columns (or, in files of outlines, 7 or more, an odd number), a whole class number below `nc`, shares in
///   0..1, sides above 0, and no twin in the same file;
/// * where sidecar files tell how objects lie, something holds each of them up ([`hanging`](crate::settle::hanging));
/// * where there is a journal, the files it names have the sizes and checksums that it says, and it names every image.
///
/// # Errors
/// When `folder` is not a folder that can be listed. Everything else is a [`Finding`].
pub fn check(folder: &Path) -> Result<Checked> {
    if !folder.is_dir() {
        return Err(Error::file(folder, "no such folder, expected a dataset"));
    }
    let mut all = Findings {
        folder,
        faults: Vec::new(),
    };
    let yaml = all.data_yaml();
    let mut images = Vec::new();
    let mut parts = Vec::new();
    for part in Part::ALL {
        images.extend(all.images(yaml.folder(part)));
        parts.resize(images.len(), part);
    }
    let looked: Vec<_> = images
        .par_iter()
        .map(|image| look(folder, image, yaml.classes()))
        .collect();
    // Of classes that have a name: how many others there are, `nc` may say of any number.
    let mut rows = vec![0; yaml.names().len()];
    let mut boxes = Vec::new();
    let mut same: BTreeMap<(u64, u32), &Path> = BTreeMap::new();
    for ((image, look), &part) in images.iter().zip(&looked).zip(&parts) {
        all.faults.extend(look.faults.iter().cloned());
        for (class, _) in &look.rows {
            if let Some(count) = rows.get_mut(*class) {
                *count += 1;
            }
        }
        boxes.extend(
            look.rows
                .iter()
                .map(|&(class, sides)| CheckedBox { part, class, sides }),
        );
        // Pictures of an empty place are alike, and rightly so.
        let twin = look
            .bytes
            .filter(|_| !look.is_empty)
            .and_then(|bytes| same.insert(bytes, image));
        if let Some(twin) = twin {
            all.add(image, None, format!("the same bytes as {}", twin.display()));
        }
    }
    all.leaks(&images, &looked, &parts);
    all.orphans(&images, &yaml);
    all.journal(&images);
    #[cfg(feature = "settle")]
    all.faults.extend(super::hanging::hanging(folder));
    all.faults.sort();
    Ok(Checked {
        faults: all.faults,
        images: images.len(),
        rows,
        boxes,
        classes: yaml.names().to_vec(),
    })
}

/// Faults found so far.
struct Findings<'a> {
    folder: &'a Path,
    faults: Vec<Finding>,
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
                faults
                    .into_iter()
                    .for_each(|(line, what)| self.add(name, line, what));
                yaml
            }
        }
    }

    /// The images of a part, in order of name.
    fn images(&mut self, part: Option<&str>) -> Vec<PathBuf> {
        let Some(part) = part else { return Vec::new() };
        let found: Vec<_> = list(self.folder, part)
            .into_iter()
            .filter(|path| is_image(path))
            .collect();
        if found.is_empty() {
            self.add(part, None, "no images, expected at least one");
        }
        found
    }

    /// Label files that belong to no image.
    fn orphans(&mut self, images: &[PathBuf], yaml: &DataYaml) {
        let wanted: BTreeSet<_> = images
            .iter()
            .map(|image| YoloSet::label_of(image))
            .collect();
        for part in Part::ALL.iter().filter_map(|&part| yaml.folder(part)) {
            let labels = YoloSet::label_of(&Path::new(part).join("x"));
            let labels = labels
                .parent()
                .unwrap_or(Path::new(""))
                .to_string_lossy()
                .into_owned();
            let texts = list(self.folder, &labels)
                .into_iter()
                .filter(|path| path.extension().is_some_and(|e| e == "txt"));
            for orphan in texts.filter(|path| !wanted.contains(path)) {
                self.add(orphan, None, "no image of this name");
            }
        }
    }

    /// Images for validation that look like one that is trained on.
    fn leaks(&mut self, images: &[PathBuf], looked: &[Look], parts: &[Part]) {
        let of = |part: Part| -> (Vec<usize>, Vec<Thumbnail>) {
            let those = (0..images.len()).filter(|&i| parts[i] == part && !looked[i].is_empty);
            those
                .filter_map(|i| Some((i, looked[i].small.clone()?)))
                .unzip()
        };
        let ((train, train_small), (val, val_small)) = (of(Part::Train), of(Part::Val));
        for (i, j, codes) in nearest(&train_small, &val_small, NEAR_DUPLICATE_RMS) {
            let (image, twin) = (&images[val[i]], &images[train[j]]);
            // The same bytes are told already.
            if looked[val[i]].bytes != looked[train[j]].bytes {
                let what = format!(
                    "leak: differs from {} by {codes:.2} of 255 only",
                    twin.display()
                );
                self.add(image, None, what);
            }
        }
    }

    /// Compares the journal, where there is one, with what is there.
    fn journal(&mut self, images: &[PathBuf]) {
        if std::fs::symlink_metadata(self.folder.join(JOURNAL)).is_err() {
            return;
        }
        let read = match numbered_lines_of(self.folder) {
            Ok(read) => read,
            Err(e) => return self.add(JOURNAL, None, self.short(&e)),
        };
        let mut named = BTreeSet::new();
        let mut lines = Vec::new();
        for (i, line) in read {
            match line {
                Err(e) => self.add(JOURNAL, Some(i), format!("not a line of a journal: {e}")),
                Ok(line) => {
                    named.extend(line.files.iter().map(|file| PathBuf::from(&file.path)));
                    lines.push((i, line));
                }
            }
        }
        let wrong = lines
            .par_iter()
            .flat_map_iter(|(i, line)| line.files.iter().map(move |file| (*i, file)));
        let wrong: Vec<_> = wrong
            .filter_map(|(i, file)| file.differs(self.folder).map(|what| (i, what)))
            .collect();
        wrong
            .into_iter()
            .for_each(|(i, what)| self.add(JOURNAL, Some(i), what));
        for image in images.iter().filter(|image| !named.contains(*image)) {
            self.add(image, None, format!("not in {JOURNAL}"));
        }
    }

    /// What an error says, without the path that a fault names anyway.
    fn short(&self, e: &Error) -> String {
        short(self.folder, e)
    }
}

pub(super) fn fault(
    path: impl AsRef<Path>,
    line: Option<usize>,
    what: impl Into<String>,
) -> Finding {
    Finding {
        path: path.as_ref().into(),
        line,
        what: what.into(),
    }
}

pub(super) fn short(folder: &Path, e: &Error) -> String {
    let said = e.to_string();
    match e {
        Error::File { what, .. } => what.clone(),
        _ => said.replace(&format!("{}/", folder.display()), ""),
    }
}

/// Files of a folder below the dataset's, in order of name; none where it cannot be listed.
pub(super) fn list(folder: &Path, below: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join(below)) else {
        return Vec::new();
    };
    let files = entries
        .flatten()
        .filter(|e| e.path().is_file())
        .map(|e| Path::new(below).join(e.file_name()));
    let mut files: Vec<_> = files.collect();
    files.sort();
    files
}

/// What one image and its labels are like.
#[derive(Default)]
struct Look {
    faults: Vec<Finding>,
    /// Class of each good row, and the sides of its box.
    rows: Vec<(usize, Option<[f64; 2]>)>,
    /// There is nothing in it.
    is_empty: bool,
    /// A small copy, if it can be read.
    small: Option<Thumbnail>,
    /// Size and checksum of the image's file.
    bytes: Option<(u64, u32)>,
}

fn look(folder: &Path, image: &Path, class_count: Option<usize>) -> Look {
    let mut look = Look::default();
    match io::read::<PremulRgba>(folder.join(image)) {
        Err(e) => look.faults.push(fault(image, None, short(folder, &e))),
        Ok(picture) if picture.width().min(picture.height()) < LEAST_SIDE_PX as usize => {
            let (w, h) = picture.size();
            look.faults.push(fault(
                image,
                None,
                format!("{w} x {h} pixels, expected at least {LEAST_SIDE_PX} a side"),
            ));
        }
        Ok(picture) => look.small = Some(Thumbnail::of(&picture.map(|p| p.color()))),
    }
    look.bytes = io::Checksum::of(folder.join(image))
        .ok()
        .map(|sum| (sum.bytes, sum.crc32));
    let label = YoloSet::label_of(image);
    match io::read_text(folder.join(&label)) {
        Err(_) => look.faults.push(fault(
            label,
            None,
            format!("missing or not text, but there is {}", image.display()),
        )),
        Ok(text) => {
            look.is_empty = text.trim().is_empty();
            look.read(&label, &text, class_count);
        }
    }
    look
}

impl Look {
    fn read(&mut self, label: &Path, text: &str, class_count: Option<usize>) {
        let rows: Vec<(usize, Vec<&str>)> = text
            .lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line.split_whitespace().collect()))
            .collect();
        let rows: Vec<_> = rows
            .into_iter()
            .filter(|(_, row): &(_, Vec<_>)| !row.is_empty())
            .collect();
        // As the trainers do: one long row makes it a file of outlines.
        let outlines = rows.iter().any(|(_, row)| row.len() > 6);
        let mut known: Vec<Vec<f64>> = Vec::new();
        for (i, row) in rows {
            match numbers(&row, outlines, class_count) {
                Err(what) => self.faults.push(fault(label, Some(i), what)),
                Ok(values) if known.contains(&values) => {
                    self.faults
                        .push(fault(label, Some(i), "the same row stands above"));
                }
                Ok(values) => {
                    let sides = (!outlines).then(|| [values[3], values[4]]);
                    self.rows
                        .extend(class_count.map(|_| (values[0] as usize, sides)));
                    known.push(values);
                }
            }
        }
    }
}

/// The numbers of a row, or what is wrong with it.
fn numbers(
    row: &[&str],
    outlines: bool,
    class_count: Option<usize>,
) -> std::result::Result<Vec<f64>, String> {
    match (outlines, row.len()) {
        (false, 5) => {}
        (true, n) if n >= 7 && n % 2 == 1 => {}
        (false, n) => return Err(format!("{n} columns, expected 5")),
        (true, n) => {
            return Err(format!(
                "{n} columns, expected a class and at least 3 pairs as in the file's other rows"
            ));
        }
    }
    let number = |text: &&str| {
        text.parse::<f64>()
            .map_err(|_| format!("\"{text}\", expected a number"))
    };
    let values: Vec<f64> = row
        .iter()
        .map(number)
        .collect::<std::result::Result<_, _>>()?;
    let class = row[0]
        .parse::<usize>()
        .map_err(|_| format!("class {}, expected a whole number from 0", row[0]))?;
    if let Some(count) = class_count.filter(|&count| class >= count) {
        return Err(format!(
            "class {class}, but data.yaml has {count} classes, from 0"
        ));
    }
    if let Some(text) = row[1..]
        .iter()
        .zip(&values[1..])
        .find(|(_, v)| !(0.0..=1.0).contains(*v))
        .map(|(t, _)| t)
    {
        return Err(format!("{text}, expected a share of the image, 0 to 1"));
    }
    if !outlines && (values[3] <= 0.0 || values[4] <= 0.0) {
        return Err(format!(
            "a box of {} x {}, expected sides above 0",
            row[3], row[4]
        ));
    }
    Ok(values)
}
