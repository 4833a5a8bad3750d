//! OpenEXR: scene-linear half or float in named channels, premultiplied alpha, text attributes.
//!
//! The header is read and checked first: the decoder allocates as much as a header declares, and a
//! failed allocation cannot be caught.

mod attributes;
mod blocks;
mod chroma;
mod parts;
mod read;
mod samples;
mod write;

pub use parts::{ChannelSamples, Part};
pub use read::Channel;
pub use write::Compression;

pub(crate) use ::exr::prelude::FlatSamples;
pub(crate) use parts::encode_parts;
pub(crate) use read::{channels, decode, header};
pub(crate) use samples::half_samples;
pub(crate) use write::encode;
