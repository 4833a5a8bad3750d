//! A dataset of archives only: each holds a fixed span of numbers, and is present whole or not at
//! all.
//!
//! The samples of an archive are generated in a hidden folder, as a dataset of their own, so a run
//! that was interrupted in the middle of an archive resumes there. When all are finished, the
//! archive is packed and moved into place in one step, and the folder is deleted.

use crate::dataset::archive_store::{self, ArchiveStore};
use crate::dataset::journal::{self, count_listed, lines_of};
use crate::dataset::paths::folder_of;
use crate::dataset::run::{Report, check_count};
use crate::dataset::webdataset::{archive, is_whole, write_archive};
use crate::dataset::{
    DatasetCounts, Inputs, Part, Plan, Progress, SampleRange, Split, WebDataset, Written, folder,
};
use crate::error::{Error, Result};
use crate::io;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Deletes the incomplete archives of a dataset so that the next run generates them again; returns
/// how many are complete and how many were not. The next run also rereads every input file.
///
/// An archive is complete if it has a valid end and all of its samples; archives hold no checksums
/// of their files' content. Samples that are not packed yet are compared as by
/// [`repair`](crate::dataset::repair).
///
/// # Errors
/// A folder that holds no dataset of archives, or one that was started by an older petcomp; an
/// archive that a run is writing.
pub fn repair_archives(folder: &Path, range: SampleRange) -> Result<(usize, usize)> {
    check_range(range)?;
    let layout = ArchiveLayout::of_folder(folder)?;
    Inputs::forget(folder);
    let (mut good, mut bad) = (0, 0);
    for number in layout.numbers(range) {
        for file in layout.files(number).filter(|file| file.path.exists()) {
            if is_whole(&file.path, file.samples) {
                good += 1;
            } else {
                std::fs::remove_file(&file.path).map_err(|e| Error::file(&file.path, e))?;
                layout.sweep(number);
                bad += 1;
            }
        }
        if layout.files(number).any(|file| !file.path.exists()) {
            layout.repair_samples(number)?;
        }
    }
    Ok((good, bad))
}

/// Generates a dataset of files.
type MakeFiles<'a> = &'a dyn Fn(&Plan, Report) -> Result<DatasetCounts>;

/// Generates the missing archives of a plan; see [`generate`](crate::dataset::generate). `files` is
/// called for each archive.
pub(super) fn generate_archives(
    plan: &Plan,
    archives: WebDataset,
    files: MakeFiles,
    progress: Report,
) -> Result<DatasetCounts> {
    archives.check()?;
    check_range(plan.range)?;
    check_count(plan.count)?;
    if let Some(store) = &plan.store {
        archive_store::claim(&**store, plan)?;
    }
    folder::share(plan)?;
    plan.inputs.keep(&plan.folder);
    let mut run = ArchiveRun::new(plan, archives)?;
    progress(run.so_far());
    for number in run.missing() {
        run.add(number, files, progress)?;
    }
    Ok(run.counts())
}

/// An archive cannot be generated in part.
fn check_range(range: SampleRange) -> Result<()> {
    match range {
        SampleRange::All | SampleRange::Shard(_) => Ok(()),
        SampleRange::One(_) | SampleRange::Span(..) => Err(Error::value(
            "only",
            "a dataset of archives, expected all of its samples or a shard",
        )),
    }
}

/// Which samples each archive of a dataset holds.
struct ArchiveLayout<'a> {
    folder: &'a Path,
    archives: WebDataset,
    /// Number of all samples.
    count: u64,
    split: Split,
}

/// One file of an archive: the samples of one part.
struct ArchiveFile {
    part: Part,
    path: PathBuf,
    /// At least one.
    samples: u64,
}

impl<'a> ArchiveLayout<'a> {
    /// As recorded by a dataset that was started before.
    fn of_folder(folder: &'a Path) -> Result<Self> {
        let before = folder::begun(folder)?;
        let layout = Self::of_identity(folder, &before);
        layout.map_err(|e| e.in_file(folder::identity_file(folder)))
    }

    fn of_identity(folder: &'a Path, identity: &Value) -> Result<Self> {
        let writers = identity["writers"].as_array().into_iter().flatten();
        let mut archives = writers.filter(|writer| writer.get("webdataset").is_some());
        let last = archives.next_back().unwrap_or(&Value::Null);
        let layout = Self {
            folder,
            archives: folder::field(last, "webdataset")?,
            count: folder::field(identity, "count")?,
            split: split_of(identity)?,
        };
        layout.archives.check()?;
        check_count(layout.count)?;
        Ok(layout)
    }

    /// The archives of a range: all, or one machine's share.
    fn numbers(&self, range: SampleRange) -> impl Iterator<Item = u64> + use<> {
        range.below(self.count.div_ceil(self.archives.samples))
    }

    fn span(&self, number: u64) -> (u64, u64) {
        self.archives.span(number, self.count)
    }

    /// Where the samples of an archive are until they are packed.
    fn samples_folder(&self, number: u64) -> PathBuf {
        self.folder.join(format!(".archive-{number:06}"))
    }

    /// Deletes what a killed run left of a folder whose archive it had already moved.
    fn sweep(&self, number: u64) {
        let _ = std::fs::remove_dir_all(self.samples_folder(number));
    }

    /// Marks the damaged samples of an archive that is not packed yet to be generated again.
    fn repair_samples(&self, number: u64) -> Result<()> {
        let folder = self.samples_folder(number);
        if folder::identity(&folder)?.is_none() {
            return Ok(());
        }
        let (_, bad) = journal::repair(&folder)?;
        if bad > 0 {
            let folder = folder.display();
            log::warn!("{folder}: {bad} images of an unfinished archive are generated again");
        }
        Ok(())
    }

    /// The file of each part that has a sample in an archive.
    fn files(&self, number: u64) -> impl Iterator<Item = ArchiveFile> {
        let files = Part::ALL.map(|part| ArchiveFile {
            part,
            path: archive(self.folder, part, number),
            samples: self.samples_of(part, number),
        });
        files.into_iter().filter(|file| file.samples > 0)
    }

    fn samples_of(&self, part: Part, number: u64) -> u64 {
        let (first, end) = self.span(number);
        let is_of_part = |k: &u64| self.split.part(*k, self.count) == part;
        (first..end).filter(is_of_part).count() as u64
    }
}

/// How samples were split; only the recipe has the length of a sequence.
fn split_of(identity: &Value) -> Result<Split> {
    let frames = &identity["recipe"]["scene"]["belt"]["frames"];
    Ok(Split {
        sequence: frames.as_u64().unwrap_or(1),
        ..folder::field(identity, "split")?
    })
}

/// What one run has done so far.
struct ArchiveRun<'a> {
    plan: &'a Plan,
    layout: ArchiveLayout<'a>,
    /// Numbers of the complete archives.
    present: BTreeSet<u64>,
    /// Counts complete archives only.
    progress: Progress,
    /// Samples of archives that were started, by number.
    begun: BTreeMap<u64, u64>,
    /// Counts what this run has made.
    made: DatasetCounts,
}

impl<'a> ArchiveRun<'a> {
    fn new(plan: &'a Plan, archives: WebDataset) -> Result<Self> {
        let mut run = Self {
            plan,
            layout: ArchiveLayout {
                folder: &plan.folder,
                archives,
                count: plan.count,
                split: plan.split,
            },
            present: BTreeSet::new(),
            progress: Progress::default(),
            begun: BTreeMap::new(),
            made: DatasetCounts::new(&[], plan, plan.count, 0),
        };
        run.present = run.find_present()?;
        run.present.iter().for_each(|&n| run.layout.sweep(n));
        run.progress.count = run.numbers().map(|n| run.size(n)).sum();
        run.progress.done = run.present.iter().map(|&n| run.size(n)).sum();
        run.missing().into_iter().for_each(|n| run.count_begun(n));
        Ok(run)
    }

    /// Notes the samples of an incomplete archive.
    fn count_begun(&mut self, number: u64) {
        let samples = count_listed(&self.layout.samples_folder(number));
        if samples > 0 {
            self.begun.insert(number, samples);
        }
    }

    /// Including the samples of archives that were started.
    fn so_far(&self) -> Progress {
        Progress {
            done: self.progress.done + self.begun.values().sum::<u64>(),
            ..self.progress
        }
    }

    /// This run's complete archives.
    fn find_present(&self) -> Result<BTreeSet<u64>> {
        if let Some(store) = self.store() {
            let present = archive_store::present(store)?;
            return Ok(self.numbers().filter(|n| present.contains(n)).collect());
        }
        io::create_folder(folder_of(&archive(&self.plan.folder, Part::Train, 0)))?;
        let is_whole = |&number: &u64| self.layout.files(number).all(|file| file.path.exists());
        Ok(self.numbers().filter(is_whole).collect())
    }

    fn store(&self) -> Option<&dyn ArchiveStore> {
        self.plan.store.as_deref()
    }

    /// The archives that this run generates: all, or one machine's share.
    fn numbers(&self) -> impl Iterator<Item = u64> + use<> {
        self.layout.numbers(self.plan.range)
    }

    fn missing(&self) -> Vec<u64> {
        self.numbers()
            .filter(|n| !self.present.contains(n))
            .collect()
    }

    /// Number of samples in an archive.
    fn size(&self, number: u64) -> u64 {
        let (first, end) = self.layout.span(number);
        end - first
    }

    /// Generates an archive, or resumes it.
    fn add(&mut self, number: u64, files: MakeFiles, progress: Report) -> Result<()> {
        let plan = self.plan_of(number);
        self.begun.remove(&number);
        let before = self.so_far();
        let made = files(&plan, &|inner| progress(before.with(inner)));
        let made = made.map_err(|error| {
            self.count_begun(number);
            self.told(error)
        })?;
        self.pack(number, &plan)?;
        self.present.insert(number);
        self.progress = self.progress.with(Progress {
            done: self.size(number),
            count: 0,
            made: made.made,
        });
        self.made += made;
        Ok(())
    }

    /// The plan for the samples of one archive.
    fn plan_of(&self, number: u64) -> Plan {
        let (first, end) = self.layout.span(number);
        Plan {
            folder: self.layout.samples_folder(number),
            range: SampleRange::Span(first, end),
            archives: None,
            store: None,
            inputs: Inputs::default(),
            ..self.plan.clone()
        }
    }

    /// Translates an interruption to the whole dataset.
    fn told(&self, error: Error) -> Error {
        match error {
            Error::Interrupted { .. } => Error::Interrupted {
                what: self.describe(),
            },
            other => other,
        }
    }

    /// Reports progress; a store holds complete archives only.
    fn describe(&self) -> String {
        match self.store() {
            Some(store) => self.progress.describe(Path::new(store.url())),
            None => self.so_far().describe(&self.plan.folder),
        }
    }

    /// Packs the samples of an archive in order of number, stores it, and deletes their folder.
    fn pack(&self, number: u64, plan: &Plan) -> Result<()> {
        let _claim = folder::reclaim(&plan.folder)?;
        let lines = lines_of(&plan.folder)?;
        let samples: Vec<Written> = lines.iter().map(|line| line.written()).collect();
        let mut packed = Vec::new();
        for ArchiveFile { part, path, .. } in self.layout.files(number) {
            let of_part: Vec<_> = samples.iter().filter(|s| s.part == part).collect();
            let aside = plan.folder.join(part.name()).with_extension("tar");
            write_archive(&aside, &plan.folder, &of_part)?;
            packed.push((aside, path));
        }
        self.keep(number, &packed)?;
        std::fs::remove_dir_all(&plan.folder).map_err(|e| Error::file(&plan.folder, e))
    }

    /// Puts the files of an archive, each with its intended path, where they belong.
    fn keep(&self, number: u64, packed: &[(PathBuf, PathBuf)]) -> Result<()> {
        if let Some(store) = self.store() {
            let named = packed
                .iter()
                .map(|(aside, path)| (self.name_of(path), aside.clone()));
            return archive_store::keep(store, number, &named.collect::<Vec<_>>());
        }
        let mut packed = packed.iter();
        packed.try_for_each(|(aside, path)| {
            std::fs::rename(aside, path).map_err(|e| Error::file(path, e))
        })
    }

    /// The path of an archive within the dataset, with slashes.
    fn name_of(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.plan.folder).unwrap_or(path);
        let parts = inside.iter().map(|part| part.to_string_lossy());
        parts.collect::<Vec<_>>().join("/")
    }

    /// What is present now; objects are counted only in what this run has made.
    fn counts(self) -> DatasetCounts {
        let present = self.present.iter();
        DatasetCounts {
            images: self.progress.done,
            val: present.map(|&n| self.layout.samples_of(Part::Val, n)).sum(),
            for_trainers: DatasetCounts::new(&[], self.plan, self.plan.count, 0).for_trainers,
            ..self.made
        }
    }
}
