//! How blurred the edges of an object are.

use super::snap::{EdgePoint, distance, edge_points, evenly_spaced};
use crate::image::Image;
use crate::matte::Outline;
use crate::pixel::LinearRgb;
use crate::quantile::median;
use rayon::prelude::*;

/// How far to either side of the outline a profile goes, pixels of the picture that was searched:
/// an edge blurred by 2 pixels is over.
const PROFILE_REACH_PX: i32 = 5;
/// Distance of the profiles along the outline, likewise.
const PROFILE_SPACING_PX: f64 = 2.0;
/// Least change along a profile (of square roots) that has a measurable blur: ten steps of an 8-bit
/// picture.
const MIN_CHANGE: f32 = 0.04;
/// Highest slope of a step of height 1 that is blurred by a Gaussian of deviation 1: `1 / sqrt(2
/// pi)`.
const GAUSSIAN_SLOPE: f64 = 0.398_942;

/// Standard deviation of the edges' blur, in pixels of the picture that was searched; 0 where no
/// edge is clear enough.
///
/// `scale` is pixels of the photo for one of those.
///
/// # Method
/// Along profiles across the outline, the steepest change over one pixel as a share of the whole
/// change: `1 / (sqrt(2 pi) sigma)` for a blurred step. The median over the outline.
pub(super) fn edge_blur_px(outline: &Outline, roots: &Image<LinearRgb>, scale: f64) -> f64 {
    let spacing = PROFILE_SPACING_PX * scale.max(1.0);
    let points: Vec<_> = outline
        .rings
        .iter()
        .flat_map(|ring| edge_points(&evenly_spaced(ring, spacing), 1))
        .collect();
    let slopes: Vec<f32> = points
        .par_iter()
        .filter_map(|point| steepest_share(&profile(roots, point, scale)))
        .collect();
    median(slopes.into_iter(), f32::total_cmp)
        .map_or(0.0, |slope| GAUSSIAN_SLOPE / f64::from(slope))
}

/// The photo along the normal, at steps of half a pixel of the search.
fn profile(roots: &Image<LinearRgb>, point: &EdgePoint, scale: f64) -> Vec<LinearRgb> {
    (-2 * PROFILE_REACH_PX..=2 * PROFILE_REACH_PX)
        .map(|k| point.mean_at(roots, 0.5 * f64::from(k), scale))
        .collect()
}

/// The steepest change over a pixel, as a share of the whole change; nothing where hardly anything
/// changes.
fn steepest_share(profile: &[LinearRgb]) -> Option<f32> {
    let pairs = (0..profile.len()).flat_map(|i| profile[i..].iter().map(move |b| (&profile[i], b)));
    let whole = largest_distance(pairs);
    let steepest = largest_distance(profile.iter().zip(profile.iter().skip(2)));
    (whole > MIN_CHANGE).then(|| steepest / whole)
}

fn largest_distance<'a>(pairs: impl Iterator<Item = (&'a LinearRgb, &'a LinearRgb)>) -> f32 {
    pairs.map(|(a, b)| distance(*a, *b)).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter;
    use crate::geom::Point2;

    #[test]
    fn the_blur_of_a_disc_is_measured() {
        let disc = |x: usize, y: usize| (x as f64 + 0.5 - 50.0).hypot(y as f64 + 0.5 - 45.0) < 30.0;
        let sharp = Image::from_fn(100, 90, |x, y| {
            LinearRgb::grey(if disc(x, y) { 0.9 } else { 0.4 })
        });
        let at = |i: usize| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * i as f64 / 200.0);
            Point2::new(50.0 + 30.0 * cos, 45.0 + 30.0 * sin)
        };
        let circle = Outline::from_ring((0..200).map(at).collect());
        for sigma in [1.0f32, 1.5, 2.0] {
            let found = edge_blur_px(&circle, &filter::gaussian_blur(&sharp, sigma), 1.0);
            // The slope is taken over a pixel, and pixels and sampling blur by about half of one
            // themselves.
            assert!(
                (found - f64::from(sigma)).abs() < 0.3,
                "{found} for {sigma}"
            );
        }
        assert_eq!(
            edge_blur_px(&circle, &Image::filled(100, 90, LinearRgb::grey(0.4)), 1.0),
            0.0
        );
    }
}
