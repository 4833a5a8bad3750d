//! What a lens and a hand do to a picture.

use super::scaled;
use petcomp::Image;
use petcomp::LinearRgb;

/// The mean of a photo moved to several places, whole pixels right and down.
fn mean_of(photo: &Image<LinearRgb>, places: &[(isize, isize)]) -> Image<LinearRgb> {
    let share = 1.0 / places.len() as f32;
    Image::from_fn(photo.width(), photo.height(), |x, y| {
        let seen = places
            .iter()
            .map(|(dx, dy)| photo.nearest(x as isize + dx, y as isize + dy));
        seen.fold(LinearRgb::BLACK, |sum, p| sum + p).scale(share)
    })
}

/// A camera that moved by some pixels in a direction.
pub(super) fn moved(photo: &Image<LinearRgb>, direction: f64, by_px: usize) -> Image<LinearRgb> {
    let (sin, cos) = libm::sincos(direction);
    let place = |i: usize| {
        let along = i as f64 - 0.5 * by_px as f64;
        (
            (along * cos).round() as isize,
            (along * sin).round() as isize,
        )
    };
    mean_of(photo, &(0..=by_px).map(place).collect::<Vec<_>>())
}

/// A lens that makes a disc of every point.
pub(super) fn defocused(photo: &Image<LinearRgb>, radius_px: isize) -> Image<LinearRgb> {
    let square =
        (-radius_px..=radius_px).flat_map(|dx| (-radius_px..=radius_px).map(move |dy| (dx, dy)));
    mean_of(
        photo,
        &square
            .filter(|(dx, dy)| dx * dx + dy * dy <= radius_px * radius_px)
            .collect::<Vec<_>>(),
    )
}

/// A lens that darkens the corners by a share.
pub(super) fn vignetted(photo: &Image<LinearRgb>, share: f64) -> Image<LinearRgb> {
    let (w, h) = (photo.width() as f64, photo.height() as f64);
    scaled(photo, |x, y| {
        let square = ((x - 0.5 * w).powi(2) + (y - 0.5 * h).powi(2)) / (0.25 * (w * w + h * h));
        (1.0 - share * square) as f32
    })
}
