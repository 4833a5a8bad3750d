//! How much two boxes share.

use crate::label::BBox;

/// Intersection over union; 0 where the union is empty.
pub fn iou(a: &BBox, b: &BBox) -> f64 {
    share(intersection(a, b), area(a) + area(b) - intersection(a, b))
}

/// Area of a box; 0 for one turned inside out.
pub(super) fn area(b: &BBox) -> f64 {
    b.width().max(0.0) * b.height().max(0.0)
}

/// Area of what two boxes share.
pub(super) fn intersection(a: &BBox, b: &BBox) -> f64 {
    let width = a.x1.min(b.x1) - a.x0.max(b.x0);
    let height = a.y1.min(b.y1) - a.y0.max(b.y0);
    width.max(0.0) * height.max(0.0)
}

/// A ratio; 0 where there is nothing to share.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::tests::bbox;
    use super::*;

    #[test]
    fn overlap_is_symmetric_and_one_only_for_the_same_box() {
        let (a, b) = (bbox(0.0, 0.0, 4.0, 4.0), bbox(2.0, 0.0, 4.0, 4.0));
        assert_eq!((iou(&a, &a), iou(&a, &b), iou(&b, &a)), (1.0, 1.0 / 3.0, 1.0 / 3.0));
    }

    #[test]
    fn boxes_apart_or_without_area_share_nothing() {
        let a = bbox(0.0, 0.0, 4.0, 4.0);
        assert_eq!(iou(&a, &bbox(5.0, 5.0, 4.0, 4.0)), 0.0);
        assert_eq!(iou(&bbox(1.0, 1.0, 0.0, 0.0), &bbox(1.0, 1.0, 0.0, 0.0)), 0.0);
        assert_eq!(iou(&a, &bbox(3.0, 3.0, -2.0, -2.0)), 0.0);
    }
}
