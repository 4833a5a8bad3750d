//! The files that a report consists of.

use petcomp::{Result, io};
use std::path::Path;

/// Writes texts into a folder, which is made if it is not there.
///
/// # Errors
/// Files that cannot be written.
pub(crate) fn write_texts<const N: usize>(folder: &Path, files: [(&str, &str); N]) -> Result<()> {
    io::create_folder(folder)?;
    for (name, text) in files {
        io::write_text(folder.join(name), text)?;
    }
    Ok(())
}
