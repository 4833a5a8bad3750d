//! Visibility of each object: one fold over the deep samples.

use crate::deep::{DeepImage, DeepSample};
use crate::label::mask::MaskBits;
use crate::label::{LabelOptions, RleMask};
use crate::pixel::ObjectId;
use crate::work::{self, Kind};
use serde::{Deserialize, Serialize};

/// What the deep samples give for one object.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ObjectVisibility {
    /// The pixels that the object covers, as if alone.
    pub(crate) amodal: RleMask,
    /// The pixels in which it is visible.
    pub(crate) visible: RleMask,
    /// Visible share of its coverage.
    pub(crate) fraction: f64,
    /// Its distance.
    pub(crate) depth: DepthRange,
}

impl ObjectVisibility {
    /// Whether it covers anything of any pixel.
    pub(crate) fn covers_any(&self) -> bool {
        self.depth.far > 0.0
    }
}

/// Distances of an object along the optical axis, metres, over the pixels that it touches; zeros if
/// it touches none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthRange {
    /// Of its nearest pixel.
    pub near: f64,
    /// The mean, by coverage as if alone.
    pub mean: f64,
    /// Of its farthest pixel.
    pub far: f64,
}

/// Sums and masks of one object while the fold runs.
struct VisibilityTally {
    amodal: MaskBits,
    visible: MaskBits,
    /// Coverage, its visible part, and coverage times depth, summed over pixels.
    alpha: f64,
    visible_alpha: f64,
    alpha_depth: f64,
    near: f64,
    far: f64,
}

impl VisibilityTally {
    fn new(size: [u32; 2]) -> Self {
        let none = MaskBits::new(size);
        Self {
            amodal: none.clone(),
            visible: none,
            alpha: 0.0,
            visible_alpha: 0.0,
            alpha_depth: 0.0,
            near: f64::INFINITY,
            far: 0.0,
        }
    }

    #[inline]
    fn add(&mut self, x: usize, y: usize, sample: &DeepSample, threshold: f32) {
        let (alpha, depth) = (f64::from(sample.alpha), f64::from(sample.depth.0));
        self.alpha += alpha;
        self.visible_alpha += f64::from(sample.visible);
        self.alpha_depth += alpha * depth;
        self.near = self.near.min(depth);
        self.far = self.far.max(depth);
        self.mark(x, y, sample, threshold);
    }

    /// Marks the pixel in the masks if the coverage is above the threshold.
    #[inline]
    fn mark(&mut self, x: usize, y: usize, sample: &DeepSample, threshold: f32) {
        if sample.alpha > threshold {
            self.amodal.insert(x, y);
        }
        if sample.visible > threshold {
            self.visible.insert(x, y);
        }
    }

    fn finish(self) -> ObjectVisibility {
        let masks = self.masks();
        if self.alpha <= 0.0 {
            return masks;
        }
        ObjectVisibility {
            fraction: (self.visible_alpha / self.alpha).clamp(0.0, 1.0),
            depth: self.depth(),
            ..masks
        }
    }

    fn masks(&self) -> ObjectVisibility {
        ObjectVisibility {
            amodal: self.amodal.mask(),
            visible: self.visible.mask(),
            ..ObjectVisibility::default()
        }
    }

    fn depth(&self) -> DepthRange {
        DepthRange {
            near: self.near,
            mean: self.alpha_depth / self.alpha,
            far: self.far,
        }
    }
}

/// Folds the samples of each object of `ids`, which are in ascending order; one entry per id.
///
/// Sums run in `f64`, row by row, so they are the same at any thread count.
pub(crate) fn fold_samples(
    deep: &DeepImage,
    ids: &[ObjectId],
    options: &LabelOptions,
) -> Vec<ObjectVisibility> {
    let size = [deep.width() as u32, deep.height() as u32];
    let mut tallies: Vec<_> = ids.iter().map(|_| VisibilityTally::new(size)).collect();
    let mut sample_count = 0;
    for y in 0..deep.height() {
        for (x, samples) in deep.row(y) {
            sample_count += samples.len();
            for sample in samples {
                if let Some(i) = index_of(sample.object, ids) {
                    tallies[i].add(x, y, sample, options.alpha_threshold);
                }
            }
        }
    }
    count_work(sample_count, ids.len());
    tallies.into_iter().map(VisibilityTally::finish).collect()
}

/// Index of an id among others in ascending order. The ids of a scene have no gaps, so there is
/// normally nothing to search.
#[inline]
fn index_of(id: ObjectId, ids: &[ObjectId]) -> Option<usize> {
    let without_gaps = id.0.wrapping_sub(ids.first()?.0) as usize;
    if ids.get(without_gaps) == Some(&id) {
        return Some(without_gaps);
    }
    ids.binary_search(&id).ok()
}

fn count_work(samples: usize, objects: usize) {
    work::add_all([
        (Kind::LabelSamples, samples as u64),
        (Kind::Masks, 2 * objects as u64),
    ]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_found_with_gaps_and_without() {
        let ids = [3, 4, 5, 9, u32::MAX].map(ObjectId);
        for (i, id) in ids.iter().enumerate() {
            assert_eq!(index_of(*id, &ids), Some(i));
        }
        for other in [0, 2, 6, 8, 10].map(ObjectId) {
            assert_eq!(index_of(other, &ids), None);
            assert_eq!(index_of(other, &[]), None);
        }
    }
}
