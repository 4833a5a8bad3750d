//! The part of a recipe that controls how labels are made and written: its table `[labels]`.

use crate::bounds::Bounds;
use crate::dataset::label_table::LabelTable;
use crate::dataset::{Coco, Layers, Mot, Obstructed, Pictures, Voc, WebDataset, Writer, Yolo};
use crate::error::{Error, Result};
use crate::geom::BBox;
use crate::label::{LabelOptions, ObjectLabel, RleMask};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How labels are made and written: the table `[labels]` of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "LabelTable", into = "LabelTable")]
pub struct LabelConfig {
    /// What happens to the labels of obstructed objects: `drop`, `keep`, `ignore` or `class`.
    /// Default: `drop`, as in the paper.
    pub obstructed: Obstructed,
    /// How objects are labelled: the keys `overlap_iou` or `min_visible`, `max_truncation`,
    /// `alpha_threshold`, `amodal` and `outline`.
    pub options: LabelOptions,
    /// Maximum distance of polygons (YOLO's `segment`, COCO's `polygon`) from the border of a mask,
    /// pixels: saves corners. Default: 0, along the edges of pixels.
    pub simplify: f64,
    /// Layouts to write in addition to the images and their scenes. Default: `["yolo"]`.
    pub formats: Vec<Format>,
    /// Settings of YOLO.
    pub yolo: Yolo,
    /// Settings of COCO.
    pub coco: Coco,
    /// Settings of Pascal VOC.
    pub voc: Voc,
    /// Settings of MOTChallenge.
    pub mot: Mot,
    /// Settings of WebDataset.
    pub webdataset: WebDataset,
    /// Settings of the EXR files with layers.
    pub layers: Layers,
}

/// A layout of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// [`Yolo`].
    Yolo,
    /// [`Coco`].
    Coco,
    /// [`Voc`].
    Voc,
    /// [`Mot`].
    Mot,
    /// [`Layers`].
    Layers,
    /// [`WebDataset`].
    WebDataset,
}

/// How much of an object a label covers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    /// The whole object as far as it is in the picture.
    #[default]
    Amodal,
    /// Its visible part; an object of which nothing is visible has no label.
    Visible,
}

impl Extent {
    /// Box and mask of an object.
    pub fn of(self, object: &ObjectLabel) -> (BBox, &RleMask) {
        match self {
            Self::Amodal => (object.amodal_box, &object.amodal_mask),
            Self::Visible => (object.visible_box, &object.visible_mask),
        }
    }

    /// Whether anything of an object can be labelled.
    pub(super) fn has_box(self, object: &ObjectLabel) -> bool {
        !self.of(object).0.is_empty()
    }

    /// Whether anything of an object can be labelled with a mask.
    pub(super) fn has_mask(self, object: &ObjectLabel) -> bool {
        self.has_box(object) && !self.of(object).1.is_empty()
    }
}

impl Default for LabelConfig {
    fn default() -> Self {
        Self {
            obstructed: Obstructed::default(),
            options: LabelOptions::default(),
            simplify: 0.0,
            formats: vec![Format::Yolo],
            yolo: Yolo::default(),
            coco: Coco::default(),
            voc: Voc::default(),
            mot: Mot::default(),
            webdataset: WebDataset::default(),
            layers: Layers::default(),
        }
    }
}

impl LabelConfig {
    /// # Errors
    /// [`Error::Value`](crate::Error::Value) for the first invalid number.
    pub fn check(&self) -> Result<()> {
        let options = &self.options;
        options.obstruction.check()?;
        let share = Bounds::new(0.0, 1.0, "a share");
        if let Some(max) = options.max_truncation {
            share.check("max_truncation", max)?;
        }
        check_threshold(options.alpha_threshold)?;
        Bounds::new(0.0, 1000.0, "pixels").check("simplify", self.simplify)?;
        Bounds::new(1.0, 1e6, "samples per archive")
            .check("webdataset.samples", self.webdataset.samples as f64)
    }

    /// The writers of the layouts, each once, in the order in which [`Format`] lists them:
    /// [`WebDataset`] packs what the others write.
    pub fn writers(&self, pictures: &Pictures) -> Vec<Arc<dyn Writer>> {
        let formats = self.distinct_formats().into_iter();
        formats
            .map(|format| self.writer(format, pictures))
            .collect()
    }

    /// The archives that samples are written to as they are made, if no other layout is requested.
    pub fn archives(&self) -> Option<WebDataset> {
        (self.distinct_formats() == [Format::WebDataset]).then_some(self.webdataset)
    }

    /// The extent of labels in memory: YOLO's if that or no layout with boxes is written, else that
    /// of the first one.
    pub fn extent(&self) -> Extent {
        // YOLO is the first of all.
        let writers = self.writers(&Pictures::default());
        let extent = writers.iter().find_map(|writer| writer.extent());
        extent.unwrap_or(self.yolo.boxes)
    }

    fn distinct_formats(&self) -> Vec<Format> {
        let mut formats = self.formats.clone();
        formats.sort();
        formats.dedup();
        formats
    }

    fn writer(&self, format: Format, pictures: &Pictures) -> Arc<dyn Writer> {
        match format {
            Format::Yolo => Arc::new(Yolo {
                simplify: self.simplify,
                ..self.yolo
            }),
            Format::Coco => Arc::new(Coco {
                pictures: pictures.format,
                simplify: self.simplify,
                ..self.coco
            }),
            Format::Voc => Arc::new(Voc {
                pictures: pictures.format,
                ..self.voc
            }),
            Format::Mot => Arc::new(Mot {
                pictures: pictures.format,
                ..self.mot
            }),
            Format::Layers => Arc::new(Layers {
                alpha_threshold: self.options.alpha_threshold,
                ..self.layers
            }),
            Format::WebDataset => Arc::new(self.webdataset),
        }
    }
}

/// Coverage is never more than 1: above a threshold of 1 nothing would get a label.
fn check_threshold(threshold: f32) -> Result<()> {
    if (0.0..1.0).contains(&threshold) {
        return Ok(());
    }
    let what = format!("{threshold}, expected 0 to less than 1 (a share)");
    Err(Error::value("alpha_threshold", what))
}

/// Whether polygons keep every corner: a setting that need not be recorded.
pub(super) fn is_exact(tolerance_px: &f64) -> bool {
    *tolerance_px == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tolerance_reaches_the_formats_with_polygons_and_none_is_not_told() {
        let told = |recipe: &str| {
            let config: LabelConfig = toml::from_str(recipe).unwrap();
            config.check().unwrap();
            config
                .writers(&Pictures::default())
                .iter()
                .map(|w| w.settings().to_string())
                .collect::<String>()
        };
        assert_eq!(
            told("formats = ['yolo', 'coco']\nsimplify = 1.5")
                .matches("\"simplify\":1.5")
                .count(),
            2
        );
        assert!(!told("formats = ['yolo', 'coco']").contains("simplify"));
    }

    #[test]
    fn numbers_that_cannot_be_right_are_named() {
        for (recipe, at) in [
            ("simplify = -1", "simplify: -1"),
            ("simplify = inf", "simplify: inf"),
            ("alpha_threshold = 2", "alpha_threshold: 2"),
            (
                "alpha_threshold = 1",
                "alpha_threshold: 1, expected 0 to less than 1",
            ),
            ("overlap_iou = nan", "overlap_iou: NaN"),
            ("min_visible = 1.01", "min_visible: 1.01"),
            ("min_visible = -0.1", "min_visible: -0.1"),
            ("max_truncation = 1.5", "max_truncation: 1.5"),
            ("max_truncation = -0.5", "max_truncation: -0.5"),
        ] {
            let e = toml::from_str::<LabelConfig>(recipe)
                .unwrap()
                .check()
                .unwrap_err()
                .to_string();
            assert!(e.contains(at), "{e}");
        }
        assert!(
            toml::from_str::<LabelConfig>("yolo = { simplify = 1 }").is_err(),
            "one place to say it"
        );
    }

    #[test]
    fn formats_are_written_once_and_archives_last() {
        let asked: LabelConfig =
            toml::from_str(r#"formats = ["webdataset", "coco", "yolo", "coco"]"#).unwrap();
        let names = asked
            .writers(&Pictures::default())
            .iter()
            .map(|w| w.settings())
            .collect::<Vec<_>>();
        let keys: Vec<_> = names
            .iter()
            .flat_map(|s| s.as_object().unwrap().keys().cloned())
            .collect();
        assert_eq!(keys, ["yolo", "coco", "webdataset"]);
    }

    #[test]
    fn labels_in_memory_are_those_that_are_written() {
        let extent = |recipe: &str| toml::from_str::<LabelConfig>(recipe).unwrap().extent();
        let coco = "coco = { boxes = 'visible' }\n";
        let formats = |formats: &str| extent(&format!("{coco}formats = {formats}"));
        assert_eq!(formats("['coco']"), Extent::Visible);
        assert_eq!(formats("['layers', 'coco', 'webdataset']"), Extent::Visible);
        assert_eq!(formats("['coco', 'yolo']"), Extent::Amodal);
        let voc = "voc = { boxes = 'visible' }\n";
        assert_eq!(
            extent(&format!("{voc}formats = ['mot', 'voc']")),
            Extent::Visible
        );
        assert_eq!(formats("[]"), Extent::Amodal);
        assert_eq!(
            extent("formats = []\nyolo = { boxes = 'visible' }"),
            Extent::Visible
        );
        assert_eq!(extent("yolo = { boxes = 'visible' }"), Extent::Visible);
    }
}
