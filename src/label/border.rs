//! Masks as polygons, for readers without pixels.

use crate::geom::Point2;
use crate::label::{Labels, ObjectLabel, trace};
use crate::pixel::ObjectId;
use serde::{Deserialize, Serialize};

/// The borders of an object's masks, pixels: one polygon for each part, clockwise in the picture,
/// holes joined by slits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Border {
    /// Id of the object in the scene.
    pub id: ObjectId,
    /// Index into the class list.
    pub class: u32,
    /// Around the pixels that it covers, visible or not.
    pub amodal: Vec<Vec<Point2<f64>>>,
    /// Around the pixels in which it is visible.
    pub visible: Vec<Vec<Point2<f64>>>,
}

/// The borders of all objects, in order of id, simplified as [`trace::polygons`] are.
pub fn borders(labels: &Labels, tolerance_px: f64) -> Vec<Border> {
    let objects = labels.objects.iter();
    objects
        .map(|object| Border::new(object, tolerance_px))
        .collect()
}

impl Border {
    fn new(object: &ObjectLabel, tolerance_px: f64) -> Self {
        Self {
            id: object.id,
            class: object.class,
            amodal: trace::polygons(&object.amodal_mask, tolerance_px),
            visible: trace::polygons(&object.visible_mask, tolerance_px),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::RleMask;

    #[test]
    fn an_object_of_which_nothing_is_seen_has_a_whole_border_and_none_that_is_seen() {
        let amodal_mask = RleMask::from_fn([9, 9], |x, y| x + y < 8);
        let object = ObjectLabel {
            id: ObjectId(3),
            class: 2,
            amodal_mask,
            ..ObjectLabel::default()
        };
        let labels = Labels {
            image: [9, 9],
            objects: vec![object],
            ..Labels::default()
        };
        let [exact, loose] = [0.0, 1.0].map(|tolerance| borders(&labels, tolerance).remove(0));
        assert_eq!(
            (exact.id, exact.class, exact.visible.len()),
            (ObjectId(3), 2, 0)
        );
        assert!(
            exact.amodal[0].len() > 2 * loose.amodal[0].len(),
            "{loose:?}"
        );
    }
}
