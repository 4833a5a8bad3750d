//! The kind of a file, by its first bytes or its extension.

use std::path::Path;

/// The kinds of picture files that are read and written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: scene-linear half or float, any number of named channels.
    Exr,
    /// PNG: 8 or 16 bits, display-encoded.
    #[default]
    Png,
    /// JPEG: 8 bits, display-encoded, no alpha.
    Jpeg,
    /// TIFF: 8 or 16 bits display-encoded, half or float scene-linear.
    Tiff,
    /// Radiance RGBE (`.hdr`): scene-linear.
    Hdr,
    /// HEIF, which phones write as HEIC: 8 to 16 bits, display-encoded; through libheif, read only.
    Heif,
    /// DPX film scans; through OpenImageIO only, read only.
    Dpx,
    /// Cineon film scans; through OpenImageIO only, read only.
    Cineon,
}

/// First bytes of each kind, and their position.
const MAGIC: [(usize, &[u8], Format); 16] = [
    (0, b"\x76\x2f\x31\x01", Format::Exr),
    (0, b"\x89PNG\r\n\x1a\n", Format::Png),
    (0, b"\xff\xd8\xff", Format::Jpeg),
    (0, b"II*\0", Format::Tiff),
    (0, b"MM\0*", Format::Tiff),
    (0, b"II+\0", Format::Tiff),
    (0, b"MM\0+", Format::Tiff),
    (0, b"#?RADIANCE", Format::Hdr),
    (0, b"#?RGBE", Format::Hdr),
    (0, b"SDPX", Format::Dpx),
    (0, b"XPDS", Format::Dpx),
    (0, b"\x80\x2a\x5f\xd7", Format::Cineon),
    (0, b"\xd7\x5f\x2a\x80", Format::Cineon),
    (4, b"ftypheic", Format::Heif),
    (4, b"ftypheix", Format::Heif),
    (4, b"ftypmif1", Format::Heif),
];

impl Format {
    /// The kind of a file from its first bytes.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        MAGIC
            .iter()
            .find(|&&(at, magic, _)| begins_at(bytes, at, magic))
            .map(|&(.., format)| format)
    }

    /// The kind for an extension, ignoring case; new files are written as this kind.
    pub fn from_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "tif" | "tiff" => Some(Self::Tiff),
            "hdr" | "pic" => Some(Self::Hdr),
            "dpx" => Some(Self::Dpx),
            "cin" => Some(Self::Cineon),
            "heic" | "heif" | "hif" => Some(Self::Heif),
            _ => None,
        }
    }

    /// Its name, as spelled by OpenImageIO for the corresponding reader.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exr => "openexr",
            Self::Png => "png",
            Self::Jpeg => "jpeg",
            Self::Tiff => "tiff",
            Self::Hdr => "hdr",
            Self::Dpx => "dpx",
            Self::Cineon => "cineon",
            Self::Heif => "heif",
        }
    }

    /// The library that decodes what our decoders do not support.
    pub(super) fn library(self) -> &'static str {
        match self {
            Self::Heif => "libheif",
            _ => "OpenImageIO",
        }
    }

    /// The kind with this [`name`](Self::name).
    #[cfg(feature = "oiio")]
    pub(super) fn from_name(name: &str) -> Option<Self> {
        MAGIC
            .iter()
            .map(|&(.., format)| format)
            .find(|f| f.name() == name)
    }
}

/// Whether a file has certain bytes at a position.
pub(super) fn begins_at(file: &[u8], at: usize, bytes: &[u8]) -> bool {
    file.get(at..).is_some_and(|rest| rest.starts_with(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_and_the_extension_is_only_a_hint() {
        assert_eq!(
            Format::from_bytes(b"\x89PNG\r\n\x1a\n...."),
            Some(Format::Png)
        );
        assert_eq!(
            Format::from_bytes(b"\0\0\0\x1cftypheic\0\0\0\0"),
            Some(Format::Heif)
        );
        assert_eq!(Format::from_bytes(b"hello"), None);
        assert_eq!(
            Format::from_extension(Path::new("a/b.TIFF")),
            Some(Format::Tiff)
        );
        assert_eq!(Format::from_extension(Path::new("a/b")), None);
    }
}
