//! Labelled photos of the place that scenes are set in.

use crate::camera::{self, Camera, SolveOptions};
use crate::error::{Error, Result};
use crate::filter;
use crate::image::{Image, Roi};
use crate::io;
use crate::pixel::LinearRgb;
use crate::scene::{Background, CameraSource};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// How a label file is named: the photo's name, then this.
const LABEL_SUFFIX: &str = ".label.json";

/// A labelled photo: its camera is solved once, its pixels are read when a picture first needs them.
#[derive(Debug)]
pub(crate) struct Place {
    /// What a recipe sees of it.
    pub(crate) background: Background,
    /// The photo's file.
    pub(crate) photo: PathBuf,
    /// The part of it that is seen.
    pub(crate) kept: Roi,
    image: [u32; 2],
    plate: OnceLock<Arc<Image<LinearRgb>>>,
}

impl Place {
    /// The labelled photos of a folder in order of name, seen at `image` pixels.
    pub(crate) fn all(folder: &Path, image: [u32; 2]) -> Result<Vec<Self>> {
        let entries = std::fs::read_dir(folder).map_err(|e| Error::file(folder, e))?;
        let mut labels: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(|p| is_label(p)).collect();
        labels.sort();
        if labels.is_empty() {
            return Err(Error::file(folder, format!("no label found, expected at least one NAME{LABEL_SUFFIX}")));
        }
        labels.iter().map(|label| Self::open(label, image)).collect()
    }

    fn open(path: &Path, image: [u32; 2]) -> Result<Self> {
        let label = camera::read_label(path)?;
        let solution = camera::solve(&label, &SolveOptions::default()).map_err(|e| Error::from(e).in_file(path))?;
        camera::check_distance(&solution).map_err(|e| e.in_file(path))?;
        for warning in &solution.warnings {
            log::warn!("{}: {warning}", path.display());
        }
        let kept = middle(label.image_size(), image);
        let camera = cropped(solution.camera, kept).resized(image);
        let background = Background { name: name(path), size: solution.size, camera: CameraSource::Known(camera) };
        let folder = path.parent().unwrap_or(Path::new(""));
        let photo = io::inside(folder, &label.image.file).map_err(|e| e.within("image").in_file(path))?;
        Ok(Self { background, photo, kept, image, plate: OnceLock::new() })
    }

    /// Name of the label's file.
    pub(crate) fn label_name(&self) -> String {
        format!("{}{LABEL_SUFFIX}", self.background.name)
    }

    /// The photo at the picture's size, scene-linear; read once.
    pub(crate) fn plate(&self) -> Result<Arc<Image<LinearRgb>>> {
        if let Some(plate) = self.plate.get() {
            return Ok(plate.clone());
        }
        let photo = io::read::<LinearRgb>(&self.photo)?;
        let [width, height] = self.image.map(|side| side as usize);
        let plate = Arc::new(filter::resize(&photo.crop(self.kept), width, height));
        Ok(self.plate.get_or_init(|| plate).clone())
    }
}

fn is_label(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(LABEL_SUFFIX))
}

/// `bg0001` of `photos/bg0001.label.json`.
fn name(path: &Path) -> String {
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    file.trim_end_matches(LABEL_SUFFIX).to_owned()
}

/// The largest middle part of a photo that has the shape of the picture.
fn middle(photo: [u32; 2], image: [u32; 2]) -> Roi {
    let [w, h] = photo.map(u64::from);
    let [iw, ih] = image.map(u64::from);
    let width = w.min((h * iw).div_ceil(ih)) as usize;
    let height = h.min((w * ih).div_ceil(iw)) as usize;
    Roi { x: (w as usize - width) / 2, y: (h as usize - height) / 2, width, height }
}

/// The camera of a part of its picture.
fn cropped(camera: Camera, kept: Roi) -> Camera {
    let corner = crate::geom::Vector2::new(kept.x as f64, kept.y as f64);
    Camera { image: [kept.width as u32, kept.height as u32], principal_px: camera.principal_px - corner, ..camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_of_the_picture_s_shape_is_kept_whole() {
        assert_eq!(middle([1280, 960], [640, 480]), Roi { x: 0, y: 0, width: 1280, height: 960 });
    }

    #[test]
    fn a_wider_photo_loses_its_sides() {
        assert_eq!(middle([1920, 960], [640, 480]), Roi { x: 320, y: 0, width: 1280, height: 960 });
    }

    #[test]
    fn a_portrait_photo_loses_top_and_bottom() {
        assert_eq!(middle([600, 1000], [640, 480]), Roi { x: 0, y: 275, width: 600, height: 450 });
    }
}
