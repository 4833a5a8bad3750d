//! How pictures are read.

use super::header::Window;
use super::limits::Limits;
#[cfg(feature = "oiio")]
use super::worker::Linked;
use crate::error::{Error, Result};
use std::sync::OnceLock;

/// What reads the kinds of file that the Rust decoders do not know.
#[derive(Clone, Copy, Debug, Default)]
pub enum Fallback {
    /// Nothing: such files are refused.
    Nothing,
    /// OpenImageIO in a process of its own, where petcomp was built with the feature `oiio`.
    #[default]
    Worker,
    /// As `Worker`, but such files are refused where the system cannot sandbox it, with Landlock
    /// and seccomp.
    StrictWorker,
    /// OpenImageIO in this process, for people who trust their files:
    /// [`oiio::in_process`](super::oiio::in_process).
    #[cfg(feature = "oiio")]
    InProcess(Linked),
}

/// How a picture is read.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// What a file may ask for. Default: [`Limits::default`].
    pub limits: Limits,
    /// What reads other kinds of file. Default: [`Fallback::Worker`].
    pub fallback: Fallback,
    /// Which part of an EXR is read. Default: [`Window::Display`].
    pub window: Window,
}

/// What a program chose for all its files.
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
    /// Makes these the default of this process, for every file that a stage reads by itself.
    /// Decides which files are read, never what is in them; for programs, once, at their start.
    ///
    /// # Errors
    /// [`Error::Value`] when it was done before.
    pub fn make_default(self) -> Result<()> {
        PROCESS_DEFAULT
            .set(self)
            .map_err(|_| Error::value("read options", "the defaults were chosen before"))
    }
}
