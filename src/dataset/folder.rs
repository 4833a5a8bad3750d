//! A dataset's folder: claimed by one run at a time, and only for the plan that it was begun with.

use crate::dataset::{Numbers, Plan, Shard, SplitOrder};
use crate::error::{Error, Result};
use crate::io;
use serde_json::{Map, Value, json};
use std::fs::{File, TryLockError};
use std::path::Path;

/// Name of the file that says what a dataset was made from.
pub(crate) const IDENTITY: &str = "dataset.json";

/// Locked while a run writes; empty.
const LOCK: &str = ".lock";

/// A claimed folder; free again when this is dropped.
pub(crate) struct Claim {
    _lock: File,
}

/// Claims the folder of a plan: makes or checks it, locks it, and lets the writers begin.
pub(crate) fn claim(plan: &Plan) -> Result<Claim> {
    let folder = plan.folder.as_path();
    if folder.exists() && !folder.is_dir() {
        return Err(Error::file(folder, "is a file, expected a folder for the dataset"));
    }
    let before = identity(folder)?;
    if before.is_none() && holds_something(folder)? {
        return Err(Error::file(folder, format!("is not empty and has no {IDENTITY}, expected a new or empty folder")));
    }
    io::create_folder(folder)?;
    io::refuse_links(folder)?;
    let lock = lock(folder)?;
    let now = plan_identity(plan)?;
    if let Some(before) = before {
        same(&before, &now, "").map_err(|(at, what)| Error::value(at, what).in_file(folder.join(IDENTITY)))?;
    }
    sweep(folder)?;
    io::write_json(folder.join(IDENTITY), &now)?;
    plan.writers.iter().try_for_each(|writer| writer.begin(folder, &plan.classes))?;
    Ok(Claim { _lock: lock })
}

/// Claims the folder of a dataset that was begun before.
pub(crate) fn reclaim(folder: &Path) -> Result<Claim> {
    match identity(folder)? {
        Some(_) => Ok(Claim { _lock: lock(folder)? }),
        None => Err(Error::file(folder, format!("no {IDENTITY}, expected a dataset that was begun before"))),
    }
}

/// What a folder was made from; none where it is no dataset yet.
pub(crate) fn identity(folder: &Path) -> Result<Option<Value>> {
    let path = folder.join(IDENTITY);
    if path.exists() { io::read_json(&path).map(Some) } else { Ok(None) }
}

fn holds_something(folder: &Path) -> Result<bool> {
    if !folder.exists() {
        return Ok(false);
    }
    let mut entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
    Ok(entries.any(|entry| entry.is_ok_and(|e| !e.file_name().to_string_lossy().starts_with('.'))))
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    // The file stays: a lock on a file that another run is about to delete would lock nothing.
    let file = File::create(&path).map_err(|e| Error::file(&path, e))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(Error::file(folder, "another run is writing this dataset")),
        Err(TryLockError::Error(e)) => Err(Error::file(&path, e)),
    }
}

/// Deletes what a killed run left half-written.
fn sweep(folder: &Path) -> Result<()> {
    for entry in std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => sweep(&entry.path())?,
            Ok(kind) if kind.is_file() && name.starts_with(".petcomp-") && name.ends_with(".tmp") => {
                std::fs::remove_file(entry.path()).map_err(|e| Error::file(entry.path(), e))?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// Everything that decides the bytes of a dataset's samples, as it reads back from a file.
fn plan_identity(plan: &Plan) -> Result<Value> {
    let mut identity = json!({
        "petcomp": env!("CARGO_PKG_VERSION"),
        "seed": plan.seed,
        "classes": plan.classes,
        "split": plan.split,
        "obstructed": plan.obstructed,
        "writers": plan.writers.iter().map(|writer| writer.settings()).collect::<Vec<_>>(),
        "recipe": plan.recipe,
    });
    if let Numbers::Shard(Shard { index, of }) = plan.numbers {
        identity["shard"] = json!({ "index": index, "of": of, "count": plan.count });
    }
    if plan.split.order == SplitOrder::Consecutive {
        identity["count"] = plan.count.into();
    }
    serde_json::from_str(&identity.to_string()).map_err(|e| Error::value("recipe", e))
}

/// Compares two documents and names the first field in which they differ.
pub(crate) fn same(before: &Value, now: &Value, at: &str) -> std::result::Result<(), (String, String)> {
    match (before, now) {
        (Value::Object(a), Value::Object(b)) => same_keys(a, b, at),
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().try_for_each(|(i, (a, b))| same(a, b, &format!("{at}[{i}]")))
        }
        _ if before == now => Ok(()),
        _ => Err((at.to_owned(), format!("the dataset was begun with {before}, this run has {now}"))),
    }
}

fn same_keys(a: &Map<String, Value>, b: &Map<String, Value>, at: &str) -> std::result::Result<(), (String, String)> {
    let none = Value::Null;
    let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
    for key in keys {
        let at = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
        same(a.get(key).unwrap_or(&none), b.get(key).unwrap_or(&none), &at)?;
    }
    Ok(())
}
