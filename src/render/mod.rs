//! Render: a [`Shot`](crate::Shot) becomes deep samples, from which the picture and its labels are both folded.

mod deep;

pub use deep::{DeepImage, DeepSample};
