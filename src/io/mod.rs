//! Input and output: the only place that opens pictures, and the only one that calls C++.
//!
//! A picture is read by its content, not by its name, and becomes the pixel type that the caller
//! requests:
//!
//! ```
//! use petcomp::{Image, LinearRgb, io};
//!
//! let folder = tempfile::tempdir().unwrap();
//! let path = folder.path().join("grey.exr");
//! io::write(&path, &Image::filled(4, 3, LinearRgb::grey(0.25)))?;
//! let picture: Image<LinearRgb> = io::read(&path)?;
//! assert_eq!(picture[(3, 2)], LinearRgb::grey(0.25));
//! # Ok::<(), petcomp::Error>(())
//! ```
//!
//! | samples of the file | colour becomes | alpha | [`Coverage`](crate::Coverage) |
//! | --- | --- | --- | --- |
//! | integers (PNG, JPEG, HEIC, TIFF) | decoded with the exact sRGB curve, or by the gamma that a PNG states | straight unless a TIFF states otherwise | code / full scale, never decoded |
//! | half and float (EXR, TIFF, HDR) | treated as scene-linear Rec. 709 | EXR premultiplied, TIFF as it states | as it is |
//!
//! Premultiplication happens here, in linear light. A fourth sample that a TIFF does not call alpha
//! (`ExtraSamples` 0) is left out with a warning. The orientation noted by a camera is applied. An
//! EXR is cropped or padded with transparent black (a film passes all light there) from its data
//! window to its display window ([`Window`] keeps the former), and converted if it names other
//! primaries. A colour profile (ICC) of primaries and curves, such as Display P3 or Adobe RGB, is
//! applied to display codes, as are code points of Rec. 709, Rec. 2020 and Display P3 with the
//! curve of sRGB or none, and a camera's word (EXIF) for Adobe RGB in a JPEG or TIFF without
//! profile; others are named in a warning and the codes treated as sRGB. Inks (CMYK) are
//! multiplied; CIELab is refused. Samples that are infinite or NaN are counted in a warning, and
//! become codes of 0 or full scale where integers are written.
//!
//! # What holds for untrusted files
//!
//! No file crashes petcomp, hangs it, exhausts the machine's memory or leads out of its folder;
//! what can be read is read correctly, what cannot is named in one line.
//!
//! * **What is opened.** Regular files only, by content and not by name: EXR, PNG, JPEG, HEIC,
//!   TIFF, Radiance HDR; DPX and Cineon only under their own names.
//! * **What a file may ask for** is in [`Limits`], and checked before pixels are touched, in
//!   arithmetic that cannot wrap: by default 32,768 pixels along a side, 128 Mi in all, 64
//!   channels, 1 GiB decoded, 10,000 times the file above 64 MiB, 64 MiB that is not pixels. Memory
//!   that the system does not give is not attempted.
//! * **Who decodes.** Decoders in Rust, in this process; one that panics has met a damaged file.
//!   What they do not know goes to OpenImageIO, HEIC to libheif, in a worker process, which gets the
//!   file's bytes through a socket and gives samples through a pipe. It may open no file (Landlock,
//!   seccomp, file size 0), start nothing but threads, connect nowhere, has memory for the current
//!   file only, and is killed when it takes more than [`Limits::seconds`]. A file on which two
//!   workers die is named with the signal. The worker is not trusted either.
//! * **What is written** goes to a temporary file beside its place, is synced, and moved there:
//!   whole or not at all. (The samples of a dataset are synced many at once, after they are moved;
//!   what a power cut tears of the last ones is made again.) A link in its place is replaced, not
//!   followed, a file gives its permissions, a device or a pipe is refused; `refuse_links` keeps
//!   outputs in their folder. No metadata of an input gets into an output, so neither positions
//!   (GPS) nor serial numbers do; keyers alone keep where an EXR lies and the shape of its pixels.
//! * **Where a document leads.** A path in a document that may come from anywhere (journal and
//!   manifest of a dataset or an asset folder, label, scene, scene for another renderer) is looked
//!   for in the folder of that document alone: [`inside`] refuses `..`, links that lead out, and
//!   all but regular files. Trusted are documents that people write for themselves and that name
//!   files elsewhere on purpose: recipes (`assets`, `backgrounds`, `environment.files`), lists of
//!   photos, `data.yaml` and the lists it names. What they name must be regular files within the
//!   limits too. Files that petcomp appends to (`.lock`, `index.jsonl`, `.runs.jsonl`) are refused
//!   where a link is in their place.
//! * **Documents** (JSON, TOML) are by default at most 16 MiB and nested 64 deep, without duplicate
//!   keys or numbers that are not finite; a mistake is named with its line.
//!
//! Not guaranteed: that decoders have no bugs (`oiio::read` and `Fallback::InProcess` let
//! OpenImageIO's into this process, and Debian does not fix them), that a kernel without Landlock
//! or seccomp has an equal sandbox (one warning reports it; [`Fallback::StrictWorker`] refuses),
//! that the stages behind reading fit into any memory, or anything against a person with an account
//! on the machine. Wrong pixels out of a JPEG or HEIC that is damaged in the middle, with its end
//! in place, cannot be distinguished from real ones.

mod codec;
mod decode;
mod document;
#[doc(hidden)]
pub mod exr;
mod foreign;
mod format;
mod fs;
#[cfg(feature = "fuzzing")]
mod fuzz;
mod header;
mod limits;
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub mod oiio;
mod options;
mod picture;
mod read;
mod source;
#[cfg(feature = "oiio")]
mod worker;
mod write;

#[doc(hidden)]
pub use codec::FromFile;
pub(crate) use codec::channels::{TRANSMITTANCE, VIEW_TRANSMITTANCE};
pub use codec::codes::Bits;
#[doc(hidden)]
pub use codec::codes::ToFile;
pub use codec::exr::Compression;
#[doc(hidden)]
pub use codec::jpeg::{Chroma, through_jpeg};
#[cfg(feature = "pipeline")]
pub(crate) use document::parse_toml;
#[doc(hidden)]
pub use document::{
    Override, from_json, from_overrides, has_extension, read_json, read_text, read_toml,
    write_json, write_text, write_toml,
};
pub(crate) use document::{
    from_table, from_table_with, parse_json, parse_toml_with, read_bytes, read_json_data,
    suggestion,
};
pub use document::{read_document, write_document};
#[doc(hidden)]
pub use format::Format;
#[doc(hidden)]
pub use fs::{
    Checksum, absolute, below, check_distinct, check_folder_of, copy, create_folder, entries,
    inside, path_text, relative, relative_on_disk,
};
pub(crate) use fs::{
    Syncing, absolute_folder, files_below, is_apple_double, length_inside, natural_key, open_own,
    real_path, refuse_foreign, refuse_links, stem_text, sync_file_system, with_last_step,
    write_through,
};
pub use header::Header;
#[doc(hidden)]
pub use header::{Canvas, Window};
pub(crate) use limits::machine_bytes;
pub use limits::{LimitOverride, Limits};
#[doc(hidden)]
pub use options::Fallback;
pub use options::ReadOptions;
#[doc(hidden)]
pub use picture::Picture;
#[cfg(feature = "pipeline")]
pub(crate) use read::read_checked;
#[doc(hidden)]
pub use read::{check_square_pixels, pictures_at_once, read_format};
pub use read::{read, read_header, read_with};
#[doc(hidden)]
pub use write::jpeg_bytes;
pub use write::{WriteOptions, write, write_with};

#[cfg(feature = "oiio")]
#[doc(hidden)]
pub use read::read_in_worker;
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub use worker::serve as serve_worker;
#[cfg(feature = "oiio")]
#[doc(hidden)]
pub use worker::worker_version;

#[cfg(feature = "fuzzing")]
pub(crate) use fuzz::header_of;
#[cfg(all(feature = "fuzzing", feature = "oiio"))]
pub(crate) use fuzz::is_worker_response;
