//! Complete files or none: everything is written to a temporary file next to its destination,
//! synced, and then moved there. Files that are recorded in a journal may be moved first and synced
//! together.

use super::listing::entries;
use super::open::reason;
use crate::error::{Error, Result};
use crate::work::{self, Kind};
use std::cell::Cell;
use std::fs::{DirEntry, File, Permissions};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

/// When files are synced to disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Syncing {
    /// Each before it gets its name: after a power failure there is either the old one or the new one.
    Alone,
    /// Many at once, by [`sync_file_system`]: after a power failure a file that was not yet synced
    /// may be torn, and whoever wrote it must detect that.
    Together,
}

thread_local! {
    static SYNCING: Cell<Syncing> = const { Cell::new(Syncing::Alone) };
}

impl Syncing {
    /// Runs a job; the files that it writes on this thread are synced in this way.
    pub(crate) fn during<T>(self, job: impl FnOnce() -> T) -> T {
        let _before = SyncingBefore(SYNCING.replace(self));
        job()
    }
}

/// The mode of a thread before a job, restored when this is dropped, even if the job panics:
/// threads of a pool survive that.
struct SyncingBefore(Syncing);

impl Drop for SyncingBefore {
    fn drop(&mut self) {
        SYNCING.set(self.0);
    }
}

/// Writes a file atomically: readers see the old one or the new one, never a part.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let alone = SYNCING.get() == Syncing::Alone;
    work::add_all([
        (Kind::BytesWritten, bytes.len() as u64),
        (Kind::SyncedFiles, u64::from(alone)),
    ]);
    write_through(path, |file| file.write_all(bytes))
}

/// Writes a file piece by piece: it does not appear until `fill` has written all of it.
///
/// # Errors
/// [`Error::File`] with the error of `fill` or of the operating system.
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

/// Rejects devices and pipes, which must not be replaced by a file.
fn check_replaceable(path: &Path) -> Result<()> {
    let what = match path.metadata() {
        Ok(there) if there.is_dir() => "is a folder",
        Ok(there) if !there.is_file() => "not a regular file",
        _ => return Ok(()),
    };
    Err(Error::file(path, format!("cannot be written: {what}")))
}

/// The folder of a file; the working folder for a bare name.
fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new("."))
}

/// Fails if the folder of a file to write does not exist, as writing it would.
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

/// Fills a new file, syncs it if required, and moves it to its destination.
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

/// Copies the permissions of the file that is replaced.
#[cfg(unix)]
fn keep_permissions(file: &File, path: &Path) -> std::io::Result<()> {
    match path.symlink_metadata() {
        Ok(old) if old.is_file() => file.set_permissions(old.permissions()),
        _ => Ok(()),
    }
}

/// On other systems permissions belong to folders.
#[cfg(not(unix))]
fn keep_permissions(_: &File, _: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Syncs a file or folder, unless that is done for many at once.
fn put_on_disk(file: &File) -> std::io::Result<()> {
    match SYNCING.get() {
        Syncing::Alone => file.sync_all(),
        Syncing::Together => Ok(()),
    }
}

/// Syncs the names in a folder.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    match File::open(folder).and_then(|folder| put_on_disk(&folder)) {
        // Some file systems cannot do this, and some folders are writable but not readable.
        Err(e) if [ErrorKind::InvalidInput, ErrorKind::PermissionDenied].contains(&e.kind()) => {
            Ok(())
        }
        done => done,
    }
}

/// Other systems write names on their own.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Syncs everything that was written to the file system of a file, so that it survives a power
/// failure; returns whether the system supports that.
///
/// # Errors
/// If the disk reports an error.
pub(crate) fn sync_file_system(file: &File) -> std::io::Result<bool> {
    match sync_all_files(file) {
        Err(e) if e.kind() == ErrorKind::Unsupported => Ok(false),
        done => done.map(|()| true),
    }
}

/// FUSE reports success without asking its server.
#[cfg(target_os = "linux")]
const FUSE_SUPER_MAGIC: i64 = 0x6573_5546;

#[cfg(target_os = "linux")]
fn sync_all_files(file: &File) -> std::io::Result<()> {
    if rustix::fs::fstatfs(file)?.f_type as i64 == FUSE_SUPER_MAGIC {
        return Err(ErrorKind::Unsupported.into());
    }
    Ok(rustix::fs::syncfs(file)?)
}

/// Other systems have no equivalent.
#[cfg(not(target_os = "linux"))]
fn sync_all_files(_: &File) -> std::io::Result<()> {
    Err(ErrorKind::Unsupported.into())
}

/// How the name of a temporary file begins and ends.
const TEMPORARY: [&str; 2] = [".petcomp-", ".tmp"];

/// Deletes the temporary files that killed runs left in a folder and its subfolders, if they are at
/// least this old: younger ones may be another run's.
pub(crate) fn sweep(folder: &Path, age: Duration) -> Result<()> {
    for entry in entries(folder)? {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => sweep(&entry.path(), age)?,
            Ok(kind) if kind.is_file() && is_left_over(&entry, age) => {
                std::fs::remove_file(entry.path()).map_err(|e| Error::file(entry.path(), e))?;
            }
            _ => {}
        }
    }
    Ok(())
}

fn is_left_over(entry: &DirEntry, age: Duration) -> bool {
    let name = entry.file_name();
    let name = name.to_string_lossy();
    let written = entry.metadata().and_then(|meta| meta.modified());
    let elapsed = written.map(|at| at.elapsed().unwrap_or_default());
    name.starts_with(TEMPORARY[0])
        && name.ends_with(TEMPORARY[1])
        && elapsed.is_ok_and(|elapsed| elapsed >= age)
}

/// Deletes a file if it exists.
pub(crate) fn remove_if_exists(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::file(file, e)),
        _ => Ok(()),
    }
}

/// A new file that is deleted unless it is moved to its destination, with the user's default
/// permissions.
fn new_beside(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY[0]).suffix(TEMPORARY[1]);
    #[cfg(unix)]
    builder.permissions(<Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Makes a path absolute without resolving links and `..`.
///
/// # Errors
/// [`Error::File`] for an empty path, and if the working folder no longer exists.
pub fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|e| Error::file(path, e))
}

/// The same for a folder, where an empty path is the working folder.
///
/// # Errors
/// If there is no working folder.
pub(crate) fn absolute_folder(path: &Path) -> Result<PathBuf> {
    absolute(&Path::new(".").join(path))
}

/// The relative path from a folder to a file or folder, both absolute; `.` for the folder itself.
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

/// The relative path from a folder to a file or folder on disk: for the system, `..` leads up from
/// the target of a link, not from its location. A link that is the last step of `to` is kept,
/// unless it leads to a folder that contains `from`; parts that do not exist are used as named.
///
/// # Errors
/// Like [`absolute`].
pub fn relative_on_disk(to: &Path, from: &Path) -> Result<PathBuf> {
    let (to, from) = (absolute(to)?, resolved(&absolute(from)?));
    let real = resolved(&to);
    let place = match (to.parent(), to.file_name()) {
        // The path to a folder that contains `from` needs no link.
        _ if from.starts_with(&real) => real,
        (Some(folder), Some(name)) => resolved(folder).join(name),
        _ => real,
    };
    Ok(relative(&place, &from))
}

/// An absolute path without links and `..`, resolved step by step as the system does.
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

/// Replaces the last path step of a given name: the labels of `a/images/b/images/c.png` are at
/// `a/images/b/labels/c.png`, as trainers expect. Unchanged without such a step.
pub(crate) fn with_last_step(path: &Path, from: &str, to: &str) -> PathBuf {
    let steps: Vec<_> = path.components().collect();
    let last = steps.iter().rposition(|step| step.as_os_str() == from);
    let swapped = steps.iter().enumerate().map(|(i, step)| match last {
        Some(place) if place == i => to.as_ref(),
        _ => step.as_os_str(),
    });
    swapped.collect()
}

/// Creates a folder and its parents; it may already exist.
///
/// # Errors
/// [`Error::File`] if a file is in the way or the folder cannot be created.
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

    /// The superuser can read every folder.
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
