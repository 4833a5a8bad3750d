//! Which kind of file it is, by its first bytes, and how it is opened.

use super::limits::{Limits, affordable, at_most};
use crate::work::{self, Kind};
use crate::{Error, Result};
use std::fs::{File, Metadata};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The kinds of picture file that are read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: scene-linear half or float, any number of named channels.
    Exr,
    /// PNG: 8 or 16 bits, display-encoded.
    Png,
    /// JPEG: 8 bits, display-encoded, no alpha.
    Jpeg,
    /// TIFF: 8 or 16 bits display-encoded, half or float scene-linear.
    Tiff,
    /// Radiance RGBE (`.hdr`): scene-linear.
    Hdr,
    /// DPX film scans; through OpenImageIO only, reading only.
    Dpx,
    /// Cineon film scans; through OpenImageIO only, reading only.
    Cineon,
}

/// First bytes of each kind.
const MAGIC: [(&[u8], Format); 13] = [
    (b"\x76\x2f\x31\x01", Format::Exr),
    (b"\x89PNG\r\n\x1a\n", Format::Png),
    (b"\xff\xd8\xff", Format::Jpeg),
    (b"II*\0", Format::Tiff),
    (b"MM\0*", Format::Tiff),
    (b"II+\0", Format::Tiff),
    (b"MM\0+", Format::Tiff),
    (b"#?RADIANCE", Format::Hdr),
    (b"#?RGBE", Format::Hdr),
    (b"SDPX", Format::Dpx),
    (b"XPDS", Format::Dpx),
    (b"\x80\x2a\x5f\xd7", Format::Cineon),
    (b"\xd7\x5f\x2a\x80", Format::Cineon),
];

impl Format {
    /// The kind of a file from its first bytes.
    pub(super) fn of_bytes(bytes: &[u8]) -> Option<Self> {
        MAGIC
            .iter()
            .find(|(magic, _)| bytes.starts_with(magic))
            .map(|&(_, format)| format)
    }

    /// The kind that an extension promises, in any case; what a new file is written as.
    pub(super) fn of_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "tif" | "tiff" => Some(Self::Tiff),
            "hdr" | "pic" => Some(Self::Hdr),
            "dpx" => Some(Self::Dpx),
            "cin" => Some(Self::Cineon),
            _ => None,
        }
    }

    /// The usual name, as OpenImageIO spells its reader.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exr => "openexr",
            Self::Png => "png",
            Self::Jpeg => "jpeg",
            Self::Tiff => "tiff",
            Self::Hdr => "hdr",
            Self::Dpx => "dpx",
            Self::Cineon => "cineon",
        }
    }

    /// The kind whose [`name`](Self::name) it is.
    #[cfg(feature = "oiio")]
    pub(super) fn of_name(name: &str) -> Option<Self> {
        MAGIC
            .iter()
            .map(|&(_, format)| format)
            .find(|f| f.name() == name)
    }
}

/// A whole file in memory, and what its content says it is.
pub(super) struct Source {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    pub(super) format: Format,
}

/// A file that is open at its first byte, and what that says it is.
pub(super) struct Opened {
    pub(super) file: BufReader<File>,
    pub(super) bytes: u64,
    pub(super) format: Format,
}

impl Opened {
    /// Opens a picture file that is worth decoding: regular, not empty, of a known kind, not larger than allowed.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        let (file, bytes) = open_regular(path, (limits.file_bytes, "file_bytes"), "picture")?;
        let mut file = BufReader::new(file);
        let start = file.fill_buf().map_err(|e| Error::file(path, reason(&e)))?;
        let format = recognized(path, start).map_err(|e| Error::file(path, e))?;
        Ok(Self {
            file,
            bytes,
            format,
        })
    }
}

impl Source {
    /// Reads a picture file that is worth decoding.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        let Opened {
            file,
            bytes,
            format,
        } = Opened::open(path, limits)?;
        let bytes = all_of(file, bytes, limits.file_bytes).map_err(|e| Error::file(path, e))?;
        Ok(Self {
            path: path.into(),
            bytes,
            format,
        })
    }
}

/// The kind of a file by its first bytes. Film scans are read only under a name of their own: OpenImageIO has to read
/// them, and what is called otherwise was not meant to be one.
fn recognized(path: &Path, start: &[u8]) -> std::result::Result<Format, String> {
    const EXPECTED: &str = "expected EXR, PNG, JPEG, TIFF or HDR";
    if start.is_empty() {
        return Err("empty file (0 bytes), expected a picture".into());
    }
    match Format::of_bytes(start) {
        Some(format @ (Format::Dpx | Format::Cineon))
            if Format::of_extension(path) != Some(format) =>
        {
            Err(format!(
                "is {} under another name, {EXPECTED}",
                format.name()
            ))
        }
        Some(format) => Ok(format),
        None => Err(format!(
            "not a picture petcomp reads (starts with {}), {EXPECTED}",
            beginning(start)
        )),
    }
}

/// Opens a regular file, and no other: a FIFO would block, a device never ends. Also gives its length. `most` is the
/// largest length, and the name of that limit.
pub(super) fn open_regular(path: &Path, most: (u64, &str), expected: &str) -> Result<(File, u64)> {
    let failed = |e: std::io::Error| Error::file(path, reason(&e));
    // Looked at before it is opened, because opening may wait, and after, because it may be another by then.
    regular(&std::fs::metadata(path).map_err(failed)?, expected)
        .map_err(|e| Error::file(path, e))?;
    let file = File::open(path).map_err(failed)?;
    let meta = file.metadata().map_err(failed)?;
    regular(&meta, expected)
        .and_then(|()| at_most(meta.len(), most.0, "bytes", most.1))
        .map_err(|e| Error::file(path, e))?;
    Ok((file, meta.len()))
}

fn regular(meta: &Metadata, expected: &str) -> std::result::Result<(), String> {
    match (meta.is_dir(), meta.is_file()) {
        (true, _) => Err(format!("is a folder, expected a {expected}")),
        (_, false) => Err(format!("not a regular file, expected a {expected}")),
        _ => Ok(()),
    }
}

/// The bytes of a regular file.
pub(super) fn read_regular(path: &Path, most: (u64, &str), expected: &str) -> Result<Vec<u8>> {
    let (file, bytes) = open_regular(path, most, expected)?;
    all_of(file, bytes, most.0).map_err(|e| Error::file(path, e))
}

/// What is left of a file that had so many bytes when it was opened, and may have grown.
fn all_of(file: impl Read, told: u64, most: u64) -> std::result::Result<Vec<u8>, String> {
    affordable(told)?;
    let mut bytes = Vec::with_capacity(usize::try_from(told).unwrap_or(0));
    file.take(most)
        .read_to_end(&mut bytes)
        .map_err(|e| reason(&e))?;
    work::add_all([(Kind::FilesRead, 1), (Kind::BytesRead, bytes.len() as u64)]);
    Ok(bytes)
}

/// What the system said, without its number and in our spelling.
pub(super) fn reason(e: &std::io::Error) -> String {
    use std::io::ErrorKind as K;
    match e.kind() {
        K::NotFound => "no such file".into(),
        K::PermissionDenied => "permission denied".into(),
        K::NotADirectory => "part of the path is a file, not a folder".into(),
        K::StorageFull => "no space left on the disk".into(),
        _ => {
            let text = e.to_string().to_lowercase();
            text.split(" (os error")
                .next()
                .unwrap_or_default()
                .to_string()
        }
    }
}

/// The first bytes in a form that is safe to print on one line.
fn beginning(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(12)];
    match std::str::from_utf8(head) {
        Ok(text)
            if text
                .chars()
                .all(|c| !c.is_control() || c.is_ascii_whitespace()) =>
        {
            format!("{text:?}")
        }
        _ => head[..head.len().min(8)]
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect::<Vec<_>>()
            .join(" "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_and_the_extension_is_only_a_hint() {
        assert_eq!(
            Format::of_bytes(b"\x89PNG\r\n\x1a\n...."),
            Some(Format::Png)
        );
        assert_eq!(Format::of_bytes(b"hello"), None);
        assert_eq!(
            Format::of_extension(Path::new("a/b.TIFF")),
            Some(Format::Tiff)
        );
        assert_eq!(Format::of_extension(Path::new("a/b")), None);
    }

    #[test]
    fn a_beginning_prints_on_one_line() {
        assert_eq!(beginning(b"hello\nworld, how"), "\"hello\\nworld,\"");
        assert_eq!(beginning(b"\x00\x01\xff"), "00 01 ff");
    }
}
