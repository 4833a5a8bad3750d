//! The description of a picture in front of its pixels.

use super::format::Format;
use crate::error::{Error, Result};
use std::path::Path;

/// Which part of an EXR is the picture. Other formats have only one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Window {
    /// What is meant to be shown: stored pixels outside are cut, missing ones are transparent
    /// black.
    #[default]
    Display,
    /// What is stored, wherever it lies: [`Header::data_at`].
    Data,
}

/// The plane that an EXR's picture lies in: where, of what pixels, and what is shown of it. Other
/// formats have only the default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Canvas {
    /// Column and row of the picture's first pixel. Default: 0, 0.
    pub at: [i32; 2],
    /// Width of a pixel by its height. Default: 1.
    pub pixel_aspect: f32,
    /// The display window of a picture that is written as a part of it: column and row of its
    /// first pixel, its columns and rows. Default: that of the picture.
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

/// How a picture file describes itself; reading it decodes no pixel.
#[non_exhaustive]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The kind of file, by its content.
    pub format: Format,
    /// Columns of the upright picture: the camera's orientation is applied.
    pub width: usize,
    /// Rows of the upright picture.
    pub height: usize,
    /// Where it lies, and of what pixels.
    pub canvas: Canvas,
    /// Column and row of the first stored pixel, seen from the picture's first one. Other than (0,
    /// 0) only in EXR; of several parts that of the one that colours are read from.
    pub data_at: [i64; 2],
    /// Columns and rows that are stored: those of the picture, but for EXR, whose data window may
    /// be any other.
    pub data_size: [usize; 2],
    /// Names of the channels, `R G B A` first if present; of several parts those of the one that
    /// colours are read from.
    pub channels: Vec<String>,
    /// Names of the parts of an EXR that has several, first that of the one that colours are read
    /// from.
    pub parts: Vec<String>,
    /// Bits of a sample: 8 and 16 are display-encoded integers (16 in an EXR: half floats), 32 is
    /// float.
    pub bits: u32,
    /// Focal length that gives the same view on 36 x 24 mm film, millimetres, where the camera
    /// noted it, or the focal length and the resolution of its sensor. Of the picture as it
    /// was taken.
    pub focal_35mm: Option<f64>,
    /// The focal length is by the resolution of the sensor, which programs that resize pictures
    /// leave as it was: it may be wrong by their factor.
    pub focal_by_sensor: bool,
    /// The camera enlarged the middle of its picture, so that its focal length may not be the
    /// picture's.
    pub digital_zoom: bool,
    /// The camera noted a picture of another shape: a part was cut away.
    pub cropped: bool,
    /// The camera noted the size of this picture, or a whole multiple of it, and no program that
    /// edits pictures wrote the file: nothing was cut away.
    pub whole: bool,
    /// The stored pixels are turned or mirrored to make the picture upright.
    pub turned: bool,
    /// The camera noted Adobe RGB, which counts where the file has no colour profile.
    pub noted_adobe_rgb: bool,
    /// Texts that the file carries, by name.
    pub metadata: Vec<(String, String)>,
}

/// By how much the width of a square pixel may differ from its height, as a share.
const SQUARE_TOLERANCE: f32 = 1e-3;

impl Header {
    /// Refuses a photo at a path whose pixels are not square, as an EXR may say: lengths and angles
    /// in it are not those of its rows and columns.
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

/// Named texts.
pub(super) type Notes = Vec<(String, String)>;

pub(super) fn note(key: &str, value: &str) -> (String, String) {
    (key.into(), value.into())
}

/// Notes for formats that keep a single text: a line `key=value` each.
pub(super) fn lines_of_notes(notes: &[(String, String)]) -> String {
    notes
        .iter()
        .map(|(key, value)| format!("{key}={}\n", value.replace('\n', " ")))
        .collect()
}

/// The inverse of [`lines_of_notes`]; other lines are left out.
pub(super) fn notes_of_lines(text: &str) -> Notes {
    text.lines()
        .filter_map(|line| line.split_once('='))
        .map(|(key, value)| note(key, value))
        .collect()
}
