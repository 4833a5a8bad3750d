//! Matte: a photo on a screen becomes a cut-out.

mod channel_key;
mod chroma_key;
mod color_spill;
mod cut_out;
mod difference_key;
mod film;
pub mod key;
mod key_color;
mod keying_screen;
mod median;
mod outline;
mod plate;
mod prepared;
mod register;
mod screen;
mod screen_corners;
mod segment;
mod triangulate;

pub use channel_key::{ChannelKeyOptions, ChannelKeyed, ChannelLimit, KeySpace, channel_key};
pub use chroma_key::{ChromaKeyOptions, chroma_key};
pub use color_spill::{ColorSpillOptions, SpillChannel, SpillLimit, color_spill};
pub use cut_out::{Boundary, CutOut, CutOutOptions, MatteMethod, cut_out, cut_out_on};
pub use difference_key::{DifferenceKeyOptions, difference_key};
pub use film::{ColorUncertainty, FilmMatte, FilmOptions, film, film_planes};
pub use key::{KeyOptions, Keyed, Keying, Screen, key};
pub use key_color::{KeyAverage, KeyColor, key_color};
pub use keying_screen::{ScreenPoint, keying_screen};
pub use outline::Outline;
pub use plate::{PlateOptions, ScreenPlate};
pub use screen::screen_color;
pub(crate) use screen_corners::from_top_left;
pub use screen_corners::{ScreenCorners, screen_corners};
pub use segment::{
    Confidence, LumaMode, SegmentOptions, SegmentStep, Segmentation, Threshold, segment,
};
pub use triangulate::{TriangulateOptions, Triangulated, triangulate};
