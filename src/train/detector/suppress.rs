//! One box an object: the surest of those that overlap.

use crate::eval::{FoundBox, iou};

/// Keeps the surest box of a class wherever boxes overlap by more than `limit`; at most `count`, by confidence.
pub(super) fn suppress(mut found: Vec<FoundBox>, limit: f64, count: usize) -> Vec<FoundBox> {
    found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    let mut kept: Vec<FoundBox> = Vec::new();
    for f in found {
        if kept.len() == count {
            break;
        }
        if kept.iter().all(|k| k.class != f.class || iou(&k.bbox, &f.bbox) <= limit) {
            kept.push(f);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::BBox;

    fn found(class: u32, x0: f64, confidence: f64) -> FoundBox {
        FoundBox { class, bbox: BBox { x0, y0: 0.0, x1: x0 + 10.0, y1: 10.0 }, confidence }
    }

    #[test]
    fn the_surest_of_overlapping_boxes_of_a_class_stays() {
        let all = vec![found(0, 0.0, 0.5), found(0, 1.0, 0.9), found(1, 1.0, 0.4), found(0, 30.0, 0.1)];
        let kept = suppress(all.clone(), 0.6, 300);
        assert_eq!(kept, [found(0, 1.0, 0.9), found(1, 1.0, 0.4), found(0, 30.0, 0.1)]);
        assert_eq!(suppress(all, 0.6, 1).len(), 1);
        assert!(suppress(Vec::new(), 0.6, 300).is_empty());
    }
}
