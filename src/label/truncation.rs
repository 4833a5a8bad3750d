//! How far an object extends beyond the picture.
//!
//! # Method
//! Truncation as defined by KITTI ("refers to the object leaving image boundaries", 0 to 1), by
//! area: the share of the outline, as the camera sees it, that is beyond the picture's edges.
//! Samples end at the edges, outlines do not. What a barrel lens cannot show is outside, at the
//! scale of its fold.

use crate::geom::BBox;
use crate::label::outline::{self, SLIVER_AREA_PX2};
use crate::scene::{Card, Shot};
use geo::{Area, MultiPolygon};
use serde::{Deserialize, Serialize};

/// How far an object extends beyond the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truncation {
    /// Share of its outline's area beyond the picture's edges, 0 to 1.
    pub fraction: f64,
    /// Box around all of its outline, inside the picture or not.
    pub whole_box: BBox,
    /// Whether the share is above [`LabelOptions::max_truncation`](crate::label::LabelOptions).
    pub above_max: bool,
}

impl Truncation {
    /// Of a card whose part inside the picture is known.
    pub(crate) fn new(card: &Card, shot: &Shot, inside: &MultiPolygon<f64>, max: f64) -> Self {
        let whole = outline::whole(card, &shot.camera, &shot.distortion());
        let fraction = outside_fraction(&whole, inside);
        Self {
            fraction,
            whole_box: outline::bounds(&whole),
            above_max: fraction > max,
        }
    }
}

/// Less than a rounding error outside counts as inside.
fn outside_fraction(whole: &MultiPolygon<f64>, inside: &MultiPolygon<f64>) -> f64 {
    let all = whole.unsigned_area();
    let outside = all - inside.unsigned_area();
    if outside <= SLIVER_AREA_PX2 {
        return 0.0;
    }
    outside / all
}
