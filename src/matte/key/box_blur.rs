//! Box blur with Blender's two windows, sums in Blender's order.

use super::calm::{Calm, Extremes, RUN_COLUMNS};
use super::model::Behaviour;
use super::options::{Blur, KeyOptions};
use super::rows::{Pad, Rows, Source, Window, rows_around, window_rows};
use super::running_blur::{BoxReach, RunningBlur};
use std::ops::Range;

/// A plane blurred by a box of `size` (at least 1), in the way that the options ask for.
pub(super) fn box_blurred<'a>(
    source: impl Rows + 'a,
    options: &KeyOptions,
    size: u32,
    picture: (usize, usize),
) -> Source<'a> {
    let (behaviour, size) = (options.profile.behaviour(), size as usize);
    match options.blur {
        Blur::Exact => Box::new(BoxBlur::new(source, behaviour, size, picture)),
        Blur::RunningSum => {
            let reach = BoxKernel::new(behaviour, size, picture).reach();
            Box::new(RunningBlur::new(source, reach, picture))
        }
    }
}

/// A plane blurred by a box, along x and then along y.
struct BoxBlur<S> {
    source: S,
    kernel: BoxKernel,
    height: usize,
    padded: Vec<f32>,
    window: Window,
    /// Extremes of the source's latest row, and of the rows blurred along x.
    calm_source: Calm,
    calm: Calm,
}

/// The window of a blur.
enum BoxKernel {
    /// Cut off at the border: the mean of the samples inside, `radius` to each side.
    CutOff { radius: usize, columns: Vec<f32> },
    /// Repeating the border: the weights of the centre and of the samples at distance 1, 2, ...,
    /// and what they make of a plane of 1.
    Repeat { weights: Vec<f32>, of_ones: f32 },
}

impl BoxKernel {
    fn new(behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        if behaviour.repeats_border() {
            let weights = weights(size);
            let of_ones = weights[1..].iter().fold(weights[0], |sum, w| sum + w + w);
            return Self::Repeat { weights, of_ones };
        }
        // Beyond the picture's own size a window that is cut off at the border finds nothing more.
        let radius = (size - 1).min(width.max(height) - 1);
        Self::CutOff {
            radius,
            columns: (0..width)
                .map(|x| rows_around(x, radius, width).len() as f32)
                .collect(),
        }
    }

    /// The samples whose weight is not 0.
    fn reach(&self) -> BoxReach {
        match self {
            Self::CutOff { radius, .. } => BoxReach {
                radius: *radius,
                repeat: false,
            },
            Self::Repeat { weights, .. } => {
                let radius = weights.iter().filter(|w| **w > 0.0).count() - 1;
                BoxReach {
                    radius,
                    repeat: true,
                }
            }
        }
    }

    fn radius(&self) -> usize {
        match self {
            Self::CutOff { radius, .. } => *radius,
            Self::Repeat { weights, .. } => weights.len() - 1,
        }
    }
}

/// Weights of a box that repeats the border: 1 as far as `size / 2`, over their sum.
fn weights(size: usize) -> Vec<f32> {
    let radius = size as f32 / 2.0;
    let scale = 1.0 / radius;
    let taps =
        (1..=radius.ceil() as usize).map(|i| if i as f32 * scale <= 1.0 { 1.0 } else { 0.0 });
    let mut weights: Vec<f32> = std::iter::once(1.0).chain(taps).collect();
    let total: f32 = 1.0 + 2.0 * weights[1..].iter().sum::<f32>();
    weights.iter_mut().for_each(|w| *w /= total);
    weights
}

impl<S: Rows> BoxBlur<S> {
    /// A blur of `size` (at least 1) over a plane of that width and height.
    fn new(source: S, behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        let kernel = BoxKernel::new(behaviour, size, (width, height));
        let capacity = window_rows(kernel.radius(), height);
        Self {
            source,
            height,
            padded: vec![0.0; width + 2 * kernel.radius()],
            window: Window::new(width, capacity),
            calm_source: Calm::new(width, 1),
            calm: Calm::new(width, capacity),
            kernel,
        }
    }
}

impl<S: Rows> Rows for BoxBlur<S> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let Self {
            source,
            kernel,
            height,
            padded,
            window,
            calm_source,
            calm,
        } = self;
        window.cover_rows(rows_around(y, kernel.radius(), *height), |y, row| {
            let inside = kernel.radius()..kernel.radius() + row.len();
            source.row(y, &mut padded[inside.clone()]);
            calm_source.note_row(0, &padded[inside]);
            kernel.along_x(padded, calm_source, row);
            calm.note_row(y, row);
        });
        kernel.along_y(window, calm, (y, *height), out);
    }
}

impl BoxKernel {
    /// A plane of 0 stays what it is, and so nearly does a plane of 1.
    fn settled_value(&self, near: Extremes) -> Option<f32> {
        let is =
            |v: f32| near.least.to_bits() == v.to_bits() && near.greatest.to_bits() == v.to_bits();
        let of_ones = if let Self::Repeat { of_ones, .. } = self {
            *of_ones
        } else {
            1.0
        };
        if is(0.0) {
            Some(0.0)
        } else {
            is(1.0).then_some(of_ones)
        }
    }

    fn along_x(&self, padded: &mut [f32], calm: &mut Calm, out: &mut [f32]) {
        let radius = self.radius();
        let repeat = matches!(self, Self::Repeat { .. });
        Pad::repeat_or(repeat, 0.0).fill_margins(padded, radius);
        calm.fill_row(
            out,
            (0, 0..1, radius),
            |_, near| self.settled_value(near),
            |columns, out| self.compute_along_x(padded, columns, out),
        );
    }

    /// Blurs a few columns of a row between margins.
    fn compute_along_x(&self, padded: &[f32], columns: Range<usize>, out: &mut [f32]) {
        let radius = self.radius();
        let at = |offset: usize| &padded[columns.start + offset..columns.end + offset];
        match self {
            Self::CutOff {
                columns: counts, ..
            } => {
                mean_of_rows(out, 2 * radius + 1, at, &counts[columns.clone()]);
            }
            Self::Repeat { weights, .. } => {
                weighted_sum(out, weights, at(radius), |i| {
                    [at(radius + i), at(radius - i)]
                });
            }
        }
    }

    /// Blender counts rows from the bottom, so sums run upwards.
    fn along_y(
        &self,
        window: &Window,
        calm: &mut Calm,
        (y, height): (usize, usize),
        out: &mut [f32],
    ) {
        let rows = rows_around(y, self.radius(), height);
        calm.fill_row(
            out,
            (y, rows, 0),
            |_, near| self.settled_value(near),
            |columns, out| self.compute_along_y(window, (y, height), columns, out),
        );
    }

    /// Blurs a few columns of row `y`.
    fn compute_along_y(
        &self,
        window: &Window,
        (y, height): (usize, usize),
        columns: Range<usize>,
        out: &mut [f32],
    ) {
        let at = |row: usize| &window.row(row)[columns.clone()];
        match self {
            Self::CutOff { .. } => {
                let rows = rows_around(y, self.radius(), height);
                let counts = [rows.len() as f32; RUN_COLUMNS];
                mean_of_rows(
                    out,
                    rows.len(),
                    |i| at(rows.end - 1 - i),
                    &counts[..columns.len()],
                );
            }
            Self::Repeat { weights, .. } => {
                weighted_sum(out, weights, at(y), |i| {
                    [at(y.saturating_sub(i)), at((y + i).min(height - 1))]
                });
            }
        }
    }
}

/// Rows added in one go, so that sums stay in registers; the order is that of one at a time.
const ROWS_AT_ONCE: usize = 4;

/// Adds up `count` rows in order, over how many samples of each sum lie inside the picture.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn mean_of_rows<'a, F: Fn(usize) -> &'a [f32]>(
    out: &mut [f32],
    count: usize,
    row: F,
    inside: &[f32],
) {
    // Longer than elsewhere: both loops are compiled for each vector width in one piece.
    out.fill(0.0);
    let whole = count - count % ROWS_AT_ONCE;
    for i in (0..whole).step_by(ROWS_AT_ONCE) {
        let rows = row(i)
            .iter()
            .zip(row(i + 1))
            .zip(row(i + 2))
            .zip(row(i + 3));
        for (o, (((a, b), c), d)) in out.iter_mut().zip(rows) {
            *o = *o + a + b + c + d;
        }
    }
    for i in whole..count {
        for (o, s) in out.iter_mut().zip(row(i)) {
            *o += s;
        }
    }
    out.iter_mut().zip(inside).for_each(|(o, n)| *o /= n);
}

/// Adds up weighted rows: the centre, then at each distance the one ahead and the one behind.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn weighted_sum<'a, F: Fn(usize) -> [&'a [f32]; 2]>(
    out: &mut [f32],
    weights: &[f32],
    centre: &[f32],
    pair: F,
) {
    let w = weights[0];
    out.iter_mut().zip(centre).for_each(|(o, c)| *o = w * c);
    for (i, &w) in weights.iter().enumerate().skip(1) {
        let [ahead, behind] = pair(i);
        for ((o, a), b) in out.iter_mut().zip(ahead).zip(behind) {
            *o = *o + w * a + w * b;
        }
    }
}
