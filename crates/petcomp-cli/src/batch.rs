//! Many files in one run, some of which may fail.

use crate::print;
use std::fmt;

/// Counts the files of a run that continues if one of them fails.
#[derive(Debug, Default)]
pub(crate) struct FileBatch {
    files: usize,
    failed: usize,
}

impl FileBatch {
    /// A run whose failures were reported already.
    pub(crate) fn counted(files: usize, failed: usize) -> Self {
        Self { files, failed }
    }

    /// Counts a file; if it failed, its error is printed at once.
    pub(crate) fn count(&mut self, outcome: anyhow::Result<()>) {
        self.files += 1;
        if let Err(error) = outcome {
            self.failed += 1;
            print::aside(format_args!("failed: {error:#}"));
        }
    }

    /// # Errors
    /// [`Incomplete`] if any file failed.
    pub(crate) fn finish(self) -> anyhow::Result<()> {
        match self.failed {
            0 => Ok(()),
            _ => Err(Incomplete(self).into()),
        }
    }
}

/// Some files of a batch failed; the rest was done.
#[derive(Debug)]
pub(crate) struct Incomplete(FileBatch);

impl fmt::Display for Incomplete {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let FileBatch { files, failed } = self.0;
        write!(f, "{failed} of {files} files could not be used")?;
        match failed < files {
            true => f.write_str("; the rest is done"),
            false => Ok(()),
        }
    }
}

impl std::error::Error for Incomplete {}
