//! The studio's folder: the only place where a name from a browser becomes a path.

use crate::refusal::{Answer, Refusal};
use axum::http::StatusCode;
use petcomp::{Error, Result, io};
use std::collections::VecDeque;
use std::ffi::OsStr;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Depth below the folder to which files are searched for.
const MAX_DEPTH: usize = 4;
/// Maximum number of entries examined in a search: a dataset of 100,000 pictures has about as many.
const MAX_ENTRIES: usize = 200_000;

/// A folder; nothing outside it is read or written.
pub(crate) struct Folder {
    root: PathBuf,
    /// Held from the check of a file's version until its replacement, so that nobody else saves in
    /// between.
    saving: Mutex<()>,
}

/// The contents of a file, and their version.
#[derive(Debug, serde::Serialize)]
pub(crate) struct Versioned {
    pub(crate) text: String,
    pub(crate) version: String,
}

impl Folder {
    /// # Errors
    /// [`Error::File`] if there is no such folder.
    pub(crate) fn open(root: &Path) -> Result<Self> {
        if !root.is_dir() {
            return Err(Error::file(root, "no such folder"));
        }
        // Files then have the names that a user would type.
        let root = if root == Path::new(".") {
            PathBuf::new()
        } else {
            root.into()
        };
        Ok(Self {
            root,
            saving: Mutex::default(),
        })
    }

    /// The folder's own name, for titles.
    pub(crate) fn name(&self) -> String {
        let path = self.here().canonicalize().unwrap_or_default();
        let name = path.file_name().unwrap_or(OsStr::new("/"));
        name.to_string_lossy().into_owned()
    }

    fn here(&self) -> &Path {
        if self.root.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &self.root
        }
    }

    /// Path of an existing file, by its name with slashes.
    ///
    /// # Errors
    /// 404 for a missing file, for a name or a link that leads outside the folder, and for anything
    /// but a regular file.
    pub(crate) fn file(&self, name: &str) -> Answer<PathBuf> {
        check_name(name)?;
        io::inside(&self.root, name).map_err(not_found)
    }

    /// Path of an existing folder; the empty name is the folder itself.
    ///
    /// # Errors
    /// As [`Folder::file`].
    pub(crate) fn folder(&self, name: &str) -> Answer<PathBuf> {
        if name.is_empty() {
            return Ok(self.here().to_path_buf());
        }
        check_name(name)?;
        let path = io::below(&self.root, name).map_err(not_found)?;
        match self.holds(&path) && path.is_dir() {
            true => Ok(path),
            false => Err(missing(name, "folder")),
        }
    }

    /// Path for writing a file in an existing folder. A link in its place is replaced, not
    /// followed.
    ///
    /// # Errors
    /// As [`Folder::file`] for the containing folder.
    pub(crate) fn place(&self, name: &str) -> Answer<PathBuf> {
        check_name(name)?;
        let path = io::below(&self.root, name).map_err(not_found)?;
        let parent = Path::new(name).parent().and_then(Path::to_str);
        self.folder(parent.unwrap_or_default())?;
        Ok(path)
    }

    /// Whether a path in one of the folder's files leads into the folder, after resolving links.
    pub(crate) fn holds(&self, path: &Path) -> bool {
        match (self.here().canonicalize(), path.canonicalize()) {
            (Ok(root), Ok(target)) => target.starts_with(root),
            _ => false,
        }
    }

    /// The name of a path inside, as browsers use it.
    pub(crate) fn name_of(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        let parts = inside.components();
        let parts = parts.map(|part| part.as_os_str().to_string_lossy());
        parts.collect::<Vec<_>>().join("/")
    }

    /// The name of a path in a list (`./a.jpg`, `b/../a.jpg`, an absolute one), as browsers use it.
    pub(crate) fn name_of_listed(&self, path: &Path) -> String {
        match straightened(path).strip_prefix(straightened(self.here())) {
            Ok(inside) => self.name_of(&self.root.join(inside)),
            Err(_) => self.name_of(path),
        }
    }

    /// The text of a file and its version.
    ///
    /// # Errors
    /// As [`Folder::file`], and for a file that is not text.
    pub(crate) fn read_text(&self, name: &str) -> Answer<Versioned> {
        let text = io::read_text(self.file(name)?)?;
        let version = version_of(&text);
        Ok(Versioned { text, version })
    }

    /// The text of a file and its version; none if there is no file or only a link that leads
    /// outside.
    ///
    /// # Errors
    /// For an existing file that cannot be read: it must not be treated as missing and overwritten.
    pub(crate) fn text_if_any(&self, name: &str) -> Answer<Option<Versioned>> {
        match self.file(name) {
            Ok(_) => self.read_text(name).map(Some),
            Err(_) => Ok(None),
        }
    }

    /// Saves a text atomically if the file is unchanged since the page read it (`version`; none:
    /// there was no file), and returns the new version.
    ///
    /// # Errors
    /// [`Refusal::stale`] if it has changed since; as [`Folder::place`] and
    /// [`Folder::text_if_any`].
    pub(crate) fn save(&self, name: &str, text: &str, version: Option<&str>) -> Answer<String> {
        let path = self.place(name)?;
        let _alone = self.saving.lock().unwrap_or_else(PoisonError::into_inner);
        let there = self.text_if_any(name)?.map(|file| file.version);
        if there.as_deref() != version {
            return Err(Refusal::stale(name));
        }
        io::write_text(path, text)?;
        Ok(version_of(text))
    }

    /// The sorted names of all files below the folder that `wanted` accepts, without hidden files
    /// and targets of links.
    pub(crate) fn find(&self, wanted: impl Fn(&Path) -> bool) -> Vec<String> {
        let files = self.files(MAX_ENTRIES).into_iter().map(without_dot);
        let wanted = files.filter(|path| wanted(path));
        let mut found: Vec<String> = wanted.map(|path| self.name_of(&path)).collect();
        found.sort();
        found
    }

    /// The files among the first entries, breadth first, so that deep entries of a large dataset do
    /// not hide anything next to it.
    fn files(&self, most: usize) -> Vec<PathBuf> {
        let mut files = Vec::new();
        let mut open = VecDeque::from([(self.here().to_path_buf(), 0)]);
        let mut left = most;
        while let Some((folder, depth)) = open.pop_front() {
            for entry in visible_entries(&folder) {
                if left == 0 {
                    let here = self.here().display();
                    log::warn!("{here}: more than {most} files and folders; the rest is ignored");
                    return files;
                }
                left -= 1;
                match entry.file_type() {
                    Ok(kind) if kind.is_file() => files.push(entry.path()),
                    Ok(kind) if kind.is_dir() && depth < MAX_DEPTH => {
                        open.push_back((entry.path(), depth + 1));
                    }
                    _ => {}
                }
            }
        }
        files
    }
}

/// `/a/c.jpg` for `/a/b/../c.jpg`.
fn straightened(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    let mut straight = PathBuf::new();
    for part in path.components() {
        match (part, straight.file_name().is_some()) {
            (Component::ParentDir, true) => drop(straight.pop()),
            (Component::CurDir, _) => {}
            _ => straight.push(part),
        }
    }
    straight
}

/// `a.jpg` for `./a.jpg`.
fn without_dot(path: PathBuf) -> PathBuf {
    match path.strip_prefix("./") {
        Ok(inside) => inside.into(),
        Err(_) => path,
    }
}

fn visible_entries(folder: &Path) -> impl Iterator<Item = std::fs::DirEntry> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
}

/// Checks that a name has the form used by petcomp's own pages: parts between slashes, none hidden.
fn check_name(name: &str) -> Answer<()> {
    let plain = |part: &str| !matches!(part, "" | "." | "..") && !part.contains(['\\', '\0']);
    if name.split('/').all(plain) {
        Ok(())
    } else {
        Err(missing(name, "file or folder"))
    }
}

fn missing(name: &str, expected: &str) -> Refusal {
    let name = petcomp::printable(name);
    let what = format!("{name}: no such {expected} in this studio's folder");
    Refusal::new(StatusCode::NOT_FOUND, what)
}

fn not_found(error: Error) -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, error.to_string())
}

/// Version of a text: FNV-1a of 64 bits (Fowler, Noll and Vo), with its length.
fn version_of(text: &str) -> String {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0100_0000_01b3;
    let fold = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(PRIME);
    format!("{:x}-{:016x}", text.len(), text.bytes().fold(OFFSET, fold))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn studio() -> (tempfile::TempDir, Folder) {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().join("folder");
        std::fs::create_dir_all(root.join("sub")).unwrap();
        std::fs::write(root.join("sub/a.txt"), "a").unwrap();
        std::fs::write(dir.path().join("secret.txt"), "b").unwrap();
        let folder = Folder::open(&root).unwrap();
        (dir, folder)
    }

    #[test]
    fn the_working_folder_can_be_listed() {
        for root in [".", "./"] {
            let folder = Folder::open(Path::new(root)).unwrap().folder("").unwrap();
            assert!(std::fs::read_dir(folder).is_ok(), "{root}");
        }
    }

    #[test]
    fn names_that_lead_out_are_refused() {
        let (_dir, folder) = studio();
        assert!(folder.file("sub/a.txt").is_ok());
        let bad = [
            "",
            ".",
            "..",
            "../secret.txt",
            "sub/../../secret.txt",
            "/etc/passwd",
            "sub//a.txt",
            "./sub/a.txt",
            "..\\secret.txt",
            "sub/a.txt\0",
        ];
        for name in bad {
            assert!(folder.file(name).is_err(), "{name:?}");
            assert!(folder.place(name).is_err(), "{name:?}");
            assert!(name.is_empty() || folder.folder(name).is_err(), "{name:?}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_out_are_refused() {
        let (dir, folder) = studio();
        let root = dir.path().join("folder");
        std::os::unix::fs::symlink("../secret.txt", root.join("far.txt")).unwrap();
        std::os::unix::fs::symlink(dir.path(), root.join("up")).unwrap();
        assert!(folder.file("far.txt").is_err() && folder.file("up/secret.txt").is_err());
        assert!(folder.folder("up").is_err() && folder.place("up/new.txt").is_err());
        assert!(folder.find(|_| true) == ["sub/a.txt"]);
    }

    #[test]
    fn a_listed_file_has_one_name_whichever_path_leads_to_it() {
        for root in ["src", "./src", "src/corners/.."] {
            let folder = Folder::open(Path::new(root)).unwrap();
            let absolute = std::path::absolute("src/lib.rs").unwrap();
            let relative = ["./lib.rs", "corners/../lib.rs", "../src/lib.rs"];
            let relative = relative.map(|name| Path::new(root).join(name));
            for path in relative.iter().chain([&absolute]) {
                assert_eq!(folder.name_of_listed(path), "lib.rs", "{root}: {path:?}");
            }
            let outside = Path::new(root).join("../lib.rs");
            assert_eq!(folder.name_of_listed(&outside), "../lib.rs");
        }
    }

    #[test]
    fn what_lies_deep_hides_no_file_above_it() {
        let dir = tempfile::tempdir().unwrap();
        let photos = ["a/a.jpg", "b/b.jpg", "c/c.jpg"].map(|name| dir.path().join(name));
        for photo in &photos {
            let deep = photo.with_file_name("deep");
            std::fs::create_dir_all(&deep).unwrap();
            std::fs::write(photo, "").unwrap();
            for i in 0..10 {
                std::fs::write(deep.join(format!("{i}.txt")), "").unwrap();
            }
        }
        let folder = Folder::open(dir.path()).unwrap();
        // The three folders, and in each of them a folder and a photo.
        let mut found = folder.files(3 + 3 * 2);
        found.sort();
        assert_eq!(found, photos);
    }

    #[test]
    fn a_stale_save_is_refused() {
        let (_dir, folder) = studio();
        let first = folder.save("b.txt", "one", None).unwrap();
        assert_eq!(
            folder.save("b.txt", "two", None).unwrap_err().status,
            StatusCode::CONFLICT
        );
        let second = folder.save("b.txt", "two", Some(&first)).unwrap();
        assert!(folder.save("b.txt", "three", Some(&first)).is_err());
        assert_eq!(folder.read_text("b.txt").unwrap().version, second);
    }

    #[test]
    fn a_file_that_cannot_be_read_is_not_replaced() {
        let (dir, folder) = studio();
        let (path, latin_1) = (dir.path().join("folder/b.txt"), b"caf\xe9");
        std::fs::write(&path, latin_1).unwrap();
        assert!(folder.text_if_any("b.txt").is_err());
        assert!(folder.save("b.txt", "new", None).is_err());
        assert_eq!(std::fs::read(path).unwrap(), latin_1);
    }
}
