//! Render: a [`Shot`](crate::Shot) becomes deep samples, from which the picture and its labels are both folded.
//!
//! Everything in a shot is planar, so each map between two planes seen from a point is a homography and visibility
//! needs no ray tracing. Work is split by frequency: textures are sharp and are sampled several times a pixel
//! (`layers`), irradiance is smooth and is computed once per receiver on a coarse lattice of the picture and looked up
//! (`irradiance`). [`render_reference`] computes the same definition sample by sample without any of this, to test against.
//!
//! The definition: cards are Lambert surfaces that scatter a share `alpha` of the light and let the rest pass; lights
//! are seen through the product of `1 - alpha` of the cards in between; the plate is multiplied by the ratio of shadowed
//! to unshadowed irradiance of the surface `z = 0`; a pixel is the average under a Blackman-Harris window three pixels
//! wide.

mod block;
mod check;
mod cryptomatte;
mod deep;
mod float4;
mod grade;
mod half_plane;
mod interreflection;
mod irradiance;
mod lattice;
mod layers;
mod light_samples;
mod occluders;
mod opacity;
mod options;
mod pixel_filter;
mod ranges;
mod receiver;
mod reference;
mod resample;
mod shadow;
mod shadow_ray;
#[cfg(test)]
mod tests;
mod texel_grid;
mod texture;
mod transmittance;
mod view;

pub use check::check;
pub use cryptomatte::Cryptomatte;
pub(crate) use cryptomatte::{attribute_name, hex_id, id_of_name};
pub use deep::{render, render_coverage};
pub use interreflection::interreflect;
pub use options::RenderOptions;
pub use reference::render_reference;
