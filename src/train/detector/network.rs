//! The whole network, and what describes it.

use super::backbone::Backbone;
use super::blocks::Builder;
use super::dice::Dice;
use super::neck::Neck;
use crate::error::{Error, Result};
use burn::module::{Module, Param};
use burn::nn::conv::Conv2d;
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use serde::{Deserialize, Serialize};

/// Number of heads.
pub const LEVELS: usize = 3;
/// Pixels per cell of each head's grid.
pub const STRIDES: [usize; LEVELS] = [8, 16, 32];
/// Boxes that a cell can tell.
pub const ANCHORS_PER_LEVEL: usize = 3;
/// Numbers of a box before those of the classes: centre, size, objectness.
pub(super) const BOX_NUMBERS: usize = 5;
/// Channels of the five stages at full width: YOLOv5's.
const WIDTHS: [f64; 5] = [64.0, 128.0, 256.0, 512.0, 1024.0];
/// Channels come in multiples of it.
const CHANNEL_STEP: f64 = 8.0;
/// Objects that an untrained head expects in an image of 640 pixels, and the share of it that is of a known class.
const EXPECTED_OBJECTS: f64 = 8.0;
const EXPECTED_CLASS: f64 = 0.6;
const FULL_SIDE: f64 = 640.0;
/// Stream of the draws of weights; epochs have the others.
const WEIGHTS: u64 = u64::MAX;

/// What a network is like: all that is needed to build it, but its weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Multiple of YOLOv5's full number of channels; 0.5 is YOLOv5s.
    pub width: f64,
    /// Multiple of the full number of blocks; 0.33 is YOLOv5s.
    pub depth: f64,
    /// Side of the square that images are fitted into, pixels; a multiple of 32, at least 64.
    pub side: usize,
    /// Widths and heights of the anchors of each head, pixels, by area.
    pub anchors: [[[f64; 2]; ANCHORS_PER_LEVEL]; LEVELS],
}

impl Description {
    /// # Errors
    /// [`Error::Value`] for a network that cannot be built.
    pub fn check(&self) -> Result<()> {
        let coarsest = STRIDES[LEVELS - 1];
        // A single cell of a single image leaves nothing to normalise over.
        let least = 2 * coarsest;
        if self.side < least || !self.side.is_multiple_of(coarsest) {
            let what = format!("{}, expected a multiple of {coarsest}, at least {least}", self.side);
            return Err(Error::value("img", what));
        }
        for (at, value) in [("width", self.width), ("depth", self.depth)] {
            if !(value > 0.0 && value <= 2.0) {
                return Err(Error::value(at, format!("{value}, expected more than 0 and at most 2")));
            }
        }
        if self.classes.is_empty() {
            return Err(Error::value("classes", "none, expected at least one"));
        }
        Ok(())
    }

    /// Channels of the five stages.
    pub(super) fn widths(&self) -> [usize; 5] {
        WIDTHS.map(|full| ((full * self.width / CHANNEL_STEP).ceil() * CHANNEL_STEP) as usize)
    }

    /// So many blocks, of so many at full depth.
    pub(super) fn blocks(&self, full: usize) -> usize {
        ((full as f64 * self.depth).round() as usize).max(1)
    }

    /// Numbers that a head tells of a box.
    pub(super) fn numbers(&self) -> usize {
        BOX_NUMBERS + self.classes.len()
    }

    /// Cells of a head's grid along a side.
    pub(super) fn cells(&self, level: usize) -> usize {
        self.side / STRIDES[level]
    }

    /// A head's anchors in cells.
    pub(super) fn anchors_in_cells(&self, level: usize) -> [[f64; 2]; ANCHORS_PER_LEVEL] {
        self.anchors[level].map(|size| size.map(|v| v / STRIDES[level] as f64))
    }
}

/// Backbone, neck and three heads.
#[derive(Module, Debug)]
pub struct Network<B: Backend> {
    backbone: Backbone<B>,
    neck: Neck<B>,
    heads: Vec<Conv2d<B>>,
}

impl<B: Backend> Network<B> {
    /// An untrained network; the same seed gives the same weights on any backend.
    pub fn new(description: &Description, seed: u64, device: &B::Device) -> Self {
        let mut builder = Builder { dice: Dice::new(seed, WEIGHTS), device };
        let [.., fine, middle, coarse] = description.widths();
        let backbone = Backbone::new(description, &mut builder);
        let neck = Neck::new(description, &mut builder);
        let heads = [fine, middle, coarse].into_iter().zip(STRIDES);
        let heads = heads.map(|(width, stride)| head(description, width, stride, &mut builder)).collect();
        Self { backbone, neck, heads }
    }

    /// For images `[image, 3, side, side]`, red, green, blue from 0 to 1, display-encoded: per head a row of numbers for
    /// every box, ordered by image, anchor, row and column of the grid.
    pub fn forward(&self, images: Tensor<B, 4>) -> [Tensor<B, 2>; LEVELS] {
        let features = self.neck.forward(self.backbone.forward(images));
        let mut heads = self.heads.iter();
        features.map(|x| {
            let y = heads.next().expect("a head per level").forward(x);
            let [images, channels, height, width] = y.dims();
            let numbers = channels / ANCHORS_PER_LEVEL;
            let y = y.reshape([images, ANCHORS_PER_LEVEL, numbers, height, width]).permute([0, 1, 3, 4, 2]);
            y.reshape([images * ANCHORS_PER_LEVEL * height * width, numbers])
        })
    }
}

/// A head that at first expects few objects, so that training does not begin with unlearning thousands.
fn head<B: Backend>(description: &Description, width: usize, stride: usize, builder: &mut Builder<'_, B>) -> Conv2d<B> {
    let numbers = description.numbers();
    let mut head = builder.plain([width, ANCHORS_PER_LEVEL * numbers], 1, 1, true);
    let objects = EXPECTED_OBJECTS / (FULL_SIDE / stride as f64).powi(2);
    let class = EXPECTED_CLASS / description.classes.len() as f64;
    let bias = |i: usize| match i % numbers {
        i if i + 1 < BOX_NUMBERS => 0.0,
        i if i < BOX_NUMBERS => logit(objects),
        _ => logit(class),
    };
    let bias: Vec<f32> = (0..ANCHORS_PER_LEVEL * numbers).map(bias).collect();
    let data = TensorData::new(bias, [ANCHORS_PER_LEVEL * numbers]);
    head.bias = Some(Param::from_tensor(Tensor::from_data(data, builder.device)));
    head
}

fn logit(p: f64) -> f32 {
    libm::log(p / (1.0 - p)) as f32
}
