//! Composite: deep samples over a shadowed plate.
//!
//! ```
//! use petcomp::{DeepImage, DeepSample, Image, LinearRgb, composite};
//!
//! let half = DeepSample {
//!     light: LinearRgb::grey(0.3),
//!     alpha: 0.5,
//!     visible: 0.5,
//!     ..DeepSample::default()
//! };
//! let deep = DeepImage::from_pixels(Image::filled(1, 1, LinearRgb::WHITE), [vec![half]]);
//! let plate = Image::filled(1, 1, LinearRgb::grey(0.8));
//! let frame = composite::frame(&deep, Some(&plate));
//! assert!((frame[(0, 0)].r - (0.3 + 0.5 * 0.8)).abs() < 1e-6);
//! ```

mod aov;
mod cryptomatte;
mod defocus;
mod effect;
mod exposed;
mod finish;
mod frame;
mod motion;
mod part;
mod picture;
mod poisson;
mod porter_duff;

#[doc(hidden)]
pub use aov::{Aov, front, parts};
#[doc(hidden)]
pub use cryptomatte::cryptomatte;
pub(crate) use exposed::Exposed;
pub use finish::finish;
#[doc(hidden)]
pub use frame::film;
pub use frame::frame;
pub use picture::picture;
