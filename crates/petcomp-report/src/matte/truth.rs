//! Photos with known mattes, in the format of the sample world.

use crate::files::json_files;
use petcomp::color::{linear_to_srgb, srgb_to_linear};
use petcomp::{Coverage, Error, Image, LinearRgb, Result, io};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The largest value of a photo's 8 bits.
const MAX_CODE: f32 = 255.0;

/// A photo and everything that its renderer knows about it; all pictures are scene-linear and of
/// the same size.
pub(crate) struct Known {
    pub(crate) name: String,
    pub(crate) photo: Image<LinearRgb>,
    /// Premultiplied foreground F.
    pub(crate) foreground: Image<LinearRgb>,
    /// Transmittance T as seen on a screen under the object, 1 outside the object.
    pub(crate) transmittance: Image<LinearRgb>,
    /// View transmittance V, 1 outside the object.
    pub(crate) view: Image<LinearRgb>,
    /// The empty screen K.
    pub(crate) screen: Image<LinearRgb>,
    pub(crate) mask: Image<Coverage>,
    /// Left, top, right and bottom of the outline, pixels.
    pub(crate) box_px: [f64; 4],
    pub(crate) noise: PhotoNoise,
    /// Colour of the screen's paint.
    pub(crate) paint: LinearRgb,
}

/// The paints of the sample world's two screens.
const GREEN_PAINT: LinearRgb = LinearRgb::new(0.045, 0.42, 0.085);
const BLUE_PAINT: LinearRgb = LinearRgb::new(0.03, 0.095, 0.52);

#[derive(Deserialize)]
struct TruthFile {
    photos: Vec<TruthRecord>,
}

#[derive(Deserialize)]
struct TruthRecord {
    name: String,
    bbox_px: [f64; 4],
    files: TruthPaths,
    sensor: PhotoNoise,
    screen: ScreenPaint,
}

#[derive(Deserialize)]
struct ScreenPaint {
    albedo_linear: [f32; 3],
}

#[derive(Deserialize)]
struct TruthPaths {
    photo_png: PathBuf,
    foreground: PathBuf,
    transmittance: PathBuf,
    transmittance_view: PathBuf,
    mask: PathBuf,
    screen_plate: PathBuf,
}

/// Sensor noise: the variance of a value is `shot^2 * value + read^2`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct PhotoNoise {
    pub(crate) shot: f64,
    pub(crate) read: f64,
}

impl PhotoNoise {
    fn deviation(&self, value: f32) -> f64 {
        (self.shot * self.shot * f64::from(value) + self.read * self.read).sqrt()
    }

    /// A value as a sensor records it, in 8 bits; `normal` is a normal number.
    fn recorded(&self, value: f32, normal: f64) -> f32 {
        let noisy = value + (self.deviation(value) * normal) as f32;
        in_eight_bits(noisy)
    }
}

/// A value as a camera of 8 bits stores it.
pub(crate) fn in_eight_bits(value: f32) -> f32 {
    let code = MAX_CODE * linear_to_srgb(value.clamp(0.0, 1.0));
    srgb_to_linear(code.round() / MAX_CODE)
}

/// The unread records of a folder, by file name.
pub(crate) struct Truths {
    folder: PathBuf,
    records: Vec<TruthRecord>,
}

impl Truths {
    /// Finds the records (`*.json`) of a folder.
    pub(crate) fn in_folder(folder: &Path) -> Result<Self> {
        let mut records = Vec::new();
        for path in json_files(folder)? {
            records.extend(io::read_json::<TruthFile>(&path)?.photos);
        }
        if records.is_empty() {
            return Err(Error::file(
                folder,
                "no photos with truth (*.json), expected those of the sample world",
            ));
        }
        Ok(Self {
            folder: folder.into(),
            records,
        })
    }

    pub(crate) fn len(&self) -> usize {
        self.records.len()
    }

    /// Reads photo `i`.
    pub(crate) fn read(&self, i: usize) -> Result<Known> {
        let record = &self.records[i];
        let files = &record.files;
        let mask: Image<Coverage> = io::read(io::inside(&self.folder, &files.mask)?)?;
        Ok(Known {
            name: record.name.clone(),
            photo: self.read_color(&files.photo_png)?,
            foreground: self.read_color(&files.foreground)?,
            transmittance: self
                .read_color(&files.transmittance)?
                .zip_map(&mask, one_outside),
            view: self.read_view(&files.transmittance_view)?,
            screen: self.read_color(&files.screen_plate)?,
            mask,
            box_px: record.bbox_px,
            noise: record.sensor,
            paint: record.screen.albedo_linear.into(),
        })
    }

    fn read_view(&self, name: &Path) -> Result<Image<LinearRgb>> {
        // Linear in 8 bits, like stored coverage and unlike colour.
        Ok(self.read_color(name)?.map(|p| p.map(linear_to_srgb)))
    }

    fn read_color(&self, name: &Path) -> Result<Image<LinearRgb>> {
        io::read(io::inside(&self.folder, name)?)
    }
}

/// Transmittance, blended with 1 where the object does not cover the pixel.
fn one_outside(transmittance: LinearRgb, coverage: Coverage) -> LinearRgb {
    transmittance.map(|t| 1.0 + coverage.0.min(1.0) * (t - 1.0))
}

impl Known {
    /// The empty screen painted green where it is blue, and blue where it is green, under the same
    /// light.
    pub(super) fn other_screen(&self) -> Image<LinearRgb> {
        let other = if self.paint.g > self.paint.b {
            BLUE_PAINT
        } else {
            GREEN_PAINT
        };
        let change = LinearRgb::new(
            other.r / self.paint.r,
            other.g / self.paint.g,
            other.b / self.paint.b,
        );
        self.screen.map(|k| k * change)
    }

    /// The object on another screen: `F + T K` with sensor noise, in 8 bits.
    pub(crate) fn on(&self, screen: &Image<LinearRgb>, seed: u64) -> Image<LinearRgb> {
        let mut draw = super::normal(seed);
        let mut seen = self.foreground.clone();
        let behind = self.transmittance.pixels().iter().zip(screen.pixels());
        for (pixel, (t, k)) in seen.pixels_mut().iter_mut().zip(behind) {
            *pixel = (*pixel + *t * *k).map(|v| self.noise.recorded(v, draw()));
        }
        seen
    }
}
