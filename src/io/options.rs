//! Options for reading pictures.

use super::header::Window;
use super::limits::Limits;
#[cfg(feature = "oiio")]
use super::worker::Linked;
use crate::error::{Error, Result};
use std::sync::OnceLock;

/// The reader for kinds of file that the Rust decoders do not support.
#[derive(Clone, Copy, Debug, Default)]
pub enum Fallback {
    /// None: such files are rejected.
    Nothing,
    /// OpenImageIO in a separate process, if petcomp was built with the feature `oiio`.
    #[default]
    Worker,
    /// Like `Worker`, but such files are rejected if the system cannot sandbox it with Landlock and
    /// seccomp.
    StrictWorker,
    /// OpenImageIO in this process, for trusted files:
    /// [`oiio::in_process`](super::oiio::in_process).
    #[cfg(feature = "oiio")]
    InProcess(Linked),
}

/// How a picture is read.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// What a file may demand. Default: [`Limits::default`].
    pub limits: Limits,
    /// The reader for other kinds of file. Default: [`Fallback::Worker`].
    pub fallback: Fallback,
    /// Which region of an EXR is read. Default: [`Window::Display`].
    pub window: Window,
}

/// The options that a program chose for all its files.
static PROCESS_DEFAULT: OnceLock<ReadOptions> = OnceLock::new();

impl Default for ReadOptions {
    fn default() -> Self {
        match PROCESS_DEFAULT.get() {
            Some(chosen) => chosen.clone(),
            None => Self {
                limits: Limits::default(),
                fallback: Fallback::default(),
                window: Window::default(),
            },
        }
    }
}

impl ReadOptions {
    /// Makes these the default of this process, for every file that a stage reads. They decide
    /// which files are read, never what their content is; programs call this once, when they start.
    ///
    /// # Errors
    /// [`Error::Value`] if it was already called.
    pub fn make_default(self) -> Result<()> {
        PROCESS_DEFAULT
            .set(self)
            .map_err(|_| Error::value("read options", "the defaults were chosen before"))
    }
}
