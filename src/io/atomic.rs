//! Whole files or none: everything is written beside its place, put on the disk, and then moved there.

use super::format::{open_regular, reason};
use crate::work::{self, Kind};
use crate::{Error, Result};
use std::fs::{File, OpenOptions, Permissions};
use std::io::{BufWriter, Read, Write};
use std::path::{Component, Path, PathBuf};

/// Writes a file in one step: readers see the old one or the new one, never a part.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    work::add(Kind::BytesWritten, bytes.len() as u64);
    write_through(path, |file| file.write_all(bytes))
}

/// Writes a file piece by piece: nothing of it is there before `fill` has written all of it.
///
/// # Errors
/// [`Error::File`] with what `fill` or the system says.
pub fn write_through(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    let failed =
        |e: std::io::Error| Error::file(path, format!("cannot be written: {}", reason(&e)));
    if path.is_dir() {
        return Err(Error::file(path, "cannot be written: is a folder"));
    }
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut file = new_beside(folder).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::file(
            path,
            format!("cannot be written: no folder {}", folder.display()),
        ),
        _ => failed(e),
    })?;
    let mut pieces = BufWriter::new(&mut file);
    fill(&mut pieces)
        .and_then(|()| pieces.flush())
        .map_err(failed)?;
    drop(pieces);
    // Before it gets its name: after a power cut there is the old file or the new one.
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    sync_folder(folder).map_err(failed)
}

/// Puts the names in a folder on the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    match std::fs::File::open(folder)?.sync_all() {
        // Some file systems have no such thing.
        Err(e) if e.kind() == std::io::ErrorKind::InvalidInput => Ok(()),
        done => done,
    }
}

/// Other systems write names by themselves.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Length and CRC-32 of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checksum {
    /// Its length.
    pub bytes: u64,
    /// CRC-32 of its bytes.
    pub crc32: u32,
}

impl Checksum {
    /// That of a regular file, which is read to its end.
    ///
    /// # Errors
    /// [`Error::File`] for one that cannot be read.
    pub fn of(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let (file, _) = open_regular(path, (u64::MAX, "file_bytes"), "file")?;
        pump(file, &mut std::io::sink()).map_err(|e| Error::file(path, reason(&e)))
    }
}

/// Copies a file in one step, if it is as it was: of another length or with other bytes it is refused, and nothing is
/// written.
///
/// # Errors
/// [`Error::File`] for the one that cannot be read or written.
pub fn copy(from: impl AsRef<Path>, to: impl AsRef<Path>, expected: Checksum) -> Result<()> {
    let (from, to) = (from.as_ref(), to.as_ref());
    let changed = || Error::file(from, "has other bytes than when it was written");
    let (file, bytes) = open_regular(from, (u64::MAX, "file_bytes"), "file")?;
    if bytes != expected.bytes {
        return Err(changed());
    }
    let mut same = true;
    let written = write_through(to, |out| {
        same = pump(file.take(bytes), out)? == expected;
        if same {
            Ok(())
        } else {
            Err(std::io::Error::other("other bytes"))
        }
    });
    if same { written } else { Err(changed()) }
}

/// Bytes that are moved at a time.
const PIECE: usize = 1 << 16;

/// Moves everything from one to the other.
fn pump(mut from: impl Read, to: &mut dyn Write) -> std::io::Result<Checksum> {
    let (mut hasher, mut bytes, mut piece) = (crc32fast::Hasher::new(), 0, vec![0; PIECE]);
    loop {
        let filled = match from.read(&mut piece) {
            Ok(0) => {
                return Ok(Checksum {
                    bytes,
                    crc32: hasher.finalize(),
                });
            }
            Ok(filled) => filled,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
            Err(e) => return Err(e),
        };
        hasher.update(&piece[..filled]);
        to.write_all(&piece[..filled])?;
        bytes += filled as u64;
    }
}

/// Opens a file of petcomp's own in an output folder, to be read and appended to; it is made where it is not there.
///
/// # Errors
/// [`Error::File`] for a link, which would lead to a file of somebody else's, and for anything but a regular file.
pub(crate) fn open_own(path: &Path) -> Result<File> {
    refuse_foreign(path)?;
    let mut options = OpenOptions::new();
    options.read(true).append(true).create(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, own_flags());
    let file = options
        .open(path)
        .map_err(|e| Error::file(path, reason(&e)))?;
    match file
        .metadata()
        .map_err(|e| Error::file(path, reason(&e)))?
        .is_file()
    {
        true => Ok(file),
        false => Err(foreign(path)),
    }
}

/// Refuses what lies in the place of a file of petcomp's own and is none.
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
        "is a link or no regular file, expected petcomp's own file; take it away",
    )
}

/// A link that takes the file's place after it was looked at is not followed, and a FIFO is not waited for.
#[cfg(unix)]
fn own_flags() -> i32 {
    (rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK).bits() as i32
}

/// Brings everything that was written to the file system of a folder to the disk, so that it outlives a power cut.
///
/// Where it cannot be done nothing is lost but time: what is not there is made again.
pub fn sync(folder: impl AsRef<Path>) {
    #[cfg(target_os = "linux")]
    if let Err(e) = std::fs::File::open(&folder).and_then(|folder| Ok(rustix::fs::syncfs(folder)?))
    {
        log::debug!("{}: syncfs: {e}", folder.as_ref().display());
    }
    #[cfg(not(target_os = "linux"))]
    let _ = folder;
}

/// A new file that vanishes if it is not moved to its place, readable like any other file of the user.
fn new_beside(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".petcomp-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// The way from a folder to a file or folder, both absolute.
pub fn relative(to: &Path, from: &Path) -> PathBuf {
    let shared = to
        .components()
        .zip(from.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

/// Makes a folder, and those above it; one that is there already is fine.
///
/// # Errors
/// [`Error::File`] where a file is in the way or the folder may not be made.
pub fn create_folder(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    if let Some(file) = path.ancestors().find(|p| p.is_file()) {
        return Err(Error::file(file, "is a file, expected a folder"));
    }
    std::fs::create_dir_all(path)
        .map_err(|e| Error::file(path, format!("cannot be made: {}", reason(&e))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("folder");
        create_folder(&place).unwrap();
        assert!(
            write_bytes(&place, b"x")
                .unwrap_err()
                .to_string()
                .contains("is a folder")
        );
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_copy_is_made_of_what_was_written_and_of_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let [from, to] = ["a", "b"].map(|name| dir.path().join(name));
        write_bytes(&from, &vec![7; 2 * PIECE + 3]).unwrap();
        let sum = Checksum::of(&from).unwrap();
        assert_eq!(
            sum,
            Checksum {
                bytes: 2 * PIECE as u64 + 3,
                crc32: crc32fast::hash(&vec![7; 2 * PIECE + 3])
            }
        );
        for wrong in [
            Checksum { bytes: 5, ..sum },
            Checksum {
                crc32: sum.crc32 ^ 1,
                ..sum
            },
        ] {
            let said = copy(&from, &to, wrong).unwrap_err().to_string();
            assert!(
                said.ends_with("a: has other bytes than when it was written"),
                "{said}"
            );
            assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
        }
        copy(&from, &to, sum).unwrap();
        assert_eq!(std::fs::read(&to).unwrap(), std::fs::read(&from).unwrap());
    }

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
                    .contains("is a link or no regular file")
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

    #[test]
    fn a_file_in_the_way_of_a_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("out");
        write_bytes(&file, b"x").unwrap();
        let e = create_folder(file.join("labels")).unwrap_err().to_string();
        assert!(e.ends_with("out: is a file, expected a folder"), "{e}");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let e = write_bytes(&dir.path().join("no/x.png"), b"x")
            .unwrap_err()
            .to_string();
        assert!(e.contains("no folder"), "{e}");
    }
}
