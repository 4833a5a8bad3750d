//! How an error ends the program: one line, and a status.

use crate::batch::Incomplete;
use crate::print;
use std::fmt;

pub(crate) const SUCCESS_STATUS: u8 = 0;
const NEEDS_REVIEW_STATUS: u8 = 1;
const INCOMPLETE_STATUS: u8 = 2;
const DATA_STATUS: u8 = 3;
pub(crate) const FILE_STATUS: u8 = 4;
pub(crate) const INTERRUPTED_STATUS: u8 = 130;

/// Everything was done, but `--strict` was given and something needs review.
#[derive(Debug)]
pub(crate) struct NeedsReview(pub(crate) String);

impl fmt::Display for NeedsReview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NeedsReview {}

/// Prints an error and its causes on one line and returns the exit status.
pub(crate) fn report_error(error: &anyhow::Error) -> u8 {
    print::aside(format_args!("error: {error:#}"));
    status_of(error)
}

/// 1 if `--strict` found something to review, 2 if some of many files could not be used, 3 for
/// invalid data, 4 for files that cannot be used, 130 after an interruption. (2 is also the status
/// of a wrong command line, which clap returns.)
fn status_of(error: &anyhow::Error) -> u8 {
    if error.is::<NeedsReview>() {
        return NEEDS_REVIEW_STATUS;
    }
    if error.is::<Incomplete>() {
        return INCOMPLETE_STATUS;
    }
    match error.downcast_ref::<petcomp::Error>() {
        Some(petcomp::Error::File { .. } | petcomp::Error::Photo { .. }) => FILE_STATUS,
        Some(petcomp::Error::Interrupted { .. }) => INTERRUPTED_STATUS,
        _ => DATA_STATUS,
    }
}
