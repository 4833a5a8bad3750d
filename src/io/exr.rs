//! OpenEXR files, accessed by the names of their channels and parts.

pub use super::codec::exr::{Channel, ChannelSamples, Part};

use super::codec::exr::{self, FlatSamples};
use super::decode::catch_panic;
use super::format::Format;
use super::fs::write_bytes;
use super::header::Canvas;
use super::options::ReadOptions;
use super::source::SourceFile;
use crate::error::{Error, Result};
use crate::work::{self, Kind};
use std::path::Path;

/// Writes float channels under the given names, zip-compressed, with text attributes, for a picture
/// placed on a canvas. The samples are not copied.
///
/// `size` is width and height; every channel has `width * height` samples, row by row from the top.
/// Names may include a layer: `diffuse.R`.
///
/// # Errors
/// [`Error::File`] for a channel of another size, a duplicate name, or a file that cannot be written.
pub fn write_channels<N: AsRef<str>>(
    path: impl AsRef<Path>,
    size: (usize, usize),
    canvas: Canvas,
    channels: Vec<(N, Vec<f32>)>,
    metadata: &[(String, String)],
) -> Result<()> {
    let (names, samples): (Vec<N>, Vec<Vec<f32>>) = channels.into_iter().unzip();
    let samples = samples.into_iter().map(FlatSamples::F32);
    let planes = names.iter().map(N::as_ref).zip(samples).collect();
    let encoded = exr::encode(size, canvas, planes, exr::Compression::Zip, metadata);
    write_encoded(path.as_ref(), encoded)
}

/// Like [`write_channels`], with half floats, without canvas and text attributes.
///
/// # Errors
/// Those of [`write_channels`].
pub fn write_half_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: &[(&str, impl AsRef<[f32]>)],
) -> Result<()> {
    let channels = channels.iter();
    let planes = channels.map(|(name, samples)| (*name, exr::half_samples(samples.as_ref())));
    let (canvas, compression) = (Canvas::default(), exr::Compression::Zip);
    let encoded = exr::encode(size, canvas, planes.collect(), compression, &[]);
    write_encoded(path.as_ref(), encoded)
}

/// Writes parts of the same size (width, height) to one EXR file, losslessly compressed; the same
/// parts give the same bytes.
///
/// # Errors
/// [`Error::File`] for an empty list of parts, a channel of another size, a duplicate name, or a
/// file that cannot be written.
pub fn write_parts(path: impl AsRef<Path>, size: (usize, usize), parts: &[Part]) -> Result<()> {
    write_encoded(path.as_ref(), exr::encode_parts(size, parts))
}

fn write_encoded(path: &Path, encoded: std::result::Result<Vec<u8>, String>) -> Result<()> {
    work::add(Kind::Encodes, 1);
    let bytes = encoded.map_err(|e| Error::file(path, e))?;
    write_bytes(path, &bytes)
}

/// Reads every channel of the first part of an EXR file, and the picture's size.
///
/// # Errors
/// [`Error::File`] for a file that cannot be opened, is not an EXR, is damaged or exceeds the
/// default [`Limits`](super::Limits).
pub fn read_channels(path: impl AsRef<Path>) -> Result<((usize, usize), Vec<Channel>)> {
    let (path, limits) = (path.as_ref(), ReadOptions::default().limits);
    let source = SourceFile::open(path, &limits)?;
    if source.format != Format::Exr {
        return Err(Error::file(
            path,
            format!("is {}, expected an EXR", source.format.name()),
        ));
    }
    catch_panic(|| exr::channels(&source.bytes, &limits)).map_err(|e| Error::file(path, e))
}
