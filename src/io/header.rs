//! The description of a picture, without its pixels.

use super::format::Format;
use crate::error::{Error, Result};
use std::path::Path;

/// Which region of an EXR is the picture. Other formats have only one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Window {
    /// The display window: stored pixels outside are cropped, missing ones are transparent black.
    #[default]
    Display,
    /// The data window: everything stored, wherever it is ([`Header::data_at`]).
    Data,
}

/// The plane of an EXR's picture: its position, its pixel aspect, and its display window. Other
/// formats have only the default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Canvas {
    /// Column and row of the picture's first pixel. Default: 0, 0.
    pub at: [i32; 2],
    /// Width of a pixel divided by its height. Default: 1.
    pub pixel_aspect: f32,
    /// The display window if the picture is written as a part of it: column and row of its first
    /// pixel, and its size in columns and rows. Default: that of the picture.
    pub display: Option<([i32; 2], [usize; 2])>,
}

impl Default for Canvas {
    fn default() -> Self {
        Self {
            at: [0; 2],
            pixel_aspect: 1.0,
            display: None,
        }
    }
}

/// How a picture file describes itself; no pixel is decoded.
#[non_exhaustive]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The kind of file, by its content.
    pub format: Format,
    /// Columns of the upright picture, with the camera's orientation applied.
    pub width: usize,
    /// Rows of the upright picture.
    pub height: usize,
    /// Its position and pixel aspect.
    pub canvas: Canvas,
    /// Column and row of the first stored pixel, relative to the picture's first one. Differs from
    /// (0, 0) only in EXR; with several parts, that of the part from which colours are read.
    pub data_at: [i64; 2],
    /// Number of stored columns and rows: those of the picture, except for EXR, whose data window
    /// may differ.
    pub data_size: [usize; 2],
    /// Names of the channels, `R G B A` first if present; with several parts, those of the part
    /// from which colours are read.
    pub channels: Vec<String>,
    /// Names of the parts of a multi-part EXR, starting with the part from which colours are read.
    pub parts: Vec<String>,
    /// Bits per sample: 8 and 16 are display-encoded integers (16 in an EXR: half floats), 32 is
    /// float.
    pub bits: u32,
    /// Focal length that gives the same view on 36 x 24 mm film, millimetres, if the camera
    /// recorded it, or the focal length and the resolution of its sensor. For the picture as it was
    /// taken.
    pub focal_35mm: Option<f64>,
    /// Whether the focal length was computed from the resolution of the sensor, which programs that
    /// resize pictures leave unchanged: it may be wrong by the resizing factor.
    pub focal_by_sensor: bool,
    /// Whether the camera enlarged the centre of its picture, so that its focal length may not be
    /// the picture's.
    pub digital_zoom: bool,
    /// Whether the camera recorded a picture with another aspect ratio: a part was cropped.
    pub cropped: bool,
    /// Whether the camera recorded the size of this picture, or an integer multiple of it, and no
    /// program that edits pictures wrote the file: it was not cropped.
    pub whole: bool,
    /// Whether the stored pixels are rotated or mirrored to make the picture upright.
    pub turned: bool,
    /// Whether the camera recorded Adobe RGB, which applies if the file has no colour profile.
    pub noted_adobe_rgb: bool,
    /// Text attributes in the file, by name.
    pub metadata: Vec<(String, String)>,
}

/// How much the width of a square pixel may differ from its height, relative.
const SQUARE_TOLERANCE: f32 = 1e-3;

impl Header {
    /// Rejects a photo at a path whose pixels are not square, as an EXR may declare: lengths and
    /// angles in it differ from those in its rows and columns.
    ///
    /// # Errors
    /// [`Error::File`] with the shape of its pixels.
    #[doc(hidden)]
    pub fn check_square_pixels(&self, path: impl AsRef<Path>) -> Result<()> {
        let aspect = self.canvas.pixel_aspect;
        if (aspect - 1.0).abs() <= SQUARE_TOLERANCE {
            return Ok(());
        }
        let what = format!(
            "pixels are {aspect} times as wide as high, expected square ones: resample it to square pixels first"
        );
        Err(Error::file(path.as_ref(), what))
    }
}

/// Text attributes by name.
pub(super) type Notes = Vec<(String, String)>;

pub(super) fn note(key: &str, value: &str) -> (String, String) {
    (key.into(), value.into())
}

/// Notes for formats that store a single text: one line `key=value` each.
pub(super) fn lines_of_notes(notes: &[(String, String)]) -> String {
    notes
        .iter()
        .map(|(key, value)| format!("{key}={}\n", value.replace('\n', " ")))
        .collect()
}

/// The inverse of [`lines_of_notes`]; other lines are ignored.
pub(super) fn notes_of_lines(text: &str) -> Notes {
    text.lines()
        .filter_map(|line| line.split_once('='))
        .map(|(key, value)| note(key, value))
        .collect()
}
