//! A screen whose edge is seen, taken for the object.

use super::outline::Outline;
use super::screen::{is_keyable, strongest_channel};
use super::screen_corners::{RIM_PX, at_search_size, four_corners, large_hue_regions};
use super::segment::{SegmentOptions, segment};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::{Point2, doubled_area};
use crate::image::{Image, Roi};
use crate::pixel::LinearRgb;
use std::ops::Range;

/// A screen with its surroundings fills at least this share of a photo; a can or a carton that is
/// green or blue seldom does.
const MIN_PHOTO_SHARE: f64 = 0.25;
/// Four corners enclose at least this share of the hull of a screen's hue. Of screens that were cut
/// out they had 0.96 and more, of bottles 0.80 at most.
const MIN_QUADRANGLE_SHARE: f64 = 0.93;
/// The hull of what has the screen's hue has at least this share of the hull that was cut out.
const MIN_HUE_SHARE: f64 = 0.9;
/// The channel that no screen is strongest in.
const RED_CHANNEL: usize = 0;

/// The warning that what was found in a photo looks like a whole screen with the object on it.
///
/// `hull` is that of what was found, pixels of the photo, clockwise as seen; `background` is the
/// mean colour around it. Where that is green or blue, it is the screen.
///
/// # Method
/// A screen is a large quadrangle of one green or blue hue, and something lies on it: another
/// colour, or, of clear plastic, what [`segment`] finds within the screen.
pub(super) fn screen_edge_seen(
    photo: &Image<LinearRgb>,
    hull: &[Point2<f64>],
    background: LinearRgb,
    options: &SegmentOptions,
) -> Option<Diagnostic> {
    let least = MIN_PHOTO_SHARE * photo.pixels().len() as f64;
    if is_screen_hue(background) || 0.5 * doubled_area(hull) < least {
        return None;
    }
    is_covered_screen(photo, hull, options).then(|| {
        Diagnostic::warning(
            Code::ScreenEdgeSeen,
            "what was cut out looks like the whole screen with something on it: let the screen fill the photo, crop the \
             photo to it, or give its size (screen_size)",
        )
    })
}

fn is_screen_hue(color: LinearRgb) -> bool {
    is_keyable(color) && strongest_channel(color) != RED_CHANNEL
}

/// Most of what lies in a hull is a quadrangle of one hue of a screen, and something lies on that.
///
/// The quadrangle is that of the hue: the hull that was cut out has bulges where a table has grain.
fn is_covered_screen(
    photo: &Image<LinearRgb>,
    hull: &[Point2<f64>],
    options: &SegmentOptions,
) -> bool {
    let picture = at_search_size(photo);
    let scale = picture.width() as f64 / photo.width() as f64;
    let hull: Vec<_> = hull
        .iter()
        .map(|p| Point2::from(p.coords * scale))
        .collect();
    let regions = large_hue_regions(&screen_hues(&picture, &hull));
    regions.iter().any(|screen| {
        let is_most = doubled_area(&screen.hull) >= MIN_HUE_SHARE * doubled_area(&hull);
        let corners = quadrangle(&screen.hull).filter(|_| is_most);
        corners.is_some_and(|corners| screen.is_covered || shows_object(&picture, corners, options))
    })
}

/// The corners of a hull that is nearly a quadrangle.
fn quadrangle(hull: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    let least = MIN_QUADRANGLE_SHARE * doubled_area(hull);
    four_corners(hull).filter(|corners| doubled_area(corners) >= least)
}

/// The picture with what has a screen's hue inside a hull, and black elsewhere.
fn screen_hues(picture: &Image<LinearRgb>, hull: &[Point2<f64>]) -> Image<LinearRgb> {
    let (w, h) = picture.size();
    let inside = Outline::from_ring(hull.to_vec()).coverage(w, h);
    picture.zip_map(&inside, |p, c| {
        if c.0 > 0.5 && is_screen_hue(p) {
            p
        } else {
            LinearRgb::BLACK
        }
    })
}

/// Something is found between the corners of a screen.
fn shows_object(
    picture: &Image<LinearRgb>,
    corners: [Point2<f64>; 4],
    options: &SegmentOptions,
) -> bool {
    let within = Roi::spanning(
        between_middle(corners.map(|p| p.x)),
        between_middle(corners.map(|p| p.y)),
    );
    within.area() > 0 && segment(&picture.crop(within), options).is_ok()
}

/// The whole pixels from the second of four coordinates to the third, without a rim: the upright
/// rectangle of two such lies within the corners.
fn between_middle(mut coordinates: [f64; 4]) -> Range<usize> {
    coordinates.sort_by(f64::total_cmp);
    let [_, low, high, _] = coordinates;
    (low + RIM_PX) as usize..(high - RIM_PX) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    const BROWN: LinearRgb = LinearRgb::new(0.2, 0.12, 0.06);
    const WHITE: LinearRgb = LinearRgb::new(0.6, 0.62, 0.65);
    const BLUE: LinearRgb = LinearRgb::new(0.05, 0.1, 0.4);
    const GREEN: LinearRgb = LinearRgb::new(0.05, 0.4, 0.1);
    const RED: LinearRgb = LinearRgb::new(0.5, 0.05, 0.05);

    /// A sheet with a smaller sheet on it on a table, told that this hull was cut out.
    fn is_hull_told([table, sheet, thing]: [LinearRgb; 3], hull: &[Point2<f64>]) -> bool {
        let photo = Image::from_fn(240, 180, |x, y| match (x, y) {
            (80..150, 70..110) => thing,
            (30..210, 25..155) => sheet,
            _ => table,
        });
        screen_edge_seen(&photo, hull, table, &SegmentOptions::default()).is_some()
    }

    /// The same of the hull of the outer one.
    fn is_told(table: LinearRgb, sheet: LinearRgb, thing: LinearRgb) -> bool {
        let hull = [[30.0, 25.0], [210.0, 25.0], [210.0, 155.0], [30.0, 155.0]];
        is_hull_told([table, sheet, thing], &hull.map(Point2::from))
    }

    #[test]
    fn a_sheet_with_something_on_it_is_told_on_any_table() {
        let clear = GREEN.scale(0.56) + LinearRgb::grey(0.02);
        for table in [BROWN, WHITE, LinearRgb::grey(0.03)] {
            for thing in [RED, WHITE, clear] {
                assert!(is_told(table, GREEN, thing), "{table:?} {thing:?}");
            }
        }
    }

    #[test]
    fn a_sheet_that_was_cut_out_with_bulges_is_told() {
        // Grain of the table bends every side outwards: four corners have 0.92 of it.
        let hull = [
            [30.0, 25.0],
            [120.0, 18.0],
            [210.0, 25.0],
            [218.0, 90.0],
            [210.0, 155.0],
            [120.0, 161.0],
            [30.0, 155.0],
            [23.0, 90.0],
        ];
        let hull = hull.map(Point2::from);
        let least = MIN_QUADRANGLE_SHARE * doubled_area(&hull);
        assert!(doubled_area(&four_corners(&hull).unwrap()) < least);
        assert!(is_hull_told([BROWN, GREEN, RED], &hull));
    }

    #[test]
    fn objects_of_a_screen_s_hue_are_none() {
        // Nothing on it; on a screen; of another hue than screens have.
        assert!(!is_told(WHITE, GREEN, GREEN));
        assert!(!is_told(BLUE, GREEN, WHITE));
        assert!(!is_told(WHITE, RED, WHITE));
    }
}
