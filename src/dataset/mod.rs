//! Dataset: images and labels in the layouts that trainers read.
//!
//! A [`Pipeline`] opens what a recipe file ([`DatasetConfig`]) names and generates sample `k` from
//! it: draws the scene, lets it settle, lights, renders and labels it.
//!
//! [`generate`] generates samples, many at a time, and hands each to [`Writer`]s: [`Pictures`]
//! writes the images, [`Sidecar`] everything that was drawn, [`Yolo`], [`Coco`], [`Voc`], [`Mot`],
//! [`WebDataset`] and [`Layers`] the labels. Sample `k` has the same files, to the byte, whatever
//! the number of threads, and after any interruption:
//!
//! ```text
//! data.yaml                      what trainers are given
//! images/{train,val}/000000.png
//! labels/{train,val}/000000.txt
//! scenes/{train,val}/000000.json
//! dataset.json                   what the folder was made from
//! index.jsonl                    one line for each finished sample
//! ```

mod archive_store;
mod archives;
mod background_photo;
mod check;
mod coco;
mod comparison;
mod config;
mod contact_sheet;
mod counts;
mod environment_maps;
mod estimate;
mod eval_truth;
mod falls;
mod finding;
mod fingerprint;
#[doc(hidden)]
pub mod fit;
mod folder;
mod formats;
mod generate;
mod idle_keys;
#[doc(hidden)]
pub mod index;
mod inputs;
mod journal;
mod journal_line;
mod known_files;
mod label_table;
mod layers;
mod listing;
mod merge;
mod mot;
mod near_duplicates;
mod obstructed;
#[doc(hidden)]
pub mod page;
mod partition;
mod paths;
mod photo_memory;
mod pictures;
mod pipeline;
mod preset;
mod quality;
#[doc(hidden)]
pub mod recipe_text;
mod run;
mod scene_config;
#[doc(hidden)]
pub mod settings;
mod shard;
mod sidecar;
mod split;
mod summary;
mod times;
mod voc;
mod webdataset;
mod yolo;
mod yolo_set;
mod yolo_yaml;

#[doc(hidden)]
pub use archive_store::ArchiveStore;
#[doc(hidden)]
pub use archives::repair_archives;
pub use check::{Checked, check};
pub use coco::Coco;
#[doc(hidden)]
pub use coco::CocoMask;
pub use config::DatasetConfig;
#[doc(hidden)]
pub use contact_sheet::contact_sheet_of;
#[doc(hidden)]
pub use counts::ClassCount;
pub use counts::DatasetCounts;
#[doc(hidden)]
pub use estimate::{LongRun, RunPace};
#[doc(hidden)]
pub use eval_truth::EvalTruth;
pub use finding::Finding;
#[doc(hidden)]
pub use folder::JOURNAL;
#[doc(hidden)]
pub use formats::Extent;
pub use formats::{Format, LabelConfig};
pub use generate::{Plan, generate};
#[doc(hidden)]
pub use inputs::Inputs;
#[cfg(feature = "fuzzing")]
pub(crate) use journal::read_lines as journal_lines;
#[doc(hidden)]
pub use journal::{listed_files, repair};
pub use layers::Layers;
pub use merge::merge;
#[doc(hidden)]
pub use mot::Mot;
#[doc(hidden)]
pub use near_duplicates::{NEAR_DUPLICATE_RMS, NearDuplicate};
pub(crate) use obstructed::Labelling;
pub use obstructed::{LabelledObject, Obstructed};
#[doc(hidden)]
pub use partition::{Group, Leakage, Partition};
pub use pictures::{PictureFormat, Pictures};
pub use pipeline::Pipeline;
#[doc(hidden)]
pub use preset::Preset;
pub use run::Progress;
#[doc(hidden)]
pub use shard::ShardChoice;
pub use shard::{SampleRange, Shard};
pub use sidecar::{SampleRecord, Sidecar};
#[doc(hidden)]
pub use split::SplitOrder;
pub use split::{Part, Split};
#[doc(hidden)]
pub use summary::{SampleSummary, ShownSample, Summary, UnlabelledReason};
#[doc(hidden)]
pub use times::Times;
pub use voc::Voc;
pub use webdataset::WebDataset;
pub use yolo::Yolo;
#[doc(hidden)]
pub use yolo::YoloTask;
#[doc(hidden)]
pub use yolo_set::YoloSet;
#[cfg(feature = "fuzzing")]
pub(crate) use yolo_yaml::DataYaml;
pub(crate) use yolo_yaml::yaml_names;

use crate::deep::DeepImage;
use crate::error::Result;
use crate::image::Image;
use crate::label::{Labels, ObjectLabel};
use crate::pixel::{ObjectId, PremulRgba};
use crate::scene::{Belt, Drawn, Scene};
use std::path::{Path, PathBuf};

/// One finished picture and all that is known of it.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The picture, scene-linear.
    pub frame: Image<PremulRgba>,
    /// What it was composed from; without pixels if nobody is to write it.
    pub deep: DeepImage,
    /// What is where in it.
    pub labels: Labels,
    /// The scene behind it; none for a picture that was made some other way.
    pub provenance: Option<Provenance>,
    /// How long it took; not written to the dataset's files.
    pub times: Times,
}

/// Where a picture comes from: the scene as it was drawn, and what it became.
#[derive(Clone, Debug)]
pub struct Provenance {
    /// What was drawn: objects not settled yet, exposure still open.
    pub drawn: Scene,
    /// The same scene with nothing left open.
    pub scene: Scene,
    /// Seed that the scene was drawn with: the dataset's own, unless scenes were rejected.
    pub scene_seed: u64,
    /// Why each scene that was drawn before this one was rejected.
    pub rejected: Vec<String>,
    /// Every draw that the scene was made with, in order.
    pub draws: Vec<Drawn>,
}

impl Provenance {
    /// The provenance of a scene without any random draws.
    pub fn from_scene(scene: Scene) -> Self {
        Self {
            drawn: scene.clone(),
            scene,
            scene_seed: 0,
            rejected: Vec::new(),
            draws: Vec::new(),
        }
    }
}

impl Sample {
    /// A picture from anywhere with its labels: all that most layouts need.
    ///
    /// [`Layers`] also needs `deep`; [`Sidecar`] writes a file only if there is a `provenance`.
    pub fn new(frame: Image<PremulRgba>, labels: Labels) -> Self {
        Self {
            frame,
            deep: DeepImage::default(),
            labels,
            provenance: None,
            times: Times::default(),
        }
    }

    /// Number of scenes that were rejected before this one.
    pub(crate) fn rejected_scenes(&self) -> usize {
        self.provenance
            .as_ref()
            .map_or(0, |provenance| provenance.rejected.len())
    }
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
    pub labelled: &'a [LabelledObject<'a>],
}

impl Entry<'_> {
    /// The label of an object, if it has one.
    pub(crate) fn label_of(&self, id: ObjectId) -> Option<&LabelledObject<'_>> {
        self.labelled.iter().find(|label| label.object.id == id)
    }

    /// Where a belt has carried its objects, if there is one.
    pub(crate) fn belt(&self) -> Option<Belt> {
        self.sample.provenance.as_ref()?.scene.belt
    }

    /// Path below the dataset's folder: `images/train/000012.png`.
    pub fn path(&self, kind: &str, extension: &str) -> PathBuf {
        let name = format!("{:06}.{extension}", self.k);
        Path::new(kind).join(self.part.name()).join(name)
    }

    /// The name of a class; its number where it has none.
    pub(crate) fn class_name(&self, class: u32) -> String {
        let name = self.classes.get(class as usize).cloned();
        name.unwrap_or_else(|| class.to_string())
    }
}

/// A sample whose files are all present: what a [`Writer`] joins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Its number.
    pub k: u64,
    /// The part that it belongs to.
    pub part: Part,
    /// Its files below the dataset's folder, those of all writers, in their order.
    pub files: Vec<PathBuf>,
}

impl Written {
    /// The sample's file in a folder of the dataset: the first in `coco` is the one that COCO
    /// joins.
    ///
    /// # Errors
    /// If there is none.
    pub fn file(&self, kind: &str) -> std::io::Result<&Path> {
        let found = self.files.iter().find(|file| file.starts_with(kind));
        found.map(PathBuf::as_path).ok_or_else(|| {
            std::io::Error::other(format!("sample {} has no file in {kind}", self.k))
        })
    }
}

/// A layout that a dataset is written in.
///
/// A layout with one file for many samples first writes a separate file for each sample, and joins
/// those when all are present: so each sample's files can be regenerated alone, on any machine, and
/// no run has to remember another.
pub trait Writer: Send + Sync {
    /// Its name and settings: written into `dataset.json`, and compared before a dataset is
    /// continued.
    fn settings(&self) -> serde_json::Value;

    /// Writes what belongs to no single sample: folders, lists of classes. Called once in each run,
    /// before any sample.
    ///
    /// # Errors
    /// If a file cannot be written.
    fn begin(&self, folder: &Path, classes: &[String]) -> Result<()>;

    /// Writes the files of one sample and returns their paths below the folder.
    ///
    /// The bytes depend on nothing but the entry.
    ///
    /// # Errors
    /// If a file cannot be written, or the layout cannot hold the sample.
    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>>;

    /// How much of an object its labels cover; none, the default, if it writes no labels.
    fn extent(&self) -> Option<Extent> {
        None
    }

    /// Whether it writes a label of an object that has one; by default, of each that has a box in
    /// its [`extent`](Self::extent).
    fn has_label_of(&self, object: &ObjectLabel) -> bool {
        self.extent().is_some_and(|extent| extent.has_box(object))
    }

    /// The files to give to trainers, below the dataset's folder: those that name all others.
    /// Default: none.
    fn for_trainers(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Deletes the files that [`finish`](Self::finish) writes, since they do not include the
    /// samples that are about to be added. By default there are none.
    ///
    /// # Errors
    /// If a file cannot be deleted.
    fn reopen(&self, folder: &Path) -> Result<()> {
        let _ = folder;
        Ok(())
    }

    /// Writes the files that hold many samples, from the files of `samples`, which are in order of
    /// number and all present; deletes what an earlier call left and is no longer needed. By
    /// default there are no such files.
    ///
    /// Called when a dataset is complete: at the end of a run, and after shards were joined. The
    /// bytes depend on nothing but the samples' files, the classes and the settings.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    fn finish(&self, folder: &Path, classes: &[String], samples: &[Written]) -> Result<()> {
        let _ = (folder, classes, samples);
        Ok(())
    }

    /// The files below the folder that are missing or not as [`finish`](Self::finish) writes them.
    /// By default there are none.
    fn changed(&self, folder: &Path, classes: &[String], samples: &[Written]) -> Vec<PathBuf> {
        let _ = (folder, classes, samples);
        Vec::new()
    }
}
