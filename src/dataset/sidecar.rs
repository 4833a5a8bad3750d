//! Everything known of a sample, one JSON file beside each image.

use crate::dataset::{Entry, Part, Writer};
use crate::error::Result;
use crate::io;
use crate::label::Labels;
use crate::pixel::ObjectId;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Writes `scenes/{train,val}/NNNNNN.json`, a [`Record`] each: label formats forget most of what is known of a picture,
/// this one nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sidecar;

/// What a sidecar file says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of the program that made the sample.
    pub petcomp: String,
    /// Seed of the dataset.
    pub seed: u64,
    /// Number of the sample.
    pub index: u64,
    /// Part of the dataset.
    pub part: Part,
    /// Objects that have a label in the dataset's other files.
    pub labelled: Vec<ObjectId>,
    /// Scenes that were drawn and thrown away before this one.
    pub retries: u32,
    /// What is where in the picture.
    pub labels: Labels,
    /// What the picture was made from: camera, poses, lights, and every other drawn value.
    pub scene: Scene,
}

impl Writer for Sidecar {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "sidecar": {} })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        for dir in Part::ALL.map(|part| folder.join("scenes").join(part.name())) {
            io::create_folder(&dir)?;
        }
        Ok(())
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let record = Record {
            petcomp: env!("CARGO_PKG_VERSION").to_owned(),
            seed: entry.seed,
            index: entry.k,
            part: entry.part,
            labelled: entry.labelled.iter().map(|object| object.id).collect(),
            retries: entry.sample.retries,
            labels: entry.sample.labels.clone(),
            scene: entry.sample.scene.clone(),
        };
        let path = entry.path("scenes", "json");
        io::write_json(folder.join(&path), &record)?;
        Ok(vec![path])
    }
}
