//! Matte: a photo on a screen becomes a cut-out.
//!
//! ```
//! use petcomp::matte::{CutOutOptions, cut_out};
//! use petcomp::{Image, LinearRgb};
//!
//! let (screen, object) = (LinearRgb::new(0.05, 0.4, 0.08), LinearRgb::new(0.5, 0.1, 0.1));
//! let photo = Image::from_fn(160, 120, |x, y| {
//!     let is_object = (50..110).contains(&x) && (40..80).contains(&y);
//!     if is_object { object } else { screen }
//! });
//! let cut = cut_out(&photo, &CutOutOptions::default())?;
//! let picture = cut.to_rgba();
//! assert!(picture[(picture.width() / 2, picture.height() / 2)].a > 0.9);
//! # Ok::<(), petcomp::Error>(())
//! ```

mod arrays;
mod channel_key;
mod check;
mod chroma_key;
mod clipping;
mod color_spill;
mod cut_out;
mod difference_key;
mod film;
mod flow;
pub mod key;
mod keying_screen;
mod outline;
mod plate;
mod prepared;
mod register;
mod screen;
mod screen_corners;
mod screen_edge;
mod segment;
mod stroke;
mod triangulate;

#[doc(hidden)]
pub use channel_key::{ChannelKeyOptions, ChannelKeyed, ChannelLimit, KeySpace, channel_key};
#[doc(hidden)]
pub use chroma_key::{ChromaKeyOptions, chroma_key};
#[cfg(feature = "pipeline")]
pub(crate) use clipping::ends_at_one;
#[doc(hidden)]
pub use color_spill::{ColorSpillOptions, SpillChannel, SpillLimit, color_spill};
#[doc(hidden)]
pub use cut_out::Boundary;
pub use cut_out::{CutOut, CutOutOptions, MatteMethod, cut_out, cut_out_corrected};
#[doc(hidden)]
pub use difference_key::{DifferenceKeyOptions, difference_key};
#[doc(hidden)]
pub use film::{ColorUncertainty, film_planes};
pub use film::{FilmMatte, FilmOptions, film};
#[doc(hidden)]
pub use flow::{Flow, LightPath};
#[doc(hidden)]
pub use key::{KeyOptions, Keyed, Keying, Screen, key};
#[doc(hidden)]
pub use keying_screen::{ScreenPoint, keying_screen};
pub use outline::Outline;
pub use plate::{PlateOptions, ScreenPlate};
pub(crate) use screen::mean_color;
#[doc(hidden)]
pub use screen::screen_color;
pub(crate) use screen_corners::from_top_left;
#[doc(hidden)]
pub use screen_corners::{ScreenCorners, screen_corners};
pub use segment::{Confidence, SegmentOptions, Segmentation, segment};
#[doc(hidden)]
pub use segment::{LumaMode, SegmentStep, Threshold};
#[cfg(feature = "pipeline")]
pub(crate) use segment::{PixelGroups, filled};
pub(crate) use stroke::check_strokes;
pub use stroke::{Claim, Stroke};
pub use triangulate::{TriangulateOptions, Triangulated, triangulate};
