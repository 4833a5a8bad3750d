//! Objects that are in the way in a picture and have no label.

use crate::geom::{BBox, Point2};
use crate::label::{DepthRange, RleMask};
use crate::pixel::ObjectId;
use serde::{Deserialize, Serialize};

/// Everything known about one distractor in one picture; the fields are those of an
/// [`ObjectLabel`](crate::label::ObjectLabel), which describes an object with a class.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distractor {
    /// Id of the object in the scene.
    pub id: ObjectId,
    /// Outline projected into the picture and clipped to it, pixels: one ring per part.
    pub outline_px: Vec<Vec<Point2<f64>>>,
    /// Box around all of it.
    pub amodal_box: BBox,
    /// Box around its visible part; empty if nothing is visible.
    pub visible_box: BBox,
    /// Pixels that it covers, visible or not.
    pub amodal_mask: RleMask,
    /// Pixels in which it is visible.
    pub visible_mask: RleMask,
    /// Visible share of its coverage, 0 to 1.
    pub visible_fraction: f64,
    /// Its distance.
    pub depth: DepthRange,
    /// Objects and distractors that cover it, by their outlines, in order of id.
    pub covered_by: Vec<ObjectId>,
}
