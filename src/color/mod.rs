//! Colour: transfer curves, primaries, hue and saturation, exactly.
//!
//! The library works in scene-linear light with Rec. 709 primaries and white D65
//! ([`LinearRgb`](crate::LinearRgb)). Everything else is converted once, where it enters or leaves:
//! display values by [`decode_srgb8`] and [`encode_srgb8`], other primaries by a [`ColorMatrix`].
//!
//! Curves are computed through the `libm` crate in `f64` and rounded once, never through the
//! system's own `powf`: the same input gives the same bytes on every machine. Matrices are derived
//! in `f64` from primaries and white points and stored as `f32`.

mod albedo;
mod hsv;
mod quantize;
mod space;
mod temperature;
mod transfer;

#[doc(hidden)]
pub use albedo::Albedo;
#[doc(hidden)]
pub use hsv::{Hsv, hsv_to_rgb, rgb_to_hsv, shift_hsv};
#[doc(hidden)]
pub use quantize::{decode_row, decode_srgb8, decode_srgb16, encode_srgb8, encode_srgb16};
pub use quantize::{from_srgb8, to_srgb8};
pub use space::RgbSpace;
pub(crate) use space::rgb_from_xyz;
#[doc(hidden)]
pub use space::{ColorMatrix, bradford, rgb_from_rgb, xyz_from_rgb};
#[doc(hidden)]
pub use temperature::planckian;
pub use transfer::{Curve, linear_to_srgb, srgb_to_linear};
