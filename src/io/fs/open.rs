//! Opens regular files without blocking, and explains system errors.

use crate::error::{Error, Result};
use crate::io::limits::{affordable, at_most};
use crate::work::{self, Kind};
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

/// Opens a regular file, and no other kind: a FIFO would block, a device never ends. Also returns
/// its length. `most` is the maximum length, and the name of that limit.
pub(crate) fn open_regular(path: &Path, most: (u64, &str), expected: &str) -> Result<(File, u64)> {
    open_checked(path, expected)
        .and_then(|(file, bytes)| {
            at_most(bytes, most.0, "bytes", most.1)?;
            Ok((file, bytes))
        })
        .map_err(|e| Error::file(path, e))
}

/// A regular file and its length. Checked before it is opened, because opening may block, and again
/// afterwards, because it may have been replaced.
fn open_checked(path: &Path, expected: &str) -> std::result::Result<(File, u64), String> {
    let before = std::fs::metadata(path).map_err(|e| reason(&e))?;
    check_regular(&before, expected)?;
    let file = File::open(path).map_err(|e| reason(&e))?;
    let meta = file.metadata().map_err(|e| reason(&e))?;
    check_regular(&meta, expected)?;
    Ok((file, meta.len()))
}

fn check_regular(meta: &Metadata, expected: &str) -> std::result::Result<(), String> {
    match (meta.is_dir(), meta.is_file()) {
        (true, _) => Err(format!("is a folder, expected a {expected}")),
        (_, false) => Err(format!("not a regular file, expected a {expected}")),
        _ => Ok(()),
    }
}

/// The bytes of a regular file.
pub(crate) fn read_regular(path: &Path, most: (u64, &str), expected: &str) -> Result<Vec<u8>> {
    let (file, bytes) = open_regular(path, most, expected)?;
    read_to_end(file, bytes, most.0).map_err(|e| Error::file(path, e))
}

/// The rest of a file that had `length` bytes when it was opened, and may have grown since.
pub(crate) fn read_to_end(
    file: impl Read,
    length: u64,
    most: u64,
) -> std::result::Result<Vec<u8>, String> {
    affordable(length)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.take(most)
        .read_to_end(&mut bytes)
        .map_err(|e| reason(&e))?;
    work::add_all([(Kind::FilesRead, 1), (Kind::BytesRead, bytes.len() as u64)]);
    Ok(bytes)
}

/// The system's reason, without its number and in our spelling.
pub(crate) fn reason(e: &std::io::Error) -> String {
    use std::io::ErrorKind as K;
    match e.kind() {
        K::NotFound => "no such file".into(),
        K::PermissionDenied => "permission denied".into(),
        K::NotADirectory => "part of the path is a file, not a folder".into(),
        K::StorageFull => "no space left on the disk".into(),
        _ => {
            let text = e.to_string().to_lowercase();
            text.split(" (os error")
                .next()
                .unwrap_or_default()
                .to_string()
        }
    }
}
