//! Archives in an object store: several machines write to it, and none needs to know of another.
//!
//! Nothing is ever overwritten. An archive counts as present once its receipt is; the receipt is
//! put last and records the sizes and checksums of its files.

use crate::dataset::Plan;
use crate::dataset::folder::{self, IDENTITY};
use crate::error::{Error, Result};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// An object store, or what is below a prefix in one.
///
/// Content that was put under a name never changes.
pub trait ArchiveStore: Send + Sync {
    /// Its address as people write it: `s3://bucket/prefix`.
    fn url(&self) -> &str;

    /// Puts content under a name unless the name exists; returns whether the name was new.
    ///
    /// A put whose answer is lost may be retried and then finds its own content there.
    ///
    /// # Errors
    /// [`Error::File`] with the object's URL if the store refuses, is full or cannot be reached.
    fn put(&self, name: &str, content: Vec<u8>) -> Result<bool>;

    /// The content under a name.
    ///
    /// # Errors
    /// As [`Self::put`], and for a name that does not exist.
    fn get(&self, name: &str) -> Result<Vec<u8>>;

    /// The names below a folder, without the folder's own, in any order.
    ///
    /// # Errors
    /// As [`Self::put`].
    fn names(&self, folder: &str) -> Result<Vec<String>>;
}

/// Folder of the receipts.
const RECEIPTS: &str = "receipts";

/// Claims the store for a plan, or checks that it belongs to that plan.
pub(super) fn claim(store: &dyn ArchiveStore, plan: &Plan) -> Result<()> {
    let now = folder::plan_identity(plan)?;
    let text = serde_json::to_vec_pretty(&now).map_err(|e| Error::value("recipe", e))?;
    if store.put(IDENTITY, text)? {
        return Ok(());
    }
    let before = serde_json::from_slice(&store.get(IDENTITY)?);
    let before = before.map_err(|e| Error::file(url_of(store, IDENTITY), e))?;
    folder::check_same_plan(&before, &now, Path::new(store.url()))
}

/// Numbers of the archives that are present.
pub(super) fn present(store: &dyn ArchiveStore) -> Result<BTreeSet<u64>> {
    let names = store.names(RECEIPTS)?;
    let numbers = names.iter().filter_map(|name| name.strip_suffix(".json"));
    Ok(numbers.filter_map(|number| number.parse().ok()).collect())
}

/// Puts the files of an archive, each under its name, and then its receipt.
pub(super) fn keep(
    store: &dyn ArchiveStore,
    number: u64,
    files: &[(String, PathBuf)],
) -> Result<()> {
    let files: Vec<ReceivedFile> = files
        .iter()
        .map(|(name, path)| upload(store, name, path))
        .collect::<Result<_>>()?;
    let receipt = serde_json::to_vec_pretty(&Receipt { files });
    let receipt = receipt.map_err(|e| Error::value("receipt", e))?;
    put_or_compare(store, &format!("{RECEIPTS}/{number:06}.json"), receipt)
}

/// What is known of an archive that has arrived.
#[derive(Serialize)]
struct Receipt {
    files: Vec<ReceivedFile>,
}

#[derive(Serialize)]
struct ReceivedFile {
    name: String,
    bytes: u64,
    crc32: u32,
}

fn upload(store: &dyn ArchiveStore, name: &str, path: &Path) -> Result<ReceivedFile> {
    let content = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    let received = ReceivedFile {
        name: name.to_owned(),
        bytes: content.len() as u64,
        crc32: crc32fast::hash(&content),
    };
    put_or_compare(store, name, content)?;
    Ok(received)
}

/// Puts content, or finds the same content there: from a run that was killed before its receipt, or
/// from a put whose answer was lost.
fn put_or_compare(store: &dyn ArchiveStore, name: &str, content: Vec<u8>) -> Result<()> {
    let checksum = crc32fast::hash(&content);
    let bytes = content.len();
    if store.put(name, content)? {
        return Ok(());
    }
    let there = store.get(name)?;
    if there.len() == bytes && crc32fast::hash(&there) == checksum {
        return Ok(());
    }
    let what = format!(
        "holds {} bytes that differ from the {bytes} of this run: another petcomp wrote it, or another machine",
        there.len()
    );
    Err(Error::file(url_of(store, name), what))
}

fn url_of(store: &dyn ArchiveStore, name: &str) -> PathBuf {
    Path::new(store.url()).join(name)
}
