//! Names and paths from documents: none may lead out of a folder.

use super::listing::entries;
use super::open::reason;
use crate::error::{Error, Result};
use std::fs::{DirEntry, Metadata};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// Joins a path from a document to a folder; the path itself must stay below the folder.
///
/// # Errors
/// [`Error::Value`] for a path that is empty, absolute or contains `..`.
pub fn below(folder: impl AsRef<Path>, file: impl AsRef<Path>) -> Result<PathBuf> {
    let file = file.as_ref();
    let mut parts = file.components().peekable();
    if parts.peek().is_none() || !parts.all(|part| matches!(part, Component::Normal(_))) {
        let what = format!(
            "\"{}\", expected a path below the document's folder",
            file.display()
        );
        return Err(Error::value("file", what));
    }
    Ok(folder.as_ref().join(file))
}

/// The file in a folder that a document names: the only way from a path in a document to a file
/// that is read.
///
/// Links are followed if they stay in the folder; the folder itself may be one.
///
/// # Errors
/// [`Error::Value`] as in [`below`]; [`Error::File`] for a link that leads out of the folder, for a
/// missing file, and for anything but a regular file, which may block or never end.
pub fn inside(folder: impl AsRef<Path>, file: impl AsRef<Path>) -> Result<PathBuf> {
    found_inside(folder.as_ref(), file.as_ref()).map(|(path, _)| path)
}

/// Length of the file in a folder that a document names.
///
/// # Errors
/// Like [`inside`].
pub(crate) fn length_inside(folder: impl AsRef<Path>, file: impl AsRef<Path>) -> Result<u64> {
    found_inside(folder.as_ref(), file.as_ref()).map(|(_, meta)| meta.len())
}

fn found_inside(folder: &Path, file: &Path) -> Result<(PathBuf, Metadata)> {
    let path = below(folder, file)?;
    let meta = match without_links(folder, file) {
        Ok(None) => through_links(folder, &path),
        found => found,
    };
    match meta.map_err(|e| Error::file(&path, reason(&e)))? {
        Some(meta) if meta.is_file() => Ok((path, meta)),
        Some(_) => Err(Error::file(path, "not a regular file")),
        None => Err(leads_out(path, folder)),
    }
}

fn leads_out(path: PathBuf, folder: &Path) -> Error {
    let folder = or_working_folder(folder).display();
    let what = format!("is a link that leads out of {folder}, expected a file in that folder");
    Error::file(path, what)
}

/// Metadata of a file; none if one of the steps to it from the folder is a link.
fn without_links(folder: &Path, file: &Path) -> std::io::Result<Option<Metadata>> {
    let (mut path, mut last) = (folder.to_path_buf(), None);
    for step in file.components() {
        path.push(step);
        let meta = std::fs::symlink_metadata(&path)?;
        if meta.is_symlink() {
            return Ok(None);
        }
        last = Some(meta);
    }
    Ok(last)
}

/// Metadata of the target of a path with links; none if it is outside the folder.
fn through_links(folder: &Path, path: &Path) -> std::io::Result<Option<Metadata>> {
    let root = or_working_folder(folder).canonicalize()?;
    let target = path.canonicalize()?;
    if target.starts_with(root) {
        std::fs::metadata(target).map(Some)
    } else {
        Ok(None)
    }
}

/// The folder; the working folder for an empty path.
pub(crate) fn or_working_folder(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    }
}

/// Rejects an output folder that contains symbolic links to folders, which would lead outside. The
/// folder itself may be one.
///
/// # Errors
/// [`Error::File`] naming the link, or a folder that cannot be listed.
pub(crate) fn refuse_links(folder: impl AsRef<Path>) -> Result<()> {
    let folder = folder.as_ref();
    entries(folder)?
        .iter()
        .try_for_each(|entry| refuse_linked_entry(folder, entry))
}

fn refuse_linked_entry(folder: &Path, entry: &DirEntry) -> Result<()> {
    let path = entry.path();
    let kind = match entry.file_type() {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        kind => kind.map_err(|e| Error::file(folder, e))?,
    };
    if kind.is_symlink() && path.is_dir() {
        return Err(Error::file(
            path,
            "is a link to a folder, expected outputs to stay in their own folder",
        ));
    }
    if kind.is_dir() {
        return refuse_links(&path).or_else(|e| if is_gone(&path) { Ok(()) } else { Err(e) });
    }
    Ok(())
}

/// Another shard deletes the folders of archives that it has packed.
fn is_gone(folder: &Path) -> bool {
    std::fs::symlink_metadata(folder).is_err_and(|e| e.kind() == ErrorKind::NotFound)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_that_leave_their_folder_are_refused() {
        assert_eq!(
            below("labels", "sub/a.jpg").unwrap(),
            Path::new("labels/sub/a.jpg")
        );
        for bad in ["", ".", "../a.jpg", "/etc/passwd", "a/../../b"] {
            assert!(below("labels", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_folder_that_another_run_deletes_meanwhile_leads_nowhere() {
        let dir = tempfile::tempdir().unwrap();
        let packed = dir.path().join("packed");
        std::fs::create_dir(&packed).unwrap();
        let listed = entries(dir.path()).unwrap();
        std::fs::remove_dir(&packed).unwrap();
        assert!(refuse_linked_entry(dir.path(), &listed[0]).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_named_file_is_a_regular_one_of_its_folder() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("shard");
        std::fs::create_dir_all(folder.join("sub")).unwrap();
        std::fs::write(folder.join("sub/a.txt"), "a").unwrap();
        std::fs::write(dir.path().join("secret.txt"), "b").unwrap();
        symlink("sub/a.txt", folder.join("near.txt")).unwrap();
        symlink("../secret.txt", folder.join("far.txt")).unwrap();
        symlink("..", folder.join("up")).unwrap();
        symlink(&folder, dir.path().join("alias")).unwrap();
        symlink("/dev/zero", folder.join("endless")).unwrap();
        assert!(rustix::fs::mkfifoat(rustix::fs::CWD, folder.join("pipe"), 0o600.into()).is_ok());
        for good in ["sub/a.txt", "near.txt"] {
            assert_eq!(inside(&folder, good).unwrap(), folder.join(good));
            assert!(inside(dir.path().join("alias"), good).is_ok());
        }
        let refused = |file: &str| inside(&folder, file).unwrap_err().to_string();
        for (file, why) in [
            ("../secret.txt", "expected a path below"),
            ("far.txt", "is a link that leads out of"),
            ("up/secret.txt", "is a link that leads out of"),
            ("endless", "is a link that leads out of"),
            ("pipe", "not a regular file"),
            ("sub", "not a regular file"),
            ("none", "no such file"),
        ] {
            assert!(refused(file).contains(why), "{file}: {}", refused(file));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_inside_an_output_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let elsewhere = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("images")).unwrap();
        refuse_links(folder.path()).unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), folder.path().join("images/train")).unwrap();
        assert!(
            refuse_links(folder.path())
                .unwrap_err()
                .to_string()
                .contains("images/train: is a link")
        );
    }
}
