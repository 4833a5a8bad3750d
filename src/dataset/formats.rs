//! The part of a recipe that says how labels are made and written: its table `[labels]`.

use crate::dataset::{Obstructed, Writer, Yolo};
use crate::label::{AmodalBox, LabelOptions};
use serde::{Deserialize, Serialize};

/// How labels are made and written: the table `[labels]` of a recipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LabelSetup {
    /// What happens to the labels of objects that something lies over: `drop`, `keep`, `ignore` or `class`. Default:
    /// `drop`, as in the paper.
    pub obstructed: Obstructed,
    /// Outlines are a pair of the topmost rule when their intersection over union is above this, 0 to 1. Default: 0, any
    /// overlap.
    pub overlap_iou: f64,
    /// A pixel belongs to an object when more than this share of it is covered. Default: 0.1.
    pub alpha_threshold: f32,
    /// What an amodal box is drawn around: `mask` or `outline`. Default: `mask`.
    pub amodal: AmodalBox,
    /// Layouts to write beside the images and their scenes. Default: `["yolo"]`.
    pub formats: Vec<Format>,
    /// Settings of YOLO.
    pub yolo: Yolo,
}

/// A layout of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// [`Yolo`].
    Yolo,
}

impl Default for LabelSetup {
    fn default() -> Self {
        let LabelOptions { amodal, alpha_threshold, overlap_iou } = LabelOptions::default();
        Self {
            obstructed: Obstructed::default(),
            overlap_iou,
            alpha_threshold,
            amodal,
            formats: vec![Format::Yolo],
            yolo: Yolo::default(),
        }
    }
}

impl LabelSetup {
    /// How labels are made.
    pub fn options(&self) -> LabelOptions {
        LabelOptions { amodal: self.amodal, alpha_threshold: self.alpha_threshold, overlap_iou: self.overlap_iou }
    }

    /// The writers of the layouts, each once, in the order in which [`Format`] lists them.
    pub fn writers(&self) -> Vec<Box<dyn Writer>> {
        let mut formats = self.formats.clone();
        formats.sort();
        formats.dedup();
        formats.into_iter().map(|format| self.writer(format)).collect()
    }

    fn writer(&self, format: Format) -> Box<dyn Writer> {
        match format {
            Format::Yolo => Box::new(self.yolo),
        }
    }
}
