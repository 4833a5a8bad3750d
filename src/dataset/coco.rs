//! Labels in COCO format: one JSON document for each part of the dataset.

use crate::dataset::comparison::Comparison;
use crate::dataset::formats::is_exact;
use crate::dataset::paths::{create_part_folders, remove_files};
use crate::dataset::{Entry, Extent, LabelledObject, Part, PictureFormat, Writer, Written};
use crate::error::{Error, Result};
use crate::geom::BBox;
use crate::io;
use crate::label::{ObjectLabel, RleMask, trace};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// Numbers reserved for the annotations of one image. Ids are computed from the number of the image
/// and of the object, so they never change, whichever images are present.
const IDS_PER_IMAGE: u64 = 1 << 16;

/// Folder of the per-image documents that are joined.
const PARTS_FOLDER: &str = "coco";

/// Folder of the documents.
const ANNOTATIONS: &str = "annotations";

/// The document of a part.
fn document(part: Part) -> PathBuf {
    Path::new(ANNOTATIONS).join(format!("instances_{}.json", part.name()))
}

/// Writes `annotations/instances_{train,val}.json`, joined from `coco/{train,val}/NNNNNN.json`.
///
/// The id of an image is its number; categories are numbered from 1, since trainers treat 0 as
/// background, and so are annotations, since COCO's evaluation treats 0 as none. An object whose
/// mask has no pixel has no annotation, whatever its box. Objects to be ignored are `iscrowd`, with
/// run lengths whatever `masks` is. Annotations also have `visible_fraction` and `topmost`, which
/// other programs ignore; with `labels.max_truncation` also `truncation` (the share outside the
/// picture), `amodal_bbox` (around the whole outline, including what is beyond the picture's edges)
/// and `visible_bbox` (around the visible part; missing if nothing is visible).
///
/// On a belt the documents are in COCO-VID format: `videos`, in each image `video_id` and
/// `frame_id` (from 0), in each annotation `instance_id`, which identifies an object throughout its
/// sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Coco {
    /// How masks are written. Default: `rle`.
    pub masks: CocoMask,
    /// Whether boxes and masks are those of the whole object or of its visible part. Default:
    /// `amodal`.
    pub boxes: Extent,
    /// Format of the pictures that it refers to; in a recipe, that of `pictures`.
    #[serde(skip)]
    pub pictures: PictureFormat,
    /// How far polygons may be from the border of a mask, pixels; in a recipe, that of `labels`.
    /// Default: 0, along pixels.
    #[serde(skip_deserializing, skip_serializing_if = "is_exact")]
    pub simplify: f64,
}

/// How masks are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CocoMask {
    /// Compressed run lengths: exact.
    #[default]
    Rle,
    /// Polygons along the edges of pixels or near them (`labels.simplify`), one for each part,
    /// holes joined by slits.
    Polygon,
}

/// One image's share of the document.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ImageShare {
    image: CocoImage,
    annotations: Vec<Annotation>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct CocoImage {
    id: u64,
    file_name: String,
    width: u32,
    height: u32,
    /// Sequence, and picture in it, on a belt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    video_id: Option<u64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frame_id: Option<u64>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Annotation {
    id: u64,
    image_id: u64,
    category_id: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    instance_id: Option<u64>,
    bbox: [f64; 4],
    area: u64,
    iscrowd: u8,
    visible_fraction: f64,
    topmost: bool,
    /// Its share outside the picture, and both boxes, if `max_truncation` is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    truncation: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    amodal_bbox: Option<[f64; 4]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    visible_bbox: Option<[f64; 4]>,
    segmentation: Segmentation,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Segmentation {
    Runs(RleMask),
    Polygons(Vec<Vec<f64>>),
}

impl Writer for Coco {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "coco": self })
    }

    fn extent(&self) -> Option<Extent> {
        Some(self.boxes)
    }

    fn has_label_of(&self, object: &ObjectLabel) -> bool {
        self.boxes.has_mask(object)
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, PARTS_FOLDER)
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let path = entry.path(PARTS_FOLDER, "json");
        io::write_json(folder.join(&path), &self.share(entry)?)?;
        Ok(vec![path])
    }

    fn for_trainers(&self) -> Vec<PathBuf> {
        Part::ALL.map(document).into()
    }

    fn reopen(&self, folder: &Path) -> Result<()> {
        remove_files(folder, Part::ALL.map(document))
    }

    fn finish(&self, folder: &Path, classes: &[String], samples: &[Written]) -> Result<()> {
        io::create_folder(folder.join(ANNOTATIONS))?;
        Part::ALL.iter().try_for_each(|&part| {
            let path = folder.join(document(part));
            let shares = samples.iter().filter(|sample| sample.part == part);
            io::write_through(&path, |out| {
                write_info(out)?;
                join(out, folder, classes, shares)
            })
        })
    }

    fn changed(&self, folder: &Path, classes: &[String], samples: &[Written]) -> Vec<PathBuf> {
        let is_changed = |part: &Part| {
            let shares = samples.iter().filter(|sample| sample.part == *part);
            !is_joined(folder, *part, classes, shares)
        };
        let changed = Part::ALL.into_iter().filter(is_changed);
        changed.map(document).collect()
    }
}

impl Coco {
    fn share(&self, entry: &Entry<'_>) -> Result<ImageShare> {
        Ok(ImageShare {
            image: self.image_of(entry),
            annotations: self.annotations(entry)?,
        })
    }

    fn annotations(&self, entry: &Entry<'_>) -> Result<Vec<Annotation>> {
        let labels = entry.labelled.iter();
        labels
            .filter_map(|label| self.annotation(entry, label).transpose())
            .collect()
    }

    fn image_of(&self, entry: &Entry<'_>) -> CocoImage {
        let [width, height] = entry.sample.labels.image;
        CocoImage {
            id: entry.k,
            file_name: format!("{:06}.{}", entry.k, self.pictures.extension()),
            width,
            height,
            video_id: entry.belt().map(|belt| belt.sequence),
            frame_id: entry.belt().map(|belt| belt.frame),
        }
    }

    /// None for an object without a box or a mask.
    fn annotation(
        &self,
        entry: &Entry<'_>,
        label: &LabelledObject<'_>,
    ) -> Result<Option<Annotation>> {
        let (k, object) = (entry.k, label.object);
        if !self.has_label_of(object) {
            return Ok(None);
        }
        let (b, mask) = self.boxes.of(object);
        Ok(Some(Annotation {
            id: annotation_id(k, object.id.0)?,
            image_id: k,
            category_id: label.class + 1,
            instance_id: instance_id(entry, object.id.0)?,
            bbox: bbox_of(&b),
            area: mask.area(),
            iscrowd: u8::from(label.ignored),
            visible_fraction: object.visible_fraction,
            topmost: object.is_topmost(),
            truncation: object.truncation.map(|t| t.fraction),
            amodal_bbox: object.truncation.map(|t| bbox_of(&t.whole_box)),
            visible_bbox: visible_bbox(object),
            segmentation: self.segmentation(mask, label.ignored),
        }))
    }

    fn segmentation(&self, mask: &RleMask, ignored: bool) -> Segmentation {
        let polygons = match self.masks {
            CocoMask::Polygon if !ignored => trace::polygons(mask, self.simplify),
            _ => Vec::new(),
        };
        // Readers reject an annotation without polygons.
        if polygons.is_empty() {
            return Segmentation::Runs(mask.clone());
        }
        let rings = polygons.iter();
        let rings = rings.map(|ring| ring.iter().flat_map(|p| [p.x, p.y]).collect());
        Segmentation::Polygons(rings.collect())
    }
}

/// Left, top, width, height.
fn bbox_of(b: &BBox) -> [f64; 4] {
    [b.x0, b.y0, b.width(), b.height()]
}

/// In addition to the box of the whole object; none if nothing of it is visible.
fn visible_bbox(object: &ObjectLabel) -> Option<[f64; 4]> {
    let is_told = object.truncation.is_some() && !object.visible_box.is_empty();
    is_told.then(|| bbox_of(&object.visible_box))
}

fn annotation_id(k: u64, object: u32) -> Result<u64> {
    let own = u64::from(object);
    let id = k
        .checked_mul(IDS_PER_IMAGE)
        .and_then(|first| first.checked_add(own));
    id.filter(|_| (1..IDS_PER_IMAGE).contains(&own))
        .ok_or_else(|| {
            let most = IDS_PER_IMAGE - 1;
            let what = format!("object {object}, expected 1 to {most} for COCO");
            Error::value("labels.objects", what)
        })
}

/// The number of an object throughout its sequence; none without a sequence.
fn instance_id(entry: &Entry<'_>, object: u32) -> Result<Option<u64>> {
    let belt = entry.belt();
    belt.map(|belt| annotation_id(belt.sequence, object))
        .transpose()
}

/// Whether the document of a part holds the shares of these samples, whichever petcomp wrote it.
fn is_joined<'a>(
    folder: &Path,
    part: Part,
    classes: &[String],
    samples: impl Iterator<Item = &'a Written>,
) -> bool {
    let Ok(file) = File::open(folder.join(document(part))) else {
        return false;
    };
    let mut file = BufReader::new(file);
    let has_info = file.skip_until(b'\n').is_ok();
    let mut rest = Comparison::new(file);
    has_info && join(&mut rest, folder, classes, samples).is_ok() && rest.is_at_end()
}

/// Writes the first line of a document.
fn write_info(out: &mut dyn Write) -> std::io::Result<()> {
    let version = env!("CARGO_PKG_VERSION");
    writeln!(out, "{{\"info\":{{\"description\":\"petcomp {version}\"}},")
}

/// Writes the rest of the document of a part, one image or annotation a line; holds one image's
/// share in memory at a time.
fn join<'a>(
    out: &mut dyn Write,
    folder: &Path,
    classes: &[String],
    samples: impl Iterator<Item = &'a Written>,
) -> std::io::Result<()> {
    writeln!(out, "\"categories\":{},", categories(classes))?;
    let mut images = Vec::new();
    write!(out, "\"annotations\":[")?;
    let mut comma = "\n";
    for sample in samples {
        let share = read_share(folder, sample)?;
        images.push(share.image);
        for annotation in &share.annotations {
            write_entry(out, &mut comma, annotation)?;
        }
    }
    write!(out, "],\n\"images\":[")?;
    comma = "\n";
    for image in &images {
        write_entry(out, &mut comma, image)?;
    }
    write_videos(out, &images)?;
    writeln!(out, "]}}")
}

/// The list of sequences, if there are any.
fn write_videos(out: &mut dyn Write, images: &[CocoImage]) -> std::io::Result<()> {
    let ids: BTreeSet<u64> = images.iter().filter_map(|image| image.video_id).collect();
    let mut comma = "],\n\"videos\":[\n";
    for id in ids {
        write_entry(
            out,
            &mut comma,
            &json!({ "id": id, "name": format!("{id:06}") }),
        )?;
    }
    Ok(())
}

fn read_share(folder: &Path, sample: &Written) -> std::io::Result<ImageShare> {
    let file = io::inside(folder, sample.file(PARTS_FOLDER)?).map_err(std::io::Error::other)?;
    io::read_json(file).map_err(std::io::Error::other)
}

/// Writes an entry of a list on a line of its own.
fn write_entry(
    out: &mut dyn Write,
    comma: &mut &str,
    entry: &impl Serialize,
) -> std::io::Result<()> {
    write!(out, "{comma}{}", serde_json::to_string(entry)?)?;
    *comma = ",\n";
    Ok(())
}

fn categories(classes: &[String]) -> serde_json::Value {
    let numbered = (1_u64..).zip(classes);
    numbered
        .map(|(id, name)| json!({ "id": id, "name": name, "supercategory": "object" }))
        .collect()
}
