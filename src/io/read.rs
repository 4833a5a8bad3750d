//! Reads pictures as typed pixels.

use super::codec::FromFile;
use super::codec::exif::CameraNotes;
use super::codec::profile::ColorDescription;
use super::codec::refusal::Refusal;
#[cfg(feature = "oiio")]
use super::decode::decode_elsewhere;
use super::decode::{catch_panic, header_elsewhere, read_file_header, warn_unreadable};
use super::format::Format;
use super::header::Header;
use super::limits::{fitting_pictures, machine_bytes};
#[cfg(feature = "oiio")]
use super::options::Fallback;
use super::options::ReadOptions;
use super::picture::Picture;
use super::source::{OpenedSource, SourceFile};
use crate::error::{Error, Result};
use crate::image::Image;
use std::path::Path;

/// Reads a picture as pixels of the requested type, with the default [`ReadOptions`].
///
/// `LinearRgb` requires an opaque picture: one with alpha below 1 is rejected, an alpha of 1 is
/// dropped. `PremulRgba` and `StraightRgba` get alpha 1 for a file without alpha, and 0 where an
/// EXR stores no pixel. `Coverage` is the only channel of a file, or `R`, `G` and `B` if they are
/// equal and have no alpha below 1, or `A`; `Depth` is the only channel, or `Z`, in float.
///
/// # Errors
/// [`Error::File`] for a file that is missing, not regular, not a picture, damaged, beyond the
/// limits, or without the required channels.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    read_with(path, &ReadOptions::default())
}

/// Reads a picture like [`read`], with the given options.
///
/// # Errors
/// As in [`read`].
pub fn read_with<P: FromFile>(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Image<P>> {
    Picture::decode(path.as_ref(), options, P::WANTED)?.into_image()
}

/// Reads a picture like [`read`], if a check accepts the bytes of its file.
///
/// # Errors
/// As in [`read`]; [`Error::File`] with the result of the check.
#[cfg(feature = "pipeline")]
pub(crate) fn read_checked<P: FromFile>(
    path: &Path,
    check: impl FnOnce(&[u8]) -> std::result::Result<(), String>,
) -> Result<Image<P>> {
    let options = ReadOptions::default();
    let source = SourceFile::open(path, &options.limits)?;
    check(&source.bytes).map_err(|what| Error::file(path, what))?;
    Picture::from_source(&source, &options, P::WANTED)?.into_image()
}

/// Reads the description of a picture in a file, without the pixels.
///
/// # Errors
/// [`Error::File`] as in [`read`].
pub fn read_header(path: impl AsRef<Path>) -> Result<Header> {
    let (path, options) = (path.as_ref(), ReadOptions::default());
    let opened = OpenedSource::open(path, &options.limits)?;
    let (mut header, notes) = match header_of(opened, &options) {
        Err(Refusal::Unsupported(what)) => {
            let source = SourceFile::open(path, &options.limits)?;
            header_elsewhere(&source, what, &options)
        }
        decoded => decoded,
    }
    .map_err(|e| Error::file(path, e))?;
    warn_unreadable(&notes, path);
    apply_notes(&mut header, &notes);
    Ok(header)
}

/// The kind of a picture file, by its first bytes.
///
/// # Errors
/// [`Error::File`] for a file that is missing, not regular, or not a picture.
#[doc(hidden)]
pub fn read_format(path: impl AsRef<Path>) -> Result<Format> {
    let limits = ReadOptions::default().limits;
    Ok(OpenedSource::open(path.as_ref(), &limits)?.format)
}

/// Rejects a photo whose pixels are not square, as an EXR may declare.
///
/// # Errors
/// Those of [`Header::check_square_pixels`] and [`read_header`].
#[doc(hidden)]
pub fn check_square_pixels(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    // Headers of other formats may take long to read, and do not contain it.
    match read_format(path)? {
        Format::Exr => read_header(path)?.check_square_pixels(path),
        _ => Ok(()),
    }
}

/// How many pictures like these to process at once: as many of the largest as fit into half of the
/// machine's memory, at least one; unlimited if that is at least one per thread, or if the memory
/// or all sizes are unknown.
#[doc(hidden)]
pub fn pictures_at_once(
    paths: impl IntoIterator<Item = impl AsRef<Path>>,
    bytes_per_pixel: u64,
) -> usize {
    let headers = paths.into_iter().filter_map(|path| read_header(path).ok());
    let pixels = headers.map(|header| (header.width * header.height) as u64);
    let largest = pixels.max().unwrap_or(0);
    let fitting = fitting_pictures(machine_bytes(), largest.saturating_mul(bytes_per_pixel));
    if fitting < rayon::current_num_threads() {
        fitting
    } else {
        usize::MAX
    }
}

/// Reads a header with our decoders.
fn header_of(
    mut opened: OpenedSource,
    options: &ReadOptions,
) -> std::result::Result<(Header, CameraNotes), Refusal> {
    let (bytes, format) = (opened.bytes, opened.format);
    catch_panic(|| read_file_header(&mut opened.file, bytes, format, &options.limits))
}

/// Adds what the camera recorded; the size becomes that of the upright picture.
fn apply_notes(header: &mut Header, notes: &CameraNotes) {
    let stored = [header.width, header.height];
    header.cropped = notes.has_other_shape(stored);
    header.whole = notes.has_same_size(stored);
    header.turned = notes.orientation.turns();
    header.noted_adobe_rgb = matches!(notes.color, Some(ColorDescription::AdobeRgb));
    (header.width, header.height) = notes.orientation.size(stored.into());
    if header.data_size == [0; 2] {
        header.data_size = [header.width, header.height];
    }
    (header.focal_35mm, header.digital_zoom) = (notes.focal_35mm, notes.digital_zoom);
    header.focal_by_sensor = notes.focal_by_sensor;
}

/// Reads a picture with OpenImageIO only, even if the Rust decoders could read it.
#[cfg(feature = "oiio")]
pub(super) fn read_by<P: FromFile>(
    fallback: Fallback,
    path: &Path,
    options: &ReadOptions,
) -> Result<Image<P>> {
    let source = SourceFile::open(path, &options.limits)?;
    let options = ReadOptions {
        fallback,
        ..options.clone()
    };
    let raster = decode_elsewhere(&source, String::new(), &options, P::WANTED);
    Picture::from_raster(raster, &source, &options.limits, P::WANTED)?.into_image()
}

/// Reads a picture through the OpenImageIO worker, even if the Rust decoders could read it: for
/// comparisons.
///
/// # Errors
/// As in [`read_with`].
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub fn read_in_worker<P: FromFile>(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Result<Image<P>> {
    read_by(Fallback::Worker, path.as_ref(), options)
}
