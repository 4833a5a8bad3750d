//! Label: what is where in a picture, read from the same deep samples as the picture itself.

use crate::geom::Point2;
use crate::pixel::ObjectId;
use serde::{Deserialize, Serialize};

/// Everything known of the objects in one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Labels {
    /// Width and height of the picture, pixels.
    pub image: [u32; 2],
    /// One entry per object that touches the picture, in order of id.
    pub objects: Vec<ObjectLabel>,
}

/// Everything known of one object in one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectLabel {
    /// Which object of the scene.
    pub id: ObjectId,
    /// Index into the class list.
    pub class: u32,
    /// Outline projected into the picture and clipped to it, pixels.
    pub outline_px: Vec<Point2<f64>>,
    /// Box around the whole object as far as it lies in the picture.
    pub amodal_box: BBox,
    /// Box around what is seen of it; empty when nothing is.
    pub visible_box: BBox,
    /// Seen share of its coverage, 0 to 1.
    pub visible_fraction: f64,
    /// Objects that lie over it, by the topmost rule.
    pub covered_by: Vec<ObjectId>,
}

impl ObjectLabel {
    /// Nothing lies over it: it can be picked.
    pub fn is_topmost(&self) -> bool {
        self.covered_by.is_empty()
    }
}

/// An axis-parallel box in pixels, `[x0, x1) x [y0, y1)`; the default is empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BBox {
    /// Left edge.
    pub x0: f64,
    /// Top edge.
    pub y0: f64,
    /// Right edge.
    pub x1: f64,
    /// Bottom edge.
    pub y1: f64,
}
