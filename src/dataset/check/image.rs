//! One image of a dataset and its label file.

use super::label_rows::{LabelRow, read_rows};
use crate::dataset::Part;
use crate::dataset::finding::Finding;
use crate::dataset::near_duplicates::{Look, Thumbnail, boxes_in};
use crate::dataset::yolo::MIN_SIDE_PX;
use crate::diagnostic::Code;
use crate::eval::{GroundTruth, label_of};
use crate::io;
use crate::pixel::PremulRgba;
use std::path::{Path, PathBuf};

/// An image that the dataset names; its paths are relative to the dataset's folder.
pub(super) struct ListedImage {
    pub(super) path: PathBuf,
    /// Where trainers look for its label file.
    pub(super) label: PathBuf,
    pub(super) part: Part,
}

/// An image and its labels.
pub(super) struct CheckedImage {
    pub(super) path: PathBuf,
    /// Where trainers look for its label file.
    pub(super) label: PathBuf,
    pub(super) part: Part,
    pub(super) findings: Vec<Finding>,
    /// The good rows of its label file.
    pub(super) rows: Vec<LabelRow>,
    /// Whether it has a label file without rows.
    pub(super) is_empty: bool,
    /// Whether it has no label file.
    pub(super) is_unlabelled: bool,
    /// None if the image cannot be read.
    thumbnail: Option<Thumbnail>,
    /// From its label file, for comparison; none if there is no file or a row is bad.
    boxes: Option<Vec<GroundTruth>>,
    /// Size and checksum of its file.
    pub(super) checksum: Option<(u64, u32)>,
}

impl CheckedImage {
    /// Reads an image of the dataset in `folder` and its label file.
    pub(super) fn read(
        folder: &Path,
        ListedImage { path, label, part }: ListedImage,
        class_count: Option<usize>,
    ) -> Self {
        let checksum = size_and_checksum(&folder.join(&path));
        let mut image = Self {
            path,
            label,
            part,
            findings: Vec::new(),
            rows: Vec::new(),
            is_empty: false,
            is_unlabelled: false,
            thumbnail: None,
            boxes: None,
            checksum,
        };
        image.read_pixels(folder);
        image.read_labels(folder, class_count);
        image
    }

    /// The features it is compared by; none if it cannot be read.
    pub(super) fn look(&self) -> Option<Look> {
        Some(Look {
            thumbnail: self.thumbnail.clone()?,
            boxes: self.boxes.clone(),
        })
    }

    fn read_pixels(&mut self, folder: &Path) {
        let finding = match io::read::<PremulRgba>(folder.join(&self.path)) {
            Ok(picture) => {
                let (w, h) = picture.size();
                if w.min(h) >= MIN_SIDE_PX as usize {
                    self.thumbnail = Some(Thumbnail::new(&picture.map(|p| p.color())));
                    return;
                }
                let message = format!("{w} x {h} pixels, expected at least {MIN_SIDE_PX} a side");
                Finding::in_file(&self.path, Code::SmallImage, message)
            }
            Err(e) => Finding::unreadable(folder, &self.path, &e),
        };
        self.findings.push(finding);
    }

    fn read_labels(&mut self, folder: &Path, class_count: Option<usize>) {
        let path = folder.join(&self.label);
        let (text, is_marked) = match io::read_marked_text(&path) {
            Ok(read) => read,
            Err(e) if path.exists() => {
                let finding = Finding::unreadable(folder, &self.label, &e);
                return self.findings.push(finding);
            }
            Err(_) => {
                // A missing image is reported already.
                self.is_unlabelled = folder.join(&self.path).exists();
                return;
            }
        };
        if is_marked {
            let message = "a byte order mark, which is part of the class to trainers";
            let finding = Finding::in_line(&self.label, 1, Code::BadLabelRow, message);
            self.findings.push(finding);
        }
        self.is_empty = text.trim().is_empty();
        self.boxes = boxes_in(&text);
        let (rows, findings) = read_rows(&self.label, &text, class_count);
        self.rows = rows;
        self.findings.extend(findings);
    }

    pub(super) fn missing_label(&self) -> Finding {
        let mut message = format!("missing, but {} exists", self.path.display());
        if self.label != label_of(&self.path) {
            message += ": trainers replace the last `images` of its absolute path, without links, by `labels`";
        }
        Finding::in_file(&self.label, Code::MissingLabel, message)
    }
}

fn size_and_checksum(file: &Path) -> Option<(u64, u32)> {
    let sum = io::Checksum::from_file(file).ok()?;
    Some((sum.bytes, sum.crc32))
}
