//! Files that pictures are made from: the bytes that each had when it was first looked at.

use crate::asset;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{self, FromFile};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// CRC-32 of files by their paths: as a dataset's plan tells them, or as pictures were first made.
#[derive(Debug, Default)]
pub(crate) struct KnownFiles {
    checksums: Mutex<BTreeMap<PathBuf, u32>>,
}

impl KnownFiles {
    /// Reads a picture.
    ///
    /// # Errors
    /// As [`io::read`]; other bytes than the file is known by.
    pub(crate) fn read<P: FromFile>(&self, path: &Path) -> Result<Image<P>> {
        io::read_checked(path, |bytes| self.compare(path, crc32fast::hash(bytes)))
    }

    /// Fails where a file is known by another checksum than this one.
    pub(crate) fn check(&self, path: &Path, crc32: u32) -> Result<()> {
        let compared = self.compare(path, crc32);
        compared.map_err(|what| Error::file(path, what))
    }

    fn compare(&self, path: &Path, crc32: u32) -> std::result::Result<(), String> {
        let checksums = self.checksums.lock();
        let mut checksums = checksums.unwrap_or_else(PoisonError::into_inner);
        let known = checksums.entry(path.to_owned()).or_insert(crc32);
        asset::check_unchanged(crc32, *known)
    }
}
