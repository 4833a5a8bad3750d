//! Noise of a photo.

use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};
use crate::quantile::median;

/// Pixels so far apart are hardly alike in their noise, whatever a camera and a JPEG made of it.
const STEP_PX: usize = 3;
/// Standard deviation of a normal distribution whose median absolute value is 1.
const SIGMA_OF_MEDIAN: f32 = 1.4826;

/// Standard deviation of a photo beside an object, in its strongest channel, by differences of
/// neighbours: the object's shadow, which the residual of a plate has in it, changes slowly.
/// Infinite where nothing is beside the object.
pub(super) fn beside(photo: &Image<LinearRgb>, inside: &Image<Coverage>) -> f32 {
    let of_channel = |channel: fn(LinearRgb) -> f32| {
        let rows = photo.rows().zip(inside.rows());
        let steps = rows.flat_map(|(pixels, covered)| {
            let pairs = pixels.iter().zip(pixels.iter().skip(STEP_PX));
            let beside = covered.iter().zip(covered.iter().skip(STEP_PX));
            let pairs = pairs.zip(beside);
            let free = pairs.filter(|(_, (a, b))| a.0 == 0.0 && b.0 == 0.0);
            free.map(move |((a, b), _)| (channel(*a) - channel(*b)).abs())
        });
        let typical = median(steps, f32::total_cmp).unwrap_or(f32::INFINITY);
        typical * SIGMA_OF_MEDIAN / std::f32::consts::SQRT_2
    };
    of_channel(|p| p.r)
        .max(of_channel(|p| p.g))
        .max(of_channel(|p| p.b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn shadows_and_the_object_are_no_noise() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut grain = || 0.01 * ((0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0);
        let mut photo = Image::from_fn(200, 100, |x, y| {
            let shade = 1.0 - 0.3 * (x as f32 / 200.0);
            let object = if (50..150).contains(&x) && (x + y) % 2 == 0 {
                0.5
            } else {
                0.0
            };
            LinearRgb::new(0.02, 0.4 * shade + object, 0.1)
        });
        for pixel in photo.pixels_mut() {
            pixel.g += grain();
        }
        let inside = Image::from_fn(200, 100, |x, _| {
            Coverage(if (50..150).contains(&x) { 1.0 } else { 0.0 })
        });
        let found = beside(&photo, &inside);
        assert!((found / 0.01 - 1.0).abs() < 0.1, "{found}");
        assert_eq!(
            beside(&photo, &inside.map(|_| Coverage(1.0))),
            f32::INFINITY
        );
    }
}
