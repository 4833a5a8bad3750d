//! Checks of photos and options, with their errors.

use crate::error::{Error, Result};

/// The error for a photo that cannot be cut out.
pub(super) fn refused(what: impl Into<String>) -> Error {
    Error::Photo { what: what.into() }
}

/// Refuses a photo that is not as it must be.
pub(super) fn check_photo(is_right: bool, what: impl FnOnce() -> String) -> Result<()> {
    if is_right {
        Ok(())
    } else {
        Err(refused(what()))
    }
}

/// Refuses an option that is not as it must be.
pub(super) fn check_value(is_right: bool, at: &str, what: impl FnOnce() -> String) -> Result<()> {
    if is_right {
        Ok(())
    } else {
        Err(Error::value(at, what()))
    }
}

/// Refuses a picture, by its name, that has not the photo's size.
pub(super) fn check_size(
    name: &str,
    (w, h): (usize, usize),
    (width, height): (usize, usize),
) -> Result<()> {
    check_value((w, h) == (width, height), name, || {
        format!("{w} x {h} pixels, expected the photo's {width} x {height}")
    })
}
