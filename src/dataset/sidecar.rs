//! Everything known about a sample: one JSON file next to each image.

use crate::dataset::paths::create_part_folders;
use crate::dataset::{Entry, Labelling, Part, Provenance, Writer};
use crate::error::Result;
use crate::io;
use crate::label::{Labels, cyclic_overlaps};
use crate::pixel::ObjectId;
use crate::scene::{Drawn, Scene};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Writes `scenes/{train,val}/NNNNNN.json`, a [`SampleRecord`] each: label formats drop most of
/// what is known about a picture, this one nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sidecar;

/// Content of a sidecar file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampleRecord {
    /// Version of the program that made the sample.
    pub petcomp: String,
    /// Hash of the recipe and of the files it names.
    pub recipe_hash: String,
    /// Seed of the dataset.
    pub seed: u64,
    /// Seed that the scene was drawn with: the dataset's own, unless scenes were rejected.
    pub scene_seed: u64,
    /// Number of the sample.
    pub index: u64,
    /// Part of the dataset.
    pub part: Part,
    /// Objects that have a label in the dataset's other files.
    pub labelled: Vec<ObjectId>,
    /// Objects that are not obstructed, by the recipe's rule.
    pub topmost: Vec<ObjectId>,
    /// Objects in cyclic overlap.
    pub knotted: Vec<ObjectId>,
    /// Why each scene that was drawn before this one was rejected.
    pub rejected: Vec<String>,
    /// Every drawn value by the name of its draw.
    pub draws: BTreeMap<String, f64>,
    /// Its labels.
    pub labels: Labels,
    /// What was drawn: objects not settled yet, exposure still open.
    pub drawn: Scene,
    /// What the picture was made from: camera, resting poses, lights, exposure.
    pub scene: Scene,
}

impl Writer for Sidecar {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "sidecar": {} })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, "scenes")
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let Some(provenance) = &entry.sample.provenance else {
            return Ok(Vec::new());
        };
        let path = entry.path("scenes", "json");
        io::write_json(folder.join(&path), &SampleRecord::new(entry, provenance))?;
        Ok(vec![path])
    }
}

impl SampleRecord {
    /// Everything known about an entry.
    fn new(entry: &Entry<'_>, provenance: &Provenance) -> Self {
        let labels = &entry.sample.labels;
        Self {
            petcomp: env!("CARGO_PKG_VERSION").to_owned(),
            recipe_hash: entry.recipe_hash.to_owned(),
            seed: entry.seed,
            scene_seed: provenance.scene_seed,
            index: entry.k,
            part: entry.part,
            labelled: labelled_ids(entry),
            topmost: topmost_ids(labels),
            knotted: cyclic_overlaps(&labels.objects),
            rejected: provenance.rejected.clone(),
            draws: values_by_path(&provenance.draws),
            labels: labels.clone(),
            drawn: provenance.drawn.clone(),
            scene: provenance.scene.clone(),
        }
    }

    /// The record with the classes and boxes that objects are labelled with: the `amodal_box` of a
    /// labelled object is its label's, whatever that is around. Objects to be ignored, or without
    /// such a box, count as objects without a label.
    pub(crate) fn into_labelled(mut self, labelling: Labelling) -> Self {
        for object in &mut self.labels.objects {
            if !self.labelled.contains(&object.id) {
                continue;
            }
            match labelling.label_of(object) {
                Some(label) => (object.class, object.amodal_box) = label,
                None => self.labelled.retain(|&id| id != object.id),
            }
        }
        self
    }
}

fn values_by_path(draws: &[Drawn]) -> BTreeMap<String, f64> {
    draws
        .iter()
        .map(|draw| (draw.path.clone(), draw.value))
        .collect()
}

fn labelled_ids(entry: &Entry<'_>) -> Vec<ObjectId> {
    entry.labelled.iter().map(|label| label.object.id).collect()
}

fn topmost_ids(labels: &Labels) -> Vec<ObjectId> {
    let topmost = labels.objects.iter().filter(|object| object.is_topmost());
    topmost.map(|object| object.id).collect()
}
