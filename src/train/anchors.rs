//! Anchors that fit a dataset's boxes.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// A box is within an anchor's reach if no side differs from the anchor's by this factor or more:
/// what equation 1 can decode, and YOLOv5's default.
pub(crate) const MAX_SIDE_RATIO: f64 = 4.0;
/// Maximum number of rounds of the clustering; it converges after a few dozen.
const MAX_ROUNDS: usize = 300;

/// Widths and heights that represent a dataset's boxes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anchors {
    /// Width and height, by area, in the unit of the boxes.
    pub sizes: Vec<[f64; 2]>,
    /// Mean intersection over union of a box with its best-fitting anchor, both centred at the same
    /// point.
    pub mean_iou: f64,
    /// Share of the boxes within reach of some anchor (`MAX_SIDE_RATIO`).
    pub best_possible_recall: f64,
}

/// `count` anchors for boxes of these widths and heights, in any unit; the same seed gives the same
/// anchors.
///
/// Boxes without area are ignored. Fewer boxes than anchors give one anchor per box; without boxes
/// there are none.
///
/// # Method
/// k-means with 1 - IoU as distance ([Redmon and Farhadi 2017], section 2), started by [k-means++].
///
/// [Redmon and Farhadi 2017]: https://arxiv.org/abs/1612.08242
/// [k-means++]: https://dl.acm.org/doi/10.5555/1283383.1283494
pub fn anchors(boxes: &[[f64; 2]], count: usize, seed: u64) -> Anchors {
    let mut boxes = boxes.to_vec();
    boxes.retain(|b| b.iter().all(|v| v.is_finite() && *v > 0.0));
    if boxes.is_empty() || count == 0 {
        return Anchors::default();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let first = spread_sizes(&boxes, count.min(boxes.len()), &mut rng);
    let mut sizes = cluster_sizes(&boxes, first);
    sizes.sort_by(|a, b| area(a).total_cmp(&area(b)));
    Anchors::measured(sizes, &boxes)
}

impl Anchors {
    /// How well the sizes fit boxes.
    fn measured(sizes: Vec<[f64; 2]>, boxes: &[[f64; 2]]) -> Self {
        let overlaps = boxes.iter().map(|b| nearest_size(b, &sizes).1);
        let reached = boxes
            .iter()
            .filter(|b| sizes.iter().any(|a| in_reach(b, a)));
        let count = boxes.len() as f64;
        Self {
            mean_iou: overlaps.sum::<f64>() / count,
            best_possible_recall: reached.count() as f64 / count,
            sizes,
        }
    }
}

/// Moves each anchor to the mean of the boxes that are nearest to it, until nothing changes.
fn cluster_sizes(boxes: &[[f64; 2]], mut sizes: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut before = Vec::new();
    for _ in 0..MAX_ROUNDS {
        let nearest = boxes.iter().map(|b| nearest_size(b, &sizes).0);
        let nearest: Vec<usize> = nearest.collect();
        if nearest == before {
            break;
        }
        sizes = (0..sizes.len())
            .map(|k| mean_of(boxes, &nearest, k).unwrap_or(sizes[k]))
            .collect();
        before = nearest;
    }
    sizes
}

/// Starting points far from each other: each drawn with a probability in proportion to the square
/// of its distance to the previous ones.
fn spread_sizes(boxes: &[[f64; 2]], count: usize, rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let mut sizes = vec![boxes[(uniform_share(rng) * boxes.len() as f64) as usize]];
    while sizes.len() < count {
        // By 1 - IoU from the size that fits best.
        let overlaps = boxes.iter().map(|b| nearest_size(b, &sizes).1);
        let squares: Vec<f64> = overlaps.map(|overlap| (1.0 - overlap).powi(2)).collect();
        let mut left = uniform_share(rng) * squares.iter().sum::<f64>();
        let drawn = squares.iter().position(|s| {
            left -= s;
            left < 0.0
        });
        sizes.push(boxes[drawn.unwrap_or(boxes.len() - 1)]);
    }
    sizes
}

/// From 0 to 1.
fn uniform_share(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn nearest_size(b: &[f64; 2], sizes: &[[f64; 2]]) -> (usize, f64) {
    let fits = sizes
        .iter()
        .map(|a| overlap_at_one_corner(a, b))
        .enumerate();
    fits.fold((0, f64::NEG_INFINITY), |best, (k, fit)| {
        if fit > best.1 { (k, fit) } else { best }
    })
}

/// Intersection over union of boxes with the same centre.
fn overlap_at_one_corner(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    let shared = a[0].min(b[0]) * a[1].min(b[1]);
    shared / (area(a) + area(b) - shared)
}

fn area(size: &[f64; 2]) -> f64 {
    size[0] * size[1]
}

fn mean_of(boxes: &[[f64; 2]], nearest: &[usize], k: usize) -> Option<[f64; 2]> {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for (b, _) in boxes.iter().zip(nearest).filter(|(_, n)| **n == k) {
        sum = [sum[0] + b[0], sum[1] + b[1]];
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|s| s / count))
}

fn in_reach(b: &[f64; 2], anchor: &[f64; 2]) -> bool {
    (0..2).all(|i| (b[i] / anchor[i]).max(anchor[i] / b[i]) < MAX_SIDE_RATIO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clear_groups_are_found() {
        let groups = [[10.0, 20.0], [60.0, 40.0], [200.0, 210.0]];
        let boxes: Vec<[f64; 2]> = (0..300)
            .map(|i| {
                let wobble = 1.0 + 0.05 * ((i * 37 % 11) as f64 / 5.0 - 1.0);
                groups[i % 3].map(|v| v * wobble)
            })
            .collect();
        let found = anchors(&boxes, 3, 1);
        for (a, g) in found.sizes.iter().zip(groups) {
            assert!(overlap_at_one_corner(a, &g) > 0.97, "{a:?} {g:?}");
        }
        assert!(found.mean_iou > 0.9 && found.best_possible_recall == 1.0);
    }

    #[test]
    fn boxes_out_of_reach_lower_the_recall() {
        let mut boxes = [[10.0, 10.0]; 5];
        boxes[4] = [1000.0, 10.0];
        let found = anchors(&boxes, 1, 1);
        assert!(found.best_possible_recall < 1.0);
    }

    #[test]
    fn awkward_boxes_are_left_out_and_few_boxes_are_their_own_anchors() {
        assert_eq!(anchors(&[], 9, 1), Anchors::default());
        let found = anchors(&[[0.0, 5.0], [f64::NAN, 1.0], [4.0, 5.0], [8.0, 2.0]], 9, 1);
        assert_eq!(found.sizes.len(), 2);
        assert!((found.mean_iou - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_same_seed_gives_the_same_anchors() {
        let boxes: Vec<[f64; 2]> = (1..200)
            .map(|i| [f64::from(i % 37 + 1), f64::from(i % 23 + 1)])
            .collect();
        assert_eq!(anchors(&boxes, 9, 4), anchors(&boxes, 9, 4));
    }
}
