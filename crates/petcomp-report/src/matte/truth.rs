//! Photos with known mattes, as the sample world has them.

use petcomp::Image;
use petcomp::io;
use petcomp::{Coverage, LinearRgb};
use petcomp::{Error, Result};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A photo and all that its renderer knows of it; all pictures are scene-linear and of one size.
pub(crate) struct Known {
    pub(crate) name: String,
    pub(crate) photo: Image<LinearRgb>,
    /// Premultiplied foreground F.
    pub(crate) foreground: Image<LinearRgb>,
    /// Transmittance T as a screen under the object shows it, 1 outside the object.
    pub(crate) transmittance: Image<LinearRgb>,
    /// View transmittance V, 1 outside the object.
    pub(crate) view: Image<LinearRgb>,
    /// The empty screen K.
    pub(crate) screen: Image<LinearRgb>,
    pub(crate) mask: Image<Coverage>,
    /// Left, top, right and bottom of the outline, pixels.
    pub(crate) box_px: [f64; 4],
    pub(crate) noise: SensorNoise,
    /// Colour of the screen's paint.
    pub(crate) paint: LinearRgb,
}

/// The paints of the sample world's two screens.
const PAINTS: [LinearRgb; 2] = [
    LinearRgb::new(0.045, 0.42, 0.085),
    LinearRgb::new(0.03, 0.095, 0.52),
];

#[derive(Deserialize)]
struct TruthFile {
    photos: Vec<Record>,
}

#[derive(Deserialize)]
struct Record {
    name: String,
    bbox_px: [f64; 4],
    files: TruthPaths,
    sensor: SensorNoise,
    screen: Paint,
}

#[derive(Deserialize)]
struct Paint {
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
pub(crate) struct SensorNoise {
    pub(crate) shot: f64,
    pub(crate) read: f64,
}

/// The records of a folder, by file name, still to be read.
pub(crate) struct Truths {
    folder: PathBuf,
    records: Vec<Record>,
}

impl Truths {
    /// Finds the records (`*.json`) of a folder.
    pub(crate) fn in_folder(folder: &Path) -> Result<Self> {
        let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
        let paths =
            entries.map(|entry| entry.map(|e| e.path()).map_err(|e| Error::file(folder, e)));
        let mut paths: Vec<PathBuf> = paths.collect::<Result<_>>()?;
        paths.retain(|path| path.extension().is_some_and(|e| e == "json"));
        paths.sort();
        let documents: Vec<TruthFile> = paths.iter().map(io::read_json).collect::<Result<_>>()?;
        let records: Vec<Record> = documents.into_iter().flat_map(|d| d.photos).collect();
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
        let color = |name: &Path| io::inside(&self.folder, name).and_then(io::read::<LinearRgb>);
        let mask: Image<Coverage> = io::read(io::inside(&self.folder, &record.files.mask)?)?;
        // Linear in 8 bits, which is how coverage is stored and colour is not.
        let view =
            color(&record.files.transmittance_view)?.map(|p| p.map(petcomp::color::linear_to_srgb));
        let inside = |t: LinearRgb, c: Coverage| t.map(|t| 1.0 + c.0.min(1.0) * (t - 1.0));
        Ok(Known {
            name: record.name.clone(),
            photo: color(&record.files.photo_png)?,
            foreground: color(&record.files.foreground)?,
            transmittance: color(&record.files.transmittance)?.zip_map(&mask, inside),
            view,
            screen: color(&record.files.screen_plate)?,
            mask,
            box_px: record.bbox_px,
            noise: record.sensor,
            paint: record.screen.albedo_linear.into(),
        })
    }
}

impl Known {
    /// The empty screen painted green where it is blue, and blue where it is green, under the same light.
    pub(super) fn other_screen(&self) -> Image<LinearRgb> {
        let other = if self.paint.g > self.paint.b {
            PAINTS[1]
        } else {
            PAINTS[0]
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
        for ((pixel, t), k) in seen
            .pixels_mut()
            .iter_mut()
            .zip(self.transmittance.pixels())
            .zip(screen.pixels())
        {
            *pixel = (*pixel + *t * *k).map(|v| {
                let deviation = (self.noise.shot * self.noise.shot * f64::from(v)
                    + self.noise.read * self.noise.read)
                    .sqrt();
                let code = 255.0
                    * petcomp::color::linear_to_srgb(
                        (v + (deviation * draw()) as f32).clamp(0.0, 1.0),
                    );
                petcomp::color::srgb_to_linear(code.round() / 255.0)
            });
        }
        seen
    }
}
