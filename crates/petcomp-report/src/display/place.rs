//! Bottles photographed on a display and over new backgrounds: the files of a place.

use nalgebra::{Matrix3, RowVector3};
use petcomp::color::linear_to_srgb;
use petcomp::geom::Homography;
use petcomp::io;
use petcomp::{Coverage, Error, Image, LinearRgb, Result, Roi};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// New backgrounds, by the names of their files.
pub(super) const BACKGROUNDS: [&str; 5] = ["checker", "text", "noise", "bottle", "plain"];

/// A room with a display and a camera above it.
#[derive(Deserialize)]
pub(super) struct Place {
    #[serde(skip)]
    folder: PathBuf,
    light: String,
    /// Width and height of photos.
    pub(super) view_px: [usize; 2],
    /// Width and height of the pictures that the display shows.
    pub(super) display_px: [u32; 2],
    /// Width and height of the display, metres.
    pub(super) display_m: [f64; 2],
    /// Maps photos of the view to the display, pixels.
    display_from_photo: [[f64; 3]; 3],
    /// Margin by which photos of painted screens are larger, on every side, pixels.
    paint_margin_px: usize,
    /// Factors of the photos' exposures, by what the display showed or the screen was painted.
    gain: BTreeMap<String, f32>,
    pub(super) bottles: Vec<Bottle>,
}

/// A bottle on the display.
#[derive(Deserialize)]
pub(super) struct Bottle {
    name: String,
    colour: String,
    pub(super) with_stripes: bool,
    /// Left, top, right and bottom of its pictures in the view.
    pub(super) crop_px: [usize; 4],
}

impl Place {
    /// The places of a folder, by name.
    ///
    /// # Errors
    /// A folder without places, or records that cannot be read.
    pub(super) fn all_in(folder: &Path) -> Result<Vec<Self>> {
        let entries = io::entries(folder)?;
        let mut folders: Vec<PathBuf> = entries.iter().map(DirEntry::path).collect();
        folders.retain(|path| path.join(RECORD).is_file());
        folders.sort();
        if folders.is_empty() {
            let what = "no places (*/place.json), expected those of the sample world's displays";
            return Err(Error::file(folder, what));
        }
        folders.into_iter().map(Self::open).collect()
    }

    fn open(folder: PathBuf) -> Result<Self> {
        let place: Self = io::read_json(folder.join(RECORD))?;
        Ok(Self { folder, ..place })
    }

    /// The region of a bottle in photos of painted screens.
    pub(super) fn in_painted(&self, bottle: &Bottle) -> Roi {
        let [x0, y0, x1, y1] = bottle.crop_px;
        Roi {
            x: self.paint_margin_px,
            y: self.paint_margin_px,
            width: x1 - x0,
            height: y1 - y0,
        }
    }

    /// Maps photos of the view to the display, pixels.
    pub(super) fn display_from_photo(&self) -> Homography {
        let rows = self.display_from_photo.map(RowVector3::from);
        Homography(Matrix3::from_rows(&rows))
    }

    /// Name of a bottle among those of all places.
    pub(super) fn name_of(&self, bottle: &Bottle) -> String {
        format!("{}/{}", self.light, bottle.name)
    }

    /// The display without a bottle, for the whole view.
    pub(super) fn empty(&self, picture: &str) -> Result<Image<LinearRgb>> {
        let ending = if BACKGROUNDS.contains(&picture) {
            "png"
        } else {
            "jpg"
        };
        io::read(self.folder.join(format!("empty_{picture}.{ending}")))
    }

    /// A photo of a bottle, by what the display showed or the screen was painted.
    pub(super) fn photo(&self, bottle: &Bottle, shown: &str) -> Result<Image<LinearRgb>> {
        io::read(self.folder.join(format!("{}_{shown}.jpg", bottle.name)))
    }

    /// A bottle over a background in reality: without noise, black away from the bottle.
    pub(super) fn reality(&self, bottle: &Bottle, background: &str) -> Result<Image<LinearRgb>> {
        io::read(
            self.folder
                .join(format!("{}_over_{background}.png", bottle.name)),
        )
    }

    /// Coverage by a bottle.
    pub(super) fn mask(&self, bottle: &Bottle) -> Result<Image<Coverage>> {
        io::read(self.folder.join(format!("{}_mask.png", bottle.name)))
    }

    /// Displacement of lines of sight on the display, and the contrast of coarse stripes, 0 to 1.
    pub(super) fn true_flow(&self, bottle: &Bottle) -> Result<Image<([f64; 2], f64)>> {
        // Codes rather than light: numbers in 8 bits.
        let file = self.folder.join(format!("{}_flow.png", bottle.name));
        let codes: Image<LinearRgb> = io::read(file)?;
        Ok(codes.map(|light| {
            let [x, y, contrast] = light.channels().map(|v| f64::from(linear_to_srgb(v)));
            let pixels = |share: f64| (255.0 * share - 128.0) / 4.0;
            ([pixels(x), pixels(y)], contrast)
        }))
    }

    /// The paint that is not a bottle's own colour, then the other one.
    pub(super) fn paints(bottle: &Bottle) -> [&'static str; 2] {
        if bottle.colour == "green" {
            ["blue", "green"]
        } else {
            ["green", "blue"]
        }
    }

    /// Factor from the light of a photo on painted ground to that of a photo on the display.
    pub(super) fn exposure_from(&self, paint: &str) -> f32 {
        let of = |name: &str| self.gain.get(name).copied().unwrap_or(1.0);
        of("display") / of(paint)
    }
}

const RECORD: &str = "place.json";
