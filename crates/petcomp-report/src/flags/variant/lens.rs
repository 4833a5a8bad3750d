//! Effects of a lens and of camera shake.

use super::scaled;
use petcomp::Image;
use petcomp::LinearRgb;

/// The mean of a photo shifted by several offsets, integer pixels right and down.
fn mean_of_shifts(photo: &Image<LinearRgb>, offsets: &[(isize, isize)]) -> Image<LinearRgb> {
    let share = 1.0 / offsets.len() as f32;
    Image::from_fn(photo.width(), photo.height(), |x, y| {
        let shifted = offsets
            .iter()
            .map(|(dx, dy)| photo.nearest(x as isize + dx, y as isize + dy));
        let sum = shifted.fold(LinearRgb::BLACK, |sum, p| sum + p);
        sum.scale(share)
    })
}

/// Motion blur: a camera that moved by some pixels in a direction.
pub(super) fn moved(photo: &Image<LinearRgb>, direction: f64, by_px: usize) -> Image<LinearRgb> {
    let (sin, cos) = libm::sincos(direction);
    let along = (0..=by_px).map(|i| i as f64 - 0.5 * by_px as f64);
    let offsets: Vec<_> = along
        .map(|along| (nearest_pixel(along * cos), nearest_pixel(along * sin)))
        .collect();
    mean_of_shifts(photo, &offsets)
}

fn nearest_pixel(offset: f64) -> isize {
    offset.round() as isize
}

/// Defocus: a lens that images every point as a disc.
pub(super) fn defocused(photo: &Image<LinearRgb>, radius_px: isize) -> Image<LinearRgb> {
    let disc: Vec<_> = square_offsets(radius_px)
        .filter(|(dx, dy)| dx * dx + dy * dy <= radius_px * radius_px)
        .collect();
    mean_of_shifts(photo, &disc)
}

fn square_offsets(radius_px: isize) -> impl Iterator<Item = (isize, isize)> {
    let side = -radius_px..=radius_px;
    side.clone()
        .flat_map(move |dx| side.clone().map(move |dy| (dx, dy)))
}

/// Vignetting: a lens that darkens the corners by a share.
pub(super) fn vignetted(photo: &Image<LinearRgb>, share: f64) -> Image<LinearRgb> {
    let (w, h) = (photo.width() as f64, photo.height() as f64);
    let corner = 0.25 * (w * w + h * h);
    scaled(photo, |x, y| {
        let square = ((x - 0.5 * w).powi(2) + (y - 0.5 * h).powi(2)) / corner;
        (1.0 - share * square) as f32
    })
}
