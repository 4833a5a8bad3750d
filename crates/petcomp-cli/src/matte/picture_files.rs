//! Pictures of the keyers' commands, with all their bits.

use anyhow::Result;
use petcomp::Image;
use petcomp::io::{self, Bits, ToFile, WriteOptions};
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Writes a picture, in an EXR with all its bits.
pub(crate) fn write_picture<P: ToFile>(path: &Path, image: &Image<P>) -> Result<()> {
    let options = WriteOptions {
        bits: is_exr(path).then_some(Bits::Float),
        ..WriteOptions::default()
    };
    Ok(io::write_with(path, image, &options)?)
}

/// The file is called `.exr`.
pub(super) fn is_exr(path: &Path) -> bool {
    io::has_extension(path, "exr")
}

/// Fails where a picture has not the size of a photo; both are named as the user does.
pub(super) fn check_same_size(
    name: impl Display,
    (w, h): (usize, usize),
    photo: &Path,
    (width, height): (usize, usize),
) -> Result<()> {
    let photo = photo.display();
    anyhow::ensure!(
        (w, h) == (width, height),
        "{name}: {w} x {h} pixels, expected {width} x {height} as {photo}"
    );
    Ok(())
}

/// Writes a picture where one was asked for.
pub(crate) fn write_optional<P: ToFile>(path: &Option<PathBuf>, image: &Image<P>) -> Result<()> {
    path.iter().try_for_each(|path| write_picture(path, image))
}
