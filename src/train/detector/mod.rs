//! Detector: a small one in the manner of YOLOv5s, and its training.
//!
//! [`fit`](fit()) trains a [`Network`] on [`Sample`]s and keeps the epoch with the best mAP@0.5:0.95; [`predict`] finds
//! boxes. Everything is generic over burn's backend; [`Cpu`] is the one that tests use. Width and depth are multiples of
//! YOLOv5's full size, so that the same code is a network for a GPU and one that a test trains in a minute.
//!
//! Draws come from seeded ChaCha, never from the backend; on the processor the same options give the same network.

mod assign;
mod augment;
mod backbone;
mod blocks;
mod checkpoint;
mod ciou;
mod dice;
mod fit;
mod history;
mod jitter;
mod loss;
mod neck;
mod network;
mod optimizer;
mod plan;
mod predict;
mod read;
mod sample;
mod schedule;
mod suppress;

pub use augment::Augment;
pub use checkpoint::{load, save};
pub use fit::{FitOptions, Fitted, TrainingSet, fit};
pub use history::{Epoch, History};
pub use network::{ANCHORS_PER_LEVEL, Description, LEVELS, Network, STRIDES};
pub use plan::Mode;
pub use predict::{found_folder, predict};
pub use sample::{Labelled, Sample};
pub use schedule::Schedule;

/// The backend that runs on every machine.
pub type Cpu = burn::backend::Autodiff<burn::backend::NdArray<f32>>;
/// The backend on the GPU that the system's drivers offer.
#[cfg(feature = "train-gpu")]
pub type Gpu = burn::backend::Autodiff<burn::backend::Wgpu>;

#[cfg(test)]
mod tests;
