//! From which value on a photo is clipped, and whether its screen is.

use super::arrays::largest;
use crate::color::ColorMatrix;
use crate::diagnostic::{Code, Diagnostic};
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};

/// From this scene-linear value on a channel of a photo that ends at 1 is clipped.
pub(super) const CLIPPED: f32 = 0.98;

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

/// A screen that is clipped in more of its pixels than this is worth a warning: a plate goes on
/// under the object, so a corner beside a lamp may be clipped.
const MAX_CLIPPED_SHARE: f32 = 0.1;

/// The warning about a screen around an object that is too bright for the camera, in photos that
/// end at 1 from `clipped` on.
pub(super) fn clipped_screen(
    photo: &Image<LinearRgb>,
    object: &Image<Coverage>,
    clipped: f32,
) -> Option<Diagnostic> {
    let share = clipped_share(photo, object, clipped);
    (share > MAX_CLIPPED_SHARE).then(|| {
        Diagnostic::warning(
            Code::ClippedScreen,
            format_args!(
                "{:.0} % of the screen is clipped: transmittance cannot be measured; use a shorter exposure",
                100.0 * share
            ),
        )
    })
}

/// Share of the pixels outside a mask with a channel that is clipped.
fn clipped_share(photo: &Image<LinearRgb>, mask: &Image<Coverage>, clipped: f32) -> f32 {
    let level = clipping_level(photo, clipped);
    let pixels = photo.pixels().iter().zip(mask.pixels());
    let outside = pixels.filter(|(_, m)| m.0 <= 0.0);
    let (all, count) = outside.fold((0_u64, 0_u64), |(all, count), (p, _)| {
        (all + 1, count + u64::from(p.max_channel() >= level))
    });
    count as f32 / all.max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bright_screen_is_not_clipped_where_the_photo_does_not_end_at_1() {
        let green = LinearRgb::new(0.04, 0.4, 0.08);
        let share = |exposure: f32| {
            let exposed = Image::filled(12, 8, green.scale(exposure));
            clipped_share(&exposed, &Image::new(12, 8), CLIPPED)
        };
        assert_eq!([1.0, 2.5, 3.0].map(share), [0.0, 1.0, 0.0]);
    }

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
