//! Pictures of the keyers' commands, with all their bits.

use anyhow::Result;
use petcomp::Image;
use petcomp::io::{self, Bits, ToFile, WriteOptions};
use std::path::{Path, PathBuf};

/// Writes a picture, in an EXR with all its bits.
pub(crate) fn write_picture<P: ToFile>(path: &Path, image: &Image<P>) -> Result<()> {
    let options = WriteOptions {
        bits: is_exr(path).then_some(Bits::Float),
        ..WriteOptions::default()
    };
    Ok(io::write_with(path, image, &options)?)
}

fn is_exr(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// Writes a picture where one was asked for.
pub(crate) fn write_optional<P: ToFile>(path: &Option<PathBuf>, image: &Image<P>) -> Result<()> {
    path.iter().try_for_each(|path| write_picture(path, image))
}
