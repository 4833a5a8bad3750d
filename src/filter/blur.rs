//! Blurs.

use super::separable::{Taps, filter_sides};
use crate::image::Image;
use crate::pixel::Mix;

/// Standard deviations at which the Gaussian window ends; what lies beyond weighs 6e-5 of the
/// whole.
const GAUSSIAN_REACH_SIGMAS: f64 = 4.0;

/// A picture blurred by a Gaussian of standard deviation `sigma_px`; unchanged where that is 0 or
/// less, or NaN.
///
/// # Method
/// The Gaussian at pixel centres, ended at 4 sigma and made to add up to 1.
pub fn gaussian_blur<P: Mix>(image: &Image<P>, sigma_px: f32) -> Image<P> {
    if sigma_px.is_nan() || sigma_px <= 0.0 {
        return image.clone();
    }
    filter_sides(image, |len| gaussian_taps(len, f64::from(sigma_px)))
}

/// A picture of which each pixel is the mean of the square of `2 radius + 1` pixels around it;
/// unchanged where that is one pixel.
pub fn box_blur<P: Mix>(image: &Image<P>, radius: usize) -> Image<P> {
    if radius == 0 {
        return image.clone();
    }
    filter_sides(image, |len| window_taps(len, radius, |_| 1.0))
}

/// A Gaussian around every sample of a line.
fn gaussian_taps(len: usize, sigma: f64) -> Vec<Taps> {
    let reach = (GAUSSIAN_REACH_SIGMAS * sigma).ceil() as usize;
    window_taps(len, reach, |d| libm::exp(-0.5 * (d as f64 / sigma).powi(2)))
}

/// Around every sample of a line, weights by a function of the distance, out to `reach`.
fn window_taps(len: usize, reach: usize, weight: impl Fn(isize) -> f64) -> Vec<Taps> {
    let reach = reach.min(len) as isize;
    (0..len as isize)
        .map(|i| Taps::new(i - reach..i + reach + 1, len, |j| weight(j - i)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::LinearRgb;

    fn dot(size: usize) -> Image<f32> {
        Image::from_fn(size, size, |x, y| {
            if (x, y) == (size / 2, size / 2) {
                1.0
            } else {
                0.0
            }
        })
    }

    #[test]
    fn a_blurred_dot_has_the_mass_and_the_variance_of_the_gaussian() {
        for sigma in [0.8_f32, 2.0, 3.7] {
            // So large that no window with the dot in it is cut off.
            let out = gaussian_blur(&dot(81), sigma);
            let mass: f64 = out.pixels().iter().map(|&v| f64::from(v)).sum();
            let variance: f64 = (0..81)
                .map(|x| (x as f64 - 40.0).powi(2) * column(&out, x))
                .sum();
            assert!((mass - 1.0).abs() < 1e-5);
            assert!(
                (variance / f64::from(sigma * sigma) - 1.0).abs() < 2e-3,
                "{sigma}: {variance}"
            );
        }
    }

    fn column(image: &Image<f32>, x: usize) -> f64 {
        (0..image.height()).map(|y| f64::from(image[(x, y)])).sum()
    }

    #[test]
    fn a_box_is_flat() {
        let out = box_blur(&dot(9), 2);
        assert_eq!(out.pixels().iter().filter(|v| **v > 0.0).count(), 25);
        assert!(
            out.pixels()
                .iter()
                .all(|&v| v == 0.0 || (v - 0.04).abs() < 1e-7)
        );
    }

    #[test]
    fn blurs_keep_a_constant_up_to_the_border() {
        let img = Image::filled(5, 3, LinearRgb::new(0.5, 1.0, 2.0));
        for out in [gaussian_blur(&img, 3.0), box_blur(&img, 4)] {
            assert!(
                out.pixels()
                    .iter()
                    .all(|c| (c.g - 1.0).abs() < 1e-6 && (c.b - 2.0).abs() < 1e-6)
            );
        }
    }

    #[test]
    fn no_blur_is_no_change() {
        let img = dot(5);
        assert!(
            [0.0, -1.0, f32::NAN]
                .iter()
                .all(|&s| gaussian_blur(&img, s) == img)
        );
        assert_eq!(box_blur(&img, 0), img);
    }

    #[test]
    fn a_window_larger_than_the_picture_is_its_mean() {
        let img = Image::from_vec(2, 1, vec![0.0, 1.0]);
        assert_eq!(box_blur(&img, usize::MAX / 4).pixels(), [0.5; 2]);
        assert_eq!(gaussian_blur(&img, f32::INFINITY).pixels(), [0.5; 2]);
        assert!(box_blur(&Image::<f32>::new(0, 0), 3).is_empty());
    }
}
