//! What is in the way in a picture and has no label.

use crate::geom::{BBox, Point2};
use crate::label::{DepthRange, RleMask};
use crate::pixel::ObjectId;
use serde::{Deserialize, Serialize};

/// Everything known of one distractor in one picture; fields are those of an
/// [`ObjectLabel`](crate::label::ObjectLabel), which is what has a class.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distractor {
    /// Which object of the scene.
    pub id: ObjectId,
    /// Outline projected into the picture and clipped to it, pixels: one ring per part.
    pub outline_px: Vec<Vec<Point2<f64>>>,
    /// Box around all of it.
    pub amodal_box: BBox,
    /// Box around what is seen of it; empty when nothing is.
    pub visible_box: BBox,
    /// Pixels that it covers, seen or not.
    pub amodal_mask: RleMask,
    /// Pixels in which it is seen.
    pub visible_mask: RleMask,
    /// Seen share of its coverage, 0 to 1.
    pub visible_fraction: f64,
    /// How far away it is.
    pub depth: DepthRange,
    /// Objects and distractors that lie over it, by their outlines, in order of id.
    pub covered_by: Vec<ObjectId>,
}
