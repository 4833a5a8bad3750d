//! Picture files, recognised by their first bytes, not by their names.

use super::foreign;
use super::format::Format;
use super::fs::{open_regular, read_to_end, reason};
use super::limits::Limits;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// A complete file in memory, and its kind by its content.
pub(super) struct SourceFile {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    pub(super) format: Format,
}

/// A file opened at its first byte, and its kind by its content.
pub(super) struct OpenedSource {
    pub(super) file: BufReader<File>,
    pub(super) bytes: u64,
    pub(super) format: Format,
}

impl OpenedSource {
    /// Opens a picture file that passes the basic checks: regular, not empty, of a known kind, and
    /// not larger than allowed.
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

impl SourceFile {
    /// Reads a picture file that passes the basic checks.
    pub(super) fn open(path: &Path, limits: &Limits) -> Result<Self> {
        let OpenedSource {
            file,
            bytes,
            format,
        } = OpenedSource::open(path, limits)?;
        let bytes =
            read_to_end(file, bytes, limits.file_bytes).map_err(|e| Error::file(path, e))?;
        Ok(Self {
            path: path.into(),
            bytes,
            format,
        })
    }
}

/// The kinds of file listed in messages.
const EXPECTED_FORMATS: &str = "expected EXR, PNG, JPEG, HEIC, TIFF or HDR";

/// The kind of a file by its first bytes. Film scans are only read under their own extensions:
/// OpenImageIO has to read them, and a file with another extension was not meant to be one.
fn recognized(path: &Path, start: &[u8]) -> std::result::Result<Format, String> {
    if start.is_empty() {
        return Err("empty file (0 bytes), expected a picture".into());
    }
    if let Some((name, advice)) = foreign::recognized(start) {
        return Err(format!("is {name}, {EXPECTED_FORMATS}: {advice}"));
    }
    match Format::from_bytes(start) {
        Some(format) if is_misnamed_scan(path, format) => {
            let name = format.name();
            Err(format!(
                "is {name} with another extension, {EXPECTED_FORMATS}"
            ))
        }
        Some(format) => Ok(format),
        None => Err(format!(
            "not a picture petcomp reads (starts with {}), {EXPECTED_FORMATS}",
            printable_start(start)
        )),
    }
}

fn is_misnamed_scan(path: &Path, format: Format) -> bool {
    let is_scan = matches!(format, Format::Dpx | Format::Cineon);
    is_scan && Format::from_extension(path) != Some(format)
}

/// The first bytes in a form that is safe to print on one line: as text, or as hexadecimal numbers.
fn printable_start(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(12)];
    match std::str::from_utf8(head) {
        Ok(text) if text.chars().all(is_text) => format!("{text:?}"),
        _ => hexadecimal(&head[..head.len().min(8)]),
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digits: Vec<String> = bytes.iter().map(|b| format!("{b:02x}")).collect();
    digits.join(" ")
}

fn is_text(c: char) -> bool {
    !c.is_control() || c.is_ascii_whitespace()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_and_not_read_comes_with_advice() {
        let told = |start: &[u8]| recognized(Path::new("a.jpg"), start).unwrap_err();
        let avif = told(b"\0\0\0\x1cftypavif\0\0\0\0");
        assert_eq!(
            avif,
            "is AVIF, expected EXR, PNG, JPEG, HEIC, TIFF or HDR: convert it to PNG first"
        );
        assert!(told(b"RIFF\x10\0\0\0WEBPVP8 ").starts_with("is WebP, expected EXR"));
        // A TIFF by its first bytes.
        for start in [
            b"II*\0\x10\0\0\0CR\x02\0".as_slice(),
            b"II*\0\x08\x0a\0\0IIIICwaR",
            b"MM\0*\0\0\x0a\x08MMMMRawT",
            b"II\x1a\0\0\0HEAPCCDR",
            b"\0MRM\0\0\0\0",
        ] {
            let raw = told(start);
            assert!(
                raw.ends_with("HDR: develop it to a 16-bit TIFF first"),
                "{raw}"
            );
        }
        // The second one begins with dark pixels.
        for start in [b"II*\0\x08\0\0\0".as_slice(), b"II*\0\x10\0\0\0IIIIIIII"] {
            let tiff = recognized(Path::new("a.jpg"), start);
            assert_eq!(tiff, Ok(Format::Tiff));
        }
    }

    #[test]
    fn the_start_prints_on_one_line() {
        assert_eq!(printable_start(b"hello\nworld, how"), "\"hello\\nworld,\"");
        assert_eq!(printable_start(b"\x00\x01\xff"), "00 01 ff");
    }
}
