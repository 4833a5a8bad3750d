//! Box blur with Blender's two windows, sums in Blender's order.

use super::model::Behaviour;
use super::rows::{Pad, Rows, Window, around, window_rows};

/// A plane blurred by a box, along x and then along y.
pub(super) struct BoxBlur<S> {
    source: S,
    kernel: Kernel,
    height: usize,
    padded: Vec<f32>,
    window: Window,
}

/// The window of a blur.
enum Kernel {
    /// Cut off at the border: the mean of the samples inside, `radius` to each side.
    CutOff { radius: usize, columns: Vec<f32> },
    /// Repeating the border: the weights of the centre and of the samples at distance 1, 2, ...
    Repeat { weights: Vec<f32> },
}

impl Kernel {
    fn new(behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        if behaviour.repeats_border() {
            return Self::Repeat { weights: weights(size) };
        }
        // Beyond the picture's own size a window that is cut off at the border finds nothing more.
        let radius = (size - 1).min(width.max(height) - 1);
        Self::CutOff { radius, columns: (0..width).map(|x| around(x, radius, width).len() as f32).collect() }
    }

    fn radius(&self) -> usize {
        match self {
            Self::CutOff { radius, .. } => *radius,
            Self::Repeat { weights } => weights.len() - 1,
        }
    }
}

/// Weights of a box that repeats the border: 1 as far as `size / 2`, over their sum.
fn weights(size: usize) -> Vec<f32> {
    let radius = size as f32 / 2.0;
    let scale = 1.0 / radius;
    let taps = (1..=radius.ceil() as usize).map(|i| if i as f32 * scale <= 1.0 { 1.0 } else { 0.0 });
    let mut weights: Vec<f32> = std::iter::once(1.0).chain(taps).collect();
    let total: f32 = 1.0 + 2.0 * weights[1..].iter().sum::<f32>();
    weights.iter_mut().for_each(|w| *w /= total);
    weights
}

impl<S: Rows> BoxBlur<S> {
    /// A blur of `size` (at least 1) over a plane of that width and height.
    pub(super) fn new(source: S, behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        let kernel = Kernel::new(behaviour, size, (width, height));
        let radius = kernel.radius();
        let padded = vec![0.0; width + 2 * radius];
        Self { source, kernel, height, padded, window: Window::new(width, window_rows(radius, height)) }
    }
}

impl<S: Rows> Rows for BoxBlur<S> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let Self { source, kernel, height, padded, window } = self;
        window.cover(around(y, kernel.radius(), *height), |y, row| {
            let radius = kernel.radius();
            source.row(y, &mut padded[radius..radius + row.len()]);
            kernel.along_x(padded, row);
        });
        kernel.along_y(window, y, *height, out);
    }
}

impl Kernel {
    fn along_x(&self, padded: &mut [f32], out: &mut [f32]) {
        let (radius, width) = (self.radius(), out.len());
        match self {
            Self::CutOff { columns, .. } => {
                Pad::Value(0.0).fill(padded, radius);
                sum(out, 2 * radius + 1, |i| &padded[i..i + width]);
                out.iter_mut().zip(columns).for_each(|(v, n)| *v /= n);
            }
            Self::Repeat { weights } => {
                Pad::Repeat.fill(padded, radius);
                let at = |offset: usize| &padded[offset..offset + width];
                weigh(out, weights, at(radius), |i| (at(radius + i), at(radius - i)));
            }
        }
    }

    /// Blender counts rows from the bottom, so sums run upwards.
    fn along_y(&self, window: &Window, y: usize, height: usize, out: &mut [f32]) {
        match self {
            Self::CutOff { radius, .. } => {
                let rows = around(y, *radius, height);
                sum(out, rows.len(), |i| window.row(rows.end - 1 - i));
                let count = rows.len() as f32;
                out.iter_mut().for_each(|v| *v /= count);
            }
            Self::Repeat { weights } => {
                let below = |i: usize| window.row((y + i).min(height - 1));
                weigh(out, weights, window.row(y), |i| (window.row(y.saturating_sub(i)), below(i)));
            }
        }
    }
}

/// Adds up `count` rows in order.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn sum<'a, F: Fn(usize) -> &'a [f32]>(out: &mut [f32], count: usize, row: F) {
    out.fill(0.0);
    for i in 0..count {
        for (o, s) in out.iter_mut().zip(row(i)) {
            *o += s;
        }
    }
}

/// Adds up weighted rows: the centre, then at each distance the one ahead and the one behind.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn weigh<'a, F: Fn(usize) -> (&'a [f32], &'a [f32])>(out: &mut [f32], weights: &[f32], centre: &[f32], pair: F) {
    let w = weights[0];
    out.iter_mut().zip(centre).for_each(|(o, c)| *o = w * c);
    for (i, &w) in weights.iter().enumerate().skip(1) {
        let (ahead, behind) = pair(i);
        for ((o, a), b) in out.iter_mut().zip(ahead).zip(behind) {
            *o = *o + w * a + w * b;
        }
    }
}
