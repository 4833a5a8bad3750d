//! Structural similarity.

use super::correlate::{Kernel, channel, correlate};
use crate::image::Image;
use rayon::prelude::*;
use std::ops::Range;

/// Radius of the window: 11 x 11 pixels.
pub(super) const RADIUS: usize = 5;
/// Standard deviation of the window's weights, pixels.
const SIGMA: f64 = 1.5;
/// Stabilise the division where means, or variances, are near 0: `(0.01 L)^2` and `(0.03 L)^2` for the range L = 1.
const C: [f32; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// Mean structural similarity of two pictures of values from 0 to 1, averaged over the channels; 1 for equal ones.
///
/// None for pictures of different size, or smaller than the window of 11 pixels.
///
/// # Method
/// [Wang et al. 2004]: Gaussian window of 1.5 pixels, `K1 = 0.01`, `K2 = 0.03`, windows wholly inside the picture only.
///
/// [Wang et al. 2004]: https://doi.org/10.1109/TIP.2003.819861
pub fn ssim(a: &Image<[f32; 3]>, b: &Image<[f32; 3]>) -> Option<f64> {
    if a.size() != b.size() {
        return None;
    }
    mean(&row_sums(a, b, inside(a.height())), a.size())
}

/// Where a window along a side lies wholly inside.
pub(super) fn inside(length: usize) -> Range<usize> {
    RADIUS..length.saturating_sub(RADIUS).max(RADIUS)
}

/// The measure of a picture from the sums of its rows that have windows; none where there are none.
pub(super) fn mean(rows: &[[f64; 3]], (width, height): (usize, usize)) -> Option<f64> {
    let windows = inside(width).len() * inside(height).len();
    let channel = |c: usize| rows.iter().map(|row| row[c]).sum::<f64>() / windows as f64;
    (windows > 0).then(|| (0..3).map(channel).sum::<f64>() / 3.0)
}

/// Sums over the windows of some rows, which lie wholly inside, for each channel.
pub(super) fn row_sums(
    a: &Image<[f32; 3]>,
    b: &Image<[f32; 3]>,
    rows: Range<usize>,
) -> Vec<[f64; 3]> {
    let channels = [0, 1, 2].map(|c| of_channel(&channel(a, c), &channel(b, c), rows.clone()));
    (0..rows.len())
        .map(|y| [0, 1, 2].map(|c| channels[c][y]))
        .collect()
}

fn of_channel(a: &Image<f32>, b: &Image<f32>, rows: Range<usize>) -> Vec<f64> {
    let window = Kernel::gaussian(RADIUS as i32, SIGMA);
    let mean = |plane: &Image<f32>| correlate(plane, &window, &window);
    let product = |p: &Image<f32>, q: &Image<f32>| mean(&p.zip_map(q, |u, v| u * v));
    let (ma, mb) = (mean(a), mean(b));
    let (aa, bb, ab) = (product(a, a), product(b, b), product(a, b));
    let width = a.width();
    let at = |x: usize, y: usize| {
        let i = (x, y);
        let (u, v) = (ma[i], mb[i]);
        let (spread, shared) = (aa[i] - u * u + bb[i] - v * v, ab[i] - u * v);
        f64::from((2.0 * u * v + C[0]) * (2.0 * shared + C[1]))
            / f64::from((u * u + v * v + C[0]) * (spread + C[1]))
    };
    rows.into_par_iter()
        .map(|y| inside(width).map(|x| at(x, y)).sum())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::likeness::tests::{changed, pattern};
    use super::*;

    #[test]
    fn equal_pictures_are_alike() {
        assert!((ssim(&pattern(), &pattern()).unwrap() - 1.0).abs() < 1e-7);
    }

    /// `structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
    /// channel_axis=2)` of scikit-image 0.26.0 for the same two pictures, by `golden/diff/reference.py`.
    #[test]
    fn the_measure_is_that_of_scikit_image() {
        let measured = ssim(&pattern(), &changed()).unwrap();
        // Variances are differences of float sums.
        assert!((measured - SCIKIT_IMAGE).abs() < 5e-6, "{measured}");
    }
    const SCIKIT_IMAGE: f64 = 0.955_346_43;

    #[test]
    fn small_or_unequal_pictures_have_no_measure() {
        let of = |w, h| Image::filled(w, h, [0.5; 3]);
        assert_eq!(ssim(&of(10, 30), &of(10, 30)), None);
        assert_eq!(ssim(&of(30, 30), &of(30, 31)), None);
        assert_eq!(ssim(&of(11, 11), &of(11, 11)), Some(1.0));
    }
}
