//! Checks of photos and options, with their errors.

use crate::error::{Error, Result};
use crate::image::Image;
use crate::pixel::Coverage;
use std::fmt::Display;

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

/// Refuses an option that is not more than 0.
pub(super) fn check_positive(at: &str, value: f32) -> Result<()> {
    check_value(value > 0.0, at, || format!("{value}, expected more than 0"))
}

/// Refuses an option that is less than 0.
pub(super) fn check_length<T: Into<f64> + Copy + Display>(at: &str, value: T) -> Result<()> {
    check_value(value.into() >= 0.0, at, || {
        format!("{value}, expected at least 0")
    })
}

/// Refuses an option that is no share.
pub(super) fn check_share<T: Into<f64> + Copy + Display>(at: &str, value: T) -> Result<()> {
    check_value((0.0..=1.0).contains(&value.into()), at, || {
        format!("{value}, expected 0 to 1")
    })
}

/// Coverage at most: shares that are summed up are 1 but for rounding.
const MAX_COVERAGE: f32 = 1.001;

/// Refuses a mask with a value that is no coverage.
pub(super) fn check_coverage(mask: &Image<Coverage>) -> Result<()> {
    let is_coverage = |c: &&Coverage| (0.0..=MAX_COVERAGE).contains(&c.0);
    let wrong = mask.pixels().iter().find(|c| !is_coverage(c));
    wrong.map_or(Ok(()), |c| check_share("mask", c.0))
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
