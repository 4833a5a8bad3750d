//! Labels for YOLO: one text file per image, one line per object, and `data.yaml`.

use crate::dataset::formats::is_exact;
use crate::dataset::page::labelled_pictures::shares_of;
use crate::dataset::paths::create_part_folders;
use crate::dataset::yolo_yaml::DataYaml;
use crate::dataset::{Entry, Extent, LabelledObject, Writer};
use crate::error::{Error, Result};
use crate::geom::Point2;
use crate::io;
use crate::label::{ObjectLabel, trace};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The file to give to trainers.
const DATA_YAML: &str = "data.yaml";

/// Minimum side of an image, pixels: trainers reject smaller ones.
pub(crate) const MIN_SIDE_PX: u32 = 10;

/// Writes `labels/{train,val}/NNNNNN.txt` and `data.yaml`.
///
/// Rows of `detect` are `class cx cy w h`, of `segment` `class x1 y1 x2 y2 ...`; positions are
/// shares of the image's width and height, 0 to 1, six decimals. An image without objects has an
/// empty file; equal rows are written once; objects to be ignored have none.
///
/// `data.yaml` names its folders relative to itself, so the dataset may be moved: Ultralytics looks
/// for them next to the file; YOLOv5 looks in the folder of its clone unless `path:` is added with
/// the absolute path of the dataset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Yolo {
    /// What is learned. Default: `detect`.
    pub task: YoloTask,
    /// Whether rows describe the whole object or its visible part. Default: `amodal`.
    pub boxes: Extent,
    /// Maximum distance of a border from that of the mask, pixels; in a recipe, that of `labels`.
    /// Default: 0, along pixels.
    #[serde(skip_deserializing, skip_serializing_if = "is_exact")]
    pub simplify: f64,
}

/// What a row describes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum YoloTask {
    /// A box.
    #[default]
    Detect,
    /// The border of the mask, along the edges of its pixels or near them (`labels.simplify`): one
    /// closed line, holes and parts joined by slits.
    Segment,
}

impl Writer for Yolo {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "yolo": self })
    }

    fn extent(&self) -> Option<Extent> {
        Some(self.boxes)
    }

    fn has_label_of(&self, object: &ObjectLabel) -> bool {
        match self.task {
            YoloTask::Detect => self.boxes.has_box(object),
            YoloTask::Segment => self.boxes.has_mask(object),
        }
    }

    fn begin(&self, folder: &Path, classes: &[String]) -> Result<()> {
        create_part_folders(folder, "labels")?;
        io::write_text(folder.join(DATA_YAML), &DataYaml::write(classes))
    }

    fn for_trainers(&self) -> Vec<PathBuf> {
        vec![DATA_YAML.into()]
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        check_sides(entry.sample.labels.image)?;
        let path = entry.path("labels", "txt");
        io::write_text(folder.join(&path), &self.rows(entry))?;
        Ok(vec![path])
    }
}

fn check_sides([w, h]: [u32; 2]) -> Result<()> {
    if w.min(h) >= MIN_SIDE_PX {
        return Ok(());
    }
    let what = format!("{w} x {h} pixels, expected at least {MIN_SIDE_PX} a side for YOLO");
    Err(Error::value("image", what))
}

impl Yolo {
    /// The label file of one image.
    fn rows(&self, entry: &Entry<'_>) -> String {
        let image = entry.sample.labels.image.map(f64::from);
        let mut rows: Vec<String> = Vec::new();
        for row in entry
            .labelled
            .iter()
            .filter(|label| !label.ignored)
            .filter_map(|label| self.row_of(label, image))
        {
            if !rows.contains(&row) {
                rows.push(row);
            }
        }
        rows.concat()
    }

    fn row_of(
        &self,
        &LabelledObject { object, class, .. }: &LabelledObject<'_>,
        image: [f64; 2],
    ) -> Option<String> {
        let (chosen, mask) = self.boxes.of(object);
        self.has_label_of(object).then(|| match self.task {
            YoloTask::Detect => row(class, shares_of(&chosen, image)),
            YoloTask::Segment => ring_row(class, &trace::polygon(mask, self.simplify), image),
        })
    }
}

fn ring_row(class: u32, ring: &[Point2<f64>], [w, h]: [f64; 2]) -> String {
    row(class, ring.iter().flat_map(|p| [p.x / w, p.y / h]))
}

fn row(class: u32, shares: impl IntoIterator<Item = f64>) -> String {
    let mut row = class.to_string();
    for share in shares {
        write!(row, " {:.6}", share.clamp(0.0, 1.0)).expect("a string takes all that is written");
    }
    row.push('\n');
    row
}
