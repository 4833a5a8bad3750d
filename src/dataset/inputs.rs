//! Checksums of the files that a dataset is made from: each file is read once, and again only if it
//! has changed.

use crate::error::{Error, Result};
use crate::io::{self, Checksum};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Name of the file that keeps the checksums: specific to the machine and its clock, and no part of
/// the dataset.
pub(crate) const INPUTS: &str = ".inputs.json";

/// A file that changed less than this ago may change again within the same tick of its file
/// system's clock (2 s on FAT), so nothing is concluded from its time.
const SETTLED_AGE: Duration = Duration::from_secs(2);

/// Checksums of a dataset's input files, kept in its folder from one run to the next.
///
/// A checksum is reused while the file has the same size, times and place on the disk.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    before: BTreeMap<String, Input>,
    now: BTreeMap<String, Input>,
}

/// What is known of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Input {
    /// Size, times and place on the disk.
    stamp: String,
    crc32: u32,
    /// Whether the file had not changed for a while when it was read.
    #[serde(skip, default = "settled")]
    is_settled: bool,
}

fn settled() -> bool {
    true
}

impl Inputs {
    /// What an earlier run kept in a dataset's folder; empty if there is nothing.
    pub(crate) fn kept(folder: &Path) -> Self {
        let before = io::inside(folder, INPUTS)
            .and_then(io::read_json)
            .unwrap_or_default();
        Self {
            before,
            now: BTreeMap::new(),
        }
    }

    /// CRC-32 of files, each with a name that it has in every run.
    ///
    /// # Errors
    /// [`Error::File`] for the first that cannot be read.
    pub(crate) fn checksums(&mut self, files: &[(String, &Path)]) -> Result<Vec<u32>> {
        self.checksums_at(files, SystemTime::now())
    }

    fn checksums_at(&mut self, files: &[(String, &Path)], now: SystemTime) -> Result<Vec<u32>> {
        let read: Vec<Result<Input>> = files
            .par_iter()
            .map(|(name, path)| self.look(name, path, now))
            .collect();
        let mut checksums = Vec::new();
        for (input, (name, _)) in read.into_iter().zip(files) {
            let input = input?;
            checksums.push(input.crc32);
            self.now.insert(name.clone(), input);
        }
        Ok(checksums)
    }

    fn look(&self, name: &str, path: &Path, now: SystemTime) -> Result<Input> {
        let meta = std::fs::metadata(path).map_err(|e| Error::file(path, e))?;
        let stamp = stamp(&meta);
        let known = self.before.get(name);
        if let Some(known) = known.filter(|input| input.stamp == stamp) {
            return Ok(known.clone());
        }
        Ok(Input {
            stamp,
            crc32: Checksum::from_file(path)?.crc32,
            is_settled: is_settled(&meta, now),
        })
    }

    /// Keeps the checksums for the next run. They only save time: a folder without room for them is
    /// no error.
    pub(crate) fn keep(&self, folder: &Path) {
        let settled = self.settled();
        if settled.is_empty() || settled == self.before.iter().collect() {
            return;
        }
        // Not counted as work: when it is written depends on the age of files.
        let text = serde_json::to_vec_pretty(&settled).unwrap_or_default();
        if let Err(e) = io::write_through(&folder.join(INPUTS), |out| out.write_all(&text)) {
            log::debug!("{e}");
        }
    }

    fn settled(&self) -> BTreeMap<&String, &Input> {
        let inputs = self.now.iter();
        inputs.filter(|(_, input)| input.is_settled).collect()
    }

    /// Makes the next run read every file again.
    pub(crate) fn forget(folder: &Path) {
        // If it does not exist or cannot be deleted, no harm is done.
        let _ = std::fs::remove_file(folder.join(INPUTS));
    }
}

/// Everything that the system reports about a file's content without reading it.
#[cfg(unix)]
fn stamp(meta: &Metadata) -> String {
    use std::os::unix::fs::MetadataExt as M;
    let times = format!(
        "{}.{:09} {}.{:09}",
        M::mtime(meta),
        M::mtime_nsec(meta),
        M::ctime(meta),
        M::ctime_nsec(meta)
    );
    format!("{} {times} {} {}", meta.len(), M::dev(meta), M::ino(meta))
}

/// Everything that the system reports about a file's content without reading it.
#[cfg(not(unix))]
fn stamp(meta: &Metadata) -> String {
    format!("{} {:?}", meta.len(), meta.modified().ok())
}

fn is_settled(meta: &Metadata, now: SystemTime) -> bool {
    let times = [meta.modified().ok(), changed(meta)];
    let latest = times.into_iter().flatten().max();
    let age = latest.and_then(|latest| now.duration_since(latest).ok());
    age.is_some_and(|age| age > SETTLED_AGE)
}

/// When a file's content or its names last changed: a time that nobody can set back.
#[cfg(unix)]
fn changed(meta: &Metadata) -> Option<SystemTime> {
    use std::os::unix::fs::MetadataExt as M;
    let seconds = u64::try_from(M::ctime(meta)).ok()?;
    UNIX_EPOCH.checked_add(Duration::new(
        seconds,
        u32::try_from(M::ctime_nsec(meta)).ok()?,
    ))
}

/// Not available on this system.
#[cfg(not(unix))]
fn changed(_: &Metadata) -> Option<SystemTime> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The checksum of a file, as a run at some time finds it.
    fn run(folder: &Path, file: &Path, now: SystemTime) -> u32 {
        let mut inputs = Inputs::kept(folder);
        let found = inputs.checksums_at(&[("a".into(), file)], now).unwrap();
        inputs.keep(folder);
        found[0]
    }

    #[test]
    fn a_file_is_read_again_when_it_has_changed() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("photo");
        std::fs::write(&file, "one").unwrap();
        let later = SystemTime::now() + Duration::from_secs(60);
        assert_eq!(run(dir.path(), &file, later), crc32fast::hash(b"one"));
        // Known by its stamp, so the kept checksum is used.
        let kept = dir.path().join(INPUTS);
        let wrong = io::read_text(&kept)
            .unwrap()
            .replace(&crc32fast::hash(b"one").to_string(), "7");
        std::fs::write(&kept, wrong).unwrap();
        assert_eq!(run(dir.path(), &file, later), 7);
        // Another content of the same length.
        std::fs::write(&file, "two").unwrap();
        assert_eq!(run(dir.path(), &file, later), crc32fast::hash(b"two"));
        Inputs::forget(dir.path());
        assert_eq!(run(dir.path(), &file, later), crc32fast::hash(b"two"));
    }

    #[test]
    fn nothing_is_concluded_from_the_time_of_a_file_that_has_just_changed() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("photo");
        std::fs::write(&file, "one").unwrap();
        run(dir.path(), &file, SystemTime::now());
        assert!(!dir.path().join(INPUTS).exists());
    }

    #[test]
    fn what_is_kept_and_damaged_is_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("photo");
        std::fs::write(&file, "one").unwrap();
        for damaged in ["{", "[]", "{\"a\": 3}"] {
            std::fs::write(dir.path().join(INPUTS), damaged).unwrap();
            assert_eq!(
                run(dir.path(), &file, SystemTime::now()),
                crc32fast::hash(b"one")
            );
        }
        assert!(
            Inputs::kept(dir.path())
                .checksums(&[("a".into(), Path::new("none"))])
                .is_err()
        );
    }
}
