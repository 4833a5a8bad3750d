//! Planes of numbers correlated with separable kernels, the ends repeated: what the measures of likeness are made of.

use crate::image::Image;

/// An odd number of weights around a centre.
pub(super) struct Kernel {
    weights: Vec<f32>,
}

impl Kernel {
    /// `f(-radius)` to `f(radius)`.
    pub(super) fn new(radius: i32, f: impl Fn(f64) -> f64) -> Self {
        Self {
            weights: (-radius..=radius).map(|i| f(f64::from(i)) as f32).collect(),
        }
    }

    /// A Gaussian that sums to 1.
    pub(super) fn gaussian(radius: i32, sigma: f64) -> Self {
        Self::new(radius, |x| libm::exp(-x * x / (2.0 * sigma * sigma))).balanced()
    }

    /// Positive weights made to sum to 1, negative ones to -1.
    pub(super) fn balanced(self) -> Self {
        let sum = |sign: f32| {
            self.weights
                .iter()
                .map(|w| (w * sign).max(0.0))
                .sum::<f32>()
        };
        let (positive, negative) = (sum(1.0), sum(-1.0));
        let scaled = |w: f32| {
            if w > 0.0 {
                w / positive
            } else if w < 0.0 {
                w / negative
            } else {
                0.0
            }
        };
        Self {
            weights: self.weights.iter().map(|&w| scaled(w)).collect(),
        }
    }

    /// The weighted sum around `at` of a line of `len` values, each end going on.
    #[inline(always)]
    fn sum(&self, at: usize, len: usize, value: impl Fn(usize) -> f32) -> f32 {
        let (radius, last) = ((self.weights.len() / 2) as isize, len as isize - 1);
        let place = |i: usize| (at as isize + i as isize - radius).clamp(0, last) as usize;
        self.weights
            .iter()
            .enumerate()
            .map(|(i, w)| w * value(place(i)))
            .sum()
    }
}

/// A plane correlated with one kernel along its rows and another along its columns.
pub(super) fn correlate(plane: &Image<f32>, along_x: &Kernel, along_y: &Kernel) -> Image<f32> {
    let (width, height) = plane.size();
    let mixed = Image::from_fn(width, height, |x, y| {
        let row = plane.row(y);
        along_x.sum(x, width, |i| row[i])
    });
    Image::from_fn(width, height, |x, y| {
        along_y.sum(y, height, |j| mixed[(x, j)])
    })
}

/// One channel of a picture of three.
pub(super) fn channel(image: &Image<[f32; 3]>, c: usize) -> Image<f32> {
    image.map(|p| p[c])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_of_one_value_stays_and_has_no_edges() {
        let plane = Image::filled(7, 5, 0.3);
        let (blur, edge) = (Kernel::gaussian(4, 1.5), Kernel::new(3, |x| -x).balanced());
        assert!(
            correlate(&plane, &blur, &blur)
                .pixels()
                .iter()
                .all(|v| (v - 0.3).abs() < 1e-6)
        );
        assert!(
            correlate(&plane, &edge, &blur)
                .pixels()
                .iter()
                .all(|v| v.abs() < 1e-6)
        );
    }

    #[test]
    fn kernels_run_the_way_the_axes_do() {
        let slope = Image::from_fn(9, 9, |x, _| x as f32);
        let (edge, one) = (Kernel::new(1, |x| x).balanced(), Kernel::gaussian(0, 1.0));
        assert_eq!(correlate(&slope, &edge, &one)[(4, 4)], 2.0);
        assert_eq!(correlate(&slope, &one, &edge)[(4, 4)], 0.0);
    }
}
