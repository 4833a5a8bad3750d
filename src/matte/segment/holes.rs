//! Holes: where the screen is seen through an opaque object, as in a ring.

use super::cluster::Groups;
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::plate::{PlateOptions, ScreenPlate};
use crate::matte::screen::is_keyable;
use crate::pixel::LinearRgb;

/// A pixel is like the screen when no channel differs from the plate by more than this share, or this many times the noise.
const LIKE_SHARE: f32 = 0.06;
const LIKE_NOISE: f32 = 3.0;
/// A pixel is unlike the screen when a channel differs by this share of the plate's strongest channel.
const UNLIKE_SHARE: f32 = 0.3;
/// Least area of a hole as a share of what is enclosed; smaller ones are a matter of the matte.
const LEAST_AREA: f64 = 0.005;
/// Share of the rim that must be unlike the screen: clear plastic is like it, and then what it encloses is the object.
const OPAQUE_RIM: f64 = 0.8;
/// The rim lies so far around a hole: past the blur of its edge.
const RIM_PX: [f64; 2] = [2.0, 5.0];

/// What is enclosed, without the holes.
///
/// A hole looks like the screen all over and has a rim that does not: a rim of clear plastic encloses clear plastic.
pub(super) fn without_holes(picture: &Image<LinearRgb>, inside: &Mask, background: &Mask) -> Mask {
    let Ok(plate) = ScreenPlate::fit(picture, background, &PlateOptions::default()) else {
        return inside.clone();
    };
    let smooth = filter::box_blur(picture, 1);
    let noise: [f32; 3] = plate.residual.into();
    let like = smooth.zip3_map(&plate.image, inside, |p, k, inside| {
        let (off, k) = (differences(p, k), <[f32; 3]>::from(k));
        inside && (0..3).all(|c| off[c] <= (LIKE_SHARE * k[c]).max(LIKE_NOISE * noise[c]))
    });
    let groups = Groups::of(&filter::erode(&like, 1.0));
    let (sizes, area) = (groups.sizes(&like), inside.count() as f64);
    let large: Vec<usize> = (0..sizes.len())
        .filter(|&g| sizes[g] as f64 >= LEAST_AREA * area)
        .collect();
    if large.is_empty() {
        return inside.clone();
    }
    let unlike = smooth.zip_map(&plate.image, |p, k| {
        let strongest = <[f32; 3]>::from(k).into_iter().fold(0.0, f32::max);
        differences(p, k)
            .into_iter()
            .any(|d| d >= UNLIKE_SHARE * strongest)
    });
    let mut kept = inside.clone();
    for group in large {
        let hole = filter::dilate(&groups.only(|g| g == group), RIM_PX[0]);
        let rim =
            filter::dilate(&hole, RIM_PX[1] - RIM_PX[0]).zip_map(&hole, |near, hole| near && !hole);
        let opaque = rim.zip_map(&unlike, |rim, unlike| rim && unlike);
        let enclosed = rim
            .zip_map(inside, |rim, inside| !rim || inside)
            .pixels()
            .iter()
            .all(|p| *p);
        if enclosed && opaque.count() as f64 >= OPAQUE_RIM * rim.count() as f64 {
            kept = kept.zip_map(&hole, |kept, hole| kept && !hole);
        }
    }
    kept
}

/// Whether the screen has enough colour to be told from clear plastic.
pub(super) fn are_told(picture: &Image<LinearRgb>, background: &Mask) -> bool {
    let seen = picture
        .pixels()
        .iter()
        .zip(background.pixels())
        .filter(|(_, free)| **free);
    is_keyable(seen.fold(LinearRgb::BLACK, |sum, (p, _)| sum + *p))
}

fn differences(a: LinearRgb, b: LinearRgb) -> [f32; 3] {
    [(a.r - b.r).abs(), (a.g - b.g).abs(), (a.b - b.b).abs()]
}

/// The pixels of the picture that was searched that surely show the screen.
pub(super) fn around(inside: &Mask, margin_px: f64) -> Mask {
    filter::dilate(inside, margin_px).complement()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: LinearRgb = LinearRgb::new(0.04, 0.4, 0.08);

    fn disc(radius: f64) -> Mask {
        Image::from_fn(120, 100, |x, y| {
            (x as f64 - 60.0).hypot(y as f64 - 50.0) < radius
        })
    }

    fn kept(rim: LinearRgb) -> Mask {
        let (outer, inner) = (disc(40.0), disc(20.0));
        let photo = outer.zip_map(
            &inner,
            |outer, inner| if outer && !inner { rim } else { GREEN },
        );
        without_holes(&photo, &outer, &around(&outer, 3.0))
    }

    #[test]
    fn an_opaque_ring_has_a_hole() {
        let kept = kept(LinearRgb::new(0.5, 0.05, 0.05));
        assert!(!kept[(60, 50)] && kept[(60, 80)] && kept[(60, 79)]);
        assert!(
            (disc(20.0).count() as f64 / (disc(40.0).count() - kept.count()) as f64 - 1.0).abs()
                < 0.15
        );
    }

    #[test]
    fn a_grey_board_tells_no_holes() {
        let background = disc(40.0).map(|inside| !inside);
        let board = |color: LinearRgb| Image::filled(120, 100, color);
        assert!(
            are_told(&board(GREEN), &background)
                && !are_told(&board(LinearRgb::grey(0.6)), &background)
        );
    }

    #[test]
    fn a_ring_of_film_encloses_film() {
        let kept = kept(GREEN.scale(0.85));
        assert_eq!(kept, disc(40.0));
    }

    #[test]
    fn a_picture_without_background_keeps_what_is_enclosed() {
        let full = Image::filled(40, 40, true);
        let photo = Image::filled(40, 40, GREEN);
        assert_eq!(without_holes(&photo, &full, &around(&full, 3.0)), full);
    }
}
