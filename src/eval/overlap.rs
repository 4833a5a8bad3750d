//! How much two boxes overlap.

use super::EvalImage;
use crate::geom::BBox;

/// Intersection over union; 0 where the union is empty.
pub fn iou(a: &BBox, b: &BBox) -> f64 {
    share(intersection(a, b), area(a) + area(b) - intersection(a, b))
}

/// Area of a box; 0 for an inverted one.
pub(super) fn area(b: &BBox) -> f64 {
    b.width().max(0.0) * b.height().max(0.0)
}

/// Area of the intersection of two boxes.
pub(super) fn intersection(a: &BBox, b: &BBox) -> f64 {
    shared_length([a.x0, a.x1], [b.x0, b.x1]) * shared_length([a.y0, a.y1], [b.y0, b.y1])
}

#[inline]
fn shared_length(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[1].min(b[1]) - a[0].max(b[0])).max(0.0)
}

/// A ratio; 0 where the whole is 0.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

/// An index of boxes that finds those that overlap another box without testing each.
pub(super) struct BoxIndex {
    boxes: Vec<BBox>,
    /// Indices into `boxes`, in order of their left edges.
    order: Vec<usize>,
    /// The greatest right edge of the boxes up to each position in `order`.
    reach: Vec<f64>,
}

impl BoxIndex {
    /// Up to this many are tested one by one.
    const FEW: usize = 24;

    pub(super) fn new(boxes: impl IntoIterator<Item = BBox>) -> Self {
        let boxes: Vec<BBox> = boxes.into_iter().collect();
        let order = if boxes.len() > Self::FEW {
            order_by_left(&boxes)
        } else {
            Vec::new()
        };
        Self {
            reach: running_right_edges(&boxes, &order),
            order,
            boxes,
        }
    }

    pub(super) fn for_truth(sheet: &EvalImage) -> Self {
        Self::new(sheet.truth.iter().map(|t| t.bbox))
    }

    pub(super) fn for_found(sheet: &EvalImage) -> Self {
        Self::new(sheet.found.iter().map(|f| f.bbox))
    }

    /// Indices of those that share more than an edge with a box, in ascending order.
    pub(super) fn near(&self, b: &BBox) -> Vec<usize> {
        if self.order.is_empty() {
            let all = 0..self.boxes.len();
            return all.filter(|&i| self.boxes[i].overlaps(b)).collect();
        }
        let mut near = self.side_by_side(b).to_vec();
        near.retain(|&i| self.boxes[i].overlaps(b));
        near.sort_unstable();
        near
    }

    /// All boxes that may share columns with `b`, from the left.
    fn side_by_side(&self, b: &BBox) -> &[usize] {
        let end = self.order.partition_point(|&i| self.boxes[i].x0 < b.x1);
        let start = self.reach[..end].partition_point(|&reach| reach <= b.x0);
        &self.order[start..end]
    }
}

/// The greatest right edge of the boxes up to each position in `order`.
fn running_right_edges(boxes: &[BBox], order: &[usize]) -> Vec<f64> {
    let edges = order.iter().scan(f64::NEG_INFINITY, |reach, &i| {
        *reach = reach.max(boxes[i].x1);
        Some(*reach)
    });
    edges.collect()
}

/// Indices of the boxes, from the leftmost.
fn order_by_left(boxes: &[BBox]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| boxes[a].x0.total_cmp(&boxes[b].x0));
    order
}

#[cfg(test)]
mod tests {
    use super::super::tests::bbox;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn the_index_finds_what_looking_at_each_finds(
            sides in prop::collection::vec([-20_i32..120, -20..120, -3..60, -3..60], 0..80),
            asked in [-20_i32..120, -20..120, -3..60, -3..60],
        ) {
            let made = |[x, y, w, h]: [i32; 4]| bbox(x.into(), y.into(), w.into(), h.into());
            let (boxes, asked): (Vec<BBox>, BBox) = (sides.into_iter().map(made).collect(), made(asked));
            let near = BoxIndex::new(boxes.iter().copied()).near(&asked);
            let sharing: Vec<usize> = (0..boxes.len()).filter(|&i| intersection(&boxes[i], &asked) > 0.0).collect();
            prop_assert!(sharing.iter().all(|i| near.contains(i)), "{near:?} without some of {sharing:?}");
            prop_assert!(near.is_sorted() && near.iter().all(|&i| boxes[i].overlaps(&asked)));
        }
    }

    #[test]
    fn overlap_is_symmetric_and_one_only_for_the_same_box() {
        let (a, b) = (bbox(0.0, 0.0, 4.0, 4.0), bbox(2.0, 0.0, 4.0, 4.0));
        assert_eq!(
            (iou(&a, &a), iou(&a, &b), iou(&b, &a)),
            (1.0, 1.0 / 3.0, 1.0 / 3.0)
        );
    }

    #[test]
    fn boxes_apart_or_without_area_share_nothing() {
        let a = bbox(0.0, 0.0, 4.0, 4.0);
        assert_eq!(iou(&a, &bbox(5.0, 5.0, 4.0, 4.0)), 0.0);
        assert_eq!(
            iou(&bbox(1.0, 1.0, 0.0, 0.0), &bbox(1.0, 1.0, 0.0, 0.0)),
            0.0
        );
        assert_eq!(iou(&a, &bbox(3.0, 3.0, -2.0, -2.0)), 0.0);
    }
}
