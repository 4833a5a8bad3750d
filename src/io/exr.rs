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

/// Writes float channels under the given names, zip-compressed, with text attributes.
///
/// `size` is width and height; every channel has `width * height` samples, row by row from the top.
/// Names may include a layer: `diffuse.R`.
///
/// # Errors
/// [`Error::File`] for a channel of another size, a duplicate name, or a file that cannot be written.
pub fn write_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: &[(&str, &[f32])],
    metadata: &[(String, String)],
) -> Result<()> {
    let planes = float_planes(channels);
    write_encoded(path.as_ref(), encode(size, planes, metadata))
}

/// Like [`write_channels`], but takes ownership of the channels, so that many large ones are not
/// copied.
///
/// # Errors
/// Those of [`write_channels`].
pub fn write_owned_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: Vec<(String, Vec<f32>)>,
    metadata: &[(String, String)],
) -> Result<()> {
    let (names, samples): (Vec<String>, Vec<Vec<f32>>) = channels.into_iter().unzip();
    let samples = samples.into_iter().map(FlatSamples::F32);
    let planes = names.iter().map(String::as_str).zip(samples).collect();
    write_encoded(path.as_ref(), encode(size, planes, metadata))
}

/// Like [`write_channels`], for a picture placed on a canvas, without text attributes.
///
/// # Errors
/// Those of [`write_channels`].
pub fn write_channels_on(
    path: impl AsRef<Path>,
    size: (usize, usize),
    canvas: Canvas,
    channels: &[(&str, &[f32])],
) -> Result<()> {
    let planes = float_planes(channels);
    let encoded = exr::encode(size, canvas, planes, exr::Compression::Zip, &[]);
    write_encoded(path.as_ref(), encoded)
}

/// Like [`write_channels`], with half floats.
///
/// # Errors
/// Those of [`write_channels`].
pub fn write_half_channels(
    path: impl AsRef<Path>,
    size: (usize, usize),
    channels: &[(&str, &[f32])],
    metadata: &[(String, String)],
) -> Result<()> {
    let planes = planes(channels, exr::half_samples);
    write_encoded(path.as_ref(), encode(size, planes, metadata))
}

fn float_planes<'a>(channels: &[(&'a str, &[f32])]) -> Vec<(&'a str, FlatSamples)> {
    planes(channels, |samples| FlatSamples::F32(samples.to_vec()))
}

fn planes<'a>(
    channels: &[(&'a str, &[f32])],
    stored: impl Fn(&[f32]) -> FlatSamples,
) -> Vec<(&'a str, FlatSamples)> {
    let channels = channels.iter();
    channels
        .map(|&(name, samples)| (name, stored(samples)))
        .collect()
}

fn encode(
    size: (usize, usize),
    planes: Vec<(&str, FlatSamples)>,
    metadata: &[(String, String)],
) -> std::result::Result<Vec<u8>, String> {
    let (canvas, compression) = (Canvas::default(), exr::Compression::Zip);
    exr::encode(size, canvas, planes, compression, metadata)
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
