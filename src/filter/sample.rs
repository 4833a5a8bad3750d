//! Values between pixels.

use super::pyramid::Pyramid;
use crate::image::Image;
use crate::pixel::Mix;

/// The bilinear value at `(x, y)` in pixels; everything outside the picture is empty (black and
/// transparent).
///
/// Pixel `(i, j)` has its centre at `(i + 0.5, j + 0.5)`, where its own value is returned. Towards
/// the outside the outermost half pixel fades, and half a pixel further out all is 0. A position
/// that is not finite gives 0.
#[inline]
pub(crate) fn sample_bilinear<P: Mix>(image: &Image<P>, x: f64, y: f64) -> P {
    bilinear(|i, j| pixel_or_empty(image, i, j), x, y)
}

#[inline(always)]
fn pixel_or_empty<P: Copy + Default>(image: &Image<P>, i: isize, j: isize) -> P {
    let (width, height) = (image.width() as isize, image.height() as isize);
    if (0..width).contains(&i) && (0..height).contains(&j) {
        image[(i as usize, j as usize)]
    } else {
        P::default()
    }
}

/// The bilinear value at `(x, y)` in pixels, going on outside the picture as the nearest pixel
/// inside; 0 in an empty picture and at a position that is not finite.
#[inline]
pub(crate) fn sample_bilinear_clamped<P: Mix>(image: &Image<P>, x: f64, y: f64) -> P {
    if image.is_empty() {
        return P::default();
    }
    bilinear(|i, j| image.nearest(i, j), x, y)
}

/// The cubic value at `(x, y)` in pixels, as [`sample_cubic_clamped`]; 0 outside the picture.
#[inline]
pub(crate) fn sample_cubic<P: Mix>(image: &Image<P>, x: f64, y: f64) -> P {
    if is_inside(image, x, y) {
        sample_cubic_clamped(image, x, y)
    } else {
        P::default()
    }
}

/// The cubic value at `(x, y)` in pixels, which keeps what a bilinear one blurs, going on outside
/// the picture as the nearest pixel inside; 0 in an empty picture and at a position that is not
/// finite. Beside steep edges it is beyond its neighbours.
///
/// # Method
/// Keys, "Cubic convolution interpolation for digital image processing", 1981, with a = -1/2.
#[inline]
pub(crate) fn sample_cubic_clamped<P: Mix>(image: &Image<P>, x: f64, y: f64) -> P {
    if image.is_empty() || !(x.is_finite() && y.is_finite()) {
        return P::default();
    }
    let ((i, u), (j, v)) = (index_and_rest(x), index_and_rest(y));
    let (across, down) = (cubic_weights(u), cubic_weights(v));
    let mut sum = P::default();
    for (dj, down) in (-1..).zip(down) {
        for (di, across) in (-1..).zip(across) {
            sum = sum.add_scaled(across * down, image.nearest(i + di, j + dj));
        }
    }
    sum
}

/// The value at `(x, y)` in pixels of a picture that a Gaussian of this standard deviation has
/// blurred, going on outside as [`sample_bilinear_clamped`] does.
///
/// # Method
/// Trilinear, as of textures ([Williams 1983]). Averages over squares of `s` pixels, read linearly,
/// have a variance of `s^2 (1/12 + 1/6)`, so the level of `s = 2 sigma` is read.
///
/// [Williams 1983]: https://doi.org/10.1145/800059.801126
pub(crate) fn sample_blurred<P: Mix>(picture: &Pyramid<P>, x: f64, y: f64, sigma_px: f64) -> P {
    let level = libm::log2(2.0 * sigma_px).clamp(0.0, (picture.levels() - 1) as f64);
    let lower = level as usize;
    let at_level = |level: usize| {
        let side = (1_u64 << level) as f64;
        sample_bilinear_clamped(picture.level(level), x / side, y / side)
    };
    let share = (level - lower as f64) as f32;
    let sharper = P::default().add_scaled(1.0 - share, at_level(lower));
    sharper.add_scaled(share, at_level(lower + 1))
}

/// Weights of the pixel before a position, of the one at or just before it, and of the two after;
/// `t` is how far it is beyond the second.
#[inline(always)]
fn cubic_weights(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t3 + t2 - 0.5 * t,
        1.5 * t3 - 2.5 * t2 + 1.0,
        -1.5 * t3 + 2.0 * t2 + 0.5 * t,
        0.5 * t3 - 0.5 * t2,
    ]
}

/// The pixel whose square holds `(x, y)`, for pixels of any kind; `None` outside the picture.
#[inline]
pub(crate) fn sample_nearest<P: Copy>(image: &Image<P>, x: f64, y: f64) -> Option<P> {
    is_inside(image, x, y).then(|| image[(x as usize, y as usize)])
}

#[inline(always)]
fn is_inside<P: Copy>(image: &Image<P>, x: f64, y: f64) -> bool {
    (0.0..image.width() as f64).contains(&x) && (0.0..image.height() as f64).contains(&y)
}

/// The last pixel whose centre is not beyond a coordinate, and how far beyond it that is.
#[inline(always)]
fn index_and_rest(x: f64) -> (isize, f32) {
    let before = (x - 0.5).floor();
    let rest = (x - 0.5 - before) as f32;
    // Far beyond any picture, so that the next pixel's index does not overflow.
    (before.clamp(-1e15, 1e15) as isize, rest)
}

#[inline(always)]
fn bilinear<P: Mix>(at: impl Fn(isize, isize) -> P, x: f64, y: f64) -> P {
    if !(x.is_finite() && y.is_finite()) {
        return P::default();
    }
    let ((i, u), (j, v)) = (index_and_rest(x), index_and_rest(y));
    P::default()
        .add_scaled((1.0 - u) * (1.0 - v), at(i, j))
        .add_scaled(u * (1.0 - v), at(i + 1, j))
        .add_scaled((1.0 - u) * v, at(i, j + 1))
        .add_scaled(u * v, at(i + 1, j + 1))
}

#[cfg(test)]
mod tests {
    use super::super::gaussian_blur;
    use super::*;
    use crate::pixel::ObjectId;

    fn plane() -> Image<f32> {
        Image::from_fn(6, 4, |x, y| x as f32 + 10.0 * y as f32)
    }

    #[test]
    fn a_pixel_centre_gives_the_pixel() {
        let img = plane();
        assert_eq!(sample_bilinear(&img, 2.5, 1.5), img[(2, 1)]);
        assert_eq!(sample_bilinear_clamped(&img, 5.5, 3.5), img[(5, 3)]);
    }

    #[test]
    fn cubic_keeps_pixels_planes_and_parabolas() {
        let img = Image::from_fn(9, 9, |x, y| (x * x) as f32 - 3.0 * y as f32);
        assert_eq!(sample_cubic_clamped(&img, 4.5, 3.5), img[(4, 3)]);
        let (x, y) = (4.85_f64, 3.3_f64);
        let expected = (x - 0.5).powi(2) - 3.0 * (y - 0.5);
        let found = f64::from(sample_cubic_clamped(&img, x, y));
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
        assert_eq!(sample_cubic_clamped(&img, -7.0, 1.5), img[(0, 1)]);
        assert_eq!(
            sample_cubic_clamped(&Image::<f32>::new(0, 0), 1.0, 1.0),
            0.0
        );
    }

    #[test]
    fn a_plane_is_sampled_exactly() {
        let value = sample_bilinear(&plane(), 2.75, 2.0);
        assert!((value - (2.25 + 15.0)).abs() < 1e-5, "{value}");
    }

    #[test]
    fn the_outside_is_empty_and_the_border_fades() {
        let img = Image::filled(3, 3, 1.0);
        assert_eq!(sample_bilinear(&img, 0.0, 1.5), 0.5);
        assert_eq!(sample_bilinear(&img, 0.0, 0.0), 0.25);
        assert_eq!(sample_bilinear(&img, -0.5, 1.5), 0.0);
        assert_eq!(sample_bilinear(&img, 3.5, 1.5), 0.0);
    }

    #[test]
    fn clamped_the_border_goes_on() {
        let img = plane();
        assert_eq!(sample_bilinear_clamped(&img, -7.0, 1.5), img[(0, 1)]);
        assert_eq!(sample_bilinear_clamped(&img, 1e300, 1e300), img[(5, 3)]);
    }

    #[test]
    fn strange_positions_and_empty_pictures_give_nothing() {
        let img = plane();
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(sample_bilinear(&img, x, 1.0), 0.0);
            assert_eq!(sample_bilinear_clamped(&img, 1.0, x), 0.0);
        }
        assert_eq!(sample_bilinear(&img, -1e300, 0.0), 0.0);
        assert_eq!(
            sample_bilinear_clamped(&Image::<f32>::new(0, 0), 1.0, 1.0),
            0.0
        );
    }

    #[test]
    fn identifiers_are_picked_never_mixed() {
        let ids = Image::from_fn(2, 1, |x, _| ObjectId(x as u32 + 1));
        assert_eq!(sample_nearest(&ids, 0.99, 0.5), Some(ObjectId(1)));
        assert_eq!(sample_nearest(&ids, 1.0, 0.5), Some(ObjectId(2)));
        assert_eq!(sample_nearest(&ids, 2.0, 0.5), None);
    }

    #[test]
    fn a_blurred_reading_is_that_of_a_blurred_picture() {
        let edge = Image::from_fn(128, 96, |x, y| if 2 * y > x { 0.8_f32 } else { 0.1 });
        let pyramid = Pyramid::new(edge.clone());
        for sigma in [1.0_f32, 2.7, 4.0, 9.0] {
            let blurred = gaussian_blur(&edge, sigma);
            let places = (0..25).map(|i| (52 + i, 48_usize));
            let off = places.map(|(x, y)| {
                let at = (x as f64 + 0.5, y as f64 + 0.5);
                (sample_blurred(&pyramid, at.0, at.1, sigma.into()) - blurred[(x, y)]).abs()
            });
            let most = off.fold(0.0, f32::max);
            assert!(most < 0.03, "{most} at {sigma}");
        }
        assert_eq!(sample_blurred(&pyramid, 30.5, 40.5, 0.0), edge[(30, 40)]);
        assert_eq!(
            sample_blurred(&Pyramid::<f32>::default(), 1.0, 1.0, 2.0),
            0.0
        );
    }
}
