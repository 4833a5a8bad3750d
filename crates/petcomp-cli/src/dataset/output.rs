//! Where a dataset goes: a folder of this machine, or an object store.

use petcomp::Result;
use petcomp::dataset::ArchiveStore;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What `-o` says.
#[derive(Clone, Debug)]
pub(crate) enum Output {
    Folder(PathBuf),
    /// `s3://BUCKET/PREFIX` or the like.
    Store(String),
}

impl Output {
    /// Reads a path or a URL; `file://` is a path.
    pub(crate) fn parse(text: OsString) -> Result<Self> {
        match text.to_str().and_then(|text| text.split_once("://")) {
            None => Ok(Self::Folder(text.into())),
            Some(("file", _)) => stores::folder_of(&text.to_string_lossy()).map(Self::Folder),
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

    /// The folder, or the one for what is not finished: that of `scratch`, or one of the system's
    /// temporary folder that the same output has the next time, too.
    pub(crate) fn folder(&self, scratch: Option<&Path>) -> PathBuf {
        match (self, scratch) {
            (Self::Folder(folder), _) => folder.clone(),
            (Self::Store(_), Some(scratch)) => scratch.into(),
            (Self::Store(url), None) => std::env::temp_dir().join(scratch_name(url)),
        }
    }
}

fn scratch_name(url: &str) -> String {
    let letters = url
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("petcomp-{}", letters.collect::<String>())
}

#[cfg(feature = "object-store")]
use petcomp_store as stores;

/// A program that knows folders alone.
#[cfg(not(feature = "object-store"))]
mod stores {
    use super::*;
    use petcomp::Error;

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
            "a URL, expected a folder: this program is built without the feature object-store";
        Error::value("output", what)
    }
}
