//! A photo as the stages of a cut-out take it: checked, reduced and square-rooted once.

use super::check::{check_photo, refused};
use crate::error::Result;
use crate::filter;
use crate::image::Image;
use crate::pixel::LinearRgb;
use std::borrow::Cow;

/// Least longer side of a picture that is searched, pixels.
pub(super) const MIN_SEARCH_SIZE_PX: usize = 32;
/// Shortest side that can hold an object and its background, pixels.
const MIN_PHOTO_SIDE_PX: usize = 16;
/// A photo with a shorter longer side than this is enlarged for the search: bands and gaps of a few
/// pixels are wide beside an object of 20.
const SMALL_PHOTO_PX: usize = 128;
/// Longer side, at least, to which it is enlarged.
const ENLARGED_PHOTO_PX: usize = 256;

/// A photo that can be segmented, and what is derived from it alone.
pub(super) struct Prepared<'a> {
    /// Scene-linear and finite.
    pub(super) photo: &'a Image<LinearRgb>,
    /// The picture that is searched for the object: the photo itself, or a copy at another
    /// resolution.
    pub(super) small: Cow<'a, Image<LinearRgb>>,
    /// Square roots of the photo, in which shot noise is the same everywhere.
    pub(super) sqrt: Image<LinearRgb>,
}

impl<'a> Prepared<'a> {
    /// Checks a photo and reduces it to a longer side of `working_size` pixels.
    ///
    /// # Errors
    /// [`Error::Photo`](crate::Error::Photo) for a photo that is too small or has a pixel that is
    /// not finite.
    pub(super) fn new(photo: &'a Image<LinearRgb>, working_size: usize) -> Result<Self> {
        check_size(photo)?;
        check_finite(photo)?;
        Ok(Self {
            photo,
            small: at_working_size(photo, working_size),
            sqrt: photo.map(square_root),
        })
    }

    /// Pixels of the photo for a pixel of [`small`](Self::small).
    pub(super) fn reduction(&self) -> f64 {
        self.longer_side() as f64 / longer_side(&self.small) as f64
    }

    /// Longer side of the photo, pixels.
    pub(super) fn longer_side(&self) -> usize {
        longer_side(self.photo)
    }
}

/// Square roots of the channels: the shot noise of a sensor is the same everywhere in them.
#[inline]
pub(super) fn square_root(p: LinearRgb) -> LinearRgb {
    p.map(|v| v.max(0.0).sqrt())
}

/// Refuses a photo with a pixel that is not finite.
pub(super) fn check_finite(photo: &Image<LinearRgb>) -> Result<()> {
    pixel_not_finite(photo).map_or(Ok(()), |what| Err(refused(what)))
}

/// Refuses one of several photos, by its name, with a pixel that is not finite.
pub(super) fn check_finite_photo(name: &str, photo: &Image<LinearRgb>) -> Result<()> {
    let what = pixel_not_finite(photo);
    what.map_or(Ok(()), |what| Err(refused(format!("{name}: {what}"))))
}

/// What is wrong with a photo with a pixel that is not finite.
fn pixel_not_finite(photo: &Image<LinearRgb>) -> Option<String> {
    let i = photo.pixels().iter().position(|p| !p.is_finite())?;
    let (x, y) = (i % photo.width(), i / photo.width());
    Some(format!("pixel ({x}, {y}) is not a finite number"))
}

fn check_size(photo: &Image<LinearRgb>) -> Result<()> {
    let (w, h) = photo.size();
    check_photo(w.min(h) >= MIN_PHOTO_SIDE_PX, || {
        format!(
            "the photo is {w} x {h} pixels, expected at least {MIN_PHOTO_SIDE_PX} x {MIN_PHOTO_SIDE_PX}"
        )
    })
}

/// Longer side of a picture, pixels.
pub(super) fn longer_side<P: Copy>(image: &Image<P>) -> usize {
    image.width().max(image.height())
}

/// The photo, or a copy whose longer side is `working_size`; a small photo enlarged.
fn at_working_size(photo: &Image<LinearRgb>, working_size: usize) -> Cow<'_, Image<LinearRgb>> {
    let longer = longer_side(photo);
    if longer < SMALL_PHOTO_PX.min(working_size) {
        let times = ENLARGED_PHOTO_PX.div_ceil(longer);
        let (w, h) = photo.size();
        Cow::Owned(filter::resize(photo, times * w, times * h))
    } else if longer <= working_size {
        Cow::Borrowed(photo)
    } else {
        let [w, h] = scaled_sides(photo.size(), working_size, MIN_SEARCH_SIZE_PX);
        Cow::Owned(filter::resize(photo, w, h))
    }
}

/// The sides of a picture that is scaled to a longer side; none is less than `shortest`.
pub(super) fn scaled_sides(
    (w, h): (usize, usize),
    longer_side: usize,
    shortest: usize,
) -> [usize; 2] {
    [w, h].map(|side| (side * longer_side).div_ceil(w.max(h)).max(shortest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(w: usize, h: usize) -> Image<LinearRgb> {
        Image::filled(w, h, LinearRgb::grey(0.25))
    }

    #[test]
    fn a_photo_of_the_search_size_is_not_copied() {
        let photo = grey(640, 300);
        let prepared = Prepared::new(&photo, 640).unwrap();
        assert!(matches!(prepared.small, Cow::Borrowed(small) if std::ptr::eq(small, &photo)));
        assert_eq!(prepared.sqrt[(3, 5)], LinearRgb::grey(0.5));
    }

    #[test]
    fn large_photos_are_reduced_and_small_ones_enlarged() {
        let size = |w, h| Prepared::new(&grey(w, h), 640).unwrap().small.size();
        assert_eq!((size(1000, 500), size(100, 50)), ((640, 320), (300, 150)));
    }

    #[test]
    fn a_pixel_that_is_not_finite_is_named() {
        let mut photo = grey(40, 30);
        photo[(7, 9)].g = f32::NAN;
        let error = Prepared::new(&photo, 640).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.contains("pixel (7, 9)")));
    }
}
