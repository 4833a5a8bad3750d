//! What is seen of each object: one fold over the deep samples.

use crate::label::{BBox, LabelOptions};
use crate::pixel::ObjectId;
use crate::render::DeepImage;

/// What the deep samples tell of one object.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// Around the pixels that the object covers, as if alone.
    pub(crate) amodal_box: BBox,
    /// Around the pixels in which it is seen.
    pub(crate) visible_box: BBox,
    /// Its own coverage, summed over the picture, pixels.
    pub(crate) alpha: f64,
    /// The seen part of that, pixels.
    pub(crate) visible: f64,
}

impl Seen {
    /// Seen share of the coverage, 0 to 1; 0 where there is no coverage.
    pub(crate) fn fraction(&self) -> f64 {
        if self.alpha > 0.0 { (self.visible / self.alpha).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// Folds the samples of each object of `ids`, which are in ascending order; one entry per id.
///
/// Sums run in `f64`, row by row, so they are the same at any thread count.
pub(crate) fn fold(deep: &DeepImage, ids: &[ObjectId], options: &LabelOptions) -> Vec<Seen> {
    let mut seen = vec![Seen::default(); ids.len()];
    for y in 0..deep.height() {
        for x in 0..deep.width() {
            for sample in deep.at(x, y) {
                let Ok(i) = ids.binary_search(&sample.object) else { continue };
                let object = &mut seen[i];
                object.alpha += f64::from(sample.alpha);
                object.visible += f64::from(sample.visible);
                if sample.alpha > options.alpha_threshold {
                    object.amodal_box = object.amodal_box.with_pixel(x, y);
                }
                if sample.visible > options.alpha_threshold {
                    object.visible_box = object.visible_box.with_pixel(x, y);
                }
            }
        }
    }
    seen
}
