//! FLIP: how different two pictures look to someone who flips between them.

use super::bands::{RowSource, bands, grown, rows_from};
use crate::image::Image;
use flip_rs::{DEFAULT_PPD, FlipError, RgbImage, ldr_flip};
use std::ops::Range;

/// Rows above and below a pixel that influence its difference: the radius of the widest filter,
/// three of its standard deviations, at 67 pixels per degree.
pub(super) const REACH_ROWS: usize = 10;

/// Mean LDR-FLIP of two display-encoded (sRGB, 0 to 1) pictures: 0 for equal ones, at most 1.
///
/// None for pictures of different size or without pixels; NaN where a value is not finite.
///
/// # Method
/// [Andersson et al. 2020] at 67 pixels per degree, by the crate `flip-rs`: difference of colours
/// after the eye's blur (HyAB in Hunt-adjusted CIELAB), raised to the power of one minus the
/// difference of edges and points.
///
/// [Andersson et al. 2020]: https://doi.org/10.1145/3406183
pub fn flip(reference: &Image<[f32; 3]>, test: &Image<[f32; 3]>) -> Option<f64> {
    if reference.size() != test.size() || reference.is_empty() {
        return None;
    }
    // In bands, since the crate refuses pictures above some 27 megapixels.
    let sum: f64 = bands(test.size())
        .map(|band| {
            let outer = grown(&band, REACH_ROWS, test.height());
            let inner = rows_from(outer.start, &band);
            let [reference, test] = [reference, test].map(|p| p.read_rows(outer.clone()));
            row_sum(&reference, &test, inner)
        })
        .sum();
    Some(sum / test.pixels().len() as f64)
}

/// Sum of the differences in some rows; NaN where a value is not finite.
pub(super) fn row_sum(
    reference: &Image<[f32; 3]>,
    test: &Image<[f32; 3]>,
    rows: Range<usize>,
) -> f64 {
    let pixels = rows.start * test.width()..rows.end * test.width();
    let errors = rgb_image(reference)
        .and_then(|reference| ldr_flip(&reference, &rgb_image(test)?, DEFAULT_PPD));
    errors.map_or(f64::NAN, |errors| {
        errors.pixels()[pixels].iter().map(|&e| f64::from(e)).sum()
    })
}

/// A picture as the crate takes it.
fn rgb_image(image: &Image<[f32; 3]>) -> Result<RgbImage<f32>, FlipError> {
    let channels = image.pixels().as_flattened().to_vec();
    RgbImage::new(image.width(), image.height(), channels)
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{changed, pattern};
    use super::*;

    #[test]
    fn equal_pictures_do_not_flip() {
        assert_eq!(flip(&pattern(), &pattern()), Some(0.0));
    }

    /// `evaluate(a, b, "LDR")` of flip-evaluator 1.7 for the same two pictures, by
    /// `golden/diff/reference.py`.
    #[test]
    fn the_measure_is_that_of_its_authors() {
        let measured = flip(&pattern(), &changed()).unwrap();
        assert!((measured - FLIP_EVALUATOR).abs() < 2e-5, "{measured}");
    }
    const FLIP_EVALUATOR: f64 = 0.194_597_66;

    #[test]
    fn black_and_white_are_as_different_as_can_be() {
        let of = |v| Image::filled(9, 4, [v; 3]);
        // HyAB of 100 is beyond the knee at 0.95; no features.
        let far = flip(&of(0.0), &of(1.0)).unwrap();
        assert!(far > 0.95 && far <= 1.0, "{far}");
        assert_eq!(flip(&of(0.0), &Image::filled(9, 5, [0.0; 3])), None);
        assert_eq!(flip(&Image::new(0, 3), &Image::new(0, 3)), None);
    }

    #[test]
    fn a_value_that_is_not_finite_has_no_measure() {
        let broken = Image::filled(9, 4, [f32::NAN; 3]);
        assert!(flip(&broken, &Image::new(9, 4)).unwrap().is_nan());
    }
}
