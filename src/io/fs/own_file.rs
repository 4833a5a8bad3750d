//! Files that petcomp owns in an output folder: never links to other files.

use super::open::reason;
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::path::Path;

/// Opens one of petcomp's own files in an output folder for reading and appending; creates it if it
/// does not exist.
///
/// # Errors
/// [`Error::File`] for a link, which would lead to someone else's file, and for anything but a
/// regular file.
pub(crate) fn open_own(path: &Path) -> Result<File> {
    refuse_foreign(path)?;
    let file = own_options()
        .open(path)
        .map_err(|e| Error::file(path, reason(&e)))?;
    match file.metadata() {
        Ok(meta) if meta.is_file() => Ok(file),
        Ok(_) => Err(foreign(path)),
        Err(e) => Err(Error::file(path, reason(&e))),
    }
}

/// For reading and appending, created if it does not exist.
fn own_options() -> OpenOptions {
    let mut options = OpenOptions::new();
    options.read(true).append(true).create(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, own_flags());
    options
}

/// Rejects anything in the place of one of petcomp's own files that is not a regular file.
///
/// # Errors
/// [`Error::File`] for a link and for anything but a regular file.
pub(crate) fn refuse_foreign(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(meta) if !meta.is_file() => Err(foreign(path)),
        _ => Ok(()),
    }
}

fn foreign(path: &Path) -> Error {
    Error::file(
        path,
        "is a link or not a regular file, expected petcomp's own file; remove it",
    )
}

/// Does not follow a link that replaces the file after the check, and does not wait for a FIFO.
#[cfg(unix)]
fn own_flags() -> i32 {
    (rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK).bits() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[cfg(unix)]
    #[test]
    fn own_files_are_no_links_and_nothing_to_wait_for() {
        let dir = tempfile::tempdir().unwrap();
        let [own, link, pipe, victim] =
            ["own", "link", "pipe", "victim"].map(|name| dir.path().join(name));
        std::fs::write(&victim, "mine").unwrap();
        std::os::unix::fs::symlink(&victim, &link).unwrap();
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, 0o600.into()).unwrap();
        for refused in [&link, &pipe, &dir.path().to_path_buf()] {
            assert!(
                open_own(refused)
                    .unwrap_err()
                    .to_string()
                    .contains("is a link or not a regular file")
            );
        }
        open_own(&own).unwrap().write_all(b"a").unwrap();
        open_own(&own).unwrap().write_all(b"b").unwrap();
        assert_eq!(
            (
                std::fs::read(&own).unwrap(),
                std::fs::read(&victim).unwrap()
            ),
            (b"ab".into(), b"mine".into())
        );
    }
}
