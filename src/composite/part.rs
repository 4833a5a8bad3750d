//! Parts of a picture as channels of floats.

use crate::deep::DeepImage;
use crate::io::exr::{ChannelSamples, Part};

/// Every pixel's column and row, in reading order.
pub(super) fn pixels_of(deep: &DeepImage) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (width, height) = (deep.width(), deep.height());
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)))
}

/// A part of float channels from the pixels in reading order.
pub(super) fn float_part<const N: usize>(
    name: impl Into<String>,
    names: [&str; N],
    values: impl Iterator<Item = [f32; N]>,
) -> Part {
    let channels = names.iter().zip(separate_planes(values));
    let channels = channels.map(|(name, plane)| (name.to_string(), ChannelSamples::Float(plane)));
    plain_part(name, channels.collect())
}

/// A part without metadata.
pub(super) fn plain_part(name: impl Into<String>, channels: Vec<(String, ChannelSamples)>) -> Part {
    Part {
        name: name.into(),
        channels,
        metadata: Vec::new(),
    }
}

/// The values of each channel.
fn separate_planes<const N: usize>(values: impl Iterator<Item = [f32; N]>) -> [Vec<f32>; N] {
    let mut planes = [const { Vec::new() }; N];
    for value in values {
        for (plane, v) in planes.iter_mut().zip(value) {
            plane.push(v);
        }
    }
    planes
}
