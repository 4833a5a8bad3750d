//! Would trainers accept this dataset? Everything they would not, with its file and line.

mod balance;
mod image;
mod label_rows;
#[cfg(feature = "settle")]
mod unsupported;

use crate::dataset::finding::Finding;
use crate::dataset::folder::{self, JOURNAL};
use crate::dataset::journal::{NumberedLines, numbered_lines};
use crate::dataset::journal_line::JournalLine;
use crate::dataset::listing::{images_in, is_list, place_of, whole_path};
use crate::dataset::merge::writers_of;
use crate::dataset::near_duplicates::{Look, NEAR_DUPLICATE_RMS, nearest};
use crate::dataset::paths::folder_of;
use crate::dataset::yolo_yaml::DataYaml;
use crate::dataset::{Part, Written};
use crate::diagnostic::Code;
use crate::error::{Error, Result};
use crate::eval::{is_class_list, label_of};
use crate::io;
use image::{CheckedImage, ListedImage};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What [`check`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checked {
    /// Everything that is wrong, in order of file and line; empty for a good dataset.
    pub findings: Vec<Finding>,
    /// Number of images that were checked.
    pub images: usize,
    /// Number of rows of label files for each class that has a name, in order.
    pub rows: Vec<usize>,
    /// The labels of all good rows.
    pub boxes: Vec<CheckedBox>,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
    /// Whether the dataset should have YOLO labels; if petcomp wrote none, no image was checked.
    pub has_yolo: bool,
    /// Number of images without a label file, which trainers take as empty, where that is no error.
    pub unlabelled: usize,
    /// The part that has no images because the dataset was generated with none there.
    pub empty_part: Option<Part>,
}

/// A row of a label file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckedBox {
    /// Part that its image belongs to.
    pub part: Part,
    /// Its class.
    pub class: usize,
    /// Width and height as shares of the image's.
    pub sides: [f64; 2],
}

/// Checks a YOLO dataset as YOLOv5 and Ultralytics do when they load it, and more strictly where
/// they only warn.
///
/// * `data.yaml` has `train`, `val` and names, as many as `nc` says, and its folders and lists exist
///   and have images, unless the dataset was generated with all of them in the other part;
/// * every image decodes to its end and has sides of at least 10 pixels; no two have the same bytes,
///   unless both show nothing;
/// * no validation image looks like a training image ([`NEAR_DUPLICATE_RMS`]) whose label file shows
///   the same, or is a training image that was saved again, unless both show nothing;
/// * every label file has an image; every image has a label file if petcomp wrote the dataset, and
///   one of each part has in any other; trainers look for labels where the absolute path of the
///   images without links leads;
/// * label files and lists have no byte order mark;
/// * rows have 5 columns (or, in files of outlines, 7 or more, an odd number), an integer class
///   below `nc`, shares in 0..1, sides above 0, and no duplicate in the same file;
/// * if sidecar files have the objects' poses, something supports each object
///   ([`hanging`](crate::settle::hanging));
/// * if there is a journal, the files in it have the recorded sizes and checksums, it lists every
///   image, and the files that are joined from them (COCO, Pascal VOC, MOT, archives) are there and
///   hold what they are joined from; of archives only the samples are counted. In a dataset that
///   petcomp made without YOLO labels, only these and the sidecar files are checked.
///
/// # Errors
/// If `folder` is not a folder that can be listed, or is a dataset of archives only, which has no
/// journal. Everything else is a [`Finding`].
pub fn check(folder: &Path) -> Result<Checked> {
    if !folder.is_dir() {
        return Err(Error::file(folder, "no such folder, expected a dataset"));
    }
    let folder = &whole_path(folder)?;
    let mut checker = Checker {
        folder,
        real: &io::real_path(folder),
        findings: Vec::new(),
        may_be_empty: part_without_share(folder),
    };
    let has_yolo = !is_for_others(folder)?;
    let yaml = match has_yolo {
        true => checker.read_data_yaml(),
        false => DataYaml::default(),
    };
    let images = checker.read_images(&yaml);
    let unlabelled = checker.find_missing_labels(&images);
    checker.find_duplicates(&images);
    checker.find_leaks(&images);
    checker.find_orphan_labels(&images, &yaml);
    checker.compare_journal(&images);
    #[cfg(feature = "settle")]
    checker.findings.extend(unsupported::find(folder));
    checker.findings.sort_by(Finding::cmp_by_place);
    let has_images = |part: &Part| images.iter().any(|image| image.part == *part);
    Ok(Checked {
        has_yolo,
        unlabelled,
        empty_part: checker.may_be_empty.filter(|part| !has_images(part)),
        ..Checked::new(checker.findings, &images, &yaml)
    })
}

/// The part that a dataset made by petcomp is meant to have no images in.
fn part_without_share(folder: &Path) -> Option<Part> {
    let identity = folder::identity(folder).ok().flatten()?;
    match identity["split"]["val_percent"].as_u64()? {
        0 => Some(Part::Val),
        100 => Some(Part::Train),
        _ => None,
    }
}

/// Whether petcomp made the dataset without YOLO labels.
fn is_for_others(folder: &Path) -> Result<bool> {
    if folder.join("data.yaml").exists() || !lacks_yolo(folder) {
        return Ok(false);
    }
    match has_journal(folder) {
        true => Ok(true),
        false => Err(Error::file(
            folder,
            "only archives, expected YOLO labels or a journal; `dataset generate --resume` finds damaged archives",
        )),
    }
}

fn lacks_yolo(folder: &Path) -> bool {
    let identity = folder::identity(folder).ok().flatten();
    let writers = identity.as_ref().and_then(|i| i["writers"].as_array());
    writers.is_some_and(|all| all.iter().all(|writer| writer.get("yolo").is_none()))
}

fn has_journal(folder: &Path) -> bool {
    std::fs::symlink_metadata(folder.join(JOURNAL)).is_ok()
}

impl Checked {
    fn new(findings: Vec<Finding>, images: &[CheckedImage], yaml: &DataYaml) -> Self {
        let boxes: Vec<CheckedBox> = images.iter().flat_map(boxes_of).collect();
        // Only for classes that have a name: `nc` may be any larger number.
        let mut rows = vec![0; yaml.names.len()];
        for class in boxes.iter().map(|b| b.class) {
            if let Some(count) = rows.get_mut(class) {
                *count += 1;
            }
        }
        Self {
            findings,
            images: images.len(),
            rows,
            boxes,
            classes: yaml.names.clone(),
            ..Self::default()
        }
    }
}

/// The findings so far.
struct Checker<'a> {
    folder: &'a Path,
    /// The same without links.
    real: &'a Path,
    findings: Vec<Finding>,
    /// The part that may be empty.
    may_be_empty: Option<Part>,
}

fn boxes_of(image: &CheckedImage) -> impl Iterator<Item = CheckedBox> {
    image.rows.iter().map(|&(class, sides)| CheckedBox {
        part: image.part,
        class,
        sides,
    })
}

/// The label files of a folder of images; empty if they cannot be listed.
fn list_labels(images: &Path) -> Vec<PathBuf> {
    let label = label_of(&images.join("x"));
    let is_label = |path: &Path| is_list(path) && !is_class_list(path);
    io::files_below(folder_of(&label), is_label, usize::MAX).unwrap_or_default()
}

impl Checker<'_> {
    fn add(&mut self, path: impl AsRef<Path>, code: Code, message: impl std::fmt::Display) {
        self.findings.push(Finding::in_file(path, code, message));
    }

    fn read_data_yaml(&mut self) -> DataYaml {
        let name = "data.yaml";
        let text = match io::read_text(self.folder.join(name)) {
            Ok(text) => text,
            Err(e) => {
                self.add_unreadable(name, &e);
                return DataYaml::default();
            }
        };
        let (yaml, problems) = DataYaml::read(&text);
        for (line, message) in problems {
            self.findings.push(Finding {
                line,
                ..Finding::in_file(name, Code::BadDataYaml, message)
            });
        }
        yaml
    }

    fn add_unreadable(&mut self, path: &str, error: &Error) {
        let finding = Finding::unreadable(self.folder, path, error);
        self.findings.push(finding);
    }

    fn read_images(&mut self, yaml: &DataYaml) -> Vec<CheckedImage> {
        let listed = self.list_images(yaml);
        let mut images: Vec<CheckedImage> = listed
            .into_par_iter()
            .map(|image| CheckedImage::read(self.folder, image, yaml.class_count()))
            .collect();
        for image in &mut images {
            self.findings.append(&mut image.findings);
        }
        images
    }

    /// The images of both parts, each part in order of name.
    fn list_images(&mut self, yaml: &DataYaml) -> Vec<ListedImage> {
        let mut images = Vec::new();
        for part in Part::ALL {
            for place in self.places(yaml, part) {
                images.extend(self.list_images_in(&place, part, yaml));
            }
        }
        images
    }

    /// The folders and lists of a part.
    fn places(&self, yaml: &DataYaml, part: Part) -> Vec<PathBuf> {
        let root = yaml.root(self.folder);
        let named = yaml.folders(part).iter();
        named.map(|named| place_of(&root, named)).collect()
    }

    /// An image in a list may be elsewhere.
    fn list_images_in(&mut self, place: &Path, part: Part, yaml: &DataYaml) -> Vec<ListedImage> {
        let found = images_in(place).unwrap_or_default();
        if found.is_empty() && self.may_be_empty != Some(part) {
            let message = match place.exists() {
                true => "no images, expected at least one",
                false => yaml.why_missing(),
            };
            self.add(io::relative(place, self.folder), Code::NoImages, message);
        }
        if is_list(place) && io::read_marked_text(place).is_ok_and(|(_, is_marked)| is_marked) {
            let place = io::relative(place, self.folder);
            let message = "a byte order mark, which is part of the first path to trainers";
            let finding = Finding::in_line(place, 1, Code::UnreadableFile, message);
            self.findings.push(finding);
        }
        let trained = trained_place(place);
        let listed = found.iter().map(|image| {
            let below = image.strip_prefix(place).map(|below| trained.join(below));
            let label = label_of(below.as_ref().unwrap_or(image));
            ListedImage {
                path: io::relative(image, self.folder),
                label: self.name_of(&label),
                part,
            }
        });
        listed.collect()
    }

    /// The path of a file as seen from the dataset's folder.
    fn name_of(&self, file: &Path) -> PathBuf {
        match file.starts_with(self.folder) {
            true => io::relative(file, self.folder),
            false => io::relative(file, self.real),
        }
    }

    /// Images without a label file: the number of them where trainers take them as empty. It is an
    /// error if petcomp, which writes all of them, made the dataset, or if no image of a part has
    /// one.
    fn find_missing_labels(&mut self, images: &[CheckedImage]) -> usize {
        let mut empty = 0;
        for part in Part::ALL {
            let images = images.iter().filter(|image| image.part == part);
            let (missing, labelled): (Vec<_>, Vec<_>) = images.partition(|i| i.is_unlabelled);
            if labelled.is_empty() || has_journal(self.folder) {
                let findings = missing.into_iter().map(CheckedImage::missing_label);
                self.findings.extend(findings);
            } else {
                empty += missing.len();
            }
        }
        empty
    }

    /// Images with the same bytes as an earlier one, which is a training image if any of them is;
    /// images of an empty scene may be identical.
    fn find_duplicates(&mut self, images: &[CheckedImage]) {
        let mut known: BTreeMap<(u64, u32), &CheckedImage> = BTreeMap::new();
        for image in images {
            let Some(checksum) = image.checksum else {
                continue;
            };
            let first = *known.entry(checksum).or_insert(image);
            let is_twin = !std::ptr::eq(first, image);
            if is_twin && !(image.is_empty && first.is_empty) {
                let (code, message) = twin_message(image, first);
                self.add(&image.path, code, message);
            }
        }
    }

    /// Validation images that look like a training image.
    fn find_leaks(&mut self, images: &[CheckedImage]) {
        let (train, train_looks) = looks(images, Part::Train);
        let (val, val_looks) = looks(images, Part::Val);
        for (i, j, rms) in nearest(&train_looks, &val_looks, NEAR_DUPLICATE_RMS) {
            let (image, twin) = (val[i], train[j]);
            // The same bytes have been reported already.
            if image.checksum != twin.checksum {
                let twin = twin.path.display();
                let message = format!("leak: differs from {twin} by only {rms:.2} of 255");
                self.add(&image.path, Code::Leak, message);
            }
        }
    }

    /// Label files in the folders of images that belong to no image; a list may leave images out.
    fn find_orphan_labels(&mut self, images: &[CheckedImage], yaml: &DataYaml) {
        let wanted: BTreeSet<&PathBuf> = images.iter().map(|image| &image.label).collect();
        let places = Part::ALL
            .into_iter()
            .flat_map(|part| self.places(yaml, part));
        let folders: Vec<PathBuf> = places.filter(|place| !is_list(place)).collect();
        for folder in folders {
            for label in list_labels(&trained_place(&folder)) {
                let label = self.name_of(&label);
                if !wanted.contains(&label) {
                    self.add(label, Code::OrphanLabel, "no image with this name");
                }
            }
        }
    }

    /// Compares the journal, if there is one, with the files in the folder.
    fn compare_journal(&mut self, images: &[CheckedImage]) {
        if !has_journal(self.folder) {
            return;
        }
        let lines = match numbered_lines(self.folder) {
            Ok(lines) => self.good_lines(lines),
            Err(e) => return self.add_unreadable(JOURNAL, &e),
        };
        self.find_changed_files(&lines);
        self.find_changed_joined_files(&lines);
        self.find_unlisted_images(images, &lines);
    }

    /// A shard has no files of many samples.
    fn find_changed_joined_files(&mut self, lines: &[(usize, JournalLine)]) {
        let identity = folder::identity(self.folder).ok().flatten();
        let Some(identity) = identity.filter(|identity| identity.get("shard").is_none()) else {
            return;
        };
        let classes: Vec<String> = folder::field(&identity, "classes").unwrap_or_default();
        // The layouts of other programs are not known.
        let writers = folder::field(&identity, "writers").and_then(writers_of);
        let mut samples: Vec<Written> = lines.iter().map(|(_, line)| line.written()).collect();
        samples.sort_by_key(|sample| sample.k);
        for writer in writers.unwrap_or_default() {
            for path in writer.changed(self.folder, &classes, &samples) {
                let message = "missing, or differs from the images' own labels; `petcomp dataset generate` writes it";
                self.add(&path, Code::ChangedFile, message);
            }
        }
    }

    fn find_unlisted_images(&mut self, images: &[CheckedImage], lines: &[(usize, JournalLine)]) {
        let files = lines.iter().flat_map(|(_, line)| &line.files);
        let listed: BTreeSet<PathBuf> = files.map(|file| PathBuf::from(&file.path)).collect();
        for image in images.iter().filter(|image| !listed.contains(&image.path)) {
            let message = format!("not in {JOURNAL}");
            self.add(&image.path, Code::UnlistedImage, message);
        }
    }

    /// The intact lines; the others become findings.
    fn good_lines(&mut self, lines: NumberedLines) -> Vec<(usize, JournalLine)> {
        let mut good = Vec::new();
        for (i, line) in lines {
            match line {
                Ok(line) => good.push((i, line)),
                Err(error) => {
                    let message = format!("not a line of a journal: {error}");
                    let finding = Finding::in_line(JOURNAL, i, Code::BadJournalLine, message);
                    self.findings.push(finding);
                }
            }
        }
        good
    }

    fn find_changed_files(&mut self, lines: &[(usize, JournalLine)]) {
        let folder = self.folder;
        let changed: Vec<Finding> = lines
            .par_iter()
            .flat_map_iter(|(i, line)| line.files.iter().map(move |file| (*i, file)))
            .filter_map(|(i, file)| {
                let message = file.difference(folder)?;
                Some(Finding::in_line(JOURNAL, i, Code::ChangedFile, message))
            })
            .collect();
        self.findings.extend(changed);
    }
}

/// A folder of images as trainers know it, which follow links; a list as it is.
fn trained_place(place: &Path) -> PathBuf {
    match is_list(place) {
        true => place.to_owned(),
        false => io::real_path(place),
    }
}

/// The finding about an image that has the same bytes as another, or is listed again.
fn twin_message(image: &CheckedImage, twin: &CheckedImage) -> (Code, String) {
    let message = format!("the same bytes as {}", twin.path.display());
    match (image.part == twin.part, image.path == twin.path) {
        (true, false) => (Code::DuplicateImage, message),
        (true, true) => (Code::DuplicateImage, "listed again".into()),
        (false, false) => (Code::Leak, format!("leak: {message}")),
        (false, true) => {
            let message = "leak: validation image is also used for training";
            (Code::Leak, message.into())
        }
    }
}

/// The images of a part that can be read, and the features they are compared by.
fn looks(images: &[CheckedImage], part: Part) -> (Vec<&CheckedImage>, Vec<Look>) {
    images
        .iter()
        .filter(|image| image.part == part)
        .filter_map(|image| Some((image, image.look()?)))
        .unzip()
}
