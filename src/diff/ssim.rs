//! Structural similarity.

use crate::image::Image;
use rayon::prelude::*;
use std::ops::Range;

/// Radius of the window: 11 x 11 pixels.
pub(super) const WINDOW_RADIUS_PX: usize = 5;
/// Standard deviation of the window's weights, pixels.
const WINDOW_SIGMA_PX: f64 = 1.5;
/// Stabilises the division where means are near 0: `(K1 L)^2` with K1 = 0.01 and the range L = 1.
const MEAN_STABILIZER: f32 = 0.01 * 0.01;
/// Stabilises the division where variances are near 0: `(K2 L)^2` with K2 = 0.03 and the range L =
/// 1.
const VARIANCE_STABILIZER: f32 = 0.03 * 0.03;

/// Mean structural similarity of two pictures with values from 0 to 1, averaged over the channels;
/// 1 for equal ones.
///
/// None for pictures of different size, or smaller than the window of 11 pixels.
///
/// # Method
/// [Wang et al. 2004]: Gaussian window of 1.5 pixels, `K1 = 0.01`, `K2 = 0.03`, only windows that
/// are entirely inside the picture.
///
/// [Wang et al. 2004]: https://doi.org/10.1109/TIP.2003.819861
pub fn ssim(a: &Image<[f32; 3]>, b: &Image<[f32; 3]>) -> Option<f64> {
    if a.size() != b.size() {
        return None;
    }
    mean(&row_sums(a, b, window_centers(a.height())), a.size())
}

/// Positions along a side at which a window is entirely inside.
pub(super) fn window_centers(length: usize) -> Range<usize> {
    WINDOW_RADIUS_PX
        ..length
            .saturating_sub(WINDOW_RADIUS_PX)
            .max(WINDOW_RADIUS_PX)
}

/// The mean over a picture, from the sums of its rows that have windows; none if there are no such
/// rows.
pub(super) fn mean(rows: &[[f64; 3]], (width, height): (usize, usize)) -> Option<f64> {
    let windows = window_centers(width).len() * window_centers(height).len();
    let means = [0, 1, 2].map(|c| channel_sum(rows, c) / windows as f64);
    (windows > 0).then(|| means.iter().sum::<f64>() / 3.0)
}

fn channel_sum(rows: &[[f64; 3]], c: usize) -> f64 {
    rows.iter().map(|row| row[c]).sum()
}

/// Sums over the windows of some rows, which are entirely inside, for each channel.
pub(super) fn row_sums(
    a: &Image<[f32; 3]>,
    b: &Image<[f32; 3]>,
    rows: Range<usize>,
) -> Vec<[f64; 3]> {
    let channels =
        [0, 1, 2].map(|c| WindowMeans::new(&channel(a, c), &channel(b, c)).row_sums(rows.clone()));
    (0..rows.len())
        .map(|y| [0, 1, 2].map(|c| channels[c][y]))
        .collect()
}

fn channel(image: &Image<[f32; 3]>, c: usize) -> Image<f32> {
    image.map(|p| p[c])
}

/// Window means of one channel of two pictures, of their squares and of their product.
struct WindowMeans {
    a: Image<f32>,
    b: Image<f32>,
    aa: Image<f32>,
    bb: Image<f32>,
    ab: Image<f32>,
}

impl WindowMeans {
    fn new(a: &Image<f32>, b: &Image<f32>) -> Self {
        let window = WindowWeights::gaussian();
        Self {
            a: window.windowed_means(a),
            b: window.windowed_means(b),
            aa: window.windowed_means(&a.map(|u| u * u)),
            bb: window.windowed_means(&b.map(|v| v * v)),
            ab: window.windowed_means(&a.zip_map(b, |u, v| u * v)),
        }
    }

    fn row_sums(&self, rows: Range<usize>) -> Vec<f64> {
        let width = self.a.width();
        rows.into_par_iter()
            .map(|y| window_centers(width).map(|x| self.similarity((x, y))).sum())
            .collect()
    }

    /// Structural similarity of the windows around one pixel.
    #[inline(always)]
    fn similarity(&self, at: (usize, usize)) -> f64 {
        let (u, v) = (self.a[at], self.b[at]);
        let variances = self.aa[at] - u * u + self.bb[at] - v * v;
        let covariance = self.ab[at] - u * v;
        f64::from((2.0 * u * v + MEAN_STABILIZER) * (2.0 * covariance + VARIANCE_STABILIZER))
            / f64::from((u * u + v * v + MEAN_STABILIZER) * (variances + VARIANCE_STABILIZER))
    }
}

/// The weights along one side of a window, which sum to 1.
struct WindowWeights {
    weights: Vec<f32>,
}

fn gaussian_weight(x: f64) -> f32 {
    libm::exp(-x * x / (2.0 * WINDOW_SIGMA_PX * WINDOW_SIGMA_PX)) as f32
}

impl WindowWeights {
    fn gaussian() -> Self {
        let radius = WINDOW_RADIUS_PX as i32;
        let weights: Vec<f32> = (-radius..=radius)
            .map(|i| gaussian_weight(f64::from(i)))
            .collect();
        let sum: f32 = weights.iter().sum();
        Self {
            weights: weights.iter().map(|w| w / sum).collect(),
        }
    }

    /// Weighted means around every pixel, with the border's values extended outside.
    fn windowed_means(&self, plane: &Image<f32>) -> Image<f32> {
        let (width, height) = plane.size();
        let along_x = Image::from_fn(width, height, |x, y| {
            let row = plane.row(y);
            self.mean(x, width, |i| row[i])
        });
        Image::from_fn(width, height, |x, y| {
            self.mean(y, height, |j| along_x[(x, j)])
        })
    }

    /// Weighted mean around `center` of a line of `len` values, extended at both ends.
    #[inline(always)]
    fn mean(&self, center: usize, len: usize, value: impl Fn(usize) -> f32) -> f32 {
        let (first, last) = (
            center as isize - WINDOW_RADIUS_PX as isize,
            len as isize - 1,
        );
        self.weights
            .iter()
            .enumerate()
            .map(|(i, w)| w * value((first + i as isize).clamp(0, last) as usize))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{changed, pattern};
    use super::*;

    #[test]
    fn equal_pictures_are_alike() {
        assert!((ssim(&pattern(), &pattern()).unwrap() - 1.0).abs() < 1e-7);
    }

    /// `structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
    /// data_range=1, channel_axis=2)` of scikit-image 0.26.0 for the same two pictures, by
    /// `golden/diff/reference.py`.
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

    #[test]
    fn the_mean_of_a_plane_of_one_value_is_that_value() {
        let means = WindowWeights::gaussian().windowed_means(&Image::filled(7, 5, 0.3));
        assert!(means.pixels().iter().all(|v| (v - 0.3).abs() < 1e-6));
    }
}
