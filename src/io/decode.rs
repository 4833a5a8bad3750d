//! Decoders by kind of file, and OpenImageIO for the kinds that they do not support.

use super::codec::exif::CameraNotes;
use super::codec::raster::Raster;
#[cfg(feature = "oiio")]
use super::codec::raster::Samples;
use super::codec::refusal::Refusal;
use super::codec::{Wanted, exr, hdr, jpeg, png, tiff};
use super::format::Format;
use super::header::Header;
use super::limits::Limits;
#[cfg(feature = "oiio")]
use super::options::Fallback;
use super::options::ReadOptions;
use super::source::SourceFile;
#[cfg(feature = "oiio")]
use super::worker::{self, Request, Response};
use std::io::{BufRead, Cursor, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Decodes samples with our decoders, or with OpenImageIO for the kinds that they do not support.
pub(super) fn decode_raster(
    source: &SourceFile,
    options: &ReadOptions,
    wanted: Wanted,
) -> Result<Raster, Refusal> {
    match catch_panic(|| decode_here(source, options, wanted)) {
        Err(Refusal::Unsupported(what)) => decode_elsewhere(source, what, options, wanted),
        decoded => decoded,
    }
}

/// Decodes samples with our decoders.
fn decode_here(
    source: &SourceFile,
    options: &ReadOptions,
    wanted: Wanted,
) -> Result<Raster, Refusal> {
    let limits = &options.limits;
    match source.format {
        Format::Exr => exr::decode(&source.bytes, limits, wanted, options.window),
        Format::Png => png::decode(&source.bytes, limits),
        Format::Jpeg => jpeg::decode(&source.bytes, limits),
        Format::Tiff => tiff::decode(&source.bytes, limits),
        Format::Hdr => hdr::decode(&source.bytes, limits),
        other => Err(needs_library(other)),
    }
}

fn needs_library(format: Format) -> Refusal {
    Refusal::Unsupported(format!("{} needs {}", format.name(), format.library()))
}

/// The last line of defence: a decoder that panics was given a damaged file.
pub(super) fn catch_panic<T>(f: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(f)).unwrap_or_else(|_| Err("damaged: the decoder gave up".into()))
}

/// Reads what precedes the pixels, and no more of the file than necessary.
pub(super) fn read_file_header<R: BufRead + Seek>(
    file: &mut R,
    bytes: u64,
    format: Format,
    limits: &Limits,
) -> Result<(Header, CameraNotes), Refusal> {
    let header = match format {
        Format::Exr => exr::header(&mut *file, bytes, limits)?,
        Format::Hdr => hdr::header(&mut *file, bytes, limits)?,
        Format::Png => png::header(&mut *file, bytes, limits)?,
        Format::Tiff => tiff::header(&mut *file, bytes, limits)?,
        Format::Jpeg => return read_jpeg_header(file, bytes, limits),
        other => return Err(needs_library(other)),
    };
    Ok((header, notes_of_file(file, format)))
}

/// The notes of a file that can be rewound.
fn notes_of_file(file: &mut (impl BufRead + Seek), format: Format) -> CameraNotes {
    match format {
        Format::Png | Format::Tiff if file.rewind().is_ok() => read_notes(file, format),
        _ => CameraNotes::default(),
    }
}

/// In a JPEG both header and notes precede the first scan.
fn read_jpeg_header(
    file: &mut impl BufRead,
    bytes: u64,
    limits: &Limits,
) -> Result<(Header, CameraNotes), Refusal> {
    let start = jpeg::read_before_scan(file, limits)?;
    let header = jpeg::header(&start, bytes, limits)?;
    Ok((header, CameraNotes::read(Cursor::new(&start))))
}

/// What the camera recorded; EXR and HDR have no such notes.
pub(super) fn camera_notes(source: &SourceFile) -> CameraNotes {
    match source.format {
        Format::Jpeg | Format::Tiff | Format::Png => notes_of_source(source),
        // libheif already rotates the picture as the file requires.
        Format::Heif => notes_of_source(source).upright(),
        _ => CameraNotes::default(),
    }
}

/// Warns of a photo whose orientation cannot be determined.
pub(super) fn warn_unreadable(notes: &CameraNotes, path: &Path) {
    if notes.unreadable {
        let path = path.display();
        log::warn!(
            "{path}: its EXIF data cannot be read: the focal length, and the orientation if stored only there, are unknown"
        );
    }
}

fn notes_of_source(source: &SourceFile) -> CameraNotes {
    // A JPEG's first scan may be followed by further pictures with their own notes.
    let start = (source.format == Format::Jpeg)
        .then(|| jpeg::read_before_scan(&mut &source.bytes[..], &Limits::default()).ok())
        .flatten();
    let file = Cursor::new(start.as_ref().unwrap_or(&source.bytes));
    catch_panic(|| Ok(read_notes(file, source.format))).unwrap_or_default()
}

fn read_notes(file: impl BufRead + Seek, format: Format) -> CameraNotes {
    match format {
        Format::Tiff => tiff::camera_notes(file),
        _ => CameraNotes::read(file),
    }
}

/// Another decoder for kinds that ours do not support.
#[cfg(feature = "oiio")]
pub(super) fn decode_elsewhere(
    source: &SourceFile,
    what: String,
    options: &ReadOptions,
    wanted: Wanted,
) -> Result<Raster, Refusal> {
    let request = Request::Pixels {
        wanted,
        window: options.window,
    };
    let response = ask_openimageio(source, what.clone(), options, request);
    match response.map_err(|e| e.after(&what))? {
        Response::Raster(raster) => {
            Ok(with_whole_palette(with_known_alpha(raster, source), source))
        }
        Response::Shape(_) => Err("OpenImageIO gave no pixels".into()),
    }
}

/// The meaning of alpha in a TIFF comes from the file's own tag: OpenImageIO treats an unspecified
/// one as associated.
#[cfg(feature = "oiio")]
fn with_known_alpha(raster: Raster, source: &SourceFile) -> Raster {
    let premultiplied = match source.format {
        Format::Tiff => tiff::has_associated_alpha(&source.bytes),
        Format::Exr => true,
        _ => raster.premultiplied,
    };
    Raster {
        premultiplied,
        ..raster
    }
}

/// OpenImageIO divides palette entries by 257 and rounds down, which is one code too low if they
/// are codes times 256. A code of 1 can then no longer be distinguished from 0, and stays 0.
#[cfg(feature = "oiio")]
fn with_whole_palette(mut raster: Raster, source: &SourceFile) -> Raster {
    let is_less = source.format == Format::Tiff && tiff::has_shifted_palette(&source.bytes);
    if is_less && let Samples::U8(codes) = &mut raster.samples {
        let lit = codes.iter_mut().filter(|code| **code > 0);
        lit.for_each(|code| *code = code.saturating_add(1));
    }
    raster
}

/// Reads a header with the other decoder.
#[cfg(feature = "oiio")]
pub(super) fn header_elsewhere(
    source: &SourceFile,
    what: String,
    options: &ReadOptions,
) -> Result<(Header, CameraNotes), Refusal> {
    let response = ask_openimageio(source, what, options, Request::Header)?;
    let Response::Shape(shape) = response else {
        return Err("OpenImageIO gave no header".into());
    };
    let header = Header {
        format: source.format,
        width: shape.width,
        height: shape.height,
        bits: 8 * shape.sample.bytes(),
        channels: shape.names,
        ..Header::default()
    };
    Ok((header, camera_notes(source)))
}

#[cfg(feature = "oiio")]
fn ask_openimageio(
    source: &SourceFile,
    what: String,
    options: &ReadOptions,
    request: Request,
) -> Result<Response, Refusal> {
    match options.fallback {
        Fallback::Nothing => Err(Refusal::Unsupported(what)),
        Fallback::Worker => worker::ask(source, &options.limits, false, request),
        Fallback::StrictWorker => worker::ask(source, &options.limits, true, request),
        Fallback::InProcess(linked) => (linked.0)(source, &options.limits, request),
    }
}

/// Without OpenImageIO there is no other decoder.
#[cfg(not(feature = "oiio"))]
fn decode_elsewhere(
    _: &SourceFile,
    what: String,
    _: &ReadOptions,
    _: Wanted,
) -> Result<Raster, Refusal> {
    Err(without_openimageio(&what))
}

/// Without OpenImageIO there is no other decoder.
#[cfg(not(feature = "oiio"))]
pub(super) fn header_elsewhere(
    _: &SourceFile,
    what: String,
    _: &ReadOptions,
) -> Result<(Header, CameraNotes), Refusal> {
    Err(without_openimageio(&what))
}

#[cfg(not(feature = "oiio"))]
fn without_openimageio(what: &str) -> Refusal {
    Refusal::Unsupported(format!("{what} (petcomp was built without OpenImageIO)"))
}
