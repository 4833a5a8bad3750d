//! Matte: a photo on a screen becomes a cut-out.

pub mod key;
mod segment;

pub use key::{KeyOptions, Keyed, Keying, Screen, key};
pub use segment::{SegmentOptions, Segmentation, Step, Threshold, segment};
