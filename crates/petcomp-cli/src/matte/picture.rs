//! What the keyers' commands share: colours on the command line, pictures with all their bits.

use anyhow::Result;
use petcomp::io::{self, Bits, ToFile, WriteOptions};
use petcomp::{Image, LinearRgb};
use std::path::{Path, PathBuf};

/// A colour from `R,G,B`.
pub(crate) fn color(text: &str) -> Result<LinearRgb, String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    let channels: Result<[f32; 3], _> = numbers.map_err(|e| e.to_string())?.try_into();
    channels
        .map(LinearRgb::from)
        .map_err(|n| format!("{} numbers, expected R,G,B", n.len()))
}

/// Writes a picture, in an EXR with all its bits.
pub(crate) fn write<P: ToFile>(path: &Path, image: &Image<P>) -> Result<()> {
    let is_exr = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let options = WriteOptions {
        bits: is_exr.then_some(Bits::Float),
        ..WriteOptions::default()
    };
    Ok(io::write_with(path, image, &options)?)
}

/// Writes a picture where one was asked for.
pub(crate) fn write_some<P: ToFile>(path: &Option<PathBuf>, image: &Image<P>) -> Result<()> {
    path.iter().try_for_each(|path| write(path, image))
}
