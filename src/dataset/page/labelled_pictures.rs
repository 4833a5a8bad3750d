//! Pictures with boxes, of this dataset or of the user.

use crate::dataset::{SampleSummary, Summary, YoloSet};
use crate::error::{Error, Result};
use crate::eval::{self, is_image, label_of};
use crate::geom::BBox;
use crate::io;
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// More images than this are not a folder of one's own pictures, but a whole disk.
const MAX_IMAGES: usize = 200_000;

/// Pictures with boxes from any source.
#[derive(Default)]
pub(in crate::dataset) struct LabelledSet {
    /// Names of the classes, in order; may be fewer than occur.
    pub(in crate::dataset) classes: Vec<String>,
    pub(in crate::dataset) pictures: Vec<LabelledPicture>,
}

/// Class of a box, and its centre, width and height as shares of the picture's.
pub type ShareBox = (u32, [f64; 4]);

/// A picture and its boxes.
#[derive(Clone)]
pub(in crate::dataset) struct LabelledPicture {
    pub(in crate::dataset) path: PathBuf,
    /// None for a picture without a label file.
    pub(in crate::dataset) boxes: Option<Vec<ShareBox>>,
}

impl LabelledSet {
    /// Reads a YOLO dataset, or a folder with images that have YOLO labels next to them or in
    /// `labels` instead of `images`.
    ///
    /// # Errors
    /// A folder without images; a label that cannot be read.
    pub(in crate::dataset) fn read(folder: &Path) -> Result<Self> {
        let (classes, images) = listed_images(folder)?;
        if images.is_empty() {
            let what = "no images, expected a YOLO dataset or a folder of images with labels";
            return Err(Error::file(folder, what));
        }
        let pictures = images.into_par_iter().map(LabelledPicture::read);
        Ok(Self {
            classes,
            pictures: pictures.collect::<Result<_>>()?,
        })
    }

    /// The pictures of a dataset that petcomp made.
    pub(in crate::dataset) fn from_summary(folder: &Path, summary: &Summary) -> Self {
        Self {
            classes: summary.classes.clone(),
            pictures: summary
                .glances
                .iter()
                .map(|sample| LabelledPicture::from_sample(folder, sample))
                .collect(),
        }
    }

    pub(in crate::dataset) fn name(&self, class: u32) -> String {
        eval::class_name(class, &self.classes)
    }

    pub(in crate::dataset) fn boxes(&self) -> impl Iterator<Item = &ShareBox> {
        self.pictures
            .iter()
            .filter_map(|picture| picture.boxes.as_ref())
            .flatten()
    }

    pub(in crate::dataset) fn centres(&self) -> Vec<[f64; 2]> {
        self.boxes().map(|(_, [x, y, ..])| [*x, *y]).collect()
    }

    pub(in crate::dataset) fn centres_of(&self, class: u32) -> Vec<[f64; 2]> {
        self.boxes()
            .filter(|(own, _)| *own == class)
            .map(|(_, [x, y, ..])| [*x, *y])
            .collect()
    }

    /// Some of the pictures, evenly spread.
    pub(in crate::dataset) fn spread(&self, max_count: usize) -> Vec<&LabelledPicture> {
        let count = max_count.min(self.pictures.len());
        (0..count)
            .map(|i| &self.pictures[i * self.pictures.len() / count])
            .collect()
    }
}

impl LabelledPicture {
    pub(in crate::dataset) fn file_name(&self) -> Cow<'_, str> {
        self.path.file_name().unwrap_or_default().to_string_lossy()
    }

    pub(in crate::dataset) fn read(path: PathBuf) -> Result<Self> {
        let label = label_beside(&path);
        let boxes = label.map(|label| read_boxes(&label)).transpose()?;
        Ok(Self { path, boxes })
    }

    fn from_sample(folder: &Path, sample: &SampleSummary) -> Self {
        let size = sample.image.map(f64::from);
        let labels = sample.labels.iter();
        let boxes = labels.map(|(class, b)| (*class, shares_of(b, size)));
        Self {
            path: folder.join(&sample.files[0]),
            boxes: Some(boxes.collect()),
        }
    }
}

/// The label file of an image: that of a YOLO dataset, or one of the same name in the same folder.
fn label_beside(image: &Path) -> Option<PathBuf> {
    let mut candidates = [label_of(image), image.with_extension("txt")].into_iter();
    candidates.find(|label| label.is_file())
}

fn read_boxes(label: &Path) -> Result<Vec<ShareBox>> {
    // In a picture of one pixel, pixels are shares.
    let image = eval::yolo_sheet(&io::read_text(label)?, "", [1, 1])
        .map_err(|what| Error::file(label, what))?;
    let boxes = image.truth.iter();
    let boxes = boxes.map(|truth| (truth.class, shares_of(&truth.bbox, [1.0; 2])));
    Ok(boxes.collect())
}

/// Classes and images of a YOLO dataset, or all images below a folder.
pub(in crate::dataset) fn listed_images(folder: &Path) -> Result<(Vec<String>, Vec<PathBuf>)> {
    if folder.join("data.yaml").is_file() {
        let set = YoloSet::read(folder)?;
        let images = set.series();
        return Ok((set.classes, images));
    }
    Ok((Vec::new(), io::files_below(folder, is_image, MAX_IMAGES)?))
}

/// Centre and sides of a box as shares of its picture.
pub(in crate::dataset) fn shares_of(b: &BBox, [w, h]: [f64; 2]) -> [f64; 4] {
    let center = b.center();
    [center.x / w, center.y / h, b.width() / w, b.height() / h]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::dataset::index::DatasetIndex;
    use crate::dataset::{
        Extent, Obstructed, Pictures, Plan, Provenance, Sample, Sidecar, Yolo, generate,
    };
    use crate::image::Image;
    use crate::label::{Labels, ObjectLabel};
    use crate::pixel::{LinearRgb, ObjectId};
    use crate::scene::{CameraSource, Scene, Surface};
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    /// A picture of 16 x 16 pixels: an object half under another.
    fn half_hidden() -> Sample {
        let bbox = |x0, x1| BBox {
            x0,
            y0: 2.0,
            x1,
            y1: 6.0,
        };
        let object = |id, visible_box, covered_by| ObjectLabel {
            id: ObjectId(id),
            amodal_box: bbox(2.0 * f64::from(id), 2.0 * f64::from(id) + 4.0),
            visible_box,
            visible_fraction: 0.5,
            covered_by,
            ..ObjectLabel::default()
        };
        let labels = Labels {
            image: [16, 16],
            objects: vec![
                object(1, bbox(2.0, 4.0), vec![ObjectId(2)]),
                object(2, bbox(4.0, 8.0), vec![]),
            ],
            ..Labels::default()
        };
        let camera = CameraSource::Known(Camera::looking_down(1.0, 20.0, [16, 16]));
        let scene = Scene::new([16, 16], camera, Surface::new([0.4, 0.3]));
        let grey = Image::filled(16, 16, LinearRgb::grey(0.2).opaque());
        Sample {
            provenance: Some(Provenance::from_scene(scene)),
            ..Sample::new(grey, labels)
        }
    }

    #[test]
    fn boxes_of_what_is_seen_are_read_as_they_are_labelled() {
        let folder = tempfile::tempdir().unwrap();
        let yolo = Yolo {
            boxes: Extent::Visible,
            ..Yolo::default()
        };
        let plan = Plan {
            obstructed: Obstructed::Keep,
            writers: vec![
                Arc::new(Pictures::default()),
                Arc::new(yolo),
                Arc::new(Sidecar),
            ],
            ..Plan::new(folder.path(), 1, vec!["cap".into()])
        };
        let sample = |_| Ok(half_hidden());
        generate(&plan, sample, &|_| {}, &AtomicBool::new(false)).unwrap();
        let summary = Summary::read(folder.path()).unwrap();
        let own = LabelledSet::from_summary(folder.path(), &summary);
        let read = LabelledSet::read(folder.path()).unwrap();
        let expected = vec![
            (0, [0.1875, 0.25, 0.125, 0.25]),
            (0, [0.375, 0.25, 0.25, 0.25]),
        ];
        assert_eq!(own.boxes().copied().collect::<Vec<_>>(), expected);
        assert_eq!(read.boxes().copied().collect::<Vec<_>>(), expected);
        assert_eq!(summary.boxes, [[2.0, 4.0], [4.0, 4.0]]);
        let index = DatasetIndex::open(folder.path()).unwrap();
        assert_eq!(
            index.facts(0).unwrap().objects[0].bbox,
            [0.1875, 0.25, 0.125, 0.25]
        );
    }

    #[test]
    fn images_are_found_with_labels_in_either_place() {
        let root = tempfile::tempdir().unwrap();
        let grey = Image::filled(8, 6, LinearRgb::grey(0.2));
        for (file, label) in [
            (
                "images/a.png",
                Some(("labels/a.txt", "1 0.5 0.25 0.5 0.5\n")),
            ),
            ("images/deep/b.jpg", Some(("images/deep/b.txt", ""))),
            ("images/c.png", None),
        ] {
            for path in [file].into_iter().chain(label.map(|l| l.0)) {
                std::fs::create_dir_all(root.path().join(path).parent().unwrap()).unwrap();
            }
            io::write(root.path().join(file), &grey).unwrap();
            if let Some((path, text)) = label {
                std::fs::write(root.path().join(path), text).unwrap();
            }
        }
        let set = LabelledSet::read(root.path()).unwrap();
        let boxes: Vec<_> = set.pictures.iter().map(|p| p.boxes.clone()).collect();
        assert_eq!(
            boxes,
            [Some(vec![(1, [0.5, 0.25, 0.5, 0.5])]), None, Some(vec![])]
        );
        std::fs::write(root.path().join("labels/a.txt"), "x\n").unwrap();
        for (folder, expected) in [("", "a.txt: line 1"), ("labels", "no images")] {
            let refused = LabelledSet::read(&root.path().join(folder)).err();
            let told = refused.unwrap().to_string();
            assert!(told.contains(expected), "{told}");
        }
    }
}
