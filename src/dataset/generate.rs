//! Generates a dataset, many samples at a time, in a folder that survives any interruption.

use crate::dataset::archive_store::ArchiveStore;
use crate::dataset::archives::generate_archives;
use crate::dataset::journal_line::JournalLine;
use crate::dataset::run::{Progress, Report, run};
use crate::dataset::times::{Times, timed};
use crate::dataset::{
    DatasetCounts, Entry, Extent, Inputs, Obstructed, Sample, SampleRange, Split, WebDataset,
    Writer,
};
use crate::error::{Error, Result};
use crate::label::ObjectLabel;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A dataset to generate.
#[derive(Clone)]
pub struct Plan {
    /// Where; created if missing.
    pub folder: PathBuf,
    /// Number of samples of the whole dataset.
    pub count: u64,
    /// Which of them this run makes.
    pub range: SampleRange,
    /// Seed, as recorded in the files; the samples come from the closure.
    pub seed: u64,
    /// Everything else that decides what a sample is: a run into a folder that was made from
    /// something else is rejected.
    pub recipe: serde_json::Value,
    /// Names of the classes, in order.
    pub classes: Vec<String>,
    /// Which samples are for validation.
    pub split: Split,
    /// What happens to the labels of objects that something covers.
    pub obstructed: Obstructed,
    /// The files to write of each sample, in this order.
    pub writers: Vec<Arc<dyn Writer>>,
    /// Archives that the files of samples are moved into as they are made, so that no single files
    /// remain; by default files stay where they are.
    pub archives: Option<WebDataset>,
    /// Where finished archives are kept, while `folder` holds what is unfinished; by default
    /// `folder` keeps both.
    pub store: Option<Arc<dyn ArchiveStore>>,
    /// Checksums of the files that `recipe` describes, to be kept in the folder. Default: none.
    pub inputs: Inputs,
}

impl Plan {
    /// `count` samples in `folder` with labels of these classes, split by the default [`Split`];
    /// its writers are still to be set.
    pub fn new(folder: impl Into<PathBuf>, count: u64, classes: Vec<String>) -> Self {
        Self {
            folder: folder.into(),
            count,
            range: SampleRange::All,
            seed: 0,
            recipe: serde_json::Value::Null,
            classes,
            split: Split::default(),
            obstructed: Obstructed::default(),
            writers: Vec::new(),
            archives: None,
            store: None,
            inputs: Inputs::default(),
        }
    }

    /// Hash of everything but the seed that decides what a sample is.
    pub fn recipe_hash(&self) -> String {
        format!(
            "{:08x}",
            crc32fast::hash(self.recipe.to_string().as_bytes())
        )
    }

    /// The extents of the writers; objects as far as they are in the picture if no writer has one.
    fn extents(&self) -> Vec<Extent> {
        let extents: Vec<_> = self.writers.iter().filter_map(|w| w.extent()).collect();
        if extents.is_empty() {
            return vec![Extent::Amodal];
        }
        extents
    }

    /// Whether any of the writers has a label of an object; if none writes labels, all have one.
    fn has_label_of(&self, object: &ObjectLabel) -> bool {
        let mut writers = self
            .writers
            .iter()
            .filter(|w| w.extent().is_some())
            .peekable();
        writers.peek().is_none() || writers.any(|w| w.has_label_of(object))
    }
}

/// Generates the samples of the plan that are missing from its folder, and returns what the folder
/// then holds.
///
/// `make(k)` returns sample `k`; it is called from several threads, for each `k` at most once, in
/// no fixed order, and must depend on nothing but `k`. `progress` is called once at the start and
/// after each sample, one call at a time. Once `stop` is true, samples in progress are finished and
/// no more are started.
///
/// The files depend on the plan alone: not on threads, order, time, or how often the run was
/// interrupted. As many samples are in memory as the current rayon pool has threads; each thread
/// works on its own sample, since that keeps processors busier than sharing the rows of one
/// picture. Files of many samples are joined when all are present; those of a shard stay apart
/// until it is [merged](crate::dataset::merge). With [`Plan::archives`] each archive is present
/// whole or not at all, shards write theirs into one folder, and [`DatasetCounts::counted`] are
/// those of this run; [`Plan::store`] receives them as they are finished.
///
/// # Errors
/// [`Error::Interrupted`] after a stop; the first error of `make` or of a writer, in order of `k`
/// among the samples in progress; a single sample outside the plan's; a folder that is a file,
/// holds something else, was made from another plan (the message names the field), or is being
/// written by another run; a full disk. In every case the folder stays valid, and the same call
/// resumes it.
pub fn generate(
    plan: &Plan,
    make: impl Fn(u64) -> Result<Sample> + Sync,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    match plan.archives {
        Some(archives) => {
            let files = |part: &Plan, progress: Report| generate_files(part, &make, progress, stop);
            generate_archives(plan, archives, &files, progress)
        }
        None if plan.store.is_some() => Err(Error::value(
            "labels.formats",
            "files of single samples, expected only [\"webdataset\"]: an object store takes only archives",
        )),
        None => generate_files(plan, make, progress, stop),
    }
}

/// Leaves the files of samples where the writers put them.
fn generate_files(
    plan: &Plan,
    make: impl Fn(u64) -> Result<Sample> + Sync,
    progress: Report,
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    let recipe_hash = plan.recipe_hash();
    run(
        plan,
        |k, syncing| {
            let sample = make(k)?;
            let write = || write_sample(plan, &recipe_hash, k, &sample);
            let (line, write) = timed(|| syncing.during(write));
            let times = Times {
                write,
                ..sample.times
            };
            Ok((line?, times))
        },
        progress,
        stop,
    )
}

/// Writes the files of a sample.
fn write_sample(plan: &Plan, recipe_hash: &str, k: u64, sample: &Sample) -> Result<JournalLine> {
    let Plan {
        folder, classes, ..
    } = plan;
    check_image_size(sample)?;
    check_object_classes(sample, classes.len())?;
    let mut labelled = plan
        .obstructed
        .labelled(&sample.labels, classes.len(), &plan.extents());
    labelled.retain(|label| plan.has_label_of(label.object));
    let entry = Entry {
        k,
        seed: plan.seed,
        classes,
        recipe_hash,
        part: plan.split.part(k, plan.count),
        sample,
        labelled: &labelled,
    };
    let mut files = Vec::new();
    for writer in &plan.writers {
        files.extend(writer.write(folder, &entry)?);
    }
    JournalLine::new(&entry, folder, &files)
}

/// The writers rely on this.
fn check_image_size(sample: &Sample) -> Result<()> {
    let (w, h) = sample.frame.size();
    let [lw, lh] = sample.labels.image;
    if (w, h) == (lw as usize, lh as usize) {
        return Ok(());
    }
    let what = format!("{lw} x {lh}, but the picture has {w} x {h}");
    Err(Error::value("labels.image", what))
}

fn check_object_classes(sample: &Sample, count: usize) -> Result<()> {
    for (i, object) in sample.labels.objects.iter().enumerate() {
        let class = object.class;
        if class as usize >= count {
            let what = format!("{class}, but there are {count} classes");
            return Err(Error::value(format!("labels.objects[{i}].class"), what));
        }
    }
    Ok(())
}
