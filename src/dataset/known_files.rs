//! Files that pictures are made from: the bytes that each had when it was first read.

use crate::asset;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{self, FromFile};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// CRC-32 of files by their paths: as recorded in a dataset's plan, or as pictures were first made.
#[derive(Debug, Default)]
pub(crate) struct KnownFiles {
    checksums: Mutex<BTreeMap<PathBuf, u32>>,
}

impl KnownFiles {
    /// Reads a picture and makes something of it. A file that `make` fails on is not recorded: it
    /// may be repaired.
    ///
    /// # Errors
    /// As [`io::read`], and those of `make`; a file whose bytes differ from those recorded.
    pub(crate) fn read<P: FromFile, T>(
        &self,
        path: &Path,
        make: impl FnOnce(Image<P>) -> Result<T>,
    ) -> Result<T> {
        let mut crc32 = 0;
        let picture = io::read_checked(path, |bytes| {
            crc32 = crc32fast::hash(bytes);
            self.compare(path, crc32)
        })?;
        let made = make(picture)?;
        self.check(path, crc32)?;
        Ok(made)
    }

    /// Fails if a file is known by another checksum; records this one if it is not known yet.
    pub(crate) fn check(&self, path: &Path, crc32: u32) -> Result<()> {
        let known = *self.lock().entry(path.to_owned()).or_insert(crc32);
        let compared = asset::check_unchanged(crc32, known);
        compared.map_err(|what| Error::file(path, what))
    }

    /// Fails if a file is known by another checksum.
    fn compare(&self, path: &Path, crc32: u32) -> std::result::Result<(), String> {
        let known = self.lock().get(path).copied();
        asset::check_unchanged(crc32, known.unwrap_or(crc32))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, u32>> {
        let checksums = self.checksums.lock();
        checksums.unwrap_or_else(PoisonError::into_inner)
    }
}
