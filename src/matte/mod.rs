//! Matte: a photo on a screen becomes a cut-out.

mod cut_out;
pub mod key;
mod screen;
mod segment;

pub use cut_out::{CutOut, CutOutOptions, MatteMethod, Within, cut_out};
pub use key::{KeyOptions, Keyed, Keying, Screen, key};
pub use screen::screen_color;
pub use segment::{SegmentOptions, Segmentation, Step, Threshold, Tone, segment};
