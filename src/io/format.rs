//! Which kind of file it is, by its first bytes or its extension.

use std::path::Path;

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
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        MAGIC
            .iter()
            .find(|(magic, _)| bytes.starts_with(magic))
            .map(|&(_, format)| format)
    }

    /// The kind that an extension promises, in any case; what a new file is written as.
    pub(super) fn from_extension(path: &Path) -> Option<Self> {
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

    /// Its name, as OpenImageIO spells its reader.
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
    pub(super) fn from_name(name: &str) -> Option<Self> {
        MAGIC
            .iter()
            .map(|&(_, format)| format)
            .find(|f| f.name() == name)
    }
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
        assert_eq!(Format::from_bytes(b"hello"), None);
        assert_eq!(
            Format::from_extension(Path::new("a/b.TIFF")),
            Some(Format::Tiff)
        );
        assert_eq!(Format::from_extension(Path::new("a/b")), None);
    }
}
