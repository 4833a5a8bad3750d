//! A dataset's folder: claimed by one run at a time, and only for the plan that it was started
//! with.

use crate::dataset::times::RUNS;
use crate::dataset::{Plan, SampleRange, Shard, SplitOrder, Writer};
use crate::error::{Error, Result};
use crate::io;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use std::fs::{DirEntry, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Name of the file that records what a dataset was made from.
pub(crate) const IDENTITY: &str = "dataset.json";

/// Name of the journal in a dataset's folder.
pub const JOURNAL: &str = "index.jsonl";

/// Locked while a run writes; empty.
const LOCK: &str = ".lock";

/// Version of [`IDENTITY`] and of the journal: 2 records every input, and the lines of the journal
/// have checksums.
const FORMAT_VERSION: u64 = 2;

/// A claimed folder; released on drop.
pub(crate) struct FolderClaim {
    _lock: File,
}

/// Claims the folder of a plan: creates or checks it, locks it, and lets the writers begin.
pub(crate) fn claim(plan: &Plan) -> Result<FolderClaim> {
    let folder = plan.folder.as_path();
    let before = enter(folder)?;
    refuse_foreign_files(folder)?;
    let lock = lock(folder)?;
    sign(plan, before)?;
    io::sweep(folder, Duration::ZERO)?;
    begin_writers(plan)?;
    Ok(FolderClaim { _lock: lock })
}

/// Creates or checks the folder of a plan that several runs write to at once, no two of them the
/// same file.
pub(crate) fn share(plan: &Plan) -> Result<()> {
    let before = enter(&plan.folder)?;
    sign(plan, before)
}

/// Creates a folder if it is missing; returns what it was made from otherwise.
fn enter(folder: &Path) -> Result<Option<Value>> {
    refuse_url(folder)?;
    let before = claimable_identity(folder)?;
    io::create_folder(folder)?;
    io::refuse_links(folder)?;
    Ok(before)
}

fn refuse_url(folder: &Path) -> Result<()> {
    match folder.to_string_lossy().contains("://") {
        false => Ok(()),
        true => Err(Error::file(folder, "is a URL, expected a folder")),
    }
}

/// Records in the folder what it is made from; fails if it was started with something else.
fn sign(plan: &Plan, before: Option<Value>) -> Result<()> {
    let folder = plan.folder.as_path();
    let now = plan_identity(plan)?;
    if let Some(before) = before {
        check_same_plan(&before, &now, folder)?;
    }
    io::write_json(identity_file(folder), &now)
}

fn refuse_foreign_files(folder: &Path) -> Result<()> {
    let mut own = [LOCK, JOURNAL, RUNS].iter();
    own.try_for_each(|name| io::refuse_foreign(&folder.join(name)))
}

fn begin_writers(plan: &Plan) -> Result<()> {
    let mut writers = plan.writers.iter();
    writers.try_for_each(|writer| writer.begin(&plan.folder, &plan.classes))
}

/// What a folder was made from; fails if it holds something else.
fn claimable_identity(folder: &Path) -> Result<Option<Value>> {
    check_is_folder(folder)?;
    let before = identity(folder)?;
    if before.is_some() || !holds_something(folder)? {
        return Ok(before);
    }
    // Another shard may have started it in between.
    let begun = identity(folder)?;
    if begun.is_none() {
        let what = format!("is not empty and has no {IDENTITY}, expected a new or empty folder");
        return Err(Error::file(folder, what));
    }
    Ok(begun)
}

fn check_is_folder(folder: &Path) -> Result<()> {
    if folder.is_dir() || !folder.exists() {
        return Ok(());
    }
    let what = "is a file, expected a folder for the dataset";
    Err(Error::file(folder, what))
}

/// Fails if the folder was started with another plan, naming the field.
pub(super) fn check_same_plan(before: &Value, now: &Value, folder: &Path) -> Result<()> {
    of_this_format(before, folder)?;
    same(before, now, "").map_err(|(at, what)| different(at, &what).in_file(identity_file(folder)))
}

fn different(at: String, what: &str) -> Error {
    Error::value(at, format!("{what}; expected the same, or a new folder"))
}

/// The file that records what the dataset in a folder was made from.
pub(super) fn identity_file(folder: &Path) -> PathBuf {
    folder.join(IDENTITY)
}

/// Claims the folder of a dataset that was started before.
pub(crate) fn reclaim(folder: &Path) -> Result<FolderClaim> {
    begun(folder)?;
    Ok(FolderClaim {
        _lock: lock(folder)?,
    })
}

/// What a dataset that was started before is made from.
pub(crate) fn begun(folder: &Path) -> Result<Value> {
    let before = known_identity(folder, "a dataset that was started before")?;
    io::refuse_links(folder)?;
    of_this_format(&before, folder)?;
    Ok(before)
}

/// Whether the folder was started before every input was recorded and lines had checksums.
pub(crate) fn is_older(folder: &Path) -> Result<bool> {
    Ok(identity(folder)?.is_some_and(|before| format_of(&before) < FORMAT_VERSION))
}

fn format_of(identity: &Value) -> u64 {
    identity["format"].as_u64().unwrap_or(1)
}

/// Rejects what another version of petcomp recorded differently: nobody could tell whether its
/// inputs are unchanged.
pub(crate) fn of_this_format(identity: &Value, folder: &Path) -> Result<()> {
    let (what, others) = match format_of(identity) {
        FORMAT_VERSION => return Ok(()),
        ..FORMAT_VERSION => (
            "was started by an older petcomp, which did not record every input",
            "older",
        ),
        _ => ("was started by a newer petcomp", "newer"),
    };
    let what = format!("{what}: finish it with the {others} one, or use a new folder");
    Err(Error::file(identity_file(folder), what))
}

/// What a folder was made from; none if it is no dataset yet.
pub(crate) fn identity(folder: &Path) -> Result<Option<Value>> {
    match std::fs::symlink_metadata(identity_file(folder)) {
        Err(_) => Ok(None),
        Ok(_) => io::read_json(io::inside(folder, IDENTITY)?).map(Some),
    }
}

/// What a dataset, or what should be one, was made from.
///
/// # Errors
/// A folder that is not a dataset.
pub(crate) fn known_identity(folder: &Path, expected: &str) -> Result<Value> {
    let identity = identity(folder)?;
    identity.ok_or_else(|| Error::file(folder, format!("no {IDENTITY}, expected {expected}")))
}

/// A field of what a dataset was made from.
pub(super) fn field<T: DeserializeOwned>(document: &Value, name: &str) -> Result<T> {
    serde_json::from_value(document[name].clone()).map_err(|e| Error::value(name, e))
}

/// What a dataset whose samples have files of their own was made from.
///
/// # Errors
/// As [`known_identity`]; a dataset of archives only.
pub(crate) fn identity_of_files(folder: &Path) -> Result<Value> {
    let identity = known_identity(folder, "a dataset")?;
    let has_files = [JOURNAL, "images"]
        .iter()
        .any(|name| folder.join(name).exists());
    if has_files || !has_archives(&identity) {
        return Ok(identity);
    }
    let what = "only archives, expected files of single pictures; `dataset generate --preview` writes some to another folder";
    Err(Error::file(folder, what))
}

fn has_archives(identity: &Value) -> bool {
    let writers = identity["writers"].as_array();
    writers.is_some_and(|all| all.iter().any(|writer| writer.get("webdataset").is_some()))
}

/// The names of the classes that an identity records.
pub(crate) fn known_classes(identity: &Value) -> Vec<String> {
    field(identity, "classes").unwrap_or_default()
}

fn holds_something(folder: &Path) -> Result<bool> {
    if !folder.exists() {
        return Ok(false);
    }
    let entries = io::entries(folder)?;
    let mut names = entries.iter().map(DirEntry::file_name);
    Ok(names.any(|name| !name.to_string_lossy().starts_with('.')))
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    // The file stays: a lock on a file that another run is about to delete would lock nothing.
    let file = io::open_own(&path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            Err(Error::file(folder, "another run is writing this dataset"))
        }
        Err(TryLockError::Error(e)) => Err(Error::file(&path, e)),
    }
}

/// Everything that decides the bytes of a dataset's samples, as read back from a file.
pub(super) fn plan_identity(plan: &Plan) -> Result<Value> {
    let mut identity = json!({
        "format": FORMAT_VERSION,
        "petcomp": env!("CARGO_PKG_VERSION"),
        "seed": plan.seed,
        "classes": plan.classes,
        "split": plan.split,
        "obstructed": plan.obstructed,
        "writers": writer_settings(plan),
        "recipe": plan.recipe,
    });
    match (plan.archives, plan.range) {
        // The last archive ends with the last sample; shards share the folder.
        (Some(_), _) => identity["count"] = plan.count.into(),
        (None, SampleRange::Shard(Shard { index, of })) => {
            identity["shard"] = json!({ "index": index, "of": of, "count": plan.count });
        }
        (None, _) => {}
    }
    if plan.split.order == SplitOrder::Consecutive {
        identity["count"] = plan.count.into();
    }
    serde_json::from_str(&identity.to_string()).map_err(|e| Error::value("recipe", e))
}

fn writer_settings(plan: &Plan) -> Vec<Value> {
    let archives = plan.archives.iter().map(Writer::settings);
    let writers = plan.writers.iter().map(|writer| writer.settings());
    writers.chain(archives).collect()
}

/// The first place where two documents differ, and how, if they do.
type FieldComparison = std::result::Result<(), (String, String)>;

/// Compares two documents and names the first field in which they differ; entries of lists by their
/// own name or file.
pub(crate) fn same(before: &Value, now: &Value, at: &str) -> FieldComparison {
    match (before, now) {
        (Value::Object(a), Value::Object(b)) => same_keys(a, b, at),
        (Value::Array(a), Value::Array(b)) => same_entries(a, b, at),
        _ if before == now => Ok(()),
        _ => differ(before, now, at),
    }
}

fn differ(before: &Value, now: &Value, at: &str) -> FieldComparison {
    let what = match (before, now) {
        // As a key that only a newer version writes.
        (Value::Null, _) => format!("without it, this run has {}", brief(now)),
        (_, Value::Null) => format!("with {}, this run has none", brief(before)),
        _ => format!("with {}, this run has {}", brief(before), brief(now)),
    };
    Err((at.to_owned(), format!("the dataset was started {what}")))
}

fn same_entries(a: &[Value], b: &[Value], at: &str) -> FieldComparison {
    for (i, (before, now)) in a.iter().zip(b).enumerate() {
        match (name_of(before), name_of(now)) {
            (Some(first), Some(second)) if first == second => {
                same(before, now, &format!("{at}[{first}]"))?
            }
            (Some(first), Some(second)) => {
                differ(&first.into(), &second.into(), &format!("{at}[{i}]"))?
            }
            _ => same(before, now, &format!("{at}[{i}]"))?,
        }
    }
    let (before, now) = (a.len(), b.len());
    if before == now {
        return Ok(());
    }
    let what = format!("the dataset was started with {before} entries, this run has {now}");
    Err((at.to_owned(), what))
}

/// The name of an entry of a list.
fn name_of(entry: &Value) -> Option<&str> {
    ["name", "file"]
        .iter()
        .find_map(|key| entry.get(key)?.as_str())
}

/// Maximum length of a value that a message shows whole, characters.
const MAX_SHOWN_LETTERS: usize = 80;

fn brief(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(MAX_SHOWN_LETTERS) {
        Some((end, _)) => format!("{}..", &text[..end]),
        None => text,
    }
}

/// The key that is compared before the others: a picture's size also affects what is recorded of
/// cameras.
const FIRST_KEY: &str = "scene";

fn same_keys(a: &Map<String, Value>, b: &Map<String, Value>, at: &str) -> FieldComparison {
    let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
    // Notes are text for people about values that are compared themselves.
    let keys = keys.filter(|key| !field_path(at, key).ends_with("recipe.notes"));
    let mut keys: Vec<&String> = keys.collect();
    keys.sort_by_key(|key| *key != FIRST_KEY);
    for key in keys {
        let [before, now] = [a, b].map(|map| map.get(key).unwrap_or(&Value::Null));
        same(before, now, &field_path(at, key))?;
    }
    Ok(())
}

pub(super) fn field_path(at: &str, key: &str) -> String {
    match at {
        "" => key.to_owned(),
        _ => format!("{at}.{key}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_named_by_entry_and_field() {
        let asset = |name: &str, mass: f64| json!({ "mass": mass, "name": name });
        let before = json!({ "assets": [asset("b0", 0.1), asset("b1", 0.2)] });
        let differs = |now: Value| same(&before, &json!({ "assets": now }), "").unwrap_err();
        for (now, expected) in [
            (
                json!([asset("b0", 0.1), asset("b1", 0.3)]),
                [
                    "assets[b1].mass",
                    "the dataset was started with 0.2, this run has 0.3",
                ],
            ),
            (
                json!([asset("b0", 0.1), asset("a", 0.4)]),
                [
                    "assets[1]",
                    "the dataset was started with \"b1\", this run has \"a\"",
                ],
            ),
            (
                json!([asset("b0", 0.1)]),
                [
                    "assets",
                    "the dataset was started with 2 entries, this run has 1",
                ],
            ),
        ] {
            assert_eq!(<[String; 2]>::from(differs(now)), expected);
        }
        let (_, what) = differs(json!("x".repeat(500)));
        assert!(what.len() < 260 && what.ends_with(".."), "{what}");
    }

    #[test]
    fn another_size_of_pictures_is_blamed_on_no_camera() {
        let recipe = |width: u32| {
            let backgrounds = json!([{ "name": "tray", "camera": format!("crc32 {width:08x}") }]);
            json!({ "recipe": { "backgrounds": backgrounds, "scene": { "image": [width, 240] } } })
        };
        let (at, _) = same(&recipe(320), &recipe(640), "").unwrap_err();
        assert_eq!(at, "recipe.scene.image[0]");
    }
}
