//! Pictures through OpenImageIO in this process: for trusted files, and for comparisons.
//!
//! A damaged file can crash OpenImageIO, and a program that calls this module links about 260
//! shared libraries. [`io::read`](super::read) runs it in a separate process, for the kinds of file
//! that the Rust decoders do not support.

pub use super::worker::Linked;

use super::codec::FromFile;
use super::codec::codes::{Bits, ToFile, interleaved};
use super::codec::refusal::Refusal;
use super::format::Format;
use super::options::{Fallback, ReadOptions};
use super::read::read_by;
use super::worker::openimageio;
use super::write::{WriteOptions, sample_storage};
use crate::error::{Error, Result};
use crate::image::Image;
use std::path::Path;

/// For [`Fallback::InProcess`]: a program that calls this links OpenImageIO.
pub fn in_process() -> Linked {
    Linked(openimageio::answer)
}

/// Reads a picture through OpenImageIO, in this process; pixels have the same meaning as in
/// [`io::read`](super::read).
///
/// # Errors
/// [`Error::File`] as in [`io::read`](super::read). A damaged file may crash the process instead.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    read_by(
        Fallback::InProcess(in_process()),
        path.as_ref(),
        &ReadOptions::default(),
    )
}

/// Writes a picture through OpenImageIO, encoded as by [`io::write_with`](super::write_with).
///
/// # Errors
/// [`Error::File`] as in [`io::write_with`](super::write_with); the file is written in place,
/// without a temporary file.
pub fn write_with<P: ToFile>(
    path: impl AsRef<Path>,
    image: &Image<P>,
    options: &WriteOptions,
) -> Result<()> {
    let path = path.as_ref();
    encode(path, image, options).map_err(|e| Error::file(path, e))
}

fn encode<P: ToFile>(
    path: &Path,
    image: &Image<P>,
    options: &WriteOptions,
) -> std::result::Result<(), Refusal> {
    openimageio::start()?;
    let format = Format::from_extension(path).ok_or("an extension that is not written")?;
    let bits = written_bits::<P>(format, options.bits)?;
    let name = path
        .to_str()
        .ok_or("a file name that is not UTF-8, which OpenImageIO cannot open")?;
    let layout = openimageio::written_layout(image.size(), P::NAMES, bits);
    let samples = sample_bytes(image, bits);
    openimageio::write_file(name, format, &layout, &samples, &options.metadata)
}

/// As requested, or the format's default; film scans have 16 bits.
fn written_bits<P: ToFile>(
    format: Format,
    requested: Option<Bits>,
) -> std::result::Result<Bits, String> {
    match format {
        Format::Dpx | Format::Cineon => Ok(requested.unwrap_or(Bits::Sixteen)),
        _ => sample_storage::<P>(Some(format), requested),
    }
}

/// The samples of a picture in native byte order.
fn sample_bytes<P: ToFile>(image: &Image<P>, bits: Bits) -> Vec<u8> {
    match bits {
        Bits::Eight => interleaved(image, P::codes::<u8>),
        Bits::Sixteen => bytemuck::cast_slice(&interleaved(image, P::codes::<u16>)).to_vec(),
        Bits::Half | Bits::Float => bytemuck::cast_slice(&interleaved(image, P::linear)).to_vec(),
    }
}
