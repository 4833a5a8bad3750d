//! One error type for the library: the place first, then the offending value and what was expected.

use std::path::{Path, PathBuf};

/// What a stage returns.
pub type Result<T> = std::result::Result<T, Error>;

/// Why something could not be done, by who must act.
///
/// Messages are one line, lower case, without a full stop: `tray.label.json: surface.corners_px: 3 corners, expected 4`.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that cannot be read, understood or written.
    #[error("{}: {what}", .path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it, and what was expected.
        what: String,
    },
    /// A value in a document that is well-formed but cannot be right.
    #[error("{}: {at}: {what}", .path.display())]
    Field {
        /// Which document.
        path: PathBuf,
        /// Which field, as a path: `objects[3].size`.
        at: String,
        /// The offending value and what was expected.
        what: String,
    },
    /// A scene or an option, given in memory, that cannot be right.
    #[error("{at}: {what}")]
    Value {
        /// Which value, as a path: `objects[3].placement`.
        at: String,
        /// The offending value and what was expected.
        what: String,
    },
    /// A photo in which no usable object was found.
    #[error("no cut-out: {what}")]
    Photo {
        /// What was found instead, and what to do.
        what: String,
    },
    /// A rectangle that no camera can have seen.
    #[error("{0}")]
    Camera(#[from] crate::camera::SolveError),
    /// Dropped objects that would not come to rest.
    #[error("settle: {what}")]
    Unsettled {
        /// What was still wrong, and after how many tries.
        what: String,
    },
    /// The caller asked to stop.
    #[error("interrupted: {what}")]
    Interrupted {
        /// What is done, and how to go on.
        what: String,
    },
}

impl Error {
    /// A [`Error::File`] from anything that says what is wrong.
    pub fn file(path: impl AsRef<Path>, what: impl std::fmt::Display) -> Self {
        Self::File { path: path.as_ref().into(), what: what.to_string() }
    }

    /// A [`Error::Value`] at a field path.
    pub fn value(at: impl Into<String>, what: impl std::fmt::Display) -> Self {
        Self::Value { at: at.into(), what: what.to_string() }
    }

    /// The same error, its field path told from one level further out: `count` within `scene` is `scene.count`.
    pub fn within(self, outer: &str) -> Self {
        match self {
            Self::Value { at, what } => Self::Value { at: format!("{outer}.{at}"), what },
            other => other,
        }
    }

    /// The same error, told of the document that the value stands in.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        let path = path.as_ref().to_path_buf();
        match self {
            Self::Value { at, what } => Self::Field { path, at, what },
            Self::Photo { .. } | Self::Camera(_) => Self::File { path, what: self.to_string() },
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_file_field_and_value() {
        let e = Error::value("count", "0 objects, expected at least 1").in_file("recipe.toml");
        assert_eq!(e.to_string(), "recipe.toml: count: 0 objects, expected at least 1");
    }
}
