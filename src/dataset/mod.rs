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
mod formats;
mod generate;
mod journal;
mod obstructed;
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
pub use formats::{Format, LabelSetup};
pub use generate::{Plan, Progress, generate};
pub use journal::{ClassCount, Report};
pub use obstructed::{Labelled, OBSTRUCTED, Obstructed};
pub use pictures::{PictureFormat, Pictures};
pub use setup::Setup;
pub use sidecar::{Record, Sidecar};
pub use split::{Part, Split, SplitOrder};
pub use studio::Studio;
pub use yolo::{Yolo, YoloBox, YoloTask};

use crate::error::Result;
use crate::image::Image;
use crate::label::Labels;
use crate::pixel::PremulRgba;
use crate::render::DeepImage;
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// One finished picture and all that is known of it.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The picture, scene-linear.
    pub frame: Image<PremulRgba>,
    /// What it was put together from; without pixels where nobody is to write it.
    pub deep: DeepImage,
    /// What is where in it.
    pub labels: Labels,
    /// What was drawn: objects still in the air, exposure still open.
    pub drawn: Scene,
    /// What that became, with nothing left open.
    pub scene: Scene,
    /// Seed that the scene was drawn with: the dataset's own, unless scenes were thrown away.
    pub scene_seed: u64,
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
    /// Names of the classes, in order.
    pub classes: &'a [String],
    /// Hash of what the dataset is made from.
    pub recipe_hash: &'a str,
    /// The part that it belongs to.
    pub part: Part,
    /// The sample.
    pub sample: &'a Sample,
    /// The objects that get a label, in order of id.
    pub labelled: &'a [Labelled<'a>],
}

impl Entry<'_> {
    /// Path below the dataset's folder: `images/train/000012.png`.
    pub fn path(&self, kind: &str, extension: &str) -> PathBuf {
        [kind, self.part.name(), &format!("{:06}.{extension}", self.k)].iter().collect()
    }
}

/// A sample whose files are all there: what a [`Writer`] joins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Its number.
    pub k: u64,
    /// The part that it belongs to.
    pub part: Part,
    /// Its files below the dataset's folder, those of all writers, in their order.
    pub files: Vec<PathBuf>,
}

/// A layout that a dataset is written in.
///
/// A layout with one file for many samples writes a file of its own for each sample first, and joins those when all are
/// there: so every file of a sample can be made again alone, on any machine, and no run has to remember another.
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

    /// Writes the files that hold many samples, from `samples`' own files, which are in order of number and all there;
    /// takes away what an earlier call left and this one has no use for. By default there are no such files.
    ///
    /// Called when a dataset is complete: at the end of a run, and after shards were joined. The bytes depend on nothing
    /// but the samples' files, the classes and the settings.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    fn finish(&self, folder: &Path, classes: &[String], samples: &[Written]) -> Result<()> {
        let _ = (folder, classes, samples);
        Ok(())
    }
}
