//! Names that come out of documents, and places below a folder: nothing leads outside.

use crate::{Error, Result};
use std::path::{Component, Path, PathBuf};

/// Longest name that is made, bytes; file systems allow 255 with what is put in front and behind.
const LONGEST_NAME: usize = 120;
/// Names that mean devices to some systems, whatever their ending.
const DEVICES: [&str; 4] = ["con", "prn", "aux", "nul"];

/// A file name out of any text: letters, digits, `.`, `_` and `-`, everything else `_`; neither hidden nor a device.
pub fn clean_name(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' };
    let name: String = text.chars().map(plain).take(LONGEST_NAME).collect();
    let stem = name.split('.').next().unwrap_or_default().to_ascii_lowercase();
    match stem.is_empty() || DEVICES.contains(&stem.as_str()) {
        true => format!("_{name}").chars().take(LONGEST_NAME).collect(),
        false => name,
    }
}

/// A file that a document names: below the folder, by its path at least.
///
/// # Errors
/// [`Error::Value`] for an empty, absolute or climbing (`..`) path.
pub fn below(folder: impl AsRef<Path>, file: impl AsRef<Path>) -> Result<PathBuf> {
    let file = file.as_ref();
    let mut parts = file.components().peekable();
    if parts.peek().is_none() || !parts.all(|part| matches!(part, Component::Normal(_))) {
        let what = format!("\"{}\", expected a path below the document's folder", file.display());
        return Err(Error::value("file", what));
    }
    Ok(folder.as_ref().join(file))
}

/// Refuses an output folder that holds symbolic links to folders, which would lead outside. The folder itself may be one.
///
/// # Errors
/// [`Error::File`] naming the link, or a folder that cannot be looked into.
pub fn refuse_links(folder: impl AsRef<Path>) -> Result<()> {
    let folder = folder.as_ref();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?.flatten() {
        let (path, kind) = (entry.path(), entry.file_type().map_err(|e| Error::file(folder, e))?);
        if kind.is_symlink() && path.is_dir() {
            return Err(Error::file(path, "is a link to a folder, expected outputs to stay where they are told to go"));
        }
        if kind.is_dir() {
            refuse_links(path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_text_makes_a_harmless_name() {
        let names =
            ["../../etc/passwd", "", ".", "..", "a/b", "C:\\x", "nul", "CON.txt", ".hidden", "ä b", "ok-1_2.png"];
        let cleaned = names.map(clean_name);
        assert_eq!(cleaned[0], "_.._.._etc_passwd");
        assert_eq!(cleaned[10], "ok-1_2.png");
        for name in &cleaned {
            assert!(!name.starts_with('.') && !name.is_empty() && !name.contains(['/', '\\']), "{name}");
        }
        assert_eq!(cleaned[6], "_nul");
        assert_eq!(clean_name(&"x".repeat(1000)).len(), LONGEST_NAME);
    }

    #[test]
    fn paths_that_leave_their_folder_are_refused() {
        assert_eq!(below("labels", "sub/a.jpg").unwrap(), Path::new("labels/sub/a.jpg"));
        for bad in ["", ".", "../a.jpg", "/etc/passwd", "a/../../b"] {
            assert!(below("labels", bad).is_err(), "{bad}");
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
        assert!(refuse_links(folder.path()).unwrap_err().to_string().contains("images/train: is a link"));
    }
}
