//! Joins the shards of a dataset into the folder that a single run would have made.

use crate::dataset::folder::{self, JOURNAL, field};
use crate::dataset::journal::numbered_lines;
use crate::dataset::journal_line::{JournalLine, WrittenFile};
use crate::dataset::run::{Progress, check_count, run};
use crate::dataset::times::Times;
use crate::dataset::{DatasetCounts, LabelConfig, Pictures, Plan, Shard, Sidecar, Writer};
use crate::error::{Error, Result};
use crate::io::{self, Syncing};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Copies the samples of shards into one folder, checks each file against its checksum, and joins
/// the files of many samples.
///
/// The folder is then, byte for byte, what one run without shards makes. The shards are not
/// changed. To resume an interrupted merge, call it again.
///
/// A shard may come from anyone: the files in its journal are looked for only in the shard itself,
/// and only regular files are read.
///
/// # Errors
/// Folders that are not shards, or not all of one dataset: another recipe, seed or program (the
/// message names the field), a shard that is missing or given twice, a sample that is missing or
/// not the shard's; a line of a journal or a file that has changed since it was written. As
/// [`generate`](crate::dataset::generate) for the folder that is written.
pub fn merge(
    shards: &[PathBuf],
    folder: &Path,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    let dataset = ShardedDataset::open(shards)?;
    let lines = dataset.lines(shards)?;
    if let Some(k) = (0..dataset.count).find(|k| !lines.contains_key(k)) {
        let shard = dataset.shard_of(k, shards).unwrap_or(folder);
        let what = format!("sample {k} is missing: finish this shard first");
        return Err(Error::file(shard, what));
    }
    let plan = merged_plan(&dataset.document, dataset.count, folder)?;
    let write = |k: u64, syncing: Syncing| syncing.during(|| copy_sample(&lines[&k], folder));
    run(&plan, write, progress, stop)
}

/// Copies the files of a sample from its shard.
fn copy_sample(
    (shard, line): &(&PathBuf, JournalLine),
    folder: &Path,
) -> Result<(JournalLine, Times)> {
    for file in &line.files {
        copy(shard, folder, file)?;
    }
    Ok((line.clone(), Times::default()))
}

/// The lines of a shard's journal, all of which must be intact.
fn lines_in(folder: &Path, shard: Shard, count: u64) -> Result<Vec<JournalLine>> {
    let mut lines = Vec::new();
    for (i, line) in numbered_lines(folder)? {
        let line = line.map_err(|what| format!("{what}; run this shard again with --resume"));
        let line = line.and_then(|line| own_line(line, shard, count));
        lines.push(line.map_err(|problem| {
            let what = format!("line {i}: {problem}");
            Error::file(folder.join(JOURNAL), what)
        })?);
    }
    Ok(lines)
}

/// The line, if its sample belongs to the shard.
fn own_line(
    line: JournalLine,
    shard: Shard,
    count: u64,
) -> std::result::Result<JournalLine, String> {
    let k = line.k;
    if k < count && shard.contains(k) {
        Ok(line)
    } else {
        Err(format!(
            "sample {k} is not in shard {shard} of {count} samples"
        ))
    }
}

/// What all shards have in common.
struct ShardedDataset {
    /// What the dataset was made from, without the shard.
    document: Value,
    count: u64,
    /// Which share each of them is.
    shares: Vec<Shard>,
}

impl ShardedDataset {
    /// Opens shards, which must be all of one dataset.
    fn open(folders: &[PathBuf]) -> Result<Self> {
        let opened = folders.iter().map(|folder| open_shard(folder));
        let opened = opened.collect::<Result<Vec<_>>>()?;
        let Some((first, ShardShare { shard, count })) = opened.first() else {
            return Err(Error::value("shards", "none, expected their folders"));
        };
        for (folder, (document, share)) in folders.iter().zip(&opened) {
            check_same_dataset((first, shard.of, *count), (document, share), folder)?;
        }
        let shares: Vec<Shard> = opened.iter().map(|(_, share)| share.shard).collect();
        check_complete(folders, &shares, shard.of)?;
        Ok(Self {
            document: first.clone(),
            count: *count,
            shares,
        })
    }

    /// The lines of all journals by number, each with its shard's folder.
    fn lines<'a>(
        &self,
        folders: &'a [PathBuf],
    ) -> Result<BTreeMap<u64, (&'a PathBuf, JournalLine)>> {
        let mut lines = BTreeMap::new();
        for (folder, share) in folders.iter().zip(&self.shares) {
            for line in lines_in(folder, *share, self.count)? {
                lines.insert(line.k, (folder, line));
            }
        }
        Ok(lines)
    }

    /// The folder of the shard that a sample belongs to.
    fn shard_of<'a>(&self, k: u64, folders: &'a [PathBuf]) -> Option<&'a Path> {
        let place = self.shares.iter().position(|share| share.contains(k))?;
        Some(&folders[place])
    }
}

/// Fails if a shard is given twice or missing.
fn check_complete(folders: &[PathBuf], shares: &[Shard], of: u64) -> Result<()> {
    let mut places = BTreeMap::new();
    for (i, shard) in shares.iter().enumerate() {
        if let Some(twin) = places.insert(shard.index, i) {
            let what = format!("is shard {shard}, as {} is", folders[twin].display());
            return Err(Error::file(&folders[i], what));
        }
    }
    match (1..=of).find(|index| !places.contains_key(index)) {
        Some(index) => Err(Error::value(
            "shards",
            format!("shard {index}/{of} is missing"),
        )),
        None => Ok(()),
    }
}

/// Fails on the first field in which a shard's dataset differs from the first shard's.
fn check_same_dataset(
    (first, of, count): (&Value, u64, u64),
    (document, share): (&Value, &ShardShare),
    folder: &Path,
) -> Result<()> {
    let expected = json!({ "of": of, "count": count, "dataset": first });
    let found = json!({ "of": share.shard.of, "count": share.count, "dataset": document });
    folder::same(&expected, &found, "").map_err(|(at, what)| {
        Error::value(at.trim_start_matches("dataset."), what).in_file(folder::identity_file(folder))
    })
}

/// What the folder of a shard records about its share.
#[derive(Deserialize)]
struct ShardShare {
    #[serde(flatten)]
    shard: Shard,
    count: u64,
}

impl ShardShare {
    /// Fails if the share is impossible.
    fn from_value(value: Value) -> Result<Self> {
        let share: Self = serde_json::from_value(value).map_err(|e| Error::value("shard", e))?;
        Shard::new(share.shard.index, share.shard.of)?;
        check_count(share.count)?;
        Ok(share)
    }
}

/// What a shard's folder was made from, and which share it is.
fn open_shard(path: &Path) -> Result<(Value, ShardShare)> {
    let mut document = folder::known_identity(path, "a shard")?;
    let share = document.as_object_mut().and_then(|map| map.remove("shard"));
    let share = share.ok_or_else(|| Error::file(path, "is a whole dataset, expected a shard"))?;
    folder::of_this_format(&document, path)?;
    let share =
        ShardShare::from_value(share).map_err(|e| e.in_file(folder::identity_file(path)))?;
    Ok((document, share))
}

/// The plan that a dataset was made with, except for where its samples come from.
fn merged_plan(document: &Value, count: u64, folder: &Path) -> Result<Plan> {
    let classes = field(document, "classes")?;
    Ok(Plan {
        writers: writers_of(field(document, "writers")?)?,
        seed: field(document, "seed")?,
        recipe: field(document, "recipe")?,
        split: field(document, "split")?,
        obstructed: field(document, "obstructed")?,
        ..Plan::new(folder, count, classes)
    })
}

/// The writers that wrote with these settings.
pub(super) fn writers_of(settings: Vec<Map<String, Value>>) -> Result<Vec<Arc<dyn Writer>>> {
    let pictures = pictures_of(&settings)?;
    let named = settings.into_iter().flatten();
    named
        .map(|(name, settings)| writer_of(&name, settings, &pictures))
        .collect()
}

fn pictures_of(settings: &[Map<String, Value>]) -> Result<Pictures> {
    let pictures = settings.iter().find_map(|map| map.get("pictures"));
    let pictures = pictures.map(Pictures::deserialize).transpose();
    Ok(pictures
        .map_err(|e| Error::value("pictures", e))?
        .unwrap_or_default())
}

/// The writer with a name and settings, as returned by [`Writer::settings`].
fn writer_of(name: &str, settings: Value, pictures: &Pictures) -> Result<Arc<dyn Writer>> {
    match name {
        "pictures" => Ok(Arc::new(pictures.clone())),
        "sidecar" => Ok(Arc::new(Sidecar)),
        format => label_writer(format, settings, pictures)
            .map_err(|what| Error::value(format!("writers.{name}"), what)),
    }
}

fn label_writer(
    format: &str,
    mut settings: Value,
    pictures: &Pictures,
) -> std::result::Result<Arc<dyn Writer>, String> {
    let mut config = json!({ "formats": [format] });
    if let Some(map) = settings.as_object_mut().filter(|map| !map.is_empty()) {
        // Settings of all layouts, recorded by each that follows them.
        for key in ["simplify", "alpha_threshold"] {
            if let Some(value) = map.remove(key) {
                config[key] = value;
            }
        }
        config[format] = settings;
    }
    let config: LabelConfig = serde_json::from_value(config).map_err(|e| e.to_string())?;
    let mut writers = config.writers(pictures).into_iter();
    writers.next().ok_or_else(|| "no such layout".into())
}

/// Copies a file if it has not changed since it was written.
fn copy(shard: &Path, folder: &Path, file: &WrittenFile) -> Result<()> {
    let from = io::inside(shard, &file.path)?;
    let to = io::below(folder, &file.path)?;
    io::create_folder(to.parent().unwrap_or(folder))?;
    io::copy(from, to, file.checksum())
}
