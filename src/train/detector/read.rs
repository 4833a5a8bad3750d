//! Reads YOLO datasets for training.

use super::fit::TrainingSet;
use super::sample::{Labelled, Sample};
use crate::color::to_srgb8;
use crate::dataset::YoloSet;
use crate::error::{Error, Result};
use crate::eval::read_yolo_boxes;
use crate::filter::resize;
use crate::label::BBox;
use crate::{LinearRgb, io};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

impl TrainingSet {
    /// Reads the training parts of one or two YOLO datasets, pictures shrunk or enlarged to `side` pixels along their
    /// longer side. The validation part is the real dataset's, else the synthetic one's.
    ///
    /// # Errors
    /// [`Error::File`] for a dataset that cannot be read or has other classes than the first; [`Error::Value`] for none.
    pub fn read(real: Option<&Path>, synthetic: Option<&Path>, side: usize) -> Result<Self> {
        let open = |folder: Option<&Path>| folder.map_or_else(|| Ok(YoloSet::default()), YoloSet::open);
        let sets = [open(real)?, open(synthetic)?];
        if let (Some(folder), true) = (synthetic, real.is_some() && sets[0].classes != sets[1].classes) {
            let what =
                format!("classes {:?}, expected those of the real images: {:?}", sets[1].classes, sets[0].classes);
            return Err(Error::file(folder, what));
        }
        let first = usize::from(real.is_none());
        let classes = sets[first].classes.clone();
        if classes.is_empty() {
            return Err(Error::value("images", "no dataset, expected a real or a synthetic one"));
        }
        let samples = |images: &[PathBuf]| -> Result<Vec<Sample>> {
            images.par_iter().map(|image| sample(image, side, classes.len())).collect()
        };
        let [real, synthetic] = [samples(&sets[0].train)?, samples(&sets[1].train)?];
        let validation = samples(&sets[first].val)?;
        Ok(Self { classes, real, synthetic, validation })
    }
}

fn sample(image: &Path, side: usize, classes: usize) -> Result<Sample> {
    let photo = io::read::<LinearRgb>(image)?;
    let labels = YoloSet::label_of(image);
    let boxes = read_yolo_boxes(&labels, [photo.width() as u32, photo.height() as u32])?;
    if let Some(unknown) = boxes.iter().find(|b| b.class as usize >= classes) {
        return Err(Error::file(labels, format!("class {}, expected 0 to {}", unknown.class, classes - 1)));
    }
    let scale = side as f64 / photo.width().max(photo.height()) as f64;
    let [width, height] = [photo.width(), photo.height()].map(|v| ((v as f64 * scale).round() as usize).max(1));
    let [across, along] = [width as f64 / photo.width() as f64, height as f64 / photo.height() as f64];
    let objects = boxes.into_iter().map(|b| Labelled {
        class: b.class,
        bbox: BBox { x0: b.bbox.x0 * across, y0: b.bbox.y0 * along, x1: b.bbox.x1 * across, y1: b.bbox.y1 * along },
    });
    Ok(Sample {
        name: image.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        picture: to_srgb8(&resize(&photo, width, height)),
        objects: objects.collect(),
        size: [photo.width() as u32, photo.height() as u32],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Image;

    #[test]
    fn pictures_and_boxes_come_at_the_networks_size() {
        let root = tempfile::tempdir().unwrap();
        for part in ["images/train", "images/val", "labels/train"] {
            std::fs::create_dir_all(root.path().join(part)).unwrap();
        }
        for image in ["images/train/a.png", "images/val/b.png"] {
            io::write(root.path().join(image), &Image::filled(80, 40, LinearRgb::WHITE)).unwrap();
        }
        std::fs::write(root.path().join("labels/train/a.txt"), "1 0.5 0.5 0.25 0.5\n").unwrap();
        std::fs::write(root.path().join("data.yaml"), "train: images/train\nval: images/val\nnames: [cap, bag]\n")
            .unwrap();
        let set = TrainingSet::read(None, Some(root.path()), 64).unwrap();
        assert_eq!(set.synthetic[0].picture.size(), (64, 32));
        assert_eq!(set.synthetic[0].objects[0].bbox, BBox { x0: 24.0, y0: 8.0, x1: 40.0, y1: 24.0 });
        assert_eq!((set.validation[0].objects.len(), set.validation[0].size, set.real.len()), (0, [80, 40], 0));
        std::fs::write(root.path().join("labels/train/a.txt"), "2 0.5 0.5 0.25 0.5\n").unwrap();
        let said = TrainingSet::read(Some(root.path()), None, 64).unwrap_err().to_string();
        assert!(said.ends_with("class 2, expected 0 to 1"), "{said}");
        assert!(TrainingSet::read(None, None, 64).is_err());
    }
}
