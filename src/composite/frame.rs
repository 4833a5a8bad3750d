//! The finished frame: the light of objects over the shaded plate.

use crate::deep::DeepImage;
use crate::image::Image;
use crate::pixel::{Film, LinearRgb, PremulRgba};
use rayon::prelude::*;

/// Folds deep samples into a picture, over `plate` if there is one.
///
/// Scene-linear, premultiplied, of the deep picture's size. With a plate every pixel is opaque,
/// `light + transmittance * shadow * plate`, and has the plate's own bits where there is neither
/// card nor shadow. Without one, pixels are the objects' light and coverage; shadows have nothing
/// to fall on and are omitted, and film loses its tint ([`film`] keeps it).
///
/// # Panics
/// If the plate's size is not the picture's.
pub fn frame(deep: &DeepImage, plate: Option<&Image<LinearRgb>>) -> Image<PremulRgba> {
    let (width, height) = (deep.width(), deep.height());
    let Some(plate) = plate else {
        return Image::from_fn(width, height, |x, y| over_nothing(deep.flat(x, y)));
    };
    let shaded = |shadow: LinearRgb, plate: LinearRgb| (shadow * plate).opaque();
    let mut picture = deep.shadow().zip_map(plate, shaded);
    picture.par_rows_mut().enumerate().for_each(|(y, row)| {
        for (x, film) in deep.row_films(y) {
            row[x] = over(film, row[x].color());
        }
    });
    picture
}

/// A film over what is behind it, opaque.
pub(super) fn over(film: Film, behind: LinearRgb) -> PremulRgba {
    let seen = film.over_color(behind);
    let LinearRgb { r, g, b } = film.color;
    let is_short_of_light = r.min(g).min(b) < 0.0;
    // Any other plate keeps its own bits.
    let left = if is_short_of_light {
        at_least_none(seen)
    } else {
        seen
    };
    left.opaque()
}

/// A film alone.
pub(super) fn over_nothing(film: Film) -> PremulRgba {
    let color = at_least_none(film.color);
    Film { color, ..film }.to_rgba()
}

/// Light clamped at 0: refraction removes light from behind an object, and lens and shutter may
/// bring less of it there.
fn at_least_none(light: LinearRgb) -> LinearRgb {
    light.map(|v| if v < 0.0 { 0.0 } else { v })
}

/// Folds deep samples into a picture of their light and of their transmittance per channel;
/// scene-linear.
pub fn film(deep: &DeepImage) -> Image<Film> {
    Image::from_fn(deep.width(), deep.height(), |x, y| deep.flat(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deep::DeepSample;
    use crate::pixel::{Depth, ObjectId};

    fn sample(light: f32, visible: f32) -> DeepSample {
        DeepSample {
            object: ObjectId(1),
            depth: Depth(1.0),
            light: LinearRgb::grey(light),
            alpha: 0.5,
            visible,
        }
    }

    /// One bare pixel, one in shadow, one behind two samples.
    fn deep() -> DeepImage {
        let shadow = Image::from_vec(3, 1, [1.0, 0.5, 1.0].map(LinearRgb::grey).to_vec());
        DeepImage::from_pixels(
            shadow,
            [vec![], vec![], vec![sample(0.2, 0.5), sample(0.1, 0.25)]],
        )
    }

    #[test]
    fn the_plate_shines_through_what_is_left() {
        let plate = Image::filled(3, 1, LinearRgb::grey(0.8));
        let out = frame(&deep(), Some(&plate));
        assert_eq!(out[(1, 0)].r, 0.4);
        assert!((out[(2, 0)].r - (0.3 + 0.25 * 0.8)).abs() < 1e-6);
        assert!(out.pixels().iter().all(|p| p.a == 1.0));
    }

    #[test]
    fn an_untouched_plate_keeps_its_bits() {
        let odd = LinearRgb::new(0.1, f32::MIN_POSITIVE, 7.3);
        let out = frame(&deep(), Some(&Image::filled(3, 1, odd)));
        assert_eq!(out[(0, 0)], odd.opaque());
    }

    #[test]
    fn film_tints_the_plate() {
        let tints = [[0.5, 0.25, 0.0], [0.25, 0.0, 0.5]]
            .map(LinearRgb::from)
            .to_vec();
        let out = frame(
            &deep().with_tints(tints),
            Some(&Image::filled(3, 1, LinearRgb::grey(0.8))),
        );
        let expected = [0.25, 0.75, 0.5].map(|pass| 0.3 + pass * 0.8);
        assert!(
            (0..3).all(|c| (<[f32; 3]>::from(out[(2, 0)].color())[c] - expected[c]).abs() < 1e-6)
        );
    }

    #[test]
    fn grey_tints_give_the_bits_of_alpha() {
        let plate = Image::filled(3, 1, LinearRgb::new(0.1, 0.7, 0.33));
        let tinted = deep().with_tints([0.5, 0.25].map(LinearRgb::grey).to_vec());
        for plate in [None, Some(&plate)] {
            assert_eq!(frame(&tinted, plate), frame(&deep(), plate));
        }
    }

    #[test]
    fn without_a_plate_the_picture_is_premultiplied() {
        let out = frame(&deep(), None);
        assert_eq!(out[(0, 0)], PremulRgba::TRANSPARENT);
        assert_eq!(out[(2, 0)].a, 0.75);
    }
}
