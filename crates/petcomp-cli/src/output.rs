//! Where results go: a local folder, or an object store.

use crate::values::check_companion;
use clap::builder::{OsStringValueParser, TypedValueParser};
use petcomp::dataset::ArchiveStore;
use petcomp::{Error, Result};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The `-o` of a dataset.
#[derive(Clone, Debug)]
pub(crate) enum Output {
    Folder(PathBuf),
    /// `s3://BUCKET/PREFIX` or the like.
    Store(String),
}

impl Output {
    /// Reads a path or a URL; `file://` is a path.
    pub(crate) fn parse(text: OsString) -> Result<Self> {
        match scheme_of(&text).as_deref() {
            None | Some("file") => parse_folder(text).map(Self::Folder),
            Some(_) => {
                let url = text.to_string_lossy().into_owned();
                stores::check(&url)?;
                Ok(Self::Store(url))
            }
        }
    }

    /// The store; none for a folder.
    pub(crate) fn open(&self) -> Result<Option<Arc<dyn ArchiveStore>>> {
        match self {
            Self::Folder(_) => Ok(None),
            Self::Store(url) => stores::open(url).map(Some),
        }
    }

    /// The folder, or for a store the one for unfinished files: `scratch`, or one in the system's
    /// temporary folder that is the same each time for the same output.
    ///
    /// # Errors
    /// `scratch` for a folder, which keeps unfinished files itself.
    pub(crate) fn folder(&self, scratch: Option<&Path>) -> Result<PathBuf> {
        let is_store = matches!(self, Self::Store(_));
        let store = "an object store as --output";
        check_companion("--scratch", scratch.is_some(), store, is_store)?;
        Ok(match (self, scratch) {
            (Self::Folder(folder), _) => folder.clone(),
            (Self::Store(_), Some(scratch)) => scratch.into(),
            (Self::Store(url), None) => std::env::temp_dir().join(scratch_name(url)),
        })
    }
}

/// Parser for the folder of a command that cannot write to object stores; `file://` is a path.
pub(crate) fn folder_parser() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().try_map(parse_folder)
}

fn parse_folder(text: OsString) -> Result<PathBuf> {
    match scheme_of(&text).as_deref() {
        None => Ok(text.into()),
        Some("file") => stores::folder_of(&text.to_string_lossy()),
        Some(_) => {
            let what = "a URL, expected a folder or file:///FOLDER";
            Err(Error::value("output", what))
        }
    }
}

/// The part before the `://` of a URL, or before the `:/` of a `file:` URL, in lower case; none for
/// a path.
fn scheme_of(text: &OsStr) -> Option<String> {
    let (scheme, rest) = text.to_str()?.split_once(":/")?;
    let scheme = scheme.to_ascii_lowercase();
    (scheme == "file" || rest.starts_with('/')).then_some(scheme)
}

fn scratch_name(url: &str) -> String {
    let letters = url
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("petcomp-{}", letters.collect::<String>())
}

#[cfg(feature = "object-store")]
use petcomp_store as stores;

/// A program that supports folders only.
#[cfg(not(feature = "object-store"))]
mod stores {
    use super::*;

    pub(super) fn folder_of(url: &str) -> Result<PathBuf> {
        Err(unknown(url))
    }

    pub(super) fn check(url: &str) -> Result<()> {
        Err(unknown(url))
    }

    pub(super) fn open(url: &str) -> Result<Arc<dyn ArchiveStore>> {
        Err(unknown(url))
    }

    fn unknown(_url: &str) -> Error {
        let what =
            "a URL, expected a folder: this program was built without the feature object-store";
        Error::value("output", what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_are_told_from_paths() {
        for (text, scheme) in [
            ("file:///a", Some("file")),
            ("FILE:///a", Some("file")),
            ("file:/a", Some("file")),
            ("S3://bucket/a", Some("s3")),
            ("file:a", None),
            ("a:/b", None),
            ("a/b", None),
        ] {
            assert_eq!(scheme_of(OsStr::new(text)).as_deref(), scheme, "{text}");
        }
    }
}
