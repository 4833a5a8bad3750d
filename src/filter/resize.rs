//! Pictures of another size.

use super::separable::{Taps, filter};
use crate::image::Image;
use crate::pixel::Mix;
use crate::work::{self, Kind};

/// A picture of another size: smoothly averaged where it shrinks, bilinear where it grows,
/// unchanged at the same size.
///
/// # Method
/// A triangle as wide as the scale, on pixel centres: its half width is one input pixel when the
/// picture grows and one output pixel when it shrinks, so it neither aliases much nor rings.
pub fn resize<P: Mix>(image: &Image<P>, width: usize, height: usize) -> Image<P> {
    if image.size() == (width, height) {
        return image.clone();
    }
    work::add(Kind::Filters, 1);
    let columns = scaling_taps(image.width(), width);
    let rows = scaling_taps(image.height(), height);
    filter(image, &columns, &rows)
}

fn scaling_taps(from: usize, to: usize) -> Vec<Taps> {
    let scale = from as f64 / to as f64;
    let half_width = scale.max(1.0);
    (0..to)
        .map(|i| triangle_around((i as f64 + 0.5) * scale, half_width, from))
        .collect()
}

/// A triangle around `center` of a line of `len` samples.
fn triangle_around(center: f64, half_width: f64, len: usize) -> Taps {
    let window = (center - half_width).floor() as isize..(center + half_width).ceil() as isize;
    Taps::new(window, len, |j| {
        1.0 - ((j as f64 + 0.5 - center) / half_width).abs()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel::PremulRgba;

    #[test]
    fn resizing_to_the_same_size_changes_nothing() {
        let img = Image::from_fn(5, 4, |x, y| (x * y) as f32);
        assert_eq!(resize(&img, 5, 4), img);
    }

    #[test]
    fn resizing_keeps_a_constant() {
        let color = PremulRgba::new(0.1, 0.2, 3.0, 0.4);
        for (w, h) in [(1, 1), (3, 50), (7, 5), (64, 2)] {
            let out = resize(&Image::filled(7, 5, color), w, h);
            assert_eq!(out.size(), (w, h));
            assert!(
                out.pixels()
                    .iter()
                    .all(|p| (p.r - 0.1).abs() < 1e-6 && (p.b - 3.0).abs() < 1e-6)
            );
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_away_from_the_border() {
        let ramp = Image::from_fn(40, 1, |x, _| x as f32 + 0.5);
        for width in [10, 23, 80, 95] {
            let out = resize(&ramp, width, 1);
            for x in width / 4..3 * width / 4 {
                let expected = (x as f32 + 0.5) * 40.0 / width as f32;
                assert!(
                    (out[(x, 0)] - expected).abs() < 0.6,
                    "{width}: {} at {x}",
                    out[(x, 0)]
                );
            }
        }
    }

    #[test]
    fn empty_pictures_and_single_pixels_survive() {
        let empty: Image<f32> = Image::new(0, 3);
        assert_eq!(resize(&empty, 2, 2), Image::new(2, 2));
        assert_eq!(resize(&Image::<f32>::new(3, 0), 2, 2), Image::new(2, 2));
        assert!(resize(&Image::filled(3, 3, 1.0), 0, 7).is_empty());
        assert_eq!(
            resize(&Image::filled(1, 1, 0.5), 3, 2),
            Image::filled(3, 2, 0.5)
        );
    }

    #[test]
    fn averaging_then_growing_is_done_in_the_right_order_of_axes() {
        let img = Image::from_fn(4, 2, |x, _| if x < 2 { 1.0 } else { 0.0 });
        let out = resize(&img, 2, 4);
        assert_eq!(out.row(0), out.row(3));
        assert!(out[(0, 0)] > out[(1, 0)]);
    }
}
