//! Holes: where the screen is seen through an opaque object, as in a ring.

use super::cluster::{PixelGroups, without};
use super::shadow::{cast_shadow, shadow_left_out};
use crate::diagnostic::{Code, Diagnostic};
use crate::filter;
use crate::image::{Image, Mask};
use crate::matte::arrays::{differences, largest};
use crate::matte::plate::{PlateOptions, ScreenPlate};
use crate::matte::prepared::longer_side;
use crate::matte::screen::{is_keyable, screen_shade};
use crate::matte::stroke::{Claims, corrected, unclaimed};
use crate::pixel::LinearRgb;

/// Width of the zone around the object that is not used as background, as a share of the longer
/// side: contact shadows.
const BACKGROUND_MARGIN: f64 = 0.04;
/// A pixel is like the screen when no channel differs from the plate by more than this share, or
/// this many times the noise.
const LIKE_SHARE: f32 = 0.06;
const LIKE_SIGMAS: f32 = 3.0;
/// A pixel is unlike the screen when a channel differs by this share of the plate's strongest
/// channel.
const UNLIKE_SHARE: f32 = 0.3;
/// Least area of a hole as a share of what is enclosed; smaller ones are left to the matte.
const MIN_HOLE_AREA: f64 = 0.005;
/// A hole goes on where the screen lies in the shadow of its rim: no darker than this share of its plate.
const LEAST_SHADE: f32 = 0.4;
/// Share of the rim that must be unlike the screen: clear plastic is like it, and then what it
/// encloses is the object.
const OPAQUE_RIM_SHARE: f64 = 0.8;
/// A hole reaches so far beyond its core, to the middle of its edge.
const EDGE_PX: f64 = 2.0;
/// The rim lies so far around a hole's core: past the blur of its edge.
const RIM_PX: [f64; 2] = [3.0, 5.0];

/// What an object covers in the picture that was searched.
pub(super) struct ObjectArea {
    /// What its edges enclose, without holes where the screen has the colour to recognise them.
    pub(super) solid: Mask,
    /// What they enclose of its shadow, which is not part of it.
    pub(super) shadow: Mask,
    /// Something inside looks like the screen.
    has_screen_like_parts: bool,
}

impl ObjectArea {
    /// All that the edges enclose.
    fn all(inside: &Mask) -> Self {
        Self {
            solid: inside.clone(),
            shadow: Image::new(inside.width(), inside.height()),
            has_screen_like_parts: false,
        }
    }

    /// With what a person says is in it, without what is not.
    pub(super) fn corrected(self, claims: Option<&Claims>) -> Self {
        Self {
            solid: corrected(self.solid, claims),
            shadow: unclaimed(self.shadow, claims),
            ..self
        }
    }

    /// The warnings about what looks like the screen; the edges enclose `inside`.
    pub(super) fn diagnostics(&self, inside: &Mask) -> impl Iterator<Item = Diagnostic> {
        let parts = self.has_screen_like_parts.then(|| {
            Diagnostic::warning(
                Code::ScreenLikeParts,
                "parts of the object look like the screen: treated as holes or, on a grey board, as clear plastic; is that right?",
            )
        });
        parts
            .into_iter()
            .chain(shadow_left_out(&self.shadow, inside))
    }
}

/// The area of the object whose edges enclose `inside`.
pub(super) fn object_area(picture: &Image<LinearRgb>, inside: &Mask) -> ObjectArea {
    let background = background(inside, BACKGROUND_MARGIN * longer_side(picture) as f64);
    let Ok(plate) = ScreenPlate::fit(picture, &background, &PlateOptions::default()) else {
        return ObjectArea::all(inside);
    };
    let smooth = filter::box_blur(picture, 1);
    let holed = without_holes(&smooth, &plate, inside);
    let has_screen_like_parts = holed != *inside;
    // What is like a grey board may be clear plastic before it.
    if !are_distinguishable(picture, &background) {
        return ObjectArea {
            has_screen_like_parts,
            ..ObjectArea::all(inside)
        };
    }
    let shadow = cast_shadow(&smooth, &plate, inside);
    ObjectArea {
        solid: without(&holed, &shadow),
        shadow,
        has_screen_like_parts,
    }
}

/// What is enclosed, without the holes.
///
/// A hole looks like the screen all over and has a rim that does not: a rim of clear plastic
/// encloses clear plastic.
fn without_holes(smooth: &Image<LinearRgb>, plate: &ScreenPlate, inside: &Mask) -> Mask {
    let like = screen_like(smooth, plate, inside);
    let candidates = large_groups(
        &with_shadows(smooth, plate, inside, &like),
        &like,
        inside.count(),
    );
    if candidates.is_empty() {
        return inside.clone();
    }
    let unlike = smooth.zip_map(&plate.image, is_unlike_screen);
    let holes = candidates.iter().map(Hole::new);
    holes
        .filter(|hole| hole.has_opaque_rim(inside, &unlike))
        .fold(inside.clone(), |kept, hole| without(&kept, &hole.area))
}

/// The pixels inside that have the plate's colour.
fn screen_like(smooth: &Image<LinearRgb>, plate: &ScreenPlate, inside: &Mask) -> Mask {
    smooth.zip3_map(&plate.image, inside, |p, k, inside| {
        inside && is_like_screen(p, k, plate.residual)
    })
}

#[inline]
fn is_like_screen(pixel: LinearRgb, plate: LinearRgb, noise: LinearRgb) -> bool {
    let off = differences(pixel, plate);
    let (plate, noise) = (plate.channels(), noise.channels());
    (0..3).all(|c| off[c] <= (LIKE_SHARE * plate[c]).max(LIKE_SIGMAS * noise[c]))
}

/// The pixels that have the plate's colour, and those that have it in the shadow of the object.
fn with_shadows(
    smooth: &Image<LinearRgb>,
    plate: &ScreenPlate,
    inside: &Mask,
    like: &Mask,
) -> Mask {
    let shaded = smooth.zip3_map(&plate.image, inside, |p, k, inside| {
        inside && screen_shade(p.into(), k.into()).is_some_and(|shade| shade >= LEAST_SHADE)
    });
    shaded.zip_map(like, |shaded, like| shaded || like)
}

/// The cores of the groups of which so much is lit screen as is enough for a hole in an area of
/// `area` pixels.
fn large_groups(shaded: &Mask, like: &Mask, area: usize) -> Vec<Mask> {
    let groups = PixelGroups::new(&filter::erode(shaded, 1.0));
    let sizes = groups.sizes(like);
    (0..sizes.len())
        .filter(|&group| sizes[group] as f64 >= MIN_HOLE_AREA * area as f64)
        .map(|group| groups.only(|g| g == group))
        .collect()
}

fn is_unlike_screen(pixel: LinearRgb, plate: LinearRgb) -> bool {
    let strongest = largest(plate.channels());
    differences(pixel, plate)
        .into_iter()
        .any(|d| d >= UNLIKE_SHARE * strongest)
}

/// What may be a hole.
struct Hole {
    area: Mask,
    /// The pixels around it.
    rim: Mask,
}

impl Hole {
    fn new(core: &Mask) -> Self {
        let [inner, outer] = RIM_PX.map(|reach| filter::dilate(core, reach));
        Self {
            area: filter::dilate(core, EDGE_PX),
            rim: without(&outer, &inner),
        }
    }

    /// It is enclosed all around, mostly by what is unlike the screen.
    fn has_opaque_rim(&self, inside: &Mask, unlike: &Mask) -> bool {
        let opaque = self
            .rim
            .zip_map(unlike, |rim, unlike| rim && unlike)
            .count();
        let least = OPAQUE_RIM_SHARE * self.rim.count() as f64;
        let is_enclosed = without(&self.rim, inside).count() == 0;
        is_enclosed && opaque as f64 >= least
    }
}

/// Whether the screen has enough colour to be distinguished from clear plastic.
fn are_distinguishable(picture: &Image<LinearRgb>, background: &Mask) -> bool {
    let free = picture.pixels_in(background);
    is_keyable(free.fold(LinearRgb::BLACK, |sum, p| sum + p))
}

/// The pixels that surely show the screen: farther than a margin from what is enclosed.
fn background(inside: &Mask, margin_px: f64) -> Mask {
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
        object_area(&photo, &outer).solid
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
    fn a_hole_in_the_shadow_of_its_rim_is_a_hole() {
        let ring = disc(40.0).zip_map(&disc(20.0), |outer, inner| outer && !inner);
        let shadow = filter::gaussian_blur(&filter::dilate(&ring, 2.0).to_coverage(), 2.0);
        for rim in [[0.5, 0.05, 0.05], [0.01, 0.01, 0.01], [0.6, 0.6, 0.6]] {
            let sharp = ring.zip_map(&shadow, |ring, shadow| {
                if ring {
                    LinearRgb::from(rim)
                } else {
                    GREEN.scale(1.0 - 0.35 * shadow.0)
                }
            });
            let photo = filter::gaussian_blur(&sharp, 1.0);
            let outer = disc(40.0);
            let kept = object_area(&photo, &outer).solid;
            assert!(
                !kept[(60, 50)] && !kept[(60, 66)] && kept[(60, 75)],
                "{rim:?}"
            );
        }
    }

    #[test]
    fn holes_are_not_distinguishable_on_a_grey_board() {
        let background = disc(40.0).map(|inside| !inside);
        let board = |color: LinearRgb| Image::filled(120, 100, color);
        assert!(
            are_distinguishable(&board(GREEN), &background)
                && !are_distinguishable(&board(LinearRgb::grey(0.6)), &background)
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
        assert_eq!(object_area(&photo, &full).solid, full);
    }
}
