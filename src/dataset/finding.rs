//! A diagnostic with the file and the line that it is about.

use crate::diagnostic::{Code, Diagnostic};
use crate::error::Error;
use std::fmt;
use std::path::{Path, PathBuf};

/// Something in a dataset that a trainer would reject, drop or misread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The file, below the dataset's folder.
    pub path: PathBuf,
    /// Its line, from 1, if the finding is about one.
    pub line: Option<usize>,
    /// What is wrong, and what was expected.
    pub diagnostic: Diagnostic,
}

impl Finding {
    /// An error in a file as a whole.
    pub(crate) fn in_file(path: impl AsRef<Path>, code: Code, message: impl fmt::Display) -> Self {
        Self {
            path: path.as_ref().into(),
            line: None,
            diagnostic: Diagnostic::error(code, message),
        }
    }

    /// An error in a line of a file, counted from 1.
    pub(crate) fn in_line(
        path: impl AsRef<Path>,
        line: usize,
        code: Code,
        message: impl fmt::Display,
    ) -> Self {
        Self {
            line: Some(line),
            ..Self::in_file(path, code, message)
        }
    }

    /// A finding about a file of the dataset in `folder` that cannot be read.
    pub(crate) fn unreadable(folder: &Path, path: impl AsRef<Path>, error: &Error) -> Self {
        Self::in_file(path, Code::UnreadableFile, without_folder(folder, error))
    }

    /// The order in which findings are listed: by file, line and message.
    pub(crate) fn cmp_by_place(&self, other: &Self) -> std::cmp::Ordering {
        (&self.path, self.line, &self.diagnostic.message).cmp(&(
            &other.path,
            other.line,
            &other.diagnostic.message,
        ))
    }
}

/// In the format of compilers: `labels/train/000001.txt:2: 4 columns, expected 5
/// [dataset.bad_label_row]`.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {} [{}]", self.diagnostic, self.diagnostic.code)
    }
}

/// The message of an error without the path, which a finding names anyway.
fn without_folder(folder: &Path, error: &Error) -> String {
    match error {
        Error::File { what, .. } => what.clone(),
        _ => error
            .to_string()
            .replace(&format!("{}/", folder.display()), ""),
    }
}
