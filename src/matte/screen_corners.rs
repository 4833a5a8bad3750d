//! The four corners of a coloured screen that is seen as a whole.

use super::outline::Outline;
use super::screen::is_keyable;
use super::segment::PixelGroups;
use crate::color::rgb_to_hsv;
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Line, Point2, Vector2};
use crate::image::{Image, Mask};
use crate::pixel::{LinearRgb, Mix};

/// Longer side of the picture that is searched, pixels.
const WORKING_SIZE: usize = 1024;
/// A screen that is worth its name covers this share of the photo.
const LEAST_SHARE: f64 = 0.1;
/// What is darker has no hue but that of its noise, scene-linear.
const LEAST_LIGHT: f32 = 0.005;
/// Steps of the circle of hues, how many of them to either side are one hue, and how many hues a photo has at most.
const HUES: usize = 72;
const SAME_HUE: usize = 5;
const MOST_HUES: usize = 4;
/// What is thinner than twice this is no part of a screen, pixels of the search.
const THIN_PX: f64 = 2.0;
/// What lies on a screen is farther than this from its border, and covers this share of it.
const RIM_PX: f64 = 8.0;
const LEAST_OBJECT: f64 = 0.002;
/// So often a corner of a rough quadrangle is moved: it takes two or three rounds.
const MOST_MOVES: usize = 40;
/// Stretches along each side, and the part of it near its corners that is not looked at: corners are worn.
const PROBES: usize = 96;
const CORNER_PART: f64 = 0.08;
/// How far across a side is looked, pixels of the search, and samples to the pixel of the photo.
const REACH_PX: f64 = 4.0;
const STEPS_PER_PX: f64 = 2.0;
/// The two sides of a border differ by this, scene-linear, or there is none.
const LEAST_CHANGE: f32 = 0.01;
/// Probes farther from a side's line than so many times the median are of something else: an object, a shadow.
const OUTLYING: f64 = 3.0;
/// Distances from a line below this are those of noise, pixels.
const NOISE_PX: f64 = 0.1;
/// A border of so many pixels of the search beside a side's line is no straight one.
const CROOKED_PX: f64 = 2.0;

/// Where the corners of a screen are seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenCorners {
    /// Top left, top right, bottom right, bottom left, pixels.
    pub corners_px: [Point2<f64>; 4],
    /// Standard error of their coordinates, pixels: how straight the screen's sides are.
    pub sigma_px: f64,
}

/// Corners of the coloured screen in a photo, to a fraction of a pixel.
///
/// `photo` is scene-linear; the screen is a rectangle on something of another colour, and all of it is seen.
///
/// # Method
/// The largest connected region of each of the photo's hues; of those that do not reach the border the largest on which
/// something lies. The four corners of its hull that enclose the most are rough ones; each side is then fitted
/// as a line to where, along profiles across it, the colour changes from the screen's to what is beside it (the centre of
/// gravity of the change in linear light, which blur does not move), and neighbours meet in the corners.
///
/// # Errors
/// [`Error::Photo`] where there is no coloured screen, it reaches the border of the photo, or its outline is no
/// rectangle's.
pub fn screen_corners(photo: &Image<LinearRgb>) -> Result<ScreenCorners> {
    let longer = photo.width().max(photo.height());
    if photo.width().min(photo.height()) == 0 {
        return Err(refused("the photo is empty"));
    }
    let side = |len: usize| (len * WORKING_SIZE.min(longer)).div_ceil(longer).max(1);
    let picture = filter::resize(photo, side(photo.width()), side(photo.height()));
    let scale = photo.width() as f64 / picture.width() as f64;
    let rough = four_corners(&screen(&picture)?.hull)
        .ok_or_else(|| refused("its outline has no four corners"))?;
    let mut corners = rough.map(|p| Point2::from(p.coords * scale));
    let mut sigma_px = 0.0;
    // The second time the probes stand where the sides are.
    for _ in 0..2 {
        let sides = sides(photo, &corners, scale)?;
        for i in 0..4 {
            let meeting = sides[(i + 3) % 4].line.meeting(&sides[i].line);
            corners[i] =
                meeting.ok_or_else(|| refused("two of its sides are parallel that should meet"))?;
        }
        sigma_px = sides
            .iter()
            .map(|side| side.off_px)
            .fold(NOISE_PX, f64::max);
    }
    Ok(ScreenCorners {
        corners_px: from_top_left(corners),
        sigma_px,
    })
}

/// The same ring of corners, begun with the one that is nearest to the picture's top left.
pub(crate) fn from_top_left(corners: [Point2<f64>; 4]) -> [Point2<f64>; 4] {
    let first = (0..4)
        .min_by(|&i, &j| (corners[i].x + corners[i].y).total_cmp(&(corners[j].x + corners[j].y)));
    let first = first.unwrap_or_default();
    [0, 1, 2, 3].map(|i| corners[(first + i) % 4])
}

fn refused(what: impl std::fmt::Display) -> Error {
    let instead = "photograph all of it on something of another colour, give its corners (`asset add --screen-corners`), \
                   or measure the object's length with a tape";
    Error::Photo {
        what: format!("the corners of the screen cannot be found: {what}; {instead}"),
    }
}

/// A connected region of one hue.
struct Region {
    pixels: usize,
    hull: Vec<Point2<f64>>,
    /// It reaches the border of the picture.
    is_cut: bool,
    /// Something lies on it.
    is_covered: bool,
}

/// The region that is a screen.
fn screen(picture: &Image<LinearRgb>) -> Result<Region> {
    let least = LEAST_SHARE * picture.pixels().len() as f64;
    let mut regions: Vec<Region> = regions(picture)
        .into_iter()
        .filter(|r| r.pixels as f64 >= least)
        .collect();
    regions.sort_by_key(|region| std::cmp::Reverse(region.pixels));
    let whole = |covered: bool| {
        regions
            .iter()
            .position(|r| !r.is_cut && r.is_covered == covered)
    };
    let is_cut = regions.iter().any(|region| region.is_cut);
    // A box on a screen that is not seen as a whole has four corners, too, but nothing lies on it.
    match (whole(true), whole(false)) {
        (Some(covered), _) => Ok(regions.swap_remove(covered)),
        (None, _) if is_cut => Err(refused("it reaches the border of the photo")),
        (None, Some(empty)) => Ok(regions.swap_remove(empty)),
        (None, None) => Err(refused(
            "no tenth of the photo has one colour such as green or blue",
        )),
    }
}

/// The largest region of each hue.
fn regions(picture: &Image<LinearRgb>) -> Vec<Region> {
    let hues = picture.map(hue);
    let common = common_hues(&hues);
    let nearest = |hue: usize| {
        common
            .iter()
            .copied()
            .min_by_key(|&other| apart(hue, other))
    };
    let of = |common: usize| {
        let is_near = |hue: usize| nearest(hue) == Some(common) && apart(hue, common) <= SAME_HUE;
        let set = hues.map(|hue| hue.is_some_and(is_near));
        largest_region(&filter::dilate(&filter::erode(&set, THIN_PX), THIN_PX))
    };
    common.iter().filter_map(|&hue| of(hue)).collect()
}

/// The step of the circle of hues; none for a grey.
fn hue(p: LinearRgb) -> Option<usize> {
    let seen = is_keyable(p) && p.r.max(p.g).max(p.b) >= LEAST_LIGHT;
    seen.then(|| (rgb_to_hsv(p).h * HUES as f32) as usize % HUES)
}

/// Steps between two hues, the shorter way around.
fn apart(a: usize, b: usize) -> usize {
    let steps = a.abs_diff(b);
    steps.min(HUES - steps)
}

/// The hues that a worthwhile share of the picture has, commonest first.
fn common_hues(hues: &Image<Option<usize>>) -> Vec<usize> {
    let mut counts = [0_usize; HUES];
    hues.pixels()
        .iter()
        .flatten()
        .for_each(|&hue| counts[hue] += 1);
    let mut common = Vec::new();
    while common.len() < MOST_HUES {
        let near =
            |hue: usize, reach: usize| (0..HUES).filter(move |&other| apart(hue, other) <= reach);
        let around = |hue: usize| {
            near(hue, SAME_HUE)
                .map(|other| counts[other])
                .sum::<usize>()
        };
        // Of windows that hold the same pixels the one around the highest count.
        let Some(most) = (0..HUES).max_by_key(|&hue| (around(hue), counts[hue])) else {
            break;
        };
        if (around(most) as f64) < LEAST_SHARE * hues.pixels().len() as f64 {
            break;
        }
        common.push(most);
        near(most, SAME_HUE).for_each(|other| counts[other] = 0);
    }
    common
}

/// The largest connected region of a set.
fn largest_region(set: &Mask) -> Option<Region> {
    let groups = PixelGroups::new(set);
    let sizes = groups.sizes(set);
    let largest = (0..sizes.len()).max_by_key(|&i| sizes[i])?;
    let only = groups.only(|i| i == largest);
    let (w, h) = only.size();
    let border = (0..w)
        .flat_map(|x| [(x, 0), (x, h - 1)])
        .chain((0..h).flat_map(|y| [(0, y), (w - 1, y)]));
    let is_cut = border.into_iter().any(|at| only[at]);
    let hull = Outline::around(&only.to_coverage()).hull();
    let is_covered = is_covered(&only, &hull);
    Some(Region {
        pixels: sizes[largest],
        hull,
        is_cut,
        is_covered,
    })
}

/// Something lies within the hull of a region, away from its border.
fn is_covered(region: &Mask, hull: &[Point2<f64>]) -> bool {
    let (w, h) = region.size();
    let within = Outline {
        rings: vec![hull.to_vec()],
    }
    .coverage(w, h)
    .map(|c| c.0 > 0.5);
    let free = filter::erode(&within, RIM_PX).zip_map(region, |inside, screen| inside && !screen);
    let largest = PixelGroups::new(&free)
        .sizes(&free)
        .into_iter()
        .max()
        .unwrap_or(0);
    largest as f64 > LEAST_OBJECT * within.count() as f64
}

/// The four points of a convex polygon that enclose the most of it, in its order.
///
/// # Method
/// From any four, each in turn becomes the point that is farthest from the way between its neighbours, until none moves.
fn four_corners(ring: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    let n = ring.len();
    let mut corners = [0, 1, 2, 3].map(|i| i * n / 4);
    let off = |p: usize, [a, b]: [usize; 2]| (ring[b] - ring[a]).perp(&(ring[p] - ring[a])).abs();
    for i in (0..if n < 4 { 0 } else { MOST_MOVES }).map(|move_| move_ % 4) {
        let [before, after] = [corners[(i + 3) % 4], corners[(i + 1) % 4]];
        let between = (1..n)
            .map(|step| (before + step) % n)
            .take_while(|&p| p != after);
        corners[i] =
            between.max_by(|&p, &q| off(p, [before, after]).total_cmp(&off(q, [before, after])))?;
    }
    (n >= 4).then(|| corners.map(|i| ring[i]))
}

/// A straight side of a screen.
#[derive(Clone, Copy)]
struct Side {
    line: Line,
    /// Root mean square distance of the border from it, pixels.
    off_px: f64,
}

fn sides(photo: &Image<LinearRgb>, corners: &[Point2<f64>; 4], scale: f64) -> Result<[Side; 4]> {
    let side = |i: usize| {
        Side::near(
            photo,
            [corners[i], corners[(i + 1) % 4]],
            REACH_PX * scale.max(1.0),
        )
    };
    let found: Vec<Side> = (0..4).filter_map(side).collect();
    let found: [Side; 4] = found
        .try_into()
        .map_err(|_| refused("a side of it shows no straight border"))?;
    match found.iter().find(|side| side.off_px > CROOKED_PX * scale) {
        Some(side) => Err(refused(format!(
            "a side of it is crooked by {:.1} pixels",
            side.off_px
        ))),
        None => Ok(found),
    }
}

impl Side {
    /// The line of the border near the way from a corner to the next, clockwise.
    fn near(photo: &Image<LinearRgb>, [from, to]: [Point2<f64>; 2], reach: f64) -> Option<Self> {
        let along = to - from;
        let outward = Vector2::new(along.y, -along.x).try_normalize(0.0)?;
        let probe = |i: usize| {
            let part = CORNER_PART + (1.0 - 2.0 * CORNER_PART) * (i as f64 + 0.5) / PROBES as f64;
            let foot = from + along * part;
            Some(foot + outward * border(photo, foot, outward, reach)?)
        };
        let mut points: Vec<Point2<f64>> = (0..PROBES).filter_map(probe).collect();
        for _ in 0..4 {
            let line = Line::through(&points)?;
            let mut off: Vec<f64> = points.iter().map(|p| line.distance(*p).abs()).collect();
            let (_, median, _) = off.select_nth_unstable_by(points.len() / 2, f64::total_cmp);
            let most = OUTLYING * median.max(NOISE_PX);
            points.retain(|p| line.distance(*p).abs() <= most);
        }
        let line = Line::through(&points)?;
        let squares: f64 = points
            .iter()
            .map(|p| line.distance(*p) * line.distance(*p))
            .sum();
        let off_px = (squares / points.len() as f64).sqrt();
        (points.len() >= PROBES / 2).then_some(Self { line, off_px })
    }
}

/// How far outwards of a place the colour inside changes to that outside; none where there is no such change.
fn border(
    photo: &Image<LinearRgb>,
    foot: Point2<f64>,
    outward: Vector2<f64>,
    reach: f64,
) -> Option<f64> {
    let steps = (2.0 * reach * STEPS_PER_PX).ceil() as usize;
    let step = 2.0 * reach / steps as f64;
    let color = |t: f64| {
        filter::sample_bilinear_clamped(photo, foot.x + outward.x * t, foot.y + outward.y * t)
    };
    let beyond = |side: f64| {
        let samples = (0..steps / 2).map(|k| color(side * (reach + k as f64 * step)));
        samples
            .fold(LinearRgb::BLACK, |sum, p| sum + p)
            .scale(2.0 / steps as f32)
    };
    let (inside, outside) = (beyond(-1.0), beyond(1.0));
    let change = inside.add_scaled(-1.0, outside);
    let dot = |a: LinearRgb, b: LinearRgb| a.r * b.r + a.g * b.g + a.b * b.b;
    let square = dot(change, change);
    let share = |t: f64| f64::from(dot(color(t).add_scaled(-1.0, outside), change) / square);
    let within: f64 = (0..steps)
        .map(|k| step * share(-reach + (k as f64 + 0.5) * step))
        .sum();
    let at = within - reach;
    (square > LEAST_CHANGE * LEAST_CHANGE && at.abs() < 0.75 * reach).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Pose, UnitQuaternion, Vector3};
    use crate::pixel::Coverage;
    use crate::{Camera, camera::project_picture, filter::Pyramid};

    const BROWN: LinearRgb = LinearRgb {
        r: 0.2,
        g: 0.12,
        b: 0.06,
    };
    const BLUE: LinearRgb = LinearRgb {
        r: 0.05,
        g: 0.12,
        b: 0.35,
    };
    const GREEN: LinearRgb = LinearRgb {
        r: 0.05,
        g: 0.4,
        b: 0.1,
    };

    /// A green screen of 0.6 x 0.4 m on a table, unevenly lit, with a red slab on it; and its camera.
    fn photo(tilt: f64, turn: f64, table: LinearRgb) -> (Image<LinearRgb>, Camera) {
        let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + tilt)
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        let camera = Camera {
            image: [600, 460],
            focal_px: [600.0; 2].into(),
            principal_px: [300.0, 230.0].into(),
            camera_from_world: Pose::from_parts(Vector3::new(0.0, 0.0, 0.9).into(), down),
        };
        let screen = Image::from_fn(300, 200, |x, y| {
            let slab = (100..190).contains(&x) && (75..115).contains(&y);
            if slab {
                LinearRgb::new(0.6, 0.05, 0.05)
            } else {
                GREEN.scale(0.6 + 0.4 * x as f32 / 300.0)
            }
        });
        let seen = project_picture(&Pyramid::new(screen), &camera, [0.6, 0.4]);
        let alpha = project_picture(
            &Pyramid::new(Image::filled(300, 200, Coverage(1.0))),
            &camera,
            [0.6, 0.4],
        );
        (
            seen.zip_map(&alpha, |p, a| p + table.scale(1.0 - a.0)),
            camera,
        )
    }

    /// Grain of a sensor: the same for the same pixel.
    fn noisy(photo: &Image<LinearRgb>, sigma: f32) -> Image<LinearRgb> {
        let (w, _) = photo.size();
        let unit = |seed: u64| {
            ((seed ^ (seed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f32 / 8_388_608.0
                - 1.0
        };
        let grain = |seed: u64| 1.73 * sigma * unit(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        Image::from_fn(w, photo.height(), |x, y| {
            let seed = 3 * (y * w + x) as u64 + 1;
            photo[(x, y)] + LinearRgb::new(grain(seed), grain(seed + 1), grain(seed + 2))
        })
    }

    #[test]
    fn corners_are_found_on_tables_of_any_colour() {
        let views = [
            (0.0, 0.0, BROWN),
            (0.3, 0.1, BLUE),
            (-0.4, -0.3, BROWN),
            (0.2, 0.2, LinearRgb::grey(0.02)),
        ];
        for (tilt, turn, table) in views {
            let (photo, camera) = photo(tilt, turn, table);
            let found = screen_corners(&noisy(&photo, 0.01)).unwrap();
            for (found, [x, y]) in
                found
                    .corners_px
                    .iter()
                    .zip([[-0.3, 0.2], [0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]])
            {
                let (truth, _) = camera.project([x, y, 0.0].into()).unwrap();
                assert!(
                    (found - truth).norm() < 0.25,
                    "{tilt} {turn}: {found} instead of {truth}"
                );
            }
            assert!(found.sigma_px < 0.3, "{}", found.sigma_px);
        }
    }

    #[test]
    fn what_shows_no_whole_screen_is_told() {
        let told = |photo: &Image<LinearRgb>| screen_corners(photo).unwrap_err().to_string();
        let (whole, _) = photo(0.0, 0.0, BROWN);
        // One side beyond the border, and all of them.
        for (x, width) in [(150, 450), (150, 300)] {
            let near = whole.crop(crate::Roi {
                x,
                y: 60,
                width,
                height: 330,
            });
            assert!(
                told(&near).contains("it reaches the border of the photo; photograph all of it"),
                "{}",
                told(&near)
            );
        }
        // Then a box that fills the photo is not taken for it.
        let boxed = Image::from_fn(200, 150, |x, y| {
            let inside = (50..150).contains(&x) && (40..110).contains(&y);
            if inside {
                LinearRgb::new(0.6, 0.05, 0.05)
            } else {
                GREEN
            }
        });
        assert!(
            told(&boxed).contains("it reaches the border"),
            "{}",
            told(&boxed)
        );
        let grey = Image::filled(90, 60, LinearRgb::grey(0.5));
        assert!(told(&grey).contains("no tenth of the photo has one colour"));
        let disc = Image::from_fn(200, 200, |x, y| {
            let inside = (x as f64 - 100.0).hypot(y as f64 - 100.0) < 80.0;
            if inside { GREEN } else { LinearRgb::grey(0.2) }
        });
        assert!(
            told(&disc).contains("a side of it shows no straight border"),
            "{}",
            told(&disc)
        );
        let nothing: Image<LinearRgb> = Image::new(0, 0);
        assert!(screen_corners(&nothing).is_err());
    }
}
