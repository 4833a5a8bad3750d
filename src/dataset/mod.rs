//! Dataset: images and labels in the layouts that trainers read.
//!
//! A [`Studio`] opens what a recipe file ([`Setup`]) names and makes sample `k` of it: draws the scene, lets it settle,
//! lights, renders and labels it.
//!
//! [`generate`] makes samples, many at a time, and hands each to [`Writer`]s: [`Pictures`] writes the images, [`Yolo`]
//! the labels, [`Sidecar`] everything that was drawn. Sample `k` has the same files, to the byte, whatever the number of
//! threads, and after any interruption:
//!
//! ```text
//! data.yaml                      what trainers are given
//! images/{train,val}/000000.png
//! labels/{train,val}/000000.txt
//! scenes/{train,val}/000000.json
//! dataset.json                   what the folder was made from
//! index.jsonl                    one line for each finished sample
//! ```

mod check;
mod contact_sheet;
mod folder;
mod generate;
mod journal;
mod pictures;
mod place;
mod setup;
mod sidecar;
mod split;
mod studio;
mod yolo;
mod yolo_yaml;

pub use check::{Checked, Fault, check};
pub use contact_sheet::{SheetOptions, Tile, contact_sheet, contact_sheet_of};
pub use generate::{Plan, Progress, generate};
pub(crate) use journal::read as journal_lines;
pub use journal::{ClassCount, Report};
pub use pictures::{PictureFormat, Pictures};
pub use setup::Setup;
pub use sidecar::{Record, Sidecar};
pub use split::{Part, Split, SplitOrder};
pub use studio::Studio;
pub use yolo::{Yolo, YoloBox, YoloTask};

use crate::error::Result;
use crate::image::Image;
use crate::label::{Labels, ObjectLabel};
use crate::pixel::PremulRgba;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// One finished picture and all that is known of it.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The picture, scene-linear.
    pub frame: Image<PremulRgba>,
    /// What is where in it.
    pub labels: Labels,
    /// What it was made from, with nothing left open.
    pub scene: Scene,
    /// Scenes that were drawn and thrown away before this one.
    pub retries: u32,
}

/// A sample and its place in the dataset: what a [`Writer`] writes.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a> {
    /// Its number.
    pub k: u64,
    /// Seed of the dataset.
    pub seed: u64,
    /// The part that it belongs to.
    pub part: Part,
    /// The sample.
    pub sample: &'a Sample,
    /// The objects that get a label, in order of id.
    pub labelled: &'a [&'a ObjectLabel],
}

impl Entry<'_> {
    /// Path below the dataset's folder: `images/train/000012.png`.
    pub fn path(&self, kind: &str, extension: &str) -> PathBuf {
        [kind, self.part.name(), &format!("{:06}.{extension}", self.k)].iter().collect()
    }
}

/// A layout that a dataset is written in.
pub trait Writer: Sync {
    /// Its name and settings: written into `dataset.json`, and compared before a dataset is continued.
    fn settings(&self) -> serde_json::Value;

    /// Writes what belongs to no one sample: folders, lists of classes. Called once in each run, before any sample.
    ///
    /// # Errors
    /// When a file cannot be written.
    fn begin(&self, folder: &Path, classes: &[String]) -> Result<()>;

    /// Writes the files of one sample and returns their paths below the folder.
    ///
    /// The bytes depend on nothing but the entry.
    ///
    /// # Errors
    /// When a file cannot be written, or the sample is one that the layout cannot hold.
    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>>;
}

/// What happens to the labels of objects that something lies over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Obstructed {
    /// They get none: a detector of what can be picked, as in the paper.
    #[default]
    Drop,
    /// They are labelled like the others.
    Keep,
}

impl Obstructed {
    /// The objects that get a label.
    pub fn labelled(self, labels: &Labels) -> Vec<&ObjectLabel> {
        labels.objects.iter().filter(|o| self == Self::Keep || o.is_topmost()).collect()
    }
}
