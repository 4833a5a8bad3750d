//! Matte: a photo on a screen becomes a cut-out.

mod segment;

pub use segment::{SegmentOptions, Segmentation, Step, Threshold, segment};
