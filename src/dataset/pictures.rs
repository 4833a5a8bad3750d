//! The images of a dataset.

use crate::bounds::Bounds;
use crate::color;
use crate::dataset::paths::create_part_folders;
use crate::dataset::{Entry, Writer};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::io::{self, Chroma, WriteOptions};
use crate::pixel::{PremulRgba, Srgb8};
use crate::scene::{DrawLog, Drawn, Draws, Range};
use crate::stopwatch::Stopwatch;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Writes `images/{train,val}/NNNNNN.png` or `.jpg`, 8-bit sRGB, on black where nothing is behind
/// the objects, and on request also the scene-linear picture as `exr/{train,val}/NNNNNN.exr`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pictures {
    /// Format. Default: `png`.
    pub format: PictureFormat,
    /// Quality of a `jpg`, 1 to 100, drawn for each picture. Default: 95.
    pub jpeg_quality: Range,
    /// Chroma subsampling of a `jpg`, one of these drawn for each picture: `4:4:4`, `4:2:2`, or
    /// `4:2:0`, which most cameras write. Default: none, which is `4:4:4`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jpeg_chroma: Vec<Chroma>,
    /// Also write the scene-linear picture with its alpha. Default: no.
    pub exr: bool,
}

impl Default for Pictures {
    fn default() -> Self {
        Self {
            format: PictureFormat::default(),
            jpeg_quality: Range::fixed(WriteOptions::default().jpeg_quality.into()),
            jpeg_chroma: Vec::new(),
            exr: false,
        }
    }
}

/// Format of the images that trainers read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureFormat {
    /// Lossless.
    #[default]
    Png,
    /// Smaller files.
    Jpg,
}

impl PictureFormat {
    pub(crate) fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpg => "jpg",
        }
    }
}

impl Pictures {
    pub(crate) fn check(&self) -> Result<()> {
        let bounds = Bounds::new(1.0, 100.0, "a JPEG's quality");
        self.jpeg_quality.check_count("jpeg_quality", &bounds)
    }

    fn write_options(&self, draws: &Draws<'_>) -> WriteOptions {
        WriteOptions {
            jpeg_quality: self.quality(draws),
            jpeg_chroma: self.chroma(draws),
            ..WriteOptions::default()
        }
    }

    /// What is drawn for picture `k` of a dataset.
    pub(super) fn drawn(&self, seed: u64, k: u64) -> Vec<Drawn> {
        let log = DrawLog::default();
        if self.format == PictureFormat::Jpg {
            self.write_options(&Draws::new(seed, k).logged(&log));
        }
        log.into_draws()
    }

    /// Picture `k` of a dataset as read from its file: 8-bit sRGB, on black where nothing is behind
    /// the objects, with the losses of a JPEG of its quality and chroma.
    ///
    /// # Errors
    /// [`Error::Value`] for a picture that a JPEG cannot hold, such as one without pixels.
    pub fn shown(&self, frame: &Image<PremulRgba>, seed: u64, k: u64) -> Result<Image<Srgb8>> {
        let codes = color::to_srgb8(&frame.map(|p| p.color()));
        if self.format == PictureFormat::Png {
            return Ok(codes);
        }
        let options = self.write_options(&Draws::new(seed, k));
        let lossy = io::through_jpeg(&codes, options.jpeg_quality, options.jpeg_chroma);
        lossy.ok_or_else(|| {
            let (w, h) = codes.size();
            Error::value(
                "picture",
                format!("{w} x {h} pixels, more than a JPEG can hold"),
            )
        })
    }

    /// For a picture outside a dataset: the middle of the quality range, and the first of the
    /// chroma subsamplings.
    #[doc(hidden)]
    pub fn middle_options(&self) -> WriteOptions {
        WriteOptions {
            jpeg_quality: self.jpeg_quality.middle().min as u8,
            jpeg_chroma: self.jpeg_chroma.first().copied().unwrap_or_default(),
            ..WriteOptions::default()
        }
    }

    /// The quality of a picture of a dataset.
    fn quality(&self, draws: &Draws<'_>) -> u8 {
        self.jpeg_quality.draw_count(draws, "pictures.jpeg_quality") as u8
    }

    /// The chroma subsampling of a picture of a dataset.
    fn chroma(&self, draws: &Draws<'_>) -> Chroma {
        match self.jpeg_chroma.len() {
            0 => Chroma::default(),
            n => self.jpeg_chroma[draws.choose("pictures.jpeg_chroma", n)],
        }
    }

    fn write_displayed(&self, folder: &Path, entry: &Entry<'_>) -> Result<PathBuf> {
        let path = entry.path("images", self.format.extension());
        let mut watch = Stopwatch::start();
        let displayed = entry.sample.frame.map(|p| p.color());
        let options = self.write_options(&Draws::new(entry.seed, entry.k));
        io::write_with(folder.join(&path), &displayed, &options)?;
        watch.lap("encode");
        watch.log(path.display());
        Ok(path)
    }
}

impl Writer for Pictures {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "pictures": self })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        create_part_folders(folder, "images")?;
        if self.exr {
            create_part_folders(folder, "exr")?;
        }
        Ok(())
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let mut paths = vec![self.write_displayed(folder, entry)?];
        if self.exr {
            let path = entry.path("exr", "exr");
            io::write(folder.join(&path), &entry.sample.frame)?;
            paths.push(path);
        }
        Ok(paths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::to_srgb8;
    use crate::pixel::LinearRgb;
    use std::collections::BTreeSet;

    #[test]
    fn quality_is_drawn_for_each_picture() {
        let pictures = Pictures {
            jpeg_quality: Range::new(80.0, 84.0),
            ..Pictures::default()
        };
        let drawn: BTreeSet<u8> = (0..100)
            .map(|k| pictures.quality(&Draws::new(3, k)))
            .collect();
        assert_eq!(drawn, BTreeSet::from([80, 81, 82, 83, 84]));
        assert_eq!(Pictures::default().quality(&Draws::new(3, 0)), 95);
    }

    #[test]
    fn chroma_is_drawn_beside_quality() {
        let mixed = Pictures {
            jpeg_quality: Range::new(80.0, 84.0),
            jpeg_chroma: vec![Chroma::Full, Chroma::Quarter],
            ..Pictures::default()
        };
        let quarters = (0..100).filter(|&k| mixed.chroma(&Draws::new(3, k)) == Chroma::Quarter);
        assert!((30..70).contains(&quarters.count()));
        let of_quality = Pictures {
            jpeg_chroma: vec![],
            ..mixed.clone()
        };
        let of_both = |k| [&mixed, &of_quality].map(|p| p.quality(&Draws::new(3, k)));
        assert!((0..100).map(of_both).all(|[a, b]| a == b));
        let drawn = Pictures {
            format: PictureFormat::Jpg,
            ..mixed.clone()
        };
        let drawn = drawn.drawn(3, 7).into_iter().map(|d| (d.path, d.value));
        let quality = f64::from(mixed.quality(&Draws::new(3, 7)));
        let chroma = f64::from(mixed.chroma(&Draws::new(3, 7)) == Chroma::Quarter);
        assert_eq!(
            Vec::from_iter(drawn),
            [
                ("pictures.jpeg_quality".to_owned(), quality),
                ("pictures.jpeg_chroma".to_owned(), chroma)
            ]
        );
        let text = serde_json::to_string(&Pictures::default()).unwrap();
        assert!(!text.contains("chroma"), "identities stay: {text}");
    }

    #[test]
    fn nothing_is_drawn_for_a_picture_outside_of_a_dataset() {
        let mixed = Pictures {
            jpeg_quality: Range::new(80.0, 90.0),
            jpeg_chroma: vec![Chroma::Quarter, Chroma::Full],
            ..Pictures::default()
        };
        let options = |pictures: &Pictures| {
            let options = pictures.middle_options();
            (options.jpeg_quality, options.jpeg_chroma)
        };
        assert_eq!(options(&mixed), (85, Chroma::Quarter));
        assert_eq!(options(&Pictures::default()), (95, Chroma::Full));
    }

    #[test]
    fn a_picture_is_shown_as_its_file_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.jpg");
        let frame = Image::from_fn(20, 12, |x, y| {
            let red = if (x + y) % 3 == 0 { 0.8 } else { 0.1 };
            PremulRgba::new(red, x as f32 / 20.0, 0.2, 1.0)
        });
        let displayed: Image<LinearRgb> = frame.map(|p| p.color());
        let jpg = Pictures {
            format: PictureFormat::Jpg,
            jpeg_quality: Range::new(20.0, 60.0),
            jpeg_chroma: vec![Chroma::Quarter, Chroma::Full],
            ..Pictures::default()
        };
        for k in 0..4 {
            io::write_with(&path, &displayed, &jpg.write_options(&Draws::new(3, k))).unwrap();
            let read: Image<LinearRgb> = io::read(&path).unwrap();
            assert_eq!(jpg.shown(&frame, 3, k).unwrap(), to_srgb8(&read));
        }
        let png = Pictures::default().shown(&frame, 3, 0).unwrap();
        assert_eq!(png, to_srgb8(&displayed));
        assert_ne!(png, jpg.shown(&frame, 3, 0).unwrap());
        assert!(jpg.shown(&Image::new(0, 0), 3, 0).is_err());
    }

    #[test]
    fn quality_that_no_jpeg_has_is_refused() {
        for (min, max) in [(0.0, 90.0), (90.0, 101.0), (80.5, 90.0)] {
            let jpeg_quality = Range::new(min, max);
            let wrong = Pictures {
                jpeg_quality,
                ..Pictures::default()
            };
            assert!(wrong.check().is_err(), "{min} {max}");
        }
    }
}
