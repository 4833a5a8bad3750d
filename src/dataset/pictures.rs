//! The images of a dataset.

use crate::bounds::Bounds;
use crate::dataset::paths::create_part_folders;
use crate::dataset::{Entry, Writer};
use crate::error::Result;
use crate::io::{self, WriteOptions};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Writes `images/{train,val}/NNNNNN.png` or `.jpg`, 8-bit sRGB, on black where nothing lies behind
/// the objects, and on request the scene-linear picture beside it as `exr/{train,val}/NNNNNN.exr`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pictures {
    /// Format. Default: `png`.
    pub format: PictureFormat,
    /// Quality of a `jpg`, 1 to 100. Default: 95.
    pub jpeg_quality: u8,
    /// Also write the scene-linear picture with its alpha. Default: no.
    pub exr: bool,
}

impl Default for Pictures {
    fn default() -> Self {
        let format = PictureFormat::default();
        Self {
            format,
            jpeg_quality: WriteOptions::default().jpeg_quality,
            exr: false,
        }
    }
}

impl Pictures {
    pub(crate) fn check(&self) -> Result<()> {
        Bounds::new(1.0, 100.0, "a JPEG's quality").check("jpeg_quality", self.jpeg_quality.into())
    }
}

/// Format of the images that trainers read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureFormat {
    /// Without loss.
    #[default]
    Png,
    /// Smaller.
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
    fn write_options(&self) -> WriteOptions {
        WriteOptions {
            jpeg_quality: self.jpeg_quality,
            ..WriteOptions::default()
        }
    }
}

impl Writer for Pictures {
    fn settings(&self) -> serde_json::Value {
        serde_json::json!({ "pictures": self })
    }

    fn begin(&self, folder: &Path, _classes: &[String]) -> Result<()> {
        let mut kinds = self.kinds().iter();
        kinds.try_for_each(|kind| create_part_folders(folder, kind))
    }

    fn write(&self, folder: &Path, entry: &Entry<'_>) -> Result<Vec<PathBuf>> {
        let mut paths = vec![self.write_displayed(folder, entry)?];
        if self.exr {
            paths.push(write_exr(folder, entry)?);
        }
        Ok(paths)
    }
}

impl Pictures {
    /// The folders of the dataset that it writes to.
    fn kinds(&self) -> &'static [&'static str] {
        if self.exr {
            &["images", "exr"]
        } else {
            &["images"]
        }
    }

    fn write_displayed(&self, folder: &Path, entry: &Entry<'_>) -> Result<PathBuf> {
        let path = entry.path("images", self.format.extension());
        let displayed = entry.sample.frame.map(|p| p.color());
        io::write_with(folder.join(&path), &displayed, &self.write_options())?;
        Ok(path)
    }
}

fn write_exr(folder: &Path, entry: &Entry<'_>) -> Result<PathBuf> {
    let path = entry.path("exr", "exr");
    io::write(folder.join(&path), &entry.sample.frame)?;
    Ok(path)
}
