//! From pixels to features at strides 8, 16 and 32.

use super::blocks::{Builder, Conv, Csp, Pyramid};
use super::network::Description;
use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// Residual blocks of the four stages at full depth: YOLOv5's.
const BLOCKS: [usize; 4] = [3, 6, 9, 3];
/// Side of the first layer's kernel: it takes the place of a focus layer.
const STEM: usize = 6;

/// Cross-stage blocks between convolutions that halve the size.
#[derive(Module, Debug)]
pub(super) struct Backbone<B: Backend> {
    stem: Conv<B>,
    halve: Vec<Conv<B>>,
    stages: Vec<Csp<B>>,
    pyramid: Pyramid<B>,
}

impl<B: Backend> Backbone<B> {
    pub(super) fn new(description: &Description, builder: &mut Builder<'_, B>) -> Self {
        let widths = description.widths();
        let stem = builder.conv([3, widths[0]], STEM, 2);
        let (mut halve, mut stages) = (Vec::new(), Vec::new());
        for (pair, blocks) in widths.windows(2).zip(BLOCKS) {
            halve.push(builder.conv([pair[0], pair[1]], 3, 2));
            stages.push(builder.csp([pair[1], pair[1]], description.blocks(blocks), true));
        }
        Self { stem, halve, stages, pyramid: builder.pyramid(widths[4]) }
    }

    /// Features at strides 8, 16 and 32.
    pub(super) fn forward(&self, x: Tensor<B, 4>) -> [Tensor<B, 4>; 3] {
        let down = |x, i: usize| self.stages[i].forward(self.halve[i].forward(x));
        let quarter = down(self.stem.forward(x), 0);
        let fine = down(quarter, 1);
        let middle = down(fine.clone(), 2);
        let coarse = self.pyramid.forward(down(middle.clone(), 3));
        [fine, middle, coarse]
    }
}
