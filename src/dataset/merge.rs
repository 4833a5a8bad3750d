//! Joins the shards of a dataset: the folder that a single run would have made.

use crate::dataset::folder::{self, IDENTITY, JOURNAL};
use crate::dataset::journal::numbered_lines;
use crate::dataset::journal_line::{JournalLine, WrittenFile};
use crate::dataset::run::{Progress, check_count, run};
use crate::dataset::times::Times;
use crate::dataset::{
    DatasetCounts, Inputs, LabelConfig, Pictures, Plan, SampleRange, Shard, Sidecar, Writer,
};
use crate::error::{Error, Result};
use crate::io;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Copies the samples of shards into one folder, checks each file against its checksum, and joins the files of many
/// samples.
///
/// The folder is then, byte for byte, what one run without shards makes. Nothing is taken from the shards. A merge that
/// was interrupted goes on when it is called again.
///
/// A shard is a folder that anybody may have made: what its journal names is looked for in the shard alone, and only
/// regular files are read.
///
/// # Errors
/// Folders that are no shards, or not all of one dataset: another recipe, seed or program (the message names the field),
/// a shard that is missing or given twice, a sample that is missing or not the shard's; a line of a journal or a file that
/// is not as it was written. As [`generate`](crate::dataset::generate) for the folder that is written.
pub fn merge(
    shards: &[PathBuf],
    folder: &Path,
    progress: &(dyn Fn(Progress) + Sync),
    stop: &AtomicBool,
) -> Result<DatasetCounts> {
    let identity = common(shards)?;
    let count = identity.count;
    let mut lines = BTreeMap::new();
    for (shard, share) in shards.iter().zip(&identity.shares) {
        lines.extend(
            lines_in(shard, *share, count)?
                .into_iter()
                .map(|line| (line.k, (shard, line))),
        );
    }
    if let Some(k) = (0..count).find(|k| !lines.contains_key(k)) {
        let shard = shards
            .iter()
            .zip(&identity.shares)
            .find(|(_, share)| share.contains(k));
        let shard = shard.map_or(folder, |(shard, _)| shard);
        return Err(Error::file(
            shard,
            format!("sample {k} is missing: finish this shard first"),
        ));
    }
    let plan = plan(identity.document, count, folder)?;
    let copy = |k| {
        let (shard, line): &(&PathBuf, JournalLine) = &lines[&k];
        line.files
            .iter()
            .try_for_each(|file| copy(shard, folder, file))?;
        Ok((line.clone(), Times::default()))
    };
    run(&plan, copy, progress, stop)
}

/// The lines of a shard's journal, all of them as they were written.
fn lines_in(folder: &Path, shard: Shard, count: u64) -> Result<Vec<JournalLine>> {
    let wrong = |i, what: String| Error::file(folder.join(JOURNAL), format!("line {i}: {what}"));
    let mend = "run this shard again with --resume";
    let checked = |(i, line): (usize, std::result::Result<JournalLine, String>)| match line {
        Err(what) => Err(wrong(i, format!("{what}; {mend}"))),
        Ok(line) if line.k >= count || !shard.contains(line.k) => Err(wrong(
            i,
            format!(
                "sample {} is none of shard {shard} of {count} samples",
                line.k
            ),
        )),
        Ok(line) => Ok(line),
    };
    numbered_lines(folder)?.into_iter().map(checked).collect()
}

/// What all shards say of themselves.
struct Common {
    /// What the dataset was made from, without the shard.
    document: Map<String, Value>,
    count: u64,
    /// Which share each of them is.
    shares: Vec<Shard>,
}

fn common(shards: &[PathBuf]) -> Result<Common> {
    let mut first: Option<(Value, u64, u64)> = None;
    let (mut places, mut shares) = (BTreeMap::new(), Vec::new());
    for (i, path) in shards.iter().enumerate() {
        let (document, Share { shard, count }) = open(path)?;
        if let Some((before, of, of_count)) = &first {
            let said = json!({ "of": of, "count": of_count, "dataset": before });
            let says = json!({ "of": shard.of, "count": count, "dataset": document });
            folder::same(&said, &says, "").map_err(|(at, what)| {
                Error::value(at.trim_start_matches("dataset."), what).in_file(path.join(IDENTITY))
            })?;
        } else {
            first = Some((document, shard.of, count));
        }
        if let Some(twin) = places.insert(shard.index, i) {
            return Err(Error::file(
                path,
                format!("is shard {shard}, as {} is", shards[twin].display()),
            ));
        }
        shares.push(shard);
    }
    let (document, of, count) =
        first.ok_or_else(|| Error::value("shards", "none, expected their folders"))?;
    if let Some(index) = (1..=of).find(|index| !places.contains_key(index)) {
        return Err(Error::value(
            "shards",
            format!("shard {index}/{of} is missing"),
        ));
    }
    let document = document.as_object().cloned().unwrap_or_default();
    Ok(Common {
        document,
        count,
        shares,
    })
}

/// What the folder of a shard says of its share.
#[derive(serde::Deserialize)]
struct Share {
    #[serde(flatten)]
    shard: Shard,
    count: u64,
}

impl Share {
    /// Fails where there can be no such share.
    fn check(self) -> Result<Self> {
        Shard::new(self.shard.index, self.shard.of)?;
        check_count(self.count)?;
        Ok(self)
    }
}

/// What a shard's folder was made from, and which share it is.
fn open(path: &Path) -> Result<(Value, Share)> {
    let document = folder::identity(path)?;
    let mut document =
        document.ok_or_else(|| Error::file(path, format!("no {IDENTITY}, expected a shard")))?;
    let share = document.as_object_mut().and_then(|map| map.remove("shard"));
    let share = share.ok_or_else(|| Error::file(path, "is a whole dataset, expected a shard"))?;
    folder::of_this_format(&document, path)?;
    let share = serde_json::from_value(share)
        .map_err(|e| Error::value("shard", e))
        .and_then(Share::check);
    Ok((document, share.map_err(|e| e.in_file(path.join(IDENTITY)))?))
}

/// The plan that a dataset was made with, but for where its samples come from.
fn plan(mut document: Map<String, Value>, count: u64, folder: &Path) -> Result<Plan> {
    let said: Vec<Map<String, Value>> = field(&mut document, "writers")?;
    let pictures = match said
        .iter()
        .find(|settings| settings.contains_key("pictures"))
    {
        Some(settings) => field(&mut settings.clone(), "pictures")?,
        None => Pictures::default(),
    };
    let writers = said
        .into_iter()
        .flatten()
        .map(|(name, settings)| writer(&name, settings, &pictures));
    Ok(Plan {
        folder: folder.into(),
        count,
        range: SampleRange::All,
        seed: field(&mut document, "seed")?,
        recipe: field(&mut document, "recipe")?,
        classes: field(&mut document, "classes")?,
        split: field(&mut document, "split")?,
        obstructed: field(&mut document, "obstructed")?,
        writers: writers.collect::<Result<_>>()?,
        inputs: Inputs::default(),
    })
}

fn field<T: serde::de::DeserializeOwned>(
    document: &mut Map<String, Value>,
    name: &str,
) -> Result<T> {
    serde_json::from_value(document.remove(name).unwrap_or_default())
        .map_err(|e| Error::value(name, e))
}

/// The writer of a name and settings, as [`Writer::settings`] told them.
fn writer(name: &str, settings: Value, pictures: &Pictures) -> Result<Box<dyn Writer>> {
    let wrong = |e: serde_json::Error| Error::value(format!("writers.{name}"), e);
    match name {
        "pictures" => Ok(Box::new(*pictures)),
        "sidecar" => Ok(Box::new(Sidecar)),
        format => {
            let mut config = json!({ "formats": [format] });
            if settings.as_object().is_some_and(|map| !map.is_empty()) {
                config[format] = settings;
            }
            let config: LabelConfig = serde_json::from_value(config).map_err(wrong)?;
            let unknown = || Error::value(format!("writers.{name}"), "no such layout");
            config
                .writers(pictures)
                .into_iter()
                .next()
                .ok_or_else(unknown)
        }
    }
}

/// Copies a file, if it is as it was written.
fn copy(shard: &Path, folder: &Path, file: &WrittenFile) -> Result<()> {
    let (from, to) = (
        io::inside(shard, &file.path)?,
        io::below(folder, &file.path)?,
    );
    io::create_folder(to.parent().unwrap_or(folder))?;
    io::copy(from, to, file.checksum())
}
