//! From which value on a photo is clipped.

use super::arrays::largest;
use crate::color::ColorMatrix;
use crate::image::Image;
use crate::pixel::LinearRgb;

/// Pictures that are brighter than this somewhere do not end at 1.
const UNLIMITED: f32 = 1.05;

/// Whether a scene-linear photo ends at 1: what is brighter is clipped in it. Saturated colours of
/// Display P3 are brighter than 1 in Rec. 709, but not in ACEScg.
pub(crate) fn ends_at_one(photo: &Image<LinearRgb>) -> bool {
    let acescg = ColorMatrix::acescg_from_linear();
    let is_brighter = |p: &LinearRgb| {
        p.max_channel() > UNLIMITED && largest(acescg.apply(p.channels())) > UNLIMITED
    };
    !photo.pixels().iter().any(is_brighter)
}

/// The value from which on a channel of a photo is clipped: `given`, or infinite where
/// that speaks of photos that end at 1 and this one does not.
pub(super) fn clipping_level(photo: &Image<LinearRgb>, given: f32) -> f32 {
    if given > UNLIMITED || ends_at_one(photo) {
        given
    } else {
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_photo_that_does_not_end_at_1_is_clipped_where_the_user_says_or_nowhere() {
        let photo = |light| Image::filled(4, 3, LinearRgb::grey(light));
        assert_eq!(clipping_level(&photo(0.9), 0.98), 0.98);
        assert_eq!(clipping_level(&photo(2.7), 0.98), f32::INFINITY);
        assert_eq!(clipping_level(&photo(2.7), 2.5), 2.5);
    }

    #[test]
    fn a_photo_of_display_p3_ends_at_1() {
        let red = Image::filled(4, 3, LinearRgb::new(1.2249, -0.0421, -0.0196));
        assert_eq!(clipping_level(&red, 0.98), 0.98);
    }
}
