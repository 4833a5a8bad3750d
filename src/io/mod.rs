//! Input and output: the only place that opens pictures, and the only one that sees C++.
//!
//! A picture is read by what it *is*, not by what it is called, and becomes the pixel type that the caller asks for:
//!
//! | samples of the file | colour becomes | alpha | [`Coverage`](crate::Coverage) |
//! | --- | --- | --- | --- |
//! | integers (PNG, JPEG, TIFF) | decoded with the exact sRGB curve, unless a PNG states gamma 1 | straight unless a TIFF says otherwise | code / full scale, never decoded |
//! | half and float (EXR, TIFF, HDR) | taken as scene-linear Rec. 709 | EXR premultiplied, TIFF as it says | as it is |
//!
//! Premultiplication happens here, in linear light. The orientation noted by a camera is applied. An EXR is cropped or
//! padded with zeros from its data window to its display window. An EXR that names other primaries is converted; embedded ICC profiles are not
//! applied.
//!
//! Sizes are checked against [`Limits`] before anything is allocated, decoders that panic are caught, and truncated JPEGs,
//! which decoders take for grey pictures, are refused. Files are written beside their place and moved there: whole or
//! not at all.

mod atomic;
mod document;
mod exif;
pub mod exr;
pub mod exr_parts;
#[cfg(feature = "oiio")]
mod ffi;
mod format;
mod hdr;
mod header;
mod jpeg;
mod limits;
#[cfg(feature = "oiio")]
pub mod oiio;
mod orient;
mod overrides;
mod png;
mod raster;
mod tiff;
#[cfg(feature = "oiio")]
mod worker;
mod write;

pub use atomic::create_folder;
pub use document::{
    from_overrides, read_document, read_json, read_text, read_toml, read_toml_with, write_document, write_json,
    write_text, write_toml,
};
pub use format::Format;
pub use header::Header;
pub use limits::Limits;
pub use overrides::Override;
pub use raster::{FromFile, TRANSMITTANCE, VIEW_TRANSMITTANCE};
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub use worker::{serve as serve_worker, worker_version};
pub use write::{Bits, Compression, ToFile, WriteOptions, write, write_with};

use crate::{Error, Image, Result};
use exif::CameraNotes;
use format::Source;
use raster::{Opaque, Raster, Refusal, Wanted};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Reads a picture as the pixels asked for, with the default [`Limits`].
///
/// `LinearRgb` wants an opaque picture: one with alpha below 1 is refused, an alpha of 1 is dropped. `PremulRgba` and
/// `StraightRgba` get alpha 1 from a file without alpha. `Coverage` is the only channel of a file, or its `A`, or its
/// `Y`; `Depth` the only one, or `Z`, in float.
///
/// # Errors
/// [`Error::File`] for a file that is missing, not regular, not a picture, damaged, beyond the limits, or without the
/// channels asked for.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    read_with(path, &ReadOptions::default())
}

/// What reads the kinds of file that the Rust decoders do not know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fallback {
    /// Nothing: such files are refused.
    Nothing,
    /// OpenImageIO in a process of its own, where petcomp was built with the feature `oiio`.
    #[default]
    Worker,
}

/// How a picture is read.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// What a file may ask for. Default: [`Limits::default`].
    pub limits: Limits,
    /// What reads other kinds of file. Default: [`Fallback::Worker`].
    pub fallback: Fallback,
}

/// Reads a picture as [`read`] does, under conditions of the caller's.
///
/// # Errors
/// As [`read`].
pub fn read_with<P: FromFile>(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Image<P>> {
    let (path, limits) = (path.as_ref(), &options.limits);
    let source = Source::open(path, limits)?;
    let raster = match caught(|| decode(&source, limits, P::WANTED)) {
        Err(Refusal::Unsupported(what)) if options.fallback == Fallback::Worker => {
            elsewhere(path, &source, what, limits, P::WANTED)?
        }
        decoded => decoded.map_err(|e| Error::file(path, e))?,
    };
    upright(&raster, &source).map_err(|e| Error::file(path, e))
}

/// Gives samples their meaning and turns the picture the way the camera was held.
fn upright<P: FromFile>(raster: &Raster, source: &Source) -> std::result::Result<Image<P>, String> {
    Ok(camera_notes(source).orientation.apply(P::from_raster(&Opaque(raster))?))
}

/// Reads what a file says about its picture, without the pixels.
///
/// # Errors
/// [`Error::File`] as [`read`].
pub fn read_header(path: impl AsRef<Path>) -> Result<Header> {
    let (path, limits) = (path.as_ref(), Limits::default());
    let source = Source::open(path, &limits)?;
    let mut header = caught(|| header(&source, &limits)).map_err(|e| Error::file(path, e))?;
    let notes = camera_notes(&source);
    header.cropped = notes.taken_in_another_shape([header.width, header.height]);
    (header.width, header.height) = notes.orientation.size((header.width, header.height));
    (header.focal_35mm, header.digital_zoom) = (notes.focal_35mm, notes.digital_zoom);
    Ok(header)
}

/// What the camera noted; EXR and HDR have no place for it.
fn camera_notes(source: &Source) -> CameraNotes {
    match source.format {
        Format::Jpeg | Format::Tiff | Format::Png => {
            caught(|| Ok(CameraNotes::of_file(&source.bytes))).unwrap_or_default()
        }
        _ => CameraNotes::default(),
    }
}

fn header(source: &Source, limits: &Limits) -> std::result::Result<Header, Refusal> {
    match source.format {
        Format::Exr => exr::header(&source.bytes, limits),
        Format::Png => png::header(&source.bytes, limits),
        Format::Jpeg => jpeg::header(&source.bytes, limits),
        Format::Tiff => tiff::header(&source.bytes, limits),
        Format::Hdr => hdr::header(&source.bytes, limits),
        other => Err(Refusal::Unsupported(format!("{} headers are not read", other.name()))),
    }
}

fn decode(source: &Source, limits: &Limits, wanted: Wanted) -> std::result::Result<Raster, Refusal> {
    match source.format {
        Format::Exr => exr::decode(&source.bytes, limits, wanted),
        Format::Png => png::decode(&source.bytes, limits),
        Format::Jpeg => jpeg::decode(&source.bytes, limits),
        Format::Tiff => tiff::decode(&source.bytes, limits),
        Format::Hdr => hdr::decode(&source.bytes, limits),
        other => Err(Refusal::Unsupported(format!("{} needs OpenImageIO", other.name()))),
    }
}

/// The last defence: a decoder that panics has met a damaged file.
fn caught<T>(f: impl FnOnce() -> std::result::Result<T, Refusal>) -> std::result::Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(f)).unwrap_or_else(|_| Err("damaged: the decoder gave up".into()))
}

/// Another decoder for what ours do not know.
#[cfg(feature = "oiio")]
fn elsewhere(path: &Path, source: &Source, _: String, limits: &Limits, wanted: Wanted) -> Result<Raster> {
    let raster = worker::decode(path, source, limits, wanted).map_err(|e| Error::file(path, e))?;
    Ok(oiio::associated(raster, source))
}

/// Without OpenImageIO there is no other decoder.
#[cfg(not(feature = "oiio"))]
fn elsewhere(path: &Path, _: &Source, what: String, _: &Limits, _: Wanted) -> Result<Raster> {
    Err(Error::file(path, format!("{what} (petcomp was built without OpenImageIO)")))
}
