//! Photos of an object on a luminous display, as a list names them.

use crate::bounds::SURFACE;
use crate::capture::Display;
use crate::error::{Error, Result};
use crate::io;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The photos of a capture in addition to that of the entry, and the display that showed the frames.
///
/// ```toml
/// [[photos]]
/// file = "IMG_0001.jpg"       # any of the photos; the cut-out is called so
/// asset = "bottle_01"
/// class = "cap"
/// thickness = 0.06
/// [photos.captured]
/// photos = ["IMG_0002.jpg"]   # the others, in any order
/// display = "frames/display.toml"
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureEntry {
    /// The other photos of the object, in any order. In a list: relative to it.
    pub photos: Vec<PathBuf>,
    /// Photos of the same frames without the object, from the same place. Default: none; the empty
    /// display is fitted to the part of it that is seen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub empty: Vec<PathBuf>,
    /// What `petcomp capture frames` wrote about the display. Default: `display.toml` beside the
    /// photo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub display: Option<PathBuf>,
    /// Width of the whole picture on the display, metres. Default: that of `display.toml`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
}

/// Name of the file about a display.
const DISPLAY: &str = "display.toml";

impl CaptureEntry {
    /// # Errors
    /// [`Error::Value`] for a capture without a second photo, or a width that no display has.
    pub(super) fn check(&self) -> Result<()> {
        if self.photos.is_empty() {
            let what = "no second photo, expected at least one of a black and one of a white frame";
            return Err(Error::value("captured.photos", what));
        }
        self.width
            .map_or(Ok(()), |width| SURFACE.check("captured.width", width))
    }

    /// Its pictures, those of the empty display too.
    pub(super) fn pictures(&self) -> impl Iterator<Item = &Path> {
        let pictures = self.photos.iter().chain(&self.empty);
        pictures.map(PathBuf::as_path)
    }

    /// The same with its paths relative to a list in this folder.
    pub(super) fn located(self, locate: impl Fn(PathBuf) -> PathBuf) -> Self {
        let all = |paths: Vec<PathBuf>| paths.into_iter().map(&locate).collect();
        Self {
            photos: all(self.photos),
            empty: all(self.empty),
            display: self.display.map(&locate),
            width: self.width,
        }
    }

    /// The file about the display of a photo.
    pub(super) fn display_file(&self, photo: &Path) -> PathBuf {
        let display = self.display.clone();
        display.unwrap_or_else(|| photo.with_file_name(DISPLAY))
    }

    /// The display, and its width, metres.
    ///
    /// # Errors
    /// Those of reading `display.toml`; [`Error::Value`] (`captured.width`) where nothing tells the
    /// width.
    pub(super) fn display(&self, beside: &Path) -> Result<(Display, f64)> {
        let path = self.display_file(beside);
        let display: Display = io::read_toml(&path)?;
        display.check().map_err(|e| e.in_file(&path))?;
        let width = self.width.or(display.width).ok_or_else(|| {
            let what = format!(
                "missing, expected the measured width of the whole picture on the display, metres: here, as \
                 --display-width, or in {}",
                path.display()
            );
            Error::value("captured.width", what)
        })?;
        Ok((display, width))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_display_has_a_width_or_says_that_it_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.jpg");
        let told = |text: &str, width| {
            std::fs::write(folder.path().join("display.toml"), text).unwrap();
            let entry = CaptureEntry {
                width,
                ..CaptureEntry::default()
            };
            entry
                .display(&photo)
                .map(|(_, width)| width)
                .map_err(|e| e.to_string())
        };
        assert_eq!(told("size_px = [640, 400]\nwidth = 0.3\n", None), Ok(0.3));
        assert_eq!(
            told("size_px = [640, 400]\nwidth = 0.3\n", Some(0.2)),
            Ok(0.2)
        );
        let missing = told("size_px = [640, 400]\n", None).unwrap_err();
        assert!(missing.starts_with("captured.width: missing"), "{missing}");
        assert!(missing.contains("--display-width"), "{missing}");
        let small = told("size_px = [64, 400]\n", Some(0.2)).unwrap_err();
        assert!(small.contains("display.toml: size_px: 64"), "{small}");
        let alone = CaptureEntry::default().check().unwrap_err().to_string();
        assert!(
            alone.starts_with("captured.photos: no second photo"),
            "{alone}"
        );
    }
}
