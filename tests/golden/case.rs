//! One golden case on disk.

use std::path::{Path, PathBuf};

/// A folder with a `case.toml`, its inputs and its references.
pub(crate) struct Case {
    /// The folder's name.
    pub(crate) name: String,
    /// The folder.
    pub(crate) dir: PathBuf,
    /// What `case.toml` says.
    pub(crate) table: toml::Table,
}

impl Case {
    /// The cases of a stage, in order of name; none where the folder does not exist.
    pub(crate) fn all(stage: &Path) -> Vec<Self> {
        let Ok(entries) = std::fs::read_dir(stage) else {
            return Vec::new();
        };
        let mut dirs: Vec<_> = entries
            .flatten()
            .map(|e| e.path())
            .filter(|p| p.join("case.toml").exists())
            .collect();
        dirs.sort();
        dirs.into_iter().map(Self::open).collect()
    }

    fn open(dir: PathBuf) -> Self {
        let path = dir.join("case.toml");
        let text =
            std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let table = text
            .parse()
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let name = dir
            .file_name()
            .expect("a folder has a name")
            .to_string_lossy()
            .into_owned();
        Self { name, dir, table }
    }
}
