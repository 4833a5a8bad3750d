//! The engine of every linear filter here: each output pixel is a weighted mean of a rectangle of input pixels, its
//! weights the product of a column's and a row's.

use crate::image::Image;
use crate::pixel::Mix;
use rayon::prelude::*;

/// The samples of one line that an output sample is the weighted mean of: the first one's index, and the weights from
/// there on.
pub(super) struct Taps {
    first: usize,
    weights: Vec<f32>,
}

impl Taps {
    /// The samples `window` of a line of `len`, cut off at its ends, weighted by `weight` and made to add up to 1.
    ///
    /// Samples at the ends of the window that weigh nothing are left out.
    pub(super) fn new(window: std::ops::Range<isize>, len: usize, weight: impl Fn(isize) -> f64) -> Self {
        let last = window.end.min(len as isize);
        let inside = window.start.max(0)..last;
        let first = inside.clone().find(|&i| weight(i) > 0.0).unwrap_or(last);
        let end = inside.rev().find(|&i| weight(i) > 0.0).map_or(first, |i| i + 1);
        let sum: f64 = (first..end).map(&weight).sum();
        Self { first: first.max(0) as usize, weights: (first..end).map(|i| (weight(i) / sum) as f32).collect() }
    }

    #[inline(always)]
    fn mean<P: Mix>(&self, line: &[P]) -> P {
        let samples = line[self.first..].iter().zip(&self.weights);
        samples.fold(P::default(), |sum, (&p, &w)| sum.add_scaled(w, p))
    }
}

/// A picture as large as there are `columns` and `rows`, filtered from `image`.
///
/// Rows are mixed first, whole and in place, so that the compiler can vectorise; the mixed row stays in the cache while
/// its pixels are mixed along it. There is no picture in between.
pub(super) fn filter<P: Mix>(image: &Image<P>, columns: &[Taps], rows: &[Taps]) -> Image<P> {
    let mut out = Image::new(columns.len(), rows.len());
    let mixed = || vec![P::default(); image.width()];
    out.par_rows_mut().zip(rows).for_each_init(mixed, |mixed, (out, taps)| {
        mix_rows(image, taps, mixed);
        for (pixel, taps) in out.iter_mut().zip(columns) {
            *pixel = taps.mean(mixed);
        }
    });
    out
}

/// The weighted mean of the rows that `taps` names.
fn mix_rows<P: Mix>(image: &Image<P>, taps: &Taps, mixed: &mut [P]) {
    mixed.fill(P::default());
    for (k, &weight) in taps.weights.iter().enumerate() {
        for (sum, &p) in mixed.iter_mut().zip(image.row(taps.first + k)) {
            *sum = sum.add_scaled(weight, p);
        }
    }
}
