//! Errors as Python's exceptions: a class for each kind, the same sentence.

use petcomp::Error;
use pyo3::prelude::*;
use std::path::Path;

/// Where the classes are.
const MODULE: &str = "petcomp.errors";

/// The exception of an error.
pub(crate) fn to_python(error: Error) -> PyErr {
    Python::attach(|py| exception(py, &error).unwrap_or_else(|problem| problem))
}

/// An exception for what must not happen.
pub(crate) fn internal(message: &str) -> PyErr {
    let text = format!("petcomp panicked, which is a bug: {message}");
    Python::attach(|py| new(py, "InternalError", &text).unwrap_or_else(|problem| problem))
}

/// An exception for an argument of the wrong type.
pub(crate) fn wrong_type(at: &str, what: &str) -> PyErr {
    Python::attach(|py| {
        let error = new(py, "ArgumentTypeError", &format!("{at}: {what}"));
        let error = error.and_then(|error| with_parts(py, error, None, Some(at), what));
        error.unwrap_or_else(|problem| problem)
    })
}

/// An exception for the use of what was closed.
pub(crate) fn closed(what: &str) -> PyErr {
    let text = format!("{what} is closed");
    Python::attach(|py| new(py, "ClosedError", &text).unwrap_or_else(|problem| problem))
}

/// An exception for a value that cannot be right.
pub(crate) fn wrong_value(at: &str, what: impl std::fmt::Display) -> PyErr {
    to_python(Error::value(at, what))
}

fn new(py: Python<'_>, class: &str, message: &str) -> PyResult<PyErr> {
    let class = py.import(MODULE)?.getattr(class)?;
    Ok(PyErr::from_value(class.call1((message,))?))
}

fn exception(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let made = new(py, class_of(error), &error.to_string())?;
    match error {
        Error::File { path, what } => with_parts(py, made, Some(path), None, what),
        Error::Field { path, at, what } => with_parts(py, made, Some(path), Some(at), what),
        Error::Value { at, what } | Error::Camera { at, what } => {
            with_parts(py, made, None, Some(at), what)
        }
        Error::Photo { what } | Error::Unsettled { what } | Error::Interrupted { what } => {
            with_parts(py, made, None, None, what)
        }
        _ => Ok(made),
    }
}

fn class_of(error: &Error) -> &'static str {
    match error {
        Error::File { .. } => "FileError",
        Error::Field { .. } => "FieldError",
        Error::Value { .. } => "InvalidValueError",
        Error::Photo { .. } => "PhotoError",
        Error::Camera { .. } => "CameraError",
        Error::Unsettled { .. } => "UnsettledError",
        Error::Interrupted { .. } => "InterruptedError",
        _ => "Error",
    }
}

fn with_parts(
    py: Python<'_>,
    error: PyErr,
    path: Option<&Path>,
    at: Option<&str>,
    what: &str,
) -> PyResult<PyErr> {
    let value = error.value(py);
    value.setattr("path", path.map(|path| path.to_string_lossy().into_owned()))?;
    value.setattr("at", at)?;
    value.setattr("what", what)?;
    Ok(error)
}
