//! Pictures with their objects, as training wants them.

use crate::label::BBox;
use crate::{Image, Srgb8};

/// A picture whose longer side is the network's, with its objects.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// Name of the image, without folder and extension.
    pub name: String,
    /// Display-encoded.
    pub picture: Image<Srgb8>,
    /// In pixels of `picture`.
    pub objects: Vec<Labelled>,
    /// Width and height of the image that it was made from.
    pub size: [u32; 2],
}

/// An object of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labelled {
    /// Index into the class list.
    pub class: u32,
    /// Where.
    pub bbox: BBox,
}
