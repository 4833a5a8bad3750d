//! Whole files or none: everything is written beside its place, put on the disk, and then moved
//! there. Files of which a journal is kept may be moved first and put on the disk together.

use super::open::reason;
use crate::error::{Error, Result};
use crate::work::{self, Kind};
use std::cell::Cell;
use std::fs::{File, Permissions};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};

/// When files are put on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Syncing {
    /// Each before it gets its name: after a power cut there is the old one or the new one.
    Alone,
    /// Many at once, by [`sync_file_system`]: after a power cut one that was not among them may be
    /// torn, and whoever wrote it has to notice.
    Together,
}

thread_local! {
    static SYNCING: Cell<Syncing> = const { Cell::new(Syncing::Alone) };
}

impl Syncing {
    /// Runs a job; the files that it writes on this thread are put on the disk so.
    pub(crate) fn during<T>(self, job: impl FnOnce() -> T) -> T {
        let _before = SyncingBefore(SYNCING.replace(self));
        job()
    }
}

/// How a thread put files on the disk before a job, and does again when this is dropped: also where
/// the job panics, which threads of a pool outlive.
struct SyncingBefore(Syncing);

impl Drop for SyncingBefore {
    fn drop(&mut self) {
        SYNCING.set(self.0);
    }
}

/// Writes a file in one step: readers see the old one or the new one, never a part.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let alone = SYNCING.get() == Syncing::Alone;
    work::add_all([
        (Kind::BytesWritten, bytes.len() as u64),
        (Kind::SyncedFiles, u64::from(alone)),
    ]);
    write_through(path, |file| file.write_all(bytes))
}

/// Writes a file piece by piece: it does not appear before `fill` has written all of it.
///
/// # Errors
/// [`Error::File`] with the error of `fill` or of the system.
pub(crate) fn write_through(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    check_replaceable(path)?;
    let folder = folder_of(path);
    let file = new_beside(folder).map_err(|e| match e.kind() {
        ErrorKind::NotFound => no_folder(path, folder),
        _ => not_written(path, &e),
    })?;
    fill_and_move(file, path, fill)
        .and_then(|()| sync_folder(folder))
        .map_err(|e| not_written(path, &e))
}

/// A device or a pipe is no file that another one may take the place of.
fn check_replaceable(path: &Path) -> Result<()> {
    let what = match path.metadata() {
        Ok(there) if there.is_dir() => "is a folder",
        Ok(there) if !there.is_file() => "not a regular file",
        _ => return Ok(()),
    };
    Err(Error::file(path, format!("cannot be written: {what}")))
}

/// The folder that a file lies in; the working folder for a bare name.
fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}

/// Fails on a file to write whose folder is not there, as writing it would.
///
/// # Errors
/// [`Error::File`], naming both.
pub fn check_folder_of(path: &Path) -> Result<()> {
    let folder = folder_of(path);
    if folder.is_dir() {
        Ok(())
    } else {
        Err(no_folder(path, folder))
    }
}

fn no_folder(path: &Path, folder: &Path) -> Error {
    let what = format!("cannot be written: no folder {}", folder.display());
    Error::file(path, what)
}

fn not_written(path: &Path, e: &std::io::Error) -> Error {
    Error::file(path, format!("cannot be written: {}", reason(e)))
}

/// Fills a new file, puts it on the disk if that is its turn, and moves it to its place.
fn fill_and_move(
    mut file: tempfile::NamedTempFile,
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    keep_permissions(file.as_file(), path)?;
    let mut buffered = BufWriter::new(&mut file);
    fill(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    put_on_disk(file.as_file())?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// A file has the permissions of the one that it replaces.
#[cfg(unix)]
fn keep_permissions(file: &File, path: &Path) -> std::io::Result<()> {
    match path.symlink_metadata() {
        Ok(old) if old.is_file() => file.set_permissions(old.permissions()),
        _ => Ok(()),
    }
}

/// Other systems keep them in folders.
#[cfg(not(unix))]
fn keep_permissions(_: &File, _: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Puts a file or the names in a folder on the disk, unless that is done for many at once.
fn put_on_disk(file: &File) -> std::io::Result<()> {
    match SYNCING.get() {
        Syncing::Alone => file.sync_all(),
        Syncing::Together => Ok(()),
    }
}

/// Puts the names in a folder on the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    match File::open(folder).and_then(|folder| put_on_disk(&folder)) {
        // Some file systems have no such thing, and some folders may be written but not read.
        Err(e) if [ErrorKind::InvalidInput, ErrorKind::PermissionDenied].contains(&e.kind()) => {
            Ok(())
        }
        done => done,
    }
}

/// Other systems write names by themselves.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Puts everything on the disk that was written to a file's file system, so that it outlives a power
/// cut; says whether the system can do that.
///
/// # Errors
/// Where the disk does not take it.
pub(crate) fn sync_file_system(file: &File) -> std::io::Result<bool> {
    match sync_all_files(file) {
        Err(e) if e.kind() == ErrorKind::Unsupported => Ok(false),
        done => done.map(|()| true),
    }
}

/// FUSE says that all is on the disk, and does not ask its server.
#[cfg(target_os = "linux")]
const FUSE_SUPER_MAGIC: i64 = 0x6573_5546;

#[cfg(target_os = "linux")]
fn sync_all_files(file: &File) -> std::io::Result<()> {
    if rustix::fs::fstatfs(file)?.f_type as i64 == FUSE_SUPER_MAGIC {
        return Err(ErrorKind::Unsupported.into());
    }
    Ok(rustix::fs::syncfs(file)?)
}

/// Other systems have nothing that waits for the disk.
#[cfg(not(target_os = "linux"))]
fn sync_all_files(_: &File) -> std::io::Result<()> {
    Err(ErrorKind::Unsupported.into())
}

/// A new file that vanishes if it is not moved to its place, readable like any other file of the
/// user.
fn new_beside(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".petcomp-").suffix(".tmp");
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// An absolute path, as it is named: links and `..` stay.
///
/// # Errors
/// [`Error::File`] for an empty path, and where the working folder is gone.
pub fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|e| Error::file(path, e))
}

/// The same of a folder, of which an empty path is the working folder.
///
/// # Errors
/// Without a working folder.
pub(crate) fn absolute_folder(path: &Path) -> Result<PathBuf> {
    absolute(&Path::new(".").join(path))
}

/// The relative path from a folder to a file or folder, both absolute; `.` to the folder itself.
pub fn relative(to: &Path, from: &Path) -> PathBuf {
    if to == from {
        return ".".into();
    }
    let shared = to
        .components()
        .zip(from.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

/// The relative path from a folder to a file or folder as the disk has them: the system climbs by
/// `..` from where a link leads to, not from where it stands. A link that is the last step of `to`
/// stays, unless it leads to a folder around `from`, and what is not there is taken as it is named.
///
/// # Errors
/// As [`absolute`].
pub fn relative_on_disk(to: &Path, from: &Path) -> Result<PathBuf> {
    let (to, from) = (absolute(to)?, resolved(&absolute(from)?));
    let real = resolved(&to);
    let place = match (to.parent(), to.file_name()) {
        // The way to a folder around `from` needs no link.
        _ if from.starts_with(&real) => real,
        (Some(folder), Some(name)) => resolved(folder).join(name),
        _ => real,
    };
    Ok(relative(&place, &from))
}

/// A path from the root without links and `..`, step by step as the system walks it.
fn resolved(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut place, step| {
        if step == Component::ParentDir {
            place.pop();
        } else {
            place.push(step);
        }
        place.canonicalize().unwrap_or(place)
    })
}

/// A path with its last step of one name given another: `a/images/b/images/c.png` leads from images
/// to labels at `a/images/b/labels/c.png`, as trainers have it. Without such a step it stays.
pub(crate) fn with_last_step(path: &Path, from: &str, to: &str) -> PathBuf {
    let steps: Vec<_> = path.components().collect();
    let last = steps.iter().rposition(|step| step.as_os_str() == from);
    let swapped = steps.iter().enumerate().map(|(i, step)| match last {
        Some(place) if place == i => to.as_ref(),
        _ => step.as_os_str(),
    });
    swapped.collect()
}

/// Makes a folder and its parents; one that already exists is fine.
///
/// # Errors
/// [`Error::File`] where a file is in the way or the folder may not be made.
pub fn create_folder(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    if let Some(file) = path.ancestors().find(|p| p.is_file()) {
        return Err(Error::file(file, "is a file, expected a folder"));
    }
    std::fs::create_dir_all(path)
        .map_err(|e| Error::file(path, format!("cannot be created: {}", reason(&e))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_panics_leaves_its_thread_as_it_was() {
        let job = || Syncing::Together.during::<()>(|| panic!("on purpose"));
        assert!(std::panic::catch_unwind(job).is_err());
        assert_eq!(SYNCING.get(), Syncing::Alone);
    }

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

    #[cfg(unix)]
    #[test]
    fn a_path_from_behind_a_link_climbs_as_the_system_does() {
        let dir = tempfile::tempdir().unwrap();
        let [folder, link, data] = ["real/a/b", "l", "data"].map(|name| dir.path().join(name));
        create_folder(&folder).unwrap();
        write_bytes(&data, b"x").unwrap();
        std::os::unix::fs::symlink(&folder, &link).unwrap();
        let beside = |to: &Path, from: &Path| relative_on_disk(to, from).unwrap();
        assert_eq!(beside(&data, &link), Path::new("../../../data"));
        assert!(link.join(beside(&data, &link)).is_file());
        let deeper = beside(&data, &link.join("new"));
        assert_eq!(deeper, Path::new("../../../../data"));
        assert_eq!(beside(&link.join("../x"), &folder), Path::new("../x"));
        assert_eq!(beside(&link, dir.path()), Path::new("l"));
        assert_eq!(beside(&link, &link).as_os_str(), ".");
        assert_eq!(beside(&link, &link.join("out")), Path::new(".."));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_replaced_is_a_file_and_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let [own, pipe, link] = ["own", "pipe", "link"].map(|name| dir.path().join(name));
        std::fs::write(&own, "old").unwrap();
        std::fs::set_permissions(&own, Permissions::from_mode(0o600)).unwrap();
        write_bytes(&own, b"new").unwrap();
        let mode = own.metadata().unwrap().permissions().mode();
        assert_eq!(
            (std::fs::read(&own).unwrap(), mode & 0o777),
            (b"new".into(), 0o600)
        );
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, 0o600.into()).unwrap();
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for path in [pipe, link] {
            let told = write_bytes(&path, b"x").unwrap_err().to_string();
            assert!(
                told.ends_with("cannot be written: not a regular file"),
                "{told}"
            );
        }
    }

    /// Whoever runs this as root may read every folder.
    #[cfg(unix)]
    #[test]
    fn a_folder_that_may_be_written_need_not_be_readable() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("in");
        create_folder(&folder).unwrap();
        std::fs::set_permissions(&folder, Permissions::from_mode(0o333)).unwrap();
        write_bytes(&folder.join("a"), b"x").unwrap();
        std::fs::set_permissions(&folder, Permissions::from_mode(0o700)).unwrap();
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
    fn the_way_from_a_folder_to_itself_is_a_dot() {
        let way = |to: &str| relative(Path::new(to), Path::new("/a/b"));
        assert_eq!(way("/a/b/").as_os_str(), ".");
        assert_eq!(way("/a/b/c"), Path::new("c"));
        assert_eq!(way("/a"), Path::new(".."));
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
