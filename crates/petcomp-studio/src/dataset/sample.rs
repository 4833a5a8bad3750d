//! A picture with everything known about it, as the page shows it.

use crate::refusal::Answer;
use petcomp::dataset::index::DatasetIndex;
use petcomp::dataset::{SampleRecord, UnlabelledReason};
use petcomp::geom::{BBox, Point2};
use petcomp::label::{ObjectLabel, RleMask};
use petcomp::{ObjectId, io};
use serde::Serialize;
use std::collections::BTreeMap;

/// A picture and its contents.
#[derive(Debug, Default, Serialize)]
pub(super) struct SampleShown {
    name: String,
    /// Its file, relative to the dataset's folder.
    file: String,
    /// Width and height, pixels.
    image: [u32; 2],
    background: String,
    objects: Vec<ObjectShown>,
    /// Boxes of distractors, which have no label.
    distractors: Vec<[f64; 4]>,
    knotted: Vec<ObjectId>,
    /// Why scenes before this one were rejected.
    rejected: Vec<String>,
    /// Every drawn value by name.
    draws: BTreeMap<String, f64>,
}

/// An object in the picture; coordinates in pixels.
#[derive(Debug, Default, Serialize)]
struct ObjectShown {
    id: u32,
    class: u32,
    /// Its asset; empty if unknown.
    asset: String,
    /// Left, top, right and bottom of its label; of the whole object if it has none.
    bbox: [f64; 4],
    /// The same for its visible part.
    visible_box: Option<[f64; 4]>,
    outline: Vec<Vec<[f64; 2]>>,
    /// Run lengths of its mask, column by column, starting with the outside.
    mask: Vec<u32>,
    visible: Option<f64>,
    covered_by: Vec<ObjectId>,
    /// Why it has no label; none if it has one.
    unlabelled: Option<&'static str>,
}

impl SampleShown {
    pub(super) fn of(index: &DatasetIndex, row: usize) -> Answer<Self> {
        let shown = match index.record(row)? {
            Some(record) => Self::of_record(record),
            None => Self::of_boxes(index, row)?,
        };
        let picture = &index.pictures[row];
        let file = picture
            .file
            .strip_prefix(&index.folder)
            .unwrap_or(&picture.file);
        Ok(Self {
            name: picture.name.clone(),
            file: file.to_string_lossy().into_owned(),
            ..shown
        })
    }

    fn of_record(record: SampleRecord) -> Self {
        let objects = record.labels.objects.iter();
        Self {
            image: record.labels.image,
            background: record.drawn.plate.clone(),
            objects: objects
                .map(|object| ObjectShown::of(object, &record))
                .collect(),
            distractors: record
                .labels
                .distractors
                .iter()
                .map(|d| sides(&d.amodal_box))
                .collect(),
            knotted: record.knotted,
            rejected: record.rejected,
            draws: record.draws,
            ..Self::default()
        }
    }

    /// For a picture from another source, which has at most boxes.
    fn of_boxes(index: &DatasetIndex, row: usize) -> Answer<Self> {
        let header = io::read_header(index.file(row)?)?;
        let image = [header.width as u32, header.height as u32];
        let boxes = index.boxes(row)?.unwrap_or_default().into_iter().zip(1..);
        Ok(Self {
            image,
            objects: boxes
                .map(|((class, shares), id)| ObjectShown::of_box(id, class, shares, image))
                .collect(),
            ..Self::default()
        })
    }
}

impl ObjectShown {
    fn of(object: &ObjectLabel, record: &SampleRecord) -> Self {
        let place = (object.id.0 as usize).wrapping_sub(1);
        let drawn = record.drawn.objects.get(place);
        let is_seen = !object.visible_box.is_empty();
        Self {
            id: object.id.0,
            class: object.class,
            asset: drawn.map(|drawn| drawn.asset.clone()).unwrap_or_default(),
            bbox: sides(&object.amodal_box),
            visible_box: is_seen.then(|| sides(&object.visible_box)),
            outline: object.outline_px.iter().map(|ring| points(ring)).collect(),
            mask: RleMask::runs(&object.visible_mask).to_vec(),
            visible: Some(object.visible_fraction),
            covered_by: object.covered_by.clone(),
            unlabelled: UnlabelledReason::of(object, record).map(UnlabelledReason::description),
        }
    }

    fn of_box(id: u32, class: u32, [x, y, w, h]: [f64; 4], image: [u32; 2]) -> Self {
        let [width, height] = image.map(f64::from);
        let (left, top) = ((x - w / 2.0) * width, (y - h / 2.0) * height);
        Self {
            id,
            class,
            bbox: [left, top, left + w * width, top + h * height],
            ..Self::default()
        }
    }
}

fn sides(b: &BBox) -> [f64; 4] {
    [b.x0, b.y0, b.x1, b.y1]
}

fn points(ring: &[Point2<f64>]) -> Vec<[f64; 2]> {
    ring.iter().map(|point| [point.x, point.y]).collect()
}
