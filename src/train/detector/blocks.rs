//! What the network is built of: convolutions with normalisation, residual blocks, pooling over several reaches.

use super::dice::Dice;
use burn::module::{Module, Param};
use burn::nn::conv::{Conv2d, Conv2dConfig};
use burn::nn::pool::{MaxPool2d, MaxPool2dConfig};
use burn::nn::{BatchNorm, BatchNormConfig, Initializer, PaddingConfig2d};
use burn::tensor::activation::silu;
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};

/// Weight of a new batch in the running statistics, and what keeps the variance off 0: YOLOv5's.
const NORM_MOMENTUM: f64 = 0.03;
const NORM_EPSILON: f64 = 1e-3;
/// Side of the window of [`Pyramid`], pixels.
const WINDOW: usize = 5;

/// Draws weights for layers, one layer after the other.
pub(super) struct Builder<'a, B: Backend> {
    pub(super) dice: Dice,
    pub(super) device: &'a B::Device,
}

impl<B: Backend> Builder<'_, B> {
    /// A convolution that keeps the size but for its stride; weights uniform within 1 / sqrt(fan in).
    pub(super) fn plain(&mut self, [from, to]: [usize; 2], kernel: usize, stride: usize, bias: bool) -> Conv2d<B> {
        // The first layer's 6 x 6 kernel has the margin of a 5 x 5 one: it halves the size exactly.
        let margin = (kernel - 1) / 2;
        let mut conv = Conv2dConfig::new([from, to], [kernel, kernel])
            .with_stride([stride, stride])
            .with_padding(PaddingConfig2d::Explicit(margin, margin))
            .with_bias(bias)
            .with_initializer(Initializer::Zeros)
            .init(self.device);
        let reach = 1.0 / ((from * kernel * kernel) as f64).sqrt();
        let count = from * to * kernel * kernel;
        let weights: Vec<f32> = (0..count).map(|_| self.dice.between(-reach, reach) as f32).collect();
        let data = TensorData::new(weights, [to, from, kernel, kernel]);
        conv.weight = Param::from_tensor(Tensor::from_data(data, self.device));
        conv
    }

    pub(super) fn conv(&mut self, channels: [usize; 2], kernel: usize, stride: usize) -> Conv<B> {
        let norm =
            BatchNormConfig::new(channels[1]).with_momentum(NORM_MOMENTUM).with_epsilon(NORM_EPSILON).init(self.device);
        Conv { conv: self.plain(channels, kernel, stride, false), norm }
    }

    /// A cross-stage block of `count` residual blocks.
    pub(super) fn csp(&mut self, [from, to]: [usize; 2], count: usize, shortcut: bool) -> Csp<B> {
        let half = to / 2;
        Csp {
            through: self.conv([from, half], 1, 1),
            around: self.conv([from, half], 1, 1),
            blocks: (0..count).map(|_| self.bottleneck(half, shortcut)).collect(),
            join: self.conv([2 * half, to], 1, 1),
        }
    }

    fn bottleneck(&mut self, channels: usize, shortcut: bool) -> Bottleneck<B> {
        let narrow = self.conv([channels, channels], 1, 1);
        Bottleneck { narrow, wide: self.conv([channels, channels], 3, 1), shortcut }
    }

    pub(super) fn pyramid(&mut self, channels: usize) -> Pyramid<B> {
        let half = channels / 2;
        let margin = PaddingConfig2d::Explicit(WINDOW / 2, WINDOW / 2);
        let pool = MaxPool2dConfig::new([WINDOW, WINDOW]).with_strides([1, 1]).with_padding(margin).init();
        Pyramid { before: self.conv([channels, half], 1, 1), pool, after: self.conv([4 * half, channels], 1, 1) }
    }
}

/// Convolution, normalisation over the batch, SiLU.
#[derive(Module, Debug)]
pub(super) struct Conv<B: Backend> {
    conv: Conv2d<B>,
    norm: BatchNorm<B>,
}

impl<B: Backend> Conv<B> {
    pub(super) fn forward(&self, x: Tensor<B, 4>) -> Tensor<B, 4> {
        silu(self.norm.forward(self.conv.forward(x)))
    }
}

/// Two convolutions, added to what went in where `shortcut` says so.
#[derive(Module, Debug)]
pub(super) struct Bottleneck<B: Backend> {
    narrow: Conv<B>,
    wide: Conv<B>,
    shortcut: bool,
}

impl<B: Backend> Bottleneck<B> {
    fn forward(&self, x: Tensor<B, 4>) -> Tensor<B, 4> {
        let y = self.wide.forward(self.narrow.forward(x.clone()));
        if self.shortcut { x + y } else { y }
    }
}

/// Cross-stage partial block: half of the channels goes through the blocks, half around them.
///
/// # Method
/// [Wang et al. 2020], in the form of YOLOv5 with three convolutions.
///
/// [Wang et al. 2020]: https://arxiv.org/abs/1911.11929
#[derive(Module, Debug)]
pub(super) struct Csp<B: Backend> {
    through: Conv<B>,
    around: Conv<B>,
    blocks: Vec<Bottleneck<B>>,
    join: Conv<B>,
}

impl<B: Backend> Csp<B> {
    pub(super) fn forward(&self, x: Tensor<B, 4>) -> Tensor<B, 4> {
        let through = self.blocks.iter().fold(self.through.forward(x.clone()), |y, block| block.forward(y));
        self.join.forward(Tensor::cat(vec![through, self.around.forward(x)], 1))
    }
}

/// Greatest values over windows of three sizes, each pooled from the one before.
#[derive(Module, Debug)]
pub(super) struct Pyramid<B: Backend> {
    before: Conv<B>,
    pool: MaxPool2d,
    after: Conv<B>,
}

impl<B: Backend> Pyramid<B> {
    pub(super) fn forward(&self, x: Tensor<B, 4>) -> Tensor<B, 4> {
        let x = self.before.forward(x);
        let small = self.pool.forward(x.clone());
        let middle = self.pool.forward(small.clone());
        let large = self.pool.forward(middle.clone());
        self.after.forward(Tensor::cat(vec![x, small, middle, large], 1))
    }
}
