//! Filters on pictures whose pixels may be averaged (`Mix`), and on masks.
//!
//! One border rule for all: the window is cut off at the border and what is left of it is averaged
//! (or, for a mask, inspected). No filter invents pixels outside the picture, so a constant picture
//! stays constant. The exception is `sample_bilinear`, which treats the outside as empty.
//!
//! Every filter takes a picture of any size, the empty one included, and gives the same bits at any
//! thread count.

mod blur;
mod distance;
mod morphology;
mod pyramid;
mod resize;
mod sample;
mod separable;

#[doc(hidden)]
pub use blur::{box_blur, gaussian_blur};
#[doc(hidden)]
pub use distance::depth;
#[doc(hidden)]
pub use morphology::dilate;
pub(crate) use morphology::{erode, largest_around};
pub use pyramid::Pyramid;
#[doc(hidden)]
pub use pyramid::{expand, halve, reduce};
#[doc(hidden)]
pub use resize::resize;
pub(crate) use sample::{
    sample_bilinear, sample_bilinear_clamped, sample_blurred, sample_cubic, sample_cubic_clamped,
    sample_nearest,
};
