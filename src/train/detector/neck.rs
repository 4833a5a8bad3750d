//! Mixes features of the three strides: from coarse to fine, and back.

use super::blocks::{Builder, Conv, Csp};
use super::network::Description;
use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;
use burn::tensor::module::interpolate;
use burn::tensor::ops::{InterpolateMode, InterpolateOptions};

/// Residual blocks of each of the four mixing stages at full depth: YOLOv5's.
const BLOCKS: usize = 3;

/// A path aggregation network.
///
/// # Method
/// [Liu et al. 2018], with the cross-stage blocks of YOLOv5.
///
/// [Liu et al. 2018]: https://arxiv.org/abs/1803.01534
#[derive(Module, Debug)]
pub(super) struct Neck<B: Backend> {
    /// Coarse and middle features with fewer channels, before they are enlarged.
    narrow: Vec<Conv<B>>,
    up: Vec<Csp<B>>,
    halve: Vec<Conv<B>>,
    down: Vec<Csp<B>>,
}

impl<B: Backend> Neck<B> {
    pub(super) fn new(description: &Description, builder: &mut Builder<'_, B>) -> Self {
        let [_, _, fine, middle, coarse] = description.widths();
        let blocks = description.blocks(BLOCKS);
        Self {
            narrow: vec![builder.conv([coarse, middle], 1, 1), builder.conv([middle, fine], 1, 1)],
            up: vec![builder.csp([2 * middle, middle], blocks, false), builder.csp([2 * fine, fine], blocks, false)],
            halve: vec![builder.conv([fine, fine], 3, 2), builder.conv([middle, middle], 3, 2)],
            down: vec![
                builder.csp([2 * fine, middle], blocks, false),
                builder.csp([2 * middle, coarse], blocks, false),
            ],
        }
    }

    /// Features of the same strides, each knowing of the others.
    pub(super) fn forward(&self, [fine, middle, coarse]: [Tensor<B, 4>; 3]) -> [Tensor<B, 4>; 3] {
        let coarse = self.narrow[0].forward(coarse);
        let middle = self.up[0].forward(beside(twice(coarse.clone()), middle));
        let middle = self.narrow[1].forward(middle);
        let fine = self.up[1].forward(beside(twice(middle.clone()), fine));
        let middle = self.down[0].forward(beside(self.halve[0].forward(fine.clone()), middle));
        let coarse = self.down[1].forward(beside(self.halve[1].forward(middle.clone()), coarse));
        [fine, middle, coarse]
    }
}

fn beside<B: Backend>(a: Tensor<B, 4>, b: Tensor<B, 4>) -> Tensor<B, 4> {
    Tensor::cat(vec![a, b], 1)
}

/// Twice as wide and high, each value four times.
fn twice<B: Backend>(x: Tensor<B, 4>) -> Tensor<B, 4> {
    let [.., height, width] = x.dims();
    interpolate(x, [2 * height, 2 * width], InterpolateOptions::new(InterpolateMode::Nearest))
}
