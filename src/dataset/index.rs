//! The pictures in a folder, listed without opening them; a picture's contents are read on demand.

pub use crate::dataset::page::labelled_pictures::ShareBox;
pub use crate::dataset::page::outlier::Outlier;

use crate::dataset::folder;
use crate::dataset::journal::lines_of;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::page::labelled_pictures::{LabelledPicture, listed_images, shares_of};
use crate::dataset::page::outlier::{Feature, outliers};
use crate::dataset::{JOURNAL, Labelling, Part, SampleRecord};
use crate::error::{Error, Result};
use crate::geom::BBox;
use crate::io;
use crate::label::{ObjectLabel, Truncation};
use crate::pixel::ObjectId;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The pictures of a dataset, or of any folder.
#[derive(Clone, Debug)]
pub struct DatasetIndex {
    /// The folder.
    pub folder: PathBuf,
    /// Names of the classes, in order; empty if unknown.
    pub classes: Vec<String>,
    /// The pictures, in order.
    pub pictures: Vec<IndexedPicture>,
    labelling: Labelling,
}

/// A picture in the list, not opened.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexedPicture {
    /// Its number, or its file's name.
    pub name: String,
    /// The part that it belongs to, if known.
    pub part: Option<Part>,
    /// Its file, below the dataset's folder for petcomp's own.
    pub file: PathBuf,
    /// What petcomp recorded about it.
    pub written: Option<WrittenPicture>,
}

/// What the list of petcomp's own pictures records about one.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenPicture {
    /// The file of its record, below the dataset's folder.
    pub record: String,
    /// Objects of each class, and how many of them have a label.
    pub classes: Vec<[u32; 2]>,
    /// Objects that something covers.
    pub obstructed: u32,
    /// Objects in cyclic overlap.
    pub knotted: u32,
    /// Scenes that were rejected before this one.
    pub rejected: u32,
    /// Size of the picture's file, bytes.
    pub bytes: u64,
}

/// Summary of a picture's contents.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PictureFacts {
    /// Name of the photo of the place; empty if unknown.
    pub background: String,
    /// Its objects, with or without a label.
    pub objects: Vec<ObjectFacts>,
    /// Objects without a class that are in the way.
    pub distractors: usize,
    /// Whether it has a label file or a record at all.
    pub is_labelled: bool,
}

/// Summary of an object of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ObjectFacts {
    /// Index into the class list.
    pub class: u32,
    /// Whether it has a label.
    pub labelled: bool,
    /// Visible share, 0 to 1; none if unknown.
    pub visible: Option<f32>,
    /// Centre, width and height of the box of its label as shares of the picture's; of the whole
    /// object if it has no label.
    pub bbox: [f32; 4],
}

impl DatasetIndex {
    /// Lists a dataset made by petcomp, a YOLO dataset, or a folder of images.
    ///
    /// # Errors
    /// A list or folder that cannot be read; no image.
    pub fn open(folder: &Path) -> Result<Self> {
        if folder.join(JOURNAL).is_file() {
            return Self::of_journal(folder);
        }
        let (classes, images) = listed_images(folder)?;
        if images.is_empty() {
            let what = "no images, expected a dataset or a folder of images";
            return Err(Error::file(folder, what));
        }
        Ok(Self {
            folder: folder.into(),
            classes,
            pictures: images.into_iter().map(IndexedPicture::found).collect(),
            labelling: Labelling::default(),
        })
    }

    fn of_journal(folder: &Path) -> Result<Self> {
        let identity = folder::known_identity(folder, "a dataset")?;
        let lines = lines_of(folder)?;
        let pictures = lines.into_iter().map(IndexedPicture::from_line);
        Ok(Self {
            folder: folder.into(),
            classes: folder::known_classes(&identity),
            labelling: Labelling::of_identity(&identity),
            pictures: pictures.collect::<Option<_>>().ok_or_else(|| {
                Error::file(
                    folder.join(JOURNAL),
                    "a sample without a picture or a record",
                )
            })?,
        })
    }

    /// The file of a picture.
    ///
    /// # Errors
    /// A picture of petcomp's that is no longer in the folder.
    pub fn file(&self, row: usize) -> Result<PathBuf> {
        let picture = &self.pictures[row];
        match picture.written {
            Some(_) => io::inside(&self.folder, &picture.file),
            None => Ok(picture.file.clone()),
        }
    }

    /// Summary of a picture's contents.
    ///
    /// # Errors
    /// A record or label that cannot be read.
    pub fn facts(&self, row: usize) -> Result<PictureFacts> {
        let picture = &self.pictures[row];
        match &picture.written {
            Some(written) => {
                let brief: BriefRecord = io::read_json(io::inside(&self.folder, &written.record)?)?;
                Ok(brief.facts(self.labelling))
            }
            None => Ok(PictureFacts::from_boxes(self.boxes(row)?)),
        }
    }

    /// Everything that petcomp recorded about a picture; none for one from elsewhere. Objects with
    /// a label have the label's class and, as `amodal_box`, the label's box.
    ///
    /// # Errors
    /// A record that cannot be read.
    pub fn record(&self, row: usize) -> Result<Option<SampleRecord>> {
        let written = self.pictures[row].written.as_ref();
        let read = |written: &WrittenPicture| {
            let record: SampleRecord = io::read_json(io::inside(&self.folder, &written.record)?)?;
            Ok(record.into_labelled(self.labelling))
        };
        written.map(read).transpose()
    }

    /// The boxes of a picture from elsewhere: class, centre, width and height as shares of the
    /// picture's; none without a label file.
    ///
    /// # Errors
    /// A label that cannot be read.
    pub fn boxes(&self, row: usize) -> Result<Option<Vec<ShareBox>>> {
        let picture = LabelledPicture::read(self.pictures[row].file.clone())?;
        Ok(picture.boxes)
    }

    /// The pictures that are unlike the others, the most unusual first, judged by the list and
    /// `facts`.
    pub fn unlike<'f>(&self, facts: impl Fn(usize) -> Option<&'f PictureFacts>) -> Vec<Outlier> {
        outliers(&self.features(facts))
    }

    /// The numbers that pictures are compared by.
    fn features<'f>(
        &self,
        facts: impl Fn(usize) -> Option<&'f PictureFacts>,
    ) -> [Feature<'static>; 6] {
        let of = |name, number: &dyn Fn(usize) -> Option<f64>| self.feature(name, number);
        let written = |row: usize| self.pictures[row].written.as_ref();
        [
            of("objects", &|row| self.count(row, facts(row), 0)),
            of("labels", &|row| self.count(row, facts(row), 1)),
            of("objects under others", &|row| {
                Some(written(row)?.obstructed.into())
            }),
            of("rejected scenes", &|row| {
                Some(written(row)?.rejected.into())
            }),
            of("bytes of the file", &|row| Some(written(row)?.bytes as f64)),
            of("percent visible of the least visible object", &|row| {
                facts(row)?.least_visible_percent()
            }),
        ]
    }

    /// A number for each picture; NaN if unknown.
    fn feature(
        &self,
        name: &'static str,
        number: &dyn Fn(usize) -> Option<f64>,
    ) -> Feature<'static> {
        let rows = 0..self.pictures.len();
        let values = rows.map(|row| number(row).unwrap_or(f64::NAN));
        Feature {
            name,
            values: values.collect(),
        }
    }

    /// How many objects (0) or labels (1) a picture has, if known.
    fn count(&self, row: usize, facts: Option<&PictureFacts>, which: usize) -> Option<f64> {
        let written = self.pictures[row].written.as_ref();
        let written = written.map(|written| f64::from(written.count(which)));
        written.or_else(|| Some(facts?.objects.len() as f64))
    }
}

impl IndexedPicture {
    fn found(file: PathBuf) -> Self {
        let name = file.file_name().unwrap_or_default();
        Self {
            name: name.to_string_lossy().into_owned(),
            part: None,
            written: None,
            file,
        }
    }

    fn from_line(line: JournalLine) -> Option<Self> {
        let of = |kind: &str| line.files.iter().find(|file| file.path.starts_with(kind));
        let (picture, record) = (of("images/")?, of("scenes/")?);
        Some(Self {
            name: line.k.to_string(),
            part: Some(line.part),
            file: picture.path.split('/').collect(),
            written: Some(WrittenPicture {
                record: record.path.clone(),
                bytes: picture.bytes,
                obstructed: line.obstructed,
                knotted: line.knotted,
                rejected: line.retries,
                classes: line.classes,
            }),
        })
    }
}

impl WrittenPicture {
    /// Objects (0) or labels (1) of all classes.
    pub fn count(&self, which: usize) -> u32 {
        self.classes.iter().map(|counts| counts[which]).sum()
    }
}

impl PictureFacts {
    fn from_boxes(boxes: Option<Vec<ShareBox>>) -> Self {
        let object = |(class, shares): &ShareBox| ObjectFacts {
            class: *class,
            labelled: true,
            visible: None,
            bbox: shares.map(|share| share as f32),
        };
        Self {
            is_labelled: boxes.is_some(),
            objects: boxes.iter().flatten().map(object).collect(),
            ..Self::default()
        }
    }

    /// Visible percentage of the least visible labelled object.
    fn least_visible_percent(&self) -> Option<f64> {
        let labelled = self.objects.iter().filter(|object| object.labelled);
        let visible = labelled.filter_map(|object| object.visible);
        visible
            .reduce(f32::min)
            .map(|share| f64::from(100.0 * share))
    }
}

/// The parts of a record that describe a picture's contents, without masks and scenes.
#[derive(Deserialize)]
struct BriefRecord {
    labelled: Vec<ObjectId>,
    #[serde(default)]
    topmost: Vec<ObjectId>,
    labels: BriefLabels,
    drawn: BriefScene,
}

#[derive(Deserialize)]
struct BriefLabels {
    image: [u32; 2],
    objects: Vec<BriefObject>,
    #[serde(default)]
    distractors: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
struct BriefObject {
    id: ObjectId,
    class: u32,
    visible_fraction: f64,
    #[serde(default)]
    amodal_box: BBox,
    #[serde(default)]
    visible_box: BBox,
    #[serde(default)]
    truncation: Option<Truncation>,
}

#[derive(Deserialize)]
struct BriefScene {
    #[serde(default)]
    plate: String,
}

impl BriefRecord {
    fn facts(self, labelling: Labelling) -> PictureFacts {
        let objects = self.labels.objects.iter();
        PictureFacts {
            objects: objects
                .map(|object| self.object_facts(object, labelling))
                .collect(),
            distractors: self.labels.distractors.len(),
            background: self.drawn.plate,
            is_labelled: true,
        }
    }

    fn object_facts(&self, object: &BriefObject, labelling: Labelling) -> ObjectFacts {
        let label = self.label_of(object, labelling);
        let (class, bbox) = label.unwrap_or((object.class, object.amodal_box));
        let bbox = shares_of(&bbox, self.labels.image.map(f64::from));
        ObjectFacts {
            class,
            labelled: label.is_some(),
            visible: Some(object.visible_fraction as f32),
            bbox: bbox.map(|share| share as f32),
        }
    }

    /// Class and box; none for an object without a label.
    fn label_of(&self, object: &BriefObject, labelling: Labelling) -> Option<(u32, BBox)> {
        let label = ObjectLabel {
            class: object.class,
            obstructed: Some(!self.topmost.contains(&object.id)),
            amodal_box: object.amodal_box,
            visible_box: object.visible_box,
            truncation: object.truncation,
            ..ObjectLabel::default()
        };
        let has_label = self.labelled.contains(&object.id);
        has_label.then(|| labelling.label_of(&label)).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::journal_line::test_line;

    const RECORD: &str = r#"{ "labelled": [2], "drawn": { "plate": "tray" }, "more": [1, 2],
        "labels": { "image": [8, 6], "objects": [
            { "id": 1, "class": 0, "visible_fraction": 0.25, "more": {} },
            { "id": 2, "class": 1, "visible_fraction": 1.0,
              "amodal_box": { "x0": 1.0, "y0": 1.0, "x1": 3.0, "y1": 4.0 } } ] } }"#;

    fn line(k: u64, objects: u32) -> JournalLine {
        let files = [
            format!("images/train/{k}.png"),
            format!("scenes/train/{k}.json"),
        ];
        JournalLine {
            classes: vec![[objects, 0], [1, 1]],
            obstructed: 1,
            ..test_line(k, &files.each_ref().map(String::as_str))
        }
    }

    fn dataset() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| {
            let path = folder.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        write(
            "dataset.json",
            r#"{ "format": 2, "classes": ["cap", "none"] }"#,
        );
        let objects = [1, 1, 2, 1, 40, 1, 1];
        let lines = objects
            .iter()
            .zip(0..)
            .map(|(&count, k)| line(k, count).text());
        write(JOURNAL, &lines.collect::<String>());
        write("images/train/0.png", "");
        write("scenes/train/0.json", RECORD);
        write("labels/train/0.txt", "1 0.5 0.5 0.2 0.1\n");
        folder
    }

    #[test]
    fn a_dataset_is_listed_by_its_journal_and_read_by_its_records() {
        let folder = dataset();
        let index = DatasetIndex::open(folder.path()).unwrap();
        assert_eq!((index.pictures.len(), index.classes.len()), (7, 2));
        let facts = index.facts(0).unwrap();
        assert_eq!((&facts.background[..], facts.objects.len()), ("tray", 2));
        assert_eq!(facts.objects[0].visible, Some(0.25));
        assert!(!facts.objects[0].labelled && facts.objects[1].labelled);
        assert!(index.file(0).unwrap().is_file());
        assert!(index.file(1).is_err() && index.facts(1).is_err());
    }

    #[test]
    fn the_strangest_picture_comes_first() {
        let index = DatasetIndex::open(dataset().path()).unwrap();
        let unlike = index.unlike(|_| None);
        assert_eq!((unlike.len(), unlike[0].row), (1, 4));
        assert_eq!(unlike[0].why, "objects 41, typically 2");
    }

    #[test]
    fn a_folder_of_images_is_listed_without_records() {
        let folder = dataset();
        let index = DatasetIndex::open(&folder.path().join("images")).unwrap();
        assert_eq!(index.record(0).unwrap(), None);
        let facts = index.facts(0).unwrap();
        assert!(facts.is_labelled && facts.objects[0].class == 1);
        let empty = tempfile::tempdir().unwrap();
        let error = DatasetIndex::open(empty.path()).unwrap_err().to_string();
        assert!(error.contains("no images"), "{error}");
    }
}
