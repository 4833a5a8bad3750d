//! Input and output: the only module that opens pictures, and the only one that calls C++.
//!
//! A picture is recognised by its content, not its name, and is converted to the pixel type that
//! the caller requests:
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
//! Premultiplication happens here, in linear light. A fourth sample that a TIFF does not declare as
//! alpha (`ExtraSamples` 0) is ignored with a warning, and without that tag is straight alpha with
//! a warning. The orientation recorded by a camera is applied. An EXR is cropped or padded with
//! transparent black (a film passes all light there) from its data window to its display window
//! ([`Window`] can keep the former), and converted if it names other primaries. An ICC colour
//! profile with primaries and curves, such as Display P3 or Adobe RGB, is applied to display codes,
//! as are code points of Rec. 709, Rec. 2020 and Display P3 with the curve of sRGB or none, and
//! Adobe RGB as recorded by a camera (EXIF) in a JPEG or TIFF without profile; others are named in
//! a warning and the codes treated as sRGB. Inks (CMYK) are multiplied; CIELab is rejected. Samples
//! that are infinite or NaN are counted in a warning, and become codes of 0 or full scale when
//! integers are written.
//!
//! # Guarantees for untrusted files
//!
//! No file crashes petcomp, hangs it, exhausts the machine's memory or leads out of its folder; a
//! readable file is read correctly, and an unreadable one is reported in one line.
//!
//! * **What is opened.** Regular files only, by content and not by name: EXR, PNG, JPEG, HEIC,
//!   TIFF, Radiance HDR; DPX and Cineon only under their own extensions.
//! * **What a file may demand** is defined by [`Limits`], and checked before pixels are decoded,
//!   with arithmetic that cannot overflow: by default 32,768 pixels per side, 128 Mi in total, 64
//!   channels, 1 GiB decoded, 10,000 times the file size above 64 MiB, 64 MiB of data that is not
//!   pixels. Memory that the system cannot provide is not requested.
//! * **Who decodes.** Decoders in Rust, in this process; a panic in one of them means a damaged
//!   file. Kinds that they do not support go to OpenImageIO, HEIC to libheif, in a worker process,
//!   which receives the file's bytes through a socket and returns samples through a pipe. It cannot
//!   open files (Landlock, seccomp, file size 0), start anything but threads, or connect to
//!   anything, has memory for the current file only, and is killed when it takes longer than
//!   [`Limits::seconds`]. A file on which two workers die is reported with the signal. The worker's
//!   output is not trusted either.
//! * **What is written** goes to a temporary file next to its destination, is synced, and moved
//!   there: completely or not at all. (The samples of a dataset are moved first and then synced
//!   many at once; any of the last ones that a power failure tears are generated again.) A link at
//!   the destination is replaced, not followed, an existing file's permissions are kept, a device
//!   or a pipe is rejected; `refuse_links` keeps outputs in their folder. No metadata of an input
//!   is copied to an output, so neither GPS positions nor serial numbers are; only keyers keep the
//!   position of an EXR and its pixel aspect.
//! * **Where a document leads.** Paths in documents that may come from anywhere (journal and
//!   manifest of a dataset or an asset folder, label, scene, scene for another renderer) are only
//!   searched in the folder of that document: [`inside`] rejects `..`, links that lead out, and
//!   anything but regular files. Trusted are documents that people write for themselves and that
//!   name files elsewhere on purpose: recipes (`assets`, `backgrounds`, `environment.files`), lists
//!   of photos, `data.yaml` and the lists it names. The files that they name must also be regular
//!   and within the limits. Files to which petcomp appends (`.lock`, `index.jsonl`, `.runs.jsonl`)
//!   are rejected if they are links.
//! * **Documents** (JSON, TOML) are by default at most 16 MiB and nested 64 deep, without duplicate
//!   keys or numbers that are not finite; a mistake is reported with its line.
//!
//! Not guaranteed: that decoders have no bugs (`oiio::read` and `Fallback::InProcess` load
//! OpenImageIO's into this process, and Debian does not fix them), that a kernel without Landlock
//! or seccomp has an equivalent sandbox (one warning reports it; [`Fallback::StrictWorker`]
//! refuses), that later stages fit into any memory, or anything against a person with an account on
//! the machine. Wrong pixels from a JPEG or HEIC that is damaged in the middle but has its end
//! cannot be distinguished from real ones.

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
#[doc(hidden)]
pub use document::{
    Override, from_json, from_overrides, has_extension, read_json, read_text, read_toml,
    write_json, write_text, write_toml,
};
#[cfg(feature = "pipeline")]
pub(crate) use document::{check_depth, parse_toml};
pub(crate) use document::{
    from_table, from_table_with, lines, parse_json, parse_toml_with, read_bytes, read_json_data,
    read_marked_text, suggestion,
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
    or_working_folder, real_path, refuse_foreign, refuse_links, remove_if_exists, stem_text, sweep,
    sync_file_system, with_last_step, write_through,
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
