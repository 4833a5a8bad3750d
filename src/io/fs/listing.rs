//! The content of folders.

use super::natural_order::compare_paths;
use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// The entries of a folder, in disk order.
///
/// # Errors
/// A folder that cannot be listed completely: its missing entries would be treated as absent.
pub fn entries(folder: &Path) -> Result<Vec<DirEntry>> {
    all_of(folder, std::fs::read_dir(folder))
}

fn all_of<T>(
    folder: &Path,
    listed: std::io::Result<impl Iterator<Item = std::io::Result<T>>>,
) -> Result<Vec<T>> {
    let all = listed.and_then(|listed| listed.collect::<std::io::Result<Vec<T>>>());
    all.map_err(|e| Error::file(folder, e))
}

/// The wanted files in a folder and its subfolders, in natural order of path (`2.png` before
/// `10.png`), without the companion files of macOS; each folder once, since links may form circles.
///
/// # Errors
/// A folder that cannot be listed, or one that brings the number of files above `most`.
pub(crate) fn files_below(
    folder: &Path,
    is_wanted: impl Fn(&Path) -> bool,
    most: usize,
) -> Result<Vec<PathBuf>> {
    let (mut files, mut seen) = (Vec::new(), BTreeSet::new());
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        if seen.insert(folder.canonicalize().map_err(|e| Error::file(&folder, e))?) {
            let (folders, found) = folders_and_files(&folder)?;
            open.extend(folders.into_iter().filter(|folder| !is_hidden(folder)));
            let found = found.into_iter().filter(|path| !is_apple_double(path));
            files.extend(found.filter(|path| is_wanted(path)));
        }
        check_file_count(files.len(), most, &folder)?;
    }
    files.sort_by(|a, b| compare_paths(a, b));
    Ok(files)
}

/// Trainers skip folders whose names begin with a dot.
fn is_hidden(folder: &Path) -> bool {
    let name = folder.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b".")
}

/// `._a.png` next to `a.png`: macOS metadata of a file, where the disk does not support it.
pub(crate) fn is_apple_double(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b"._")
}

/// The folders and files in a folder, sorted by name, so that of equivalent names the same one
/// always counts.
fn folders_and_files(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    let entries = entries(folder)?;
    let mut paths: Vec<PathBuf> = entries.iter().map(DirEntry::path).collect();
    paths.sort();
    Ok(paths.into_iter().partition(|path| path.is_dir()))
}

fn check_file_count(count: usize, most: usize, folder: &Path) -> Result<()> {
    if count <= most {
        return Ok(());
    }
    let what = format!("more than {most} images, expected fewer");
    Err(Error::file(folder, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_be_listed_to_its_end_is_an_error() {
        let listed = [Ok(1), Err(std::io::Error::other("a bad block")), Ok(3)];
        let told = all_of(Path::new("photos"), Ok(listed.into_iter())).unwrap_err();
        assert_eq!(told.to_string(), "photos: a bad block");
    }

    #[test]
    fn files_of_macos_beside_others_are_passed_over() {
        let dir = tempfile::tempdir().unwrap();
        let [image, note] = ["a.png", "._a.png"].map(|name| dir.path().join(name));
        std::fs::write(&image, "").unwrap();
        std::fs::write(note, "").unwrap();
        let found = files_below(dir.path(), |_| true, usize::MAX).unwrap();
        assert_eq!(found, [image]);
    }

    #[test]
    fn files_are_in_order_of_their_numbers() {
        let dir = tempfile::tempdir().unwrap();
        let names = [
            "a/1000000.png",
            "a/200000.png",
            "a/b.png",
            "a10/1.png",
            "a9/1.png",
        ];
        for name in names {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let found = files_below(dir.path(), |_| true, usize::MAX).unwrap();
        let order = [1, 0, 2, 4, 3].map(|i| dir.path().join(names[i]));
        assert_eq!(found, order);
    }
}
