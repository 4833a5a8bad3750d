//! The engine of every linear filter here: each output pixel is a weighted mean of a rectangle of
//! input pixels, its weights the product of a column's and a row's.

use crate::image::Image;
use crate::pixel::Mix;
use crate::work::{self, Kind};
use rayon::prelude::*;

/// The samples of one line that an output sample is the weighted mean of: the first one's index,
/// and the weights from there on.
pub(super) struct Taps {
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    /// The samples `window` of a line of `len`, cut off at its ends, weighted by `weight` and made
    /// to add up to 1.
    ///
    /// Samples at the ends of the window that weigh nothing are left out.
    pub(super) fn new(
        window: std::ops::Range<isize>,
        len: usize,
        weight: impl Fn(isize) -> f64,
    ) -> Self {
        let inside = window.start.max(0)..window.end.min(len as isize);
        let range = without_weightless_ends(inside, &weight);
        let sum: f64 = range.clone().map(&weight).sum();
        Self {
            first: range.start.max(0) as usize,
            weights: range.map(|i| (weight(i) / sum) as f32).collect(),
        }
    }

    /// So many samples of a line of `len` with equal weights, from `first` on: they add up to less
    /// than 1 where the line ends before.
    pub(super) fn equal(first: usize, count: usize, len: usize) -> Self {
        Self {
            first,
            weights: vec![1.0 / count as f32; count.min(len - first)],
        }
    }

    /// The same weights one sample further on.
    fn follows(&self, before: &Self) -> bool {
        self.first == before.first + 1 && self.weights == before.weights
    }

    #[inline(always)]
    fn mean<P: Mix>(&self, line: &[P]) -> P {
        let samples = line[self.first..].iter().zip(&self.weights);
        samples.fold(P::default(), |sum, (&p, &w)| sum.add_scaled(w, p))
    }
}

/// The part of a range between its first and its last sample that weigh something.
fn without_weightless_ends(
    range: std::ops::Range<isize>,
    weight: impl Fn(isize) -> f64,
) -> std::ops::Range<isize> {
    let mut weighty = range.clone().filter(|&i| weight(i) > 0.0);
    let last = weighty.clone().next_back();
    let first = weighty.next().unwrap_or(range.end);
    first..last.map_or(first, |last| last + 1)
}

/// Output pixels that are worked on together, few enough for their sums to stay in the first cache.
const BLOCK_PIXELS: usize = 512;

/// A picture filtered along both sides with the taps for their lengths.
pub(super) fn filter_sides<P: Mix>(
    image: &Image<P>,
    taps: impl Fn(usize) -> Vec<Taps>,
) -> Image<P> {
    work::add(Kind::Filters, 1);
    let [columns, rows] = [image.width(), image.height()].map(taps);
    filter(image, &columns, &rows)
}

/// A picture as large as there are `columns` and `rows`, filtered from `image`.
///
/// Rows are mixed first, whole, so that the compiler can vectorise; the mixed row stays in the
/// cache while it is mixed along itself. There is no picture in between. Neighbours with the same
/// weights (a blur) are summed tap by tap, not pixel by pixel, for the same reason.
pub(super) fn filter<P: Mix>(image: &Image<P>, columns: &[Taps], rows: &[Taps]) -> Image<P> {
    let runs: Vec<&[Taps]> = columns
        .chunk_by(|a, b| b.follows(a))
        .flat_map(|run| run.chunks(BLOCK_PIXELS))
        .collect();
    let mut out = Image::new(columns.len(), rows.len());
    out.par_rows_mut().zip(rows).for_each_init(
        || vec![P::default(); image.width()],
        |mixed, (out, taps)| {
            mix_rows(image, taps, mixed);
            mix_runs(mixed, &runs, out);
        },
    );
    out
}

/// A row of output pixels, run by run, from a mixed row.
fn mix_runs<P: Mix>(line: &[P], runs: &[&[Taps]], mut out: &mut [P]) {
    for run in runs {
        let (here, rest) = out.split_at_mut(run.len());
        mix_along(line, run, here);
        out = rest;
    }
}

/// The rows of a picture that the taps name, mixed to one.
fn mix_rows<P: Mix>(image: &Image<P>, taps: &Taps, mixed: &mut [P]) {
    for (block, mixed) in mixed.chunks_mut(BLOCK_PIXELS).enumerate() {
        let start = block * BLOCK_PIXELS;
        mix(
            &taps.weights,
            |k| &image.row(taps.first + k)[start..],
            mixed,
        );
    }
}

/// A run of output pixels, each the weighted mean of samples of `line`.
fn mix_along<P: Mix>(line: &[P], run: &[Taps], out: &mut [P]) {
    match run {
        [single] => out[0] = single.mean(line),
        _ => mix(&run[0].weights, |k| &line[run[0].first + k..], out),
    }
}

/// The weighted sum of lines: `line(k)`, at least as long as `out`, by the weight `k`.
///
/// Dense on purpose: four lines a turn are what the compiler vectorises.
fn mix<'a, P: Mix + 'a>(weights: &[f32], line: impl Fn(usize) -> &'a [P], out: &mut [P]) {
    out.fill(P::default());
    // Four lines at once: a sum stays in its register for four additions, whose order is the same.
    let (fours, rest) = weights.as_chunks::<4>();
    for (i, &[a, b, c, d]) in fours.iter().enumerate() {
        let [p, q, r, s] = [0, 1, 2, 3].map(|k| line(4 * i + k));
        for (sum, (((&p, &q), &r), &s)) in out.iter_mut().zip(p.iter().zip(q).zip(r).zip(s)) {
            *sum = sum
                .add_scaled(a, p)
                .add_scaled(b, q)
                .add_scaled(c, r)
                .add_scaled(d, s);
        }
    }
    for (k, &weight) in rest.iter().enumerate() {
        for (sum, &p) in out.iter_mut().zip(line(4 * fours.len() + k)) {
            *sum = sum.add_scaled(weight, p);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(len: usize) -> Vec<Taps> {
        (0..len as isize)
            .map(|i| Taps::new(i - 2..i + 3, len, |j| 3.0 - (j - i).abs() as f64))
            .collect()
    }

    /// The definition, in `f64`.
    fn slowly(image: &Image<f32>, x: isize, y: isize) -> f64 {
        let near = |a: isize, len: usize| (a - 2).max(0)..(a + 3).min(len as isize);
        let weight = |dx: isize, dy: isize| (3 - dx.abs()) as f64 * (3 - dy.abs()) as f64;
        let (mut sum, mut total) = (0.0, 0.0);
        for j in near(y, image.height()) {
            for i in near(x, image.width()) {
                sum += weight(i - x, j - y) * f64::from(image[(i as usize, j as usize)]);
                total += weight(i - x, j - y);
            }
        }
        sum / total
    }

    #[test]
    fn runs_and_single_pixels_are_weighted_means() {
        for (width, height) in [(1, 7), (4, 4), (2 * BLOCK_PIXELS + 7, 6)] {
            let img = Image::from_fn(width, height, |x, y| {
                ((x * 7919 + y * 104_729) % 101) as f32
            });
            let out = filter(&img, &triangle(width), &triangle(height));
            for (k, value) in out.pixels().iter().enumerate() {
                let exact = slowly(&img, (k % width) as isize, (k / width) as isize);
                assert!(
                    (f64::from(*value) - exact).abs() < 1e-4,
                    "{k} of {width} x {height}"
                );
            }
        }
    }

    #[test]
    fn samples_that_weigh_nothing_are_left_out() {
        let taps = Taps::new(-3..4, 9, |j| if j == 2 { 5.0 } else { 0.0 });
        assert_eq!((taps.first, taps.weights), (2, vec![1.0]));
    }
}
