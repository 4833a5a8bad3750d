//! A mip level downsampled by a factor of up to two, with a transparent border.

use crate::image::Image;
use crate::pixel::Mix;
use crate::render::texel_grid::BORDER_TEXELS;
use bytemuck::Pod;

/// A mip level and a further downsampling factor.
#[derive(Clone, Copy)]
pub(super) struct DetailLevel {
    level: usize,
    /// Texels of the level per texel of the result, along each side: 1 up to 2.
    step: f64,
}

/// Texels with their border, row by row.
pub(super) struct BorderedTexels<T> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Vec<T>,
}

impl DetailLevel {
    /// A fractional level: the integer level before it, averaged further.
    pub(super) fn new(level: f64) -> Self {
        Self {
            level: level as usize,
            step: libm::exp2(level.fract()),
        }
    }

    /// Reads the required parts of a picture of floats from its pyramid, and finishes them row by
    /// row.
    pub(super) fn resample<'a, P: Pod, T: Mix>(
        &self,
        level: impl Fn(usize) -> &'a Image<P>,
        wanted: impl Fn(P) -> T,
        finish: impl Fn(&mut [T]),
    ) -> BorderedTexels<T> {
        let image = level(self.level);
        let columns = downsample_axis(image.width(), self.step);
        let rows = downsample_axis(image.height(), self.step);
        let mut out = BorderedTexels::transparent(columns.len(), rows.len());
        let mut averages = RowAverages::new(image);
        for (row, line) in rows.iter().zip(out.inner_lines()) {
            let line = &mut line[..columns.len()];
            average_columns(&columns, averages.average(row, &wanted), line);
            finish(line);
        }
        out
    }
}

impl<T: Mix> BorderedTexels<T> {
    /// Room for this many columns and rows inside the border.
    fn transparent(columns: usize, rows: usize) -> Self {
        let (width, height) = (columns + 2 * BORDER_TEXELS, rows + 2 * BORDER_TEXELS);
        Self {
            width,
            height,
            texels: vec![T::default(); width * height],
        }
    }

    /// Rows from the first inside the border on, without the border on their left.
    fn inner_lines(&mut self) -> impl Iterator<Item = &mut [T]> {
        self.texels
            .chunks_exact_mut(self.width)
            .skip(BORDER_TEXELS)
            .map(|line| &mut line[BORDER_TEXELS..])
    }
}

/// Rows of a picture, averaged.
struct RowAverages<'a, P, T> {
    image: &'a Image<P>,
    /// The channels of a row's pixels.
    sum: Vec<f32>,
    line: Vec<T>,
}

impl<'a, P: Pod, T: Mix> RowAverages<'a, P, T> {
    fn new(image: &'a Image<P>) -> Self {
        let channels = size_of::<P>() / size_of::<f32>();
        Self {
            image,
            sum: vec![0.0; image.width() * channels],
            line: vec![T::default(); image.width()],
        }
    }

    fn average(&mut self, rows: &TexelWeights, wanted: impl Fn(P) -> T) -> &[T] {
        self.sum.fill(0.0);
        for (y, weight) in rows.weighted() {
            add_row(
                &mut self.sum,
                weight,
                bytemuck::cast_slice(self.image.row(y)),
            );
        }
        let sums: &[P] = bytemuck::cast_slice(&self.sum);
        for (t, &p) in self.line.iter_mut().zip(sums) {
            *t = wanted(p);
        }
        &self.line
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn add_row(sum: &mut [f32], weight: f32, row: &[f32]) {
    for (s, v) in sum.iter_mut().zip(row) {
        *s += weight * v;
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn average_columns<T: Mix>(columns: &[TexelWeights], line: &[T], out: &mut [T]) {
    for (column, out) in columns.iter().zip(out) {
        *out = column.weighted_sum(line);
    }
}

/// Up to three consecutive texels and their weights, which sum to 1 (less at the end of the
/// picture).
struct TexelWeights {
    first: usize,
    weights: [f32; 3],
    count: usize,
}

/// Weights of each texel of a smaller picture along one side: averages over `step` texels (1 up to
/// 2).
fn downsample_axis(len: usize, step: f64) -> Vec<TexelWeights> {
    let count = (len as f64 / step).ceil() as usize;
    (0..count)
        .map(|k| TexelWeights::new(k as f64 * step, (k + 1) as f64 * step, len))
        .collect()
}

/// Share of an interval that is on a texel.
fn share_of_texel(texel: usize, start: f64, end: f64) -> f32 {
    let at = texel as f64;
    (((at + 1.0).min(end) - at.max(start)).max(0.0) / (end - start)) as f32
}

impl TexelWeights {
    fn new(start: f64, end: f64, len: usize) -> Self {
        let first = (start as usize).min(len - 1);
        let count = ((end.ceil() as usize).min(len) - first).min(3);
        let weights = [0, 1, 2].map(|n| share_of_texel(first + n, start, end));
        Self {
            first,
            weights,
            count,
        }
    }

    #[inline(always)]
    fn weighted_sum<T: Mix>(&self, texels: &[T]) -> T {
        self.weighted().fold(T::default(), |sum, (x, weight)| {
            sum.add_scaled(weight, texels[x])
        })
    }

    #[inline(always)]
    fn weighted(&self) -> impl Iterator<Item = (usize, f32)> {
        self.weights
            .into_iter()
            .take(self.count)
            .enumerate()
            .map(|(n, weight)| (self.first + n, weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_but_for_the_end() {
        for (len, step) in [(7, 1.0), (7, 1.3), (10, 1.999), (1, 1.5)] {
            let axis = downsample_axis(len, step);
            let mut taken = vec![0.0; len];
            axis.iter()
                .flat_map(TexelWeights::weighted)
                .for_each(|(x, w)| taken[x] += f64::from(w) * step);
            assert!(
                taken.iter().all(|t| (t - 1.0).abs() < 1e-6),
                "{len}, {step}: every texel is used once"
            );
            assert!(axis.len() == (len as f64 / step).ceil() as usize);
        }
    }
}
