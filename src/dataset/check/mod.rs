//! Would trainers take this dataset? Everything they would not, with its file and line.

mod balance;
mod image;
mod label_rows;
#[cfg(feature = "settle")]
mod unsupported;

use crate::dataset::finding::Finding;
use crate::dataset::folder::JOURNAL;
use crate::dataset::journal::numbered_lines;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::listing::is_image;
use crate::dataset::near_duplicates::{NEAR_DUPLICATE_RMS, Thumbnail, nearest};
use crate::dataset::yolo_yaml::DataYaml;
use crate::dataset::{Part, YoloSet};
use crate::diagnostic::Code;
use crate::error::{Error, Result};
use crate::io;
use image::CheckedImage;
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
    /// Rows of label files for each class that has a name, in order.
    pub rows: Vec<usize>,
    /// The labels of all good rows.
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

/// Checks a YOLO dataset as YOLOv5 and Ultralytics do on loading it, and more strictly where they only warn.
///
/// * `data.yaml` has `train`, `val` and names, as many as `nc` says, and its folders exist and hold images;
/// * every image decodes to its end and has sides of at least 10 pixels; no two that show something have the same bytes;
/// * no image for validation looks like one for training ([`NEAR_DUPLICATE_RMS`]), unless it shows nothing;
/// * every image has a label file and every label file an image;
/// * rows have 5 columns (or, in files of outlines, 7 or more, an odd number), an integer class below `nc`, shares in
///   0..1, sides above 0, and no duplicate in the same file;
/// * where sidecar files have the objects' poses, something holds each of them up
///   ([`hanging`](crate::settle::hanging));
/// * where there is a journal, the files it names have the sizes and checksums that it says, and it names every image.
///
/// # Errors
/// When `folder` is not a folder that can be listed. Everything else is a [`Finding`].
pub fn check(folder: &Path) -> Result<Checked> {
    if !folder.is_dir() {
        return Err(Error::file(folder, "no such folder, expected a dataset"));
    }
    let mut checker = Checker {
        folder,
        findings: Vec::new(),
    };
    let yaml = checker.read_data_yaml();
    let listed = checker.list_images(&yaml);
    let mut images: Vec<CheckedImage> = listed
        .into_par_iter()
        .map(|(part, path)| CheckedImage::read(folder, path, part, yaml.class_count()))
        .collect();
    for image in &mut images {
        checker.findings.append(&mut image.findings);
    }
    checker.find_duplicates(&images);
    checker.find_leaks(&images);
    checker.find_orphan_labels(&images, &yaml);
    checker.compare_journal(&images);
    #[cfg(feature = "settle")]
    checker.findings.extend(unsupported::find(folder));
    checker.findings.sort_by(Finding::cmp_by_place);
    Ok(Checked::new(checker.findings, &images, &yaml))
}

impl Checked {
    fn new(findings: Vec<Finding>, images: &[CheckedImage], yaml: &DataYaml) -> Self {
        // Only for classes that have a name: `nc` may claim any number of others.
        let mut rows = vec![0; yaml.names().len()];
        let mut boxes = Vec::new();
        for image in images {
            for &(class, sides) in &image.rows {
                if let Some(count) = rows.get_mut(class) {
                    *count += 1;
                }
                boxes.push(CheckedBox {
                    part: image.part,
                    class,
                    sides,
                });
            }
        }
        Self {
            findings,
            images: images.len(),
            rows,
            boxes,
            classes: yaml.names().to_vec(),
        }
    }
}

/// The findings so far.
struct Checker<'a> {
    folder: &'a Path,
    findings: Vec<Finding>,
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
                self.findings
                    .push(Finding::unreadable(self.folder, name, &e));
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

    /// The images of both parts, each part in order of name.
    fn list_images(&mut self, yaml: &DataYaml) -> Vec<(Part, PathBuf)> {
        let mut images = Vec::new();
        for part in Part::ALL {
            for folder in yaml.folders(part) {
                let found: Vec<_> = list_files(self.folder, folder)
                    .into_iter()
                    .filter(|path| is_image(path))
                    .collect();
                if found.is_empty() {
                    self.add(folder, Code::NoImages, "no images, expected at least one");
                }
                images.extend(found.into_iter().map(|path| (part, path)));
            }
        }
        images
    }

    /// Images with the bytes of another; images of an empty scene may well be the same.
    fn find_duplicates(&mut self, images: &[CheckedImage]) {
        let mut known: BTreeMap<(u64, u32), &Path> = BTreeMap::new();
        for image in images.iter().filter(|image| !image.is_empty) {
            let twin = image
                .checksum
                .and_then(|checksum| known.insert(checksum, &image.path));
            if let Some(twin) = twin {
                let message = format!("the same bytes as {}", twin.display());
                self.add(&image.path, Code::DuplicateImage, message);
            }
        }
    }

    /// Images for validation that look like one that is trained on.
    fn find_leaks(&mut self, images: &[CheckedImage]) {
        let (train, train_thumbnails) = thumbnails(images, Part::Train);
        let (val, val_thumbnails) = thumbnails(images, Part::Val);
        for (i, j, rms) in nearest(&train_thumbnails, &val_thumbnails, NEAR_DUPLICATE_RMS) {
            let (image, twin) = (val[i], train[j]);
            // The same bytes are reported already.
            if image.checksum != twin.checksum {
                let message = format!(
                    "leak: differs from {} by {rms:.2} of 255 only",
                    twin.path.display()
                );
                self.add(&image.path, Code::Leak, message);
            }
        }
    }

    /// Label files that belong to no image.
    fn find_orphan_labels(&mut self, images: &[CheckedImage], yaml: &DataYaml) {
        let wanted: BTreeSet<PathBuf> = images
            .iter()
            .map(|image| YoloSet::label_of(&image.path))
            .collect();
        for folder in Part::ALL.iter().flat_map(|&part| yaml.folders(part)) {
            let labels = YoloSet::label_of(&Path::new(folder).join("x"));
            let labels = labels.parent().unwrap_or(Path::new(""));
            let orphans = list_files(self.folder, &labels.to_string_lossy())
                .into_iter()
                .filter(|path| path.extension().is_some_and(|e| e == "txt"))
                .filter(|path| !wanted.contains(path));
            for orphan in orphans {
                self.add(orphan, Code::OrphanLabel, "no image of this name");
            }
        }
    }

    /// Compares the journal, where there is one, with the files in the folder.
    fn compare_journal(&mut self, images: &[CheckedImage]) {
        if std::fs::symlink_metadata(self.folder.join(JOURNAL)).is_err() {
            return;
        }
        let lines = match numbered_lines(self.folder) {
            Ok(lines) => lines,
            Err(e) => {
                let finding = Finding::unreadable(self.folder, JOURNAL, &e);
                return self.findings.push(finding);
            }
        };
        let lines = self.good_lines(lines);
        self.find_changed_files(&lines);
        let listed: BTreeSet<PathBuf> = lines
            .iter()
            .flat_map(|(_, line)| &line.files)
            .map(|file| PathBuf::from(&file.path))
            .collect();
        for image in images.iter().filter(|image| !listed.contains(&image.path)) {
            let message = format!("not in {JOURNAL}");
            self.add(&image.path, Code::UnlistedImage, message);
        }
    }

    /// The lines that are as they were written; the others are findings.
    fn good_lines(
        &mut self,
        lines: Vec<(usize, std::result::Result<JournalLine, String>)>,
    ) -> Vec<(usize, JournalLine)> {
        let mut good = Vec::new();
        for (i, line) in lines {
            match line {
                Ok(line) => good.push((i, line)),
                Err(e) => self.findings.push(Finding::in_line(
                    JOURNAL,
                    i,
                    Code::BadJournalLine,
                    format!("not a line of a journal: {e}"),
                )),
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

/// The images of a part that show something and can be read, and their thumbnails.
fn thumbnails(images: &[CheckedImage], part: Part) -> (Vec<&CheckedImage>, Vec<Thumbnail>) {
    images
        .iter()
        .filter(|image| image.part == part && !image.is_empty)
        .filter_map(|image| Some((image, image.thumbnail.clone()?)))
        .unzip()
}

/// Files of a folder below the dataset's, in order of name; none where it cannot be listed.
fn list_files(folder: &Path, below: &str) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join(below)) else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .filter(|entry| entry.path().is_file())
        .map(|entry| Path::new(below).join(entry.file_name()))
        .collect();
    files.sort();
    files
}
