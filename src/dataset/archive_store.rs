//! Archives in an object store: several machines write to it, and none needs to know of another.
//!
//! Nothing is ever overwritten. An archive counts as there once its receipt is, which is put last
//! and says how long its files are and what their checksums are.

use crate::dataset::Plan;
use crate::dataset::folder::{self, IDENTITY};
use crate::error::{Error, Result};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// An object store, or what lies below a prefix in one.
///
/// Content that was put under a name stays as it is.
pub trait ArchiveStore: Send + Sync {
    /// What people call it: `s3://bucket/prefix`.
    fn url(&self) -> &str;

    /// Puts content under a name unless something is there; says whether nothing was.
    ///
    /// A put whose answer is lost may be tried again and then finds its own content there.
    ///
    /// # Errors
    /// [`Error::File`] with the object's URL where the store refuses, is full or cannot be reached.
    fn put(&self, name: &str, content: Vec<u8>) -> Result<bool>;

    /// What is under a name.
    ///
    /// # Errors
    /// As [`Self::put`], and where nothing is.
    fn get(&self, name: &str) -> Result<Vec<u8>>;

    /// The names below a folder, without its own, in any order.
    ///
    /// # Errors
    /// As [`Self::put`].
    fn names(&self, folder: &str) -> Result<Vec<String>>;
}

/// Where receipts are.
const RECEIPTS: &str = "receipts";

/// Makes the store the plan's, or checks that it is.
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

/// The numbers of the archives that are there.
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

/// Puts content, or finds the same there: from a run that was killed before its receipt, or of a
/// put whose answer was lost.
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
