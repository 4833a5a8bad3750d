//! What the camera wrote beside the pixels: which way up, and how wide the lens was.

use super::orient::Orientation;
use exif::{Exif, In, Tag};

/// The part of the EXIF data that means something here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CameraNotes {
    pub(super) orientation: Orientation,
    /// Focal length that would give the same view on 36 x 24 mm film, millimetres.
    pub(super) focal_35mm: Option<f64>,
}

impl Default for CameraNotes {
    fn default() -> Self {
        Self { orientation: Orientation(1), focal_35mm: None }
    }
}

impl CameraNotes {
    /// The notes in a JPEG, TIFF or PNG file. A photo without notes, or with damaged ones, is as good as another.
    pub(super) fn of_file(bytes: &[u8]) -> Self {
        let mut cursor = std::io::Cursor::new(bytes);
        match exif::Reader::new().read_from_container(&mut cursor) {
            Ok(exif) => Self::of(&exif),
            Err(_) => Self::default(),
        }
    }

    /// A TIFF says that its colours are multiplied by alpha (TIFF 6.0, `ExtraSamples` = 1).
    #[cfg(feature = "oiio")]
    pub(super) fn has_associated_alpha(tiff: &[u8]) -> bool {
        const EXTRA_SAMPLES: Tag = Tag(exif::Context::Tiff, 338);
        let exif = exif::Reader::new().read_from_container(&mut std::io::Cursor::new(tiff));
        let extra = exif.ok().and_then(|e| e.get_field(EXTRA_SAMPLES, In::PRIMARY)?.value.get_uint(0));
        extra == Some(1)
    }

    fn of(exif: &Exif) -> Self {
        let number = |tag| exif.get_field(tag, In::PRIMARY).and_then(|f| f.value.get_uint(0));
        let orientation = number(Tag::Orientation).and_then(|v| u8::try_from(v).ok()).unwrap_or(1);
        let focal = number(Tag::FocalLengthIn35mmFilm).filter(|&mm| mm > 0);
        Self { orientation: Orientation(orientation), focal_35mm: focal.map(f64::from) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_notes_are_no_notes() {
        assert_eq!(CameraNotes::of_file(b"\xff\xd8\xff\xe1\x00\x08Exif\0\0II"), CameraNotes::default());
        assert_eq!(CameraNotes::of_file(b""), CameraNotes::default());
    }
}
