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
//! padded with zeros from its data window to its display window ([`Window`] keeps the former), and converted if it names
//! other primaries. A colour profile (ICC) of primaries and curves, such as Display P3 or Adobe RGB, is applied to display
//! codes; others are named in a warning and the codes taken for sRGB. Inks (CMYK) are multiplied. Samples that are infinite or no
//! number are counted in a warning, and become codes of 0 or full where integers are written.
//!
//! # What is promised of files that nobody vouches for
//!
//! No file that is handed to petcomp kills it, hangs it, takes the machine's memory or gets out of its folder; what can be
//! read is read right, what cannot is named in one line.
//!
//! * **What is opened.** Regular files only, by content and not by name: EXR, PNG, JPEG, TIFF, Radiance HDR; DPX and Cineon
//!   only under their own names.
//! * **What a file may ask for** is in [`Limits`], and checked before pixels are touched, in arithmetic that cannot wrap: by default
//!   32,768 pixels along a side, 128 Mi in all, 64 channels, 1 GiB decoded, 10,000 times the file above 64 MiB, 64 MiB that
//!   is not pixels. Memory that the system does not give is not attempted.
//! * **Who decodes.** Decoders in Rust, in this process; one that panics has met a damaged file. What they do not know goes
//!   to OpenImageIO in a worker process, which gets the file's bytes and gives samples through pipes. It may open no file
//!   (Landlock, seccomp, file size 0), start nothing, connect nowhere, has memory for the file in hand, and is killed when it takes more
//!   than [`Limits::seconds`]. A file on which two workers die is named with the signal. The worker is not believed either.
//! * **What is written** stands beside its place first, is put on the disk, and is moved there: whole or not at all. A link in
//!   the way is replaced, not followed; [`refuse_links`] and [`clean_name`] keep outputs in their folder. No metadata of an input
//!   gets into an output, so neither places (GPS) nor serial numbers do.
//! * **Where a document leads.** A path in a document that may come from anywhere (journal and manifest of a dataset or an
//!   asset folder, label, scene, scene for another renderer) is looked for in the folder of that document alone: [`inside`] refuses `..`, links
//!   that lead out, and all but regular files. Trusted are documents that people write for themselves and that name files
//!   elsewhere on purpose: recipes (`assets`, `backgrounds`, `environment.files`), lists of photos, `data.yaml` and the lists it names.
//!   What they name must be regular files within the limits too. Files that petcomp appends to (`.lock`, `index.jsonl`,
//!   `.runs.jsonl`) are refused where a link is in their place.
//! * **Documents** (JSON, TOML) are at most 64 MiB and nested 80 to 128 deep, without a key twice or a number that is not finite;
//!   a mistake is named with its line.
//!
//! Not promised: that decoders have no mistakes ([`oiio::read`] and [`Fallback::InProcess`] let OpenImageIO's into this process,
//! and Debian does not mend them), that a kernel without Landlock or seccomp confines as well (one warning says so;
//! [`Fallback::StrictWorker`] refuses), that the stages behind reading fit into any memory, or anything against a person with an account on the machine. Half-grey
//! pictures out of JPEGs that are damaged in the middle, with their end in place, cannot be told from real ones.

mod atomic;
#[cfg(feature = "oiio")]
mod confine;
mod document;
mod exif;
pub mod exr;
mod exr_blocks;
mod exr_chroma;
pub mod exr_parts;
mod exr_runs;
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
#[cfg(feature = "oiio")]
mod patience;
mod picture;
mod place;
mod png;
mod profile;
#[cfg(feature = "oiio")]
mod protocol;
mod raster;
#[cfg(feature = "oiio")]
mod serve;
mod soundness;
mod tiff;
#[cfg(feature = "oiio")]
mod worker;
mod write;

pub use atomic::{Checksum, copy, create_folder, relative, sync, write_through};
pub(crate) use atomic::{open_own, refuse_foreign};
pub use document::{
    from_overrides, parse_json, parse_toml, read_document, read_json, read_json_data, read_text,
    read_toml, read_toml_with, write_document, write_json, write_text, write_toml,
};
pub(crate) use document::{from_table, from_table_with, read_bytes, suggestion};
pub use format::Format;
pub use header::Header;
#[doc(hidden)]
pub use jpeg::through_jpeg;
pub use limits::{Limits, Raise};
pub use overrides::Override;
pub use picture::Picture;
pub(crate) use place::length_inside;
pub use place::{below, clean_name, inside, refuse_links};
pub use raster::{FromFile, TRANSMITTANCE, VIEW_TRANSMITTANCE};
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub use serve::serve as serve_worker;
#[cfg(feature = "oiio")]
pub use worker::worker_version;
pub use write::{
    Bits, Compression, PngEffort, ToFile, WriteOptions, jpeg_bytes, write, write_with,
};

use crate::{Error, Image, Result};
use exif::CameraNotes;
use format::{Opened, Source};
#[cfg(feature = "oiio")]
use protocol::{Ask, Sample, Shape, Told};
use raster::{Raster, Refusal, Wanted};
use std::io::{BufRead, Cursor, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::OnceLock;

/// Reads a picture as the pixels asked for, with the default [`ReadOptions`].
///
/// `LinearRgb` wants an opaque picture: one with alpha below 1 is refused, an alpha of 1 is dropped. `PremulRgba` and
/// `StraightRgba` get alpha 1 from a file without alpha. `Coverage` is the only channel of a file, or `R`, `G` and `B` where
/// they are equal and no alpha below 1 is beside them, or `A`; `Depth` the only one, or `Z`, in float.
///
/// # Errors
/// [`Error::File`] for a file that is missing, not regular, not a picture, damaged, beyond the limits, or without the
/// channels asked for.
pub fn read<P: FromFile>(path: impl AsRef<Path>) -> Result<Image<P>> {
    read_with(path, &ReadOptions::default())
}

/// What reads the kinds of file that the Rust decoders do not know.
#[derive(Clone, Copy, Debug, Default)]
pub enum Fallback {
    /// Nothing: such files are refused.
    Nothing,
    /// OpenImageIO in a process of its own, where petcomp was built with the feature `oiio`.
    #[default]
    Worker,
    /// As `Worker`, but such files are refused where the system cannot confine it, with Landlock and seccomp.
    StrictWorker,
    /// OpenImageIO in this process, for people who trust their files: [`oiio::in_process`].
    #[cfg(feature = "oiio")]
    InProcess(oiio::Linked),
}

/// Which part of an EXR is the picture. Other formats have only one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Window {
    /// What is meant to be shown: stored pixels outside are cut, missing ones are transparent black.
    #[default]
    Display,
    /// What is stored, wherever it lies: [`Header::data_at`].
    Data,
}

/// How a picture is read.
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// What a file may ask for. Default: [`Limits::default`].
    pub limits: Limits,
    /// What reads other kinds of file. Default: [`Fallback::Worker`].
    pub fallback: Fallback,
    /// Which part of an EXR is read. Default: [`Window::Display`].
    pub window: Window,
}

/// What a program chose for all its files.
static CHOSEN: OnceLock<ReadOptions> = OnceLock::new();

impl Default for ReadOptions {
    fn default() -> Self {
        let built_in = || Self {
            limits: Limits::default(),
            fallback: Fallback::default(),
            window: Window::default(),
        };
        CHOSEN.get().cloned().unwrap_or_else(built_in)
    }
}

impl ReadOptions {
    /// Makes these the default of this process, for every file that a stage reads by itself. Decides which files are
    /// read, never what is in them; for programs, once, at their start.
    ///
    /// # Errors
    /// [`Error::Value`] when it was done before.
    pub fn make_default(self) -> Result<()> {
        CHOSEN
            .set(self)
            .map_err(|_| Error::value("read options", "the defaults were chosen before"))
    }
}

/// Reads a picture as [`read`] does, under conditions of the caller's.
///
/// # Errors
/// As [`read`].
pub fn read_with<P: FromFile>(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Image<P>> {
    Picture::decode(path.as_ref(), options, P::WANTED)?.into_image()
}

/// Samples by our decoders, or by OpenImageIO where those do not know the kind.
fn raster_of(
    source: &Source,
    options: &ReadOptions,
    wanted: Wanted,
) -> std::result::Result<Raster, Refusal> {
    match caught(|| decode(source, options, wanted)) {
        Err(Refusal::Unsupported(what)) => elsewhere(source, what, options, wanted),
        decoded => decoded,
    }
}

/// Reads what a file says about its picture, without the pixels.
///
/// # Errors
/// [`Error::File`] as [`read`].
pub fn read_header(path: impl AsRef<Path>) -> Result<Header> {
    let (path, options) = (path.as_ref(), ReadOptions::default());
    let mut opened = Opened::open(path, &options.limits)?;
    let Opened {
        file,
        bytes,
        format,
    } = &mut opened;
    let (mut header, notes) = match caught(|| header(file, *bytes, *format, &options.limits)) {
        Err(Refusal::Unsupported(what)) => header_elsewhere(path, what, &options)?,
        header => header.map_err(|e| Error::file(path, e))?,
    };
    header.cropped = notes.taken_in_another_shape([header.width, header.height]);
    header.whole = notes.taken_whole([header.width, header.height]);
    (header.width, header.height) = notes.orientation.size((header.width, header.height));
    if header.data_size == [0; 2] {
        header.data_size = [header.width, header.height];
    }
    (header.focal_35mm, header.digital_zoom) = (notes.focal_35mm, notes.digital_zoom);
    Ok(header)
}

/// The header of a file in memory, for fuzzing: nothing is caught.
pub(crate) fn header_of(bytes: &[u8]) -> std::result::Result<Header, String> {
    let format = Format::of_bytes(bytes).ok_or("no picture")?;
    let told = header(
        &mut Cursor::new(bytes),
        bytes.len() as u64,
        format,
        &Limits::default(),
    );
    told.map(|(header, _)| header).map_err(|e| e.to_string())
}

/// What a worker says, for fuzzing.
#[cfg(feature = "oiio")]
pub(crate) fn worker_answer(bytes: &[u8]) -> bool {
    let mut from = bytes;
    let shape = protocol::receive_shape(&mut from, &Limits::default(), bytes.len() as u64);
    shape
        .ok()
        .and_then(|shape| protocol::receive_samples(&mut from, shape.ok()?).ok())
        .is_some()
}

/// What the camera noted; EXR and HDR have no place for it.
fn camera_notes(source: &Source) -> CameraNotes {
    match source.format {
        Format::Jpeg | Format::Tiff | Format::Png => {
            caught(|| Ok(CameraNotes::of_file(Cursor::new(&source.bytes)))).unwrap_or_default()
        }
        _ => CameraNotes::default(),
    }
}

/// What stands in front of the pixels, and no more of the file than that takes.
fn header<R: BufRead + Seek>(
    file: &mut R,
    bytes: u64,
    format: Format,
    limits: &Limits,
) -> std::result::Result<(Header, CameraNotes), Refusal> {
    let header = match format {
        Format::Exr => exr::header(&mut *file, bytes, limits)?,
        Format::Hdr => hdr::header(&mut *file, bytes, limits)?,
        Format::Png => png::header(&mut *file, bytes, limits)?,
        Format::Tiff => tiff::header(&mut *file, bytes, limits)?,
        Format::Jpeg => {
            let start = jpeg::head(file, limits)?;
            return Ok((
                jpeg::header(&start, bytes, limits)?,
                CameraNotes::of_file(Cursor::new(&start)),
            ));
        }
        other => {
            return Err(Refusal::Unsupported(format!(
                "{} needs OpenImageIO",
                other.name()
            )));
        }
    };
    let notes = match format {
        Format::Png | Format::Tiff if file.rewind().is_ok() => CameraNotes::of_file(file),
        _ => CameraNotes::default(),
    };
    Ok((header, notes))
}

fn decode(
    source: &Source,
    options: &ReadOptions,
    wanted: Wanted,
) -> std::result::Result<Raster, Refusal> {
    let limits = &options.limits;
    match source.format {
        Format::Exr => exr::decode(&source.bytes, limits, wanted, options.window),
        Format::Png => png::decode(&source.bytes, limits),
        Format::Jpeg => jpeg::decode(&source.bytes, limits),
        Format::Tiff => tiff::decode(&source.bytes, limits),
        Format::Hdr => hdr::decode(&source.bytes, limits),
        other => Err(Refusal::Unsupported(format!(
            "{} needs OpenImageIO",
            other.name()
        ))),
    }
}

/// The last defence: a decoder that panics has met a damaged file.
fn caught<T>(
    f: impl FnOnce() -> std::result::Result<T, Refusal>,
) -> std::result::Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(f)).unwrap_or_else(|_| Err("damaged: the decoder gave up".into()))
}

/// Another decoder for what ours do not know.
#[cfg(feature = "oiio")]
fn elsewhere(
    source: &Source,
    what: String,
    options: &ReadOptions,
    wanted: Wanted,
) -> std::result::Result<Raster, Refusal> {
    let told = told(
        source,
        what.clone(),
        options,
        Ask::Pixels {
            wanted,
            window: options.window,
        },
    );
    match told.map_err(|e| e.after(&what))? {
        Told::Raster(raster) => Ok(oiio::associated(raster, source)),
        Told::Shape(_) => Err("OpenImageIO gave no pixels".into()),
    }
}

/// What the other decoder says of a header.
#[cfg(feature = "oiio")]
fn header_elsewhere(
    path: &Path,
    what: String,
    options: &ReadOptions,
) -> Result<(Header, CameraNotes)> {
    let source = Source::open(path, &options.limits)?;
    let told = told(&source, what, options, Ask::Header).map_err(|e| Error::file(path, e))?;
    let Told::Shape(Shape {
        width,
        height,
        names,
        sample,
        ..
    }) = told
    else {
        return Err(Error::file(path, "OpenImageIO gave no header"));
    };
    let bits = 8 * Sample::bytes(sample);
    let header = Header {
        format: source.format,
        width,
        height,
        channels: names,
        bits,
        ..Header::default()
    };
    Ok((header, camera_notes(&source)))
}

#[cfg(feature = "oiio")]
fn told(
    source: &Source,
    what: String,
    options: &ReadOptions,
    ask: Ask,
) -> std::result::Result<Told, Refusal> {
    match options.fallback {
        Fallback::Nothing => Err(Refusal::Unsupported(what)),
        Fallback::Worker => worker::ask(source, &options.limits, false, ask),
        Fallback::StrictWorker => worker::ask(source, &options.limits, true, ask),
        Fallback::InProcess(linked) => (linked.0)(source, &options.limits, ask),
    }
}

/// Every pixel by OpenImageIO, even those that ours could read.
#[cfg(feature = "oiio")]
fn read_by<P: FromFile>(
    fallback: Fallback,
    path: &Path,
    options: &ReadOptions,
) -> Result<Image<P>> {
    let source = Source::open(path, &options.limits)?;
    let options = ReadOptions {
        fallback,
        ..options.clone()
    };
    let raster = elsewhere(&source, String::new(), &options, P::WANTED);
    Picture::of(raster, &source, &options.limits, P::WANTED)?.into_image()
}

/// Reads a picture through the OpenImageIO worker, even one that the Rust decoders could read: for comparisons.
///
/// # Errors
/// As [`read_with`].
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub fn read_in_worker<P: FromFile>(
    path: impl AsRef<Path>,
    options: &ReadOptions,
) -> Result<Image<P>> {
    read_by(Fallback::Worker, path.as_ref(), options)
}

/// Without OpenImageIO there is no other decoder.
#[cfg(not(feature = "oiio"))]
fn elsewhere(
    _: &Source,
    what: String,
    _: &ReadOptions,
    _: Wanted,
) -> std::result::Result<Raster, Refusal> {
    Err(Refusal::Unsupported(format!(
        "{what} (petcomp was built without OpenImageIO)"
    )))
}

/// Without OpenImageIO there is no other decoder.
#[cfg(not(feature = "oiio"))]
fn header_elsewhere(path: &Path, what: String, _: &ReadOptions) -> Result<(Header, CameraNotes)> {
    Err(Error::file(
        path,
        format!("{what} (petcomp was built without OpenImageIO)"),
    ))
}
