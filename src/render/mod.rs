//! Render: a [`Shot`](crate::Shot) becomes deep samples, from which both the picture and its labels
//! are computed.
//!
//! Everything in a shot is planar, so each map between two planes seen from a point is a homography
//! and visibility needs no ray tracing. Work is split by frequency: textures are sharp and are
//! sampled several times per pixel (`layers`); irradiance is smooth and is computed once per
//! receiver on a coarse lattice of the picture and interpolated (`irradiance`).
//! [`render_reference`] computes the same definition sample by sample without any of this, for
//! tests.
//!
//! The definition: cards are Lambertian surfaces that scatter a share `alpha` of the light and
//! transmit the rest; lights are attenuated by the product of `1 - alpha` of the cards in between;
//! the plate is multiplied by the ratio of shadowed to unshadowed irradiance of the surface
//! `z = 0`; a pixel is the average under a Blackman-Harris window three pixels wide.
//!
//! ```
//! use petcomp::geom::{Pose, Quad};
//! use petcomp::render::{RenderOptions, render};
//! use petcomp::scene::Card;
//! use petcomp::{Camera, Image, LinearRgb, ObjectId, PremulRgba, Shot};
//!
//! let quad = Quad { world_from_card: Pose::translation(0.0, 0.0, 0.05), size: [0.2, 0.1] };
//! let half = Image::filled(8, 8, PremulRgba::new(0.25, 0.25, 0.25, 0.5));
//! let shot = Shot::new(Camera::looking_down(1.0, 80.0, [64, 48]))
//!     .with_card(Card::new(ObjectId(1), quad, half))
//!     .with_ambient(LinearRgb::WHITE);
//! let deep = render(&shot, &RenderOptions::default());
//! let sample = deep.at(32, 24)[0];
//! assert!((sample.alpha - 0.5).abs() < 1e-5 && (sample.depth.0 - 0.95).abs() < 1e-5);
//! ```

mod block;
mod card_texel;
mod check;
mod cryptomatte;
mod deep;
mod detail;
mod float4;
mod float8;
mod grade;
mod half_plane;
mod interreflection;
mod irradiance;
mod lattice;
mod layers;
mod lens;
mod light_samples;
mod occluders;
mod opacity;
mod options;
mod pixel_filter;
mod ranges;
mod receiver;
mod reference;
mod refraction;
mod resample;
mod retouch;
mod shadow;
mod shadow_ray;
#[cfg(test)]
mod tests;
mod texel_extent;
mod texel_grid;
mod texture;
mod transmittance;
mod view;

#[doc(hidden)]
pub use check::check;
pub use cryptomatte::Cryptomatte;
pub use deep::{render, render_coverage};
pub(crate) use deep::{render_beyond, render_unhidden};
pub use options::RenderOptions;
#[doc(hidden)]
pub use reference::render_reference;
#[doc(hidden)]
pub use retouch::retouched_fully;

/// Fills a buffer with `n` copies of a value, reusing its memory.
#[inline]
fn refill<T: Copy>(buffer: &mut Vec<T>, n: usize, value: T) {
    buffer.clear();
    buffer.resize(n, value);
}
