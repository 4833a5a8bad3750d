//! The program inside the package.

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs a command line of the program `petcomp` and returns its exit status. Call it only once per
/// process.
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, words: Vec<OsString>) -> u8 {
    py.detach(|| petcomp_cli::run(words.into_iter()))
}
