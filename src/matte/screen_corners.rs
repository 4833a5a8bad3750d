//! The four corners of a coloured screen that is seen as a whole.

use super::outline::Outline;
use super::screen::{is_keyable, strongest_channel};
use super::segment::Groups;
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Point2, Vector2};
use crate::image::Image;
use crate::pixel::{Coverage, LinearRgb};

/// Longer side of the picture that is searched, pixels.
const WORKING_SIZE: usize = 1024;
/// A screen that is worth its name covers this share of the photo.
const LEAST_SHARE: f64 = 0.1;
/// How far the two weaker channels may be from the screen's, as shares of its strongest.
const HUE_SLACK: f32 = 0.2;
/// How much darker or brighter than its median a screen may be: uneven light, shadows.
const LIGHT: std::ops::Range<f32> = 0.1..5.0;
/// The middle share of a side that its line is fitted to: corners are worn, and the next side begins.
const MIDDLE: f64 = 0.8;
/// A border of so many pixels of the search beside a side's line is no straight one.
const CROOKED_PX: f64 = 2.0;

/// Corners of the coloured screen in a photo: top left, top right, bottom right, bottom left, pixels.
///
/// `photo` is scene-linear; the screen is a rectangle on something of another colour, and all of it is seen.
///
/// # Method
/// Pixels of the commonest saturated hue, their largest connected group, its convex hull; each side of the four-cornered
/// polygon that is left when the corners of least area are taken away is then fitted as a line (total least squares).
///
/// # Errors
/// [`Error::Photo`] where there is no coloured screen, it reaches the border of the photo, or its outline is no
/// rectangle's.
pub fn screen_corners(photo: &Image<LinearRgb>) -> Result<[Point2<f64>; 4]> {
    let longer = photo.width().max(photo.height());
    if photo.width().min(photo.height()) == 0 {
        return Err(refused("the photo is empty"));
    }
    let side = |len: usize| (len * WORKING_SIZE.min(longer)).div_ceil(longer).max(1);
    let picture = filter::resize(photo, side(photo.width()), side(photo.height()));
    let screen = largest_group(&colored(&picture)?)?;
    let soft = filter::gaussian_blur(&screen.map(|inside| Coverage(f32::from(u8::from(inside)))), 1.0);
    let hull = Outline::around(&soft).hull();
    let rough = four_corners(hull.clone()).ok_or_else(|| refused("its outline has no four corners"))?;
    let lines = [0, 1, 2, 3].map(|i| Line::fit(&hull, rough[i], rough[(i + 1) % 4]));
    if let Some(off) = lines.iter().map(|line| line.off).find(|off| *off > CROOKED_PX) {
        return Err(refused(format!("a side of it is crooked by {off:.1} pixels of {WORKING_SIZE}")));
    }
    let corner = |i: usize| lines[(i + 3) % 4].crossing(&lines[i]);
    let corners: Option<Vec<Point2<f64>>> = (0..4).map(corner).collect();
    let corners = corners.ok_or_else(|| refused("two sides of it are parallel"))?;
    let scale = photo.width() as f64 / picture.width() as f64;
    let first = (0..4).min_by(|&i, &j| (corners[i].x + corners[i].y).total_cmp(&(corners[j].x + corners[j].y)));
    let first = first.unwrap_or_default();
    Ok([0, 1, 2, 3].map(|i| Point2::from(corners[(first + i) % 4].coords * scale)))
}

fn refused(what: impl std::fmt::Display) -> Error {
    let instead = "name screen_corners, or a length";
    Error::Photo { what: format!("the corners of the screen cannot be found: {what}; {instead}") }
}

/// The pixels that have the commonest saturated hue.
fn colored(picture: &Image<LinearRgb>) -> Result<Image<bool>> {
    let keyable: Vec<LinearRgb> = picture.pixels().iter().copied().filter(|p| is_keyable(*p)).collect();
    let of = |key: usize| keyable.iter().copied().filter(move |p| strongest_channel(*p) == key);
    let key = (0..3).max_by_key(|&key| of(key).count()).unwrap_or_default();
    if (of(key).count() as f64) < LEAST_SHARE * picture.pixels().len() as f64 {
        return Err(refused("less than a tenth of the photo has a colour"));
    }
    let shares = |p: LinearRgb| {
        let channels: [f32; 3] = p.into();
        [channels[(key + 1) % 3] / channels[key], channels[(key + 2) % 3] / channels[key]]
    };
    let light = median(of(key).map(|p| <[f32; 3]>::from(p)[key]).collect());
    let usual = [0, 1].map(|i| median(of(key).map(|p| shares(p)[i]).collect()));
    Ok(picture.map(|p| {
        let near = shares(p).iter().zip(usual).all(|(share, usual)| (share - usual).abs() < HUE_SLACK);
        is_keyable(p) && strongest_channel(p) == key && near && LIGHT.contains(&(<[f32; 3]>::from(p)[key] / light))
    }))
}

fn median(mut values: Vec<f32>) -> f32 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// The largest connected group of a set, which must not reach the border of the picture.
fn largest_group(set: &Image<bool>) -> Result<Image<bool>> {
    let groups = Groups::of(set);
    let sizes = groups.sizes(set);
    let largest = (0..sizes.len()).max_by_key(|&i| sizes[i]).ok_or_else(|| refused("nothing of it is seen"))?;
    let screen = groups.only(|i| i == largest);
    let (w, h) = screen.size();
    let border = (0..w).flat_map(|x| [(x, 0), (x, h - 1)]).chain((0..h).flat_map(|y| [(0, y), (w - 1, y)]));
    if border.into_iter().any(|at| screen[at]) {
        return Err(refused("it reaches the border of the photo"));
    }
    Ok(screen)
}

/// What is left of a convex polygon when the corner whose triangle with its neighbours is least goes, again and again.
fn four_corners(mut ring: Vec<Point2<f64>>) -> Option<[Point2<f64>; 4]> {
    let area = |ring: &[Point2<f64>], i: usize| {
        let [a, b, c] = [i + ring.len() - 1, i, i + 1].map(|i| ring[i % ring.len()]);
        (b - a).perp(&(c - b)).abs()
    };
    while ring.len() > 4 {
        let least = (0..ring.len()).min_by(|&i, &j| area(&ring, i).total_cmp(&area(&ring, j)))?;
        ring.remove(least);
    }
    ring.try_into().ok()
}

/// A straight side.
struct Line {
    at: Point2<f64>,
    along: Vector2<f64>,
    /// Largest distance of the border from it.
    off: f64,
}

impl Line {
    /// Through the border between two corners, of which it is asked every pixel.
    fn fit(hull: &[Point2<f64>], from: Point2<f64>, to: Point2<f64>) -> Self {
        let (length, along) = ((to - from).norm(), (to - from).normalize());
        let ends = [0.5 * (1.0 - MIDDLE), 0.5 * (1.0 + MIDDLE)].map(|share| share * length);
        let next = hull.iter().cycle().skip(1);
        let border: Vec<Point2<f64>> = hull.iter().zip(next).flat_map(|(a, b)| every_pixel(*a, *b)).collect();
        let beside = |p: &&Point2<f64>| {
            let (t, off) = ((*p - from).dot(&along), (*p - from).perp(&along).abs());
            (ends[0]..=ends[1]).contains(&t) && off < 0.1 * length
        };
        let side: Vec<Point2<f64>> = border.iter().filter(beside).copied().collect();
        let count = side.len().max(1) as f64;
        let at = side.iter().fold(Point2::origin(), |sum, p| sum + p.coords / count);
        let [xx, xy, yy] = side
            .iter()
            .map(|p| p - at)
            .fold([0.0; 3], |[xx, xy, yy], d| [xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y]);
        let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
        let along = Vector2::new(libm::cos(angle), libm::sin(angle));
        let off = side.iter().map(|p| (p - at).perp(&along).abs()).fold(0.0, f64::max);
        Self { at, along, off }
    }

    fn crossing(&self, other: &Self) -> Option<Point2<f64>> {
        let across = self.along.perp(&other.along);
        (across.abs() > 0.1).then(|| self.at + self.along * ((other.at - self.at).perp(&other.along) / across))
    }
}

fn every_pixel(a: Point2<f64>, b: Point2<f64>) -> impl Iterator<Item = Point2<f64>> {
    let steps = (b - a).norm().ceil().max(1.0) as usize;
    (0..steps).map(move |i| a + (b - a) * (i as f64 / steps as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Pose, UnitQuaternion, Vector3};
    use crate::{Camera, camera::project_picture, filter::Pyramid};

    /// A green screen of 0.6 x 0.4 m on a brown table, unevenly lit, with a red slab on it; and its camera.
    fn photo(tilt: f64, turn: f64, height: f64) -> (Image<LinearRgb>, Camera) {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt)
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let camera = Camera {
            image: [900, 700],
            focal_px: [900.0; 2].into(),
            principal_px: [450.0, 350.0].into(),
            camera_from_world: Pose::from_parts((down * Vector3::new(0.0, 0.0, -height)).into(), down),
        };
        let screen = Image::from_fn(600, 400, |x, y| {
            let slab = (200..380).contains(&x) && (150..230).contains(&y);
            let light = 0.6 + 0.4 * x as f32 / 600.0;
            if slab { LinearRgb::new(0.6, 0.05, 0.05) } else { LinearRgb::new(0.05, 0.4, 0.1).scale(light) }
        });
        let seen = project_picture(&Pyramid::new(screen), &camera, [0.6, 0.4]);
        let alpha = project_picture(&Pyramid::new(Image::filled(600, 400, Coverage(1.0))), &camera, [0.6, 0.4]);
        let table = LinearRgb::new(0.2, 0.16, 0.12);
        (seen.zip_map(&alpha, |p, a| p + table.scale(1.0 - a.0)), camera)
    }

    #[test]
    fn the_corners_are_found_to_half_a_pixel_of_the_search() {
        for (tilt, turn, height) in [(0.0, 0.0, 0.8), (0.15, 0.1, 0.9), (-0.2, -0.15, 1.0)] {
            let (photo, camera) = photo(tilt, turn, height);
            let found = screen_corners(&photo).unwrap();
            for (found, [x, y]) in found.iter().zip([[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]]) {
                let (truth, _) = camera.project([x, y, 0.0].into()).unwrap();
                assert!((found - truth).norm() < 0.5, "{tilt} {turn}: {found} instead of {truth}");
            }
        }
    }

    #[test]
    fn what_shows_no_whole_screen_is_told() {
        let told = |photo: &Image<LinearRgb>| screen_corners(photo).unwrap_err().to_string();
        let (whole, _) = photo(0.0, 0.0, 0.8);
        let near = whole.crop(crate::Roi { x: 200, y: 150, width: 400, height: 300 });
        assert!(told(&near).contains("it reaches the border of the photo; name screen_corners"), "{}", told(&near));
        let grey = Image::filled(90, 60, LinearRgb::grey(0.5));
        assert!(told(&grey).contains("less than a tenth of the photo has a colour"));
        let disc = Image::from_fn(200, 200, |x, y| {
            let inside = (x as f64 - 100.0).hypot(y as f64 - 100.0) < 80.0;
            if inside { LinearRgb::new(0.05, 0.4, 0.1) } else { LinearRgb::grey(0.2) }
        });
        assert!(told(&disc).contains("crooked"), "{}", told(&disc));
        let nothing: Image<LinearRgb> = Image::new(0, 0);
        assert!(screen_corners(&nothing).is_err());
    }
}
