//! The four corners of a coloured screen that is seen as a whole.

use super::arrays::dot;
use super::check::refused;
use super::outline::Outline;
use super::prepared::{longer_side, scaled_sides};
use super::screen::is_keyable;
use super::segment::PixelGroups;
use crate::color::rgb_to_hsv;
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Line, Point2, Vector2, corners_between};
use crate::image::{Image, Mask};
use crate::pixel::{LinearRgb, Mix};
use crate::quantile::median;

/// Longer side of the picture that is searched, pixels.
const SEARCH_SIZE_PX: usize = 1024;
/// A screen covers at least this share of the photo.
const MIN_SCREEN_SHARE: f64 = 0.1;
/// What is darker has no hue but that of its noise, scene-linear.
const MIN_BRIGHTNESS: f32 = 0.005;
/// Steps of the circle of hues, how many of them to either side are one hue, and how many hues a
/// photo has at most.
const HUE_STEPS: usize = 72;
const SAME_HUE_STEPS: usize = 5;
const MAX_HUES: usize = 4;
/// What is thinner than twice this is no part of a screen, pixels of the search.
const THIN_PX: f64 = 2.0;
/// What lies on a screen is farther than this from its border, and covers this share of it.
pub(super) const RIM_PX: f64 = 8.0;
const MIN_OBJECT_SHARE: f64 = 0.002;
/// Times a corner of a rough quadrangle is moved, at most: it takes two or three rounds.
const MAX_CORNER_MOVES: usize = 40;
/// Stretches along each side, and the part of it near its corners that is left out: corners are
/// worn.
const PROBE_COUNT: usize = 96;
const CORNER_PART: f64 = 0.08;
/// How far across a side a probe reaches, pixels of the search, and samples to the pixel of the
/// photo.
const REACH_PX: f64 = 4.0;
const STEPS_PER_PX: f64 = 2.0;
/// The two sides of a border differ by this, scene-linear, or there is none.
const MIN_CHANGE: f32 = 0.01;
/// A border is found at most this share of the reach from where it is expected.
const MAX_OFFSET_SHARE: f64 = 0.75;
/// Probes farther from a side's line than this multiple of the median belong to something else: an
/// object, a shadow.
const OUTLIER_FACTOR: f64 = 3.0;
/// Rounds in which such probes are dropped.
const OUTLIER_ROUNDS: usize = 4;
/// Distances from a line below this are those of noise, pixels.
const NOISE_PX: f64 = 0.1;
/// A border this far off a side's line, in pixels of the search, is not straight.
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
/// `photo` is scene-linear; the screen is a rectangle on a background of another colour, and all of
/// it is visible.
///
/// # Method
/// The largest connected region of each of the photo's hues; of those that do not reach the border
/// the largest on which something lies. The four corners of its hull that enclose the most are
/// rough ones; each side is then fitted as a line to where, along profiles across it, the colour
/// changes from the screen's to its surroundings' (the centre of gravity of the change in linear
/// light, which blur does not move), and neighbours meet in the corners.
///
/// # Errors
/// [`Error::Photo`] where there is no coloured screen, it reaches the border of the photo, or its
/// outline is not a rectangle.
pub fn screen_corners(photo: &Image<LinearRgb>) -> Result<ScreenCorners> {
    if photo.width().min(photo.height()) == 0 {
        return Err(not_found("the photo is empty"));
    }
    let picture = at_search_size(photo);
    let scale = photo.width() as f64 / picture.width() as f64;
    let rough = rough_corners(&picture)?.map(|p| Point2::from(p.coords * scale));
    // The second time the probes stand where the sides are.
    let near = refined(photo, &rough, scale)?;
    let found = refined(photo, &near.corners_px, scale)?;
    Ok(ScreenCorners {
        corners_px: from_top_left(found.corners_px),
        ..found
    })
}

fn rough_corners(picture: &Image<LinearRgb>) -> Result<[Point2<f64>; 4]> {
    four_corners(&screen_region(picture)?.hull)
        .ok_or_else(|| not_found("its outline does not have four corners"))
}

pub(super) fn at_search_size(photo: &Image<LinearRgb>) -> Image<LinearRgb> {
    let longer = SEARCH_SIZE_PX.min(longer_side(photo));
    let [width, height] = scaled_sides(photo.size(), longer, 1);
    filter::resize(photo, width, height)
}

/// Where lines that are fitted near the sides of a quadrangle meet.
fn refined(
    photo: &Image<LinearRgb>,
    corners: &[Point2<f64>; 4],
    scale: f64,
) -> Result<ScreenCorners> {
    let sides = fitted_sides(photo, corners, scale)?;
    let corners_px = corners_between(&sides.map(|side| side.line))
        .ok_or_else(|| not_found("two sides that should meet are parallel"))?;
    let off_px = sides.map(|side| side.off_px);
    Ok(ScreenCorners {
        corners_px,
        sigma_px: off_px.into_iter().fold(NOISE_PX, f64::max),
    })
}

/// The same ring of corners, begun with the one that is nearest to the picture's top left.
pub(crate) fn from_top_left(corners: [Point2<f64>; 4]) -> [Point2<f64>; 4] {
    let from_corner = corners.map(|p| p.x + p.y);
    let first = (0..4)
        .min_by(|&i, &j| from_corner[i].total_cmp(&from_corner[j]))
        .unwrap_or_default();
    [0, 1, 2, 3].map(|i| corners[(first + i) % 4])
}

fn not_found(what: impl std::fmt::Display) -> Error {
    refused(format!(
        "the corners of the screen cannot be found: {what}; \
         photograph all of it on a background of another colour, give its corners (`asset add --screen-corners`), \
         or measure the object's length with a tape"
    ))
}

/// A connected region of one hue.
pub(super) struct HueRegion {
    pixels: usize,
    pub(super) hull: Vec<Point2<f64>>,
    /// It reaches the border of the picture.
    is_cut: bool,
    /// Something lies on it.
    pub(super) is_covered: bool,
}

/// The region that is a screen.
fn screen_region(picture: &Image<LinearRgb>) -> Result<HueRegion> {
    let mut regions = large_hue_regions(picture);
    let is_cut = regions.iter().any(|region| region.is_cut);
    regions.retain(|region| !region.is_cut);
    // A box on a screen that is not seen as a whole has four corners, too, but nothing lies on it.
    if let Some(covered) = regions.iter().position(|region| region.is_covered) {
        return Ok(regions.swap_remove(covered));
    }
    if is_cut {
        return Err(not_found("it reaches the border of the photo"));
    }
    regions
        .into_iter()
        .next()
        .ok_or_else(|| not_found("no colour such as green or blue covers a tenth of the photo"))
}

/// The regions that are large enough for a screen, largest first.
pub(super) fn large_hue_regions(picture: &Image<LinearRgb>) -> Vec<HueRegion> {
    let least = MIN_SCREEN_SHARE * picture.pixels().len() as f64;
    let mut regions = hue_regions(picture);
    regions.retain(|region| region.pixels as f64 >= least);
    regions.sort_by_key(|region| std::cmp::Reverse(region.pixels));
    regions
}

/// The largest region of each hue.
fn hue_regions(picture: &Image<LinearRgb>) -> Vec<HueRegion> {
    let hues = picture.map(hue_step);
    let common = common_hues(&hues);
    common
        .iter()
        .filter_map(|&hue| {
            let set = hues.map(|other| other.is_some_and(|other| is_of_hue(other, hue, &common)));
            largest_region(&without_thin_parts(&set))
        })
        .collect()
}

fn without_thin_parts(set: &Mask) -> Mask {
    filter::dilate(&filter::erode(set, THIN_PX), THIN_PX)
}

/// A hue is near one of the common hues, and nearer to it than to the others.
fn is_of_hue(hue: usize, common_hue: usize, common: &[usize]) -> bool {
    let nearest = common.iter().min_by_key(|other| hue_distance(hue, **other));
    nearest == Some(&common_hue) && hue_distance(hue, common_hue) <= SAME_HUE_STEPS
}

/// The step of the circle of hues; none for a grey.
fn hue_step(p: LinearRgb) -> Option<usize> {
    let has_hue = is_keyable(p) && p.max_channel() >= MIN_BRIGHTNESS;
    has_hue.then(|| (rgb_to_hsv(p).h * HUE_STEPS as f32) as usize % HUE_STEPS)
}

/// Steps between two hues, the shorter way around.
fn hue_distance(a: usize, b: usize) -> usize {
    let steps = a.abs_diff(b);
    steps.min(HUE_STEPS - steps)
}

/// The hues that cover enough of the picture for a screen, most common first.
fn common_hues(hues: &Image<Option<usize>>) -> Vec<usize> {
    let mut counts = hue_counts(hues);
    let least = MIN_SCREEN_SHARE * hues.pixels().len() as f64;
    let mut common = Vec::new();
    while common.len() < MAX_HUES {
        let (count, hue) = fullest_window(&counts);
        if (count as f64) < least {
            break;
        }
        common.push(hue);
        same_hues(hue).for_each(|other| counts[other] = 0);
    }
    common
}

fn hue_counts(hues: &Image<Option<usize>>) -> [usize; HUE_STEPS] {
    let mut counts = [0; HUE_STEPS];
    for &hue in hues.pixels().iter().flatten() {
        counts[hue] += 1;
    }
    counts
}

/// The number of pixels that are nearly of one hue, and that hue.
fn fullest_window(counts: &[usize; HUE_STEPS]) -> (usize, usize) {
    // Of windows that hold the same pixels the one around the highest count.
    let windows = (0..HUE_STEPS).map(|hue| (window_count(counts, hue), counts[hue], hue));
    windows.max().map_or((0, 0), |(count, _, hue)| (count, hue))
}

/// The steps that are one hue.
fn same_hues(hue: usize) -> impl Iterator<Item = usize> {
    (0..HUE_STEPS).filter(move |&other| hue_distance(hue, other) <= SAME_HUE_STEPS)
}

fn window_count(counts: &[usize; HUE_STEPS], hue: usize) -> usize {
    same_hues(hue).map(|other| counts[other]).sum()
}

/// The largest connected region of a set.
fn largest_region(set: &Mask) -> Option<HueRegion> {
    let groups = PixelGroups::new(set);
    let sizes = groups.sizes(set);
    let largest = (0..sizes.len()).max_by_key(|&i| sizes[i])?;
    let only = groups.only(|i| i == largest);
    let hull = Outline::around(&only.to_coverage()).hull();
    Some(HueRegion {
        pixels: sizes[largest],
        is_cut: reaches_border(&only),
        is_covered: is_covered(&only, &hull),
        hull,
    })
}

fn reaches_border(set: &Mask) -> bool {
    let (w, h) = set.size();
    (0..w).any(|x| set[(x, 0)] || set[(x, h - 1)]) || (0..h).any(|y| set[(0, y)] || set[(w - 1, y)])
}

/// Something lies within the hull of a region, away from its border.
fn is_covered(region: &Mask, hull: &[Point2<f64>]) -> bool {
    let (w, h) = region.size();
    let coverage = Outline::from_ring(hull.to_vec()).coverage(w, h);
    let within = coverage.map(|c| c.0 > 0.5);
    let free = filter::erode(&within, RIM_PX).zip_map(region, |inside, screen| inside && !screen);
    let largest = PixelGroups::new(&free).sizes(&free).into_iter().max();
    largest.unwrap_or(0) as f64 > MIN_OBJECT_SHARE * within.count() as f64
}

/// The four points of a convex polygon that enclose the most of it, in its order.
///
/// # Method
/// From any four, each in turn becomes the point that is farthest from the way between its
/// neighbours, until none moves.
pub(super) fn four_corners(ring: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    let n = ring.len();
    if n < 4 {
        return None;
    }
    let mut corners = [0, 1, 2, 3].map(|i| i * n / 4);
    for i in (0..MAX_CORNER_MOVES).map(|round| round % 4) {
        corners[i] = farthest_between(ring, corners[(i + 3) % 4], corners[(i + 1) % 4])?;
    }
    Some(corners.map(|i| ring[i]))
}

/// Which point of a ring between two others is farthest from the line through them.
fn farthest_between(ring: &[Point2<f64>], before: usize, after: usize) -> Option<usize> {
    let n = ring.len();
    let along = ring[after] - ring[before];
    let (farthest, _) = (1..n)
        .map(|step| (before + step) % n)
        .take_while(|&p| p != after)
        .map(|p| (p, along.perp(&(ring[p] - ring[before])).abs()))
        .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    Some(farthest)
}

/// A straight side of a screen.
#[derive(Clone, Copy)]
struct ScreenSide {
    line: Line,
    /// Root mean square distance of the border from it, pixels.
    off_px: f64,
}

fn fitted_sides(
    photo: &Image<LinearRgb>,
    corners: &[Point2<f64>; 4],
    scale: f64,
) -> Result<[ScreenSide; 4]> {
    let reach = REACH_PX * scale.max(1.0);
    let found: Vec<ScreenSide> = (0..4)
        .filter_map(|i| ScreenSide::near(photo, [corners[i], corners[(i + 1) % 4]], reach))
        .collect();
    let sides = found
        .try_into()
        .map_err(|_| not_found("one of its sides has no straight border"))?;
    check_straight(&sides, CROOKED_PX * scale)?;
    Ok(sides)
}

fn check_straight(sides: &[ScreenSide; 4], limit_px: f64) -> Result<()> {
    match sides.iter().find(|side| side.off_px > limit_px) {
        Some(ScreenSide { off_px, .. }) => Err(not_found(format!(
            "one of its sides is off a straight line by {off_px:.1} pixels"
        ))),
        None => Ok(()),
    }
}

impl ScreenSide {
    /// The line of the border near the way from a corner to the next, clockwise.
    fn near(photo: &Image<LinearRgb>, ends: [Point2<f64>; 2], reach: f64) -> Option<Self> {
        let mut points = border_points(photo, ends, reach)?;
        for _ in 0..OUTLIER_ROUNDS {
            drop_outliers(&mut points)?;
        }
        let line = Line::through(&points)?;
        let off_px = rms_distance(&line, &points);
        (points.len() >= PROBE_COUNT / 2).then_some(Self { line, off_px })
    }
}

fn rms_distance(line: &Line, points: &[Point2<f64>]) -> f64 {
    let squares: f64 = points
        .iter()
        .map(|p| line.distance(*p) * line.distance(*p))
        .sum();
    (squares / points.len() as f64).sqrt()
}

/// Where probes along the way from one corner to the next find a border.
fn border_points(
    photo: &Image<LinearRgb>,
    [from, to]: [Point2<f64>; 2],
    reach: f64,
) -> Option<Vec<Point2<f64>>> {
    let along = to - from;
    let outward = Vector2::new(along.y, -along.x).try_normalize(0.0)?;
    let points = (0..PROBE_COUNT).filter_map(|i| {
        let probe = BorderProbe {
            photo,
            foot: from + along * probe_part(i),
            outward,
        };
        probe.border(reach)
    });
    Some(points.collect())
}

/// Where a probe stands on its side, 0 to 1.
fn probe_part(i: usize) -> f64 {
    CORNER_PART + (1.0 - 2.0 * CORNER_PART) * (i as f64 + 0.5) / PROBE_COUNT as f64
}

/// Drops the points that are far from the line through all.
fn drop_outliers(points: &mut Vec<Point2<f64>>) -> Option<()> {
    let line = Line::through(points)?;
    let off = points.iter().map(|p| line.distance(*p).abs());
    let most = OUTLIER_FACTOR * median(off, f64::total_cmp)?.max(NOISE_PX);
    points.retain(|p| line.distance(*p).abs() <= most);
    Some(())
}

/// A profile across a side.
struct BorderProbe<'a> {
    photo: &'a Image<LinearRgb>,
    foot: Point2<f64>,
    outward: Vector2<f64>,
}

impl BorderProbe<'_> {
    /// Where the colour inside changes to that outside; none where there is no such change.
    ///
    /// # Method
    /// The centre of gravity of the change in linear light, which blur does not move.
    fn border(&self, reach: f64) -> Option<Point2<f64>> {
        let steps = (2.0 * reach * STEPS_PER_PX).ceil() as usize;
        let [inside, outside] = [-1.0, 1.0].map(|side| self.mean_beyond(side, reach, steps));
        let change = inside.add_scaled(-1.0, outside).channels();
        let square = dot(change, change);
        let step = 2.0 * reach / steps as f64;
        let inside_length: f64 = self
            .colors(reach, steps)
            .map(|color| color.add_scaled(-1.0, outside).channels())
            .map(|off| step * f64::from(dot(off, change) / square))
            .sum();
        // Where the inside ends, from the foot.
        let at = inside_length - reach;
        (square > MIN_CHANGE * MIN_CHANGE && at.abs() < MAX_OFFSET_SHARE * reach)
            .then(|| self.foot + self.outward * at)
    }

    /// The colours in the middle of each step.
    fn colors(&self, reach: f64, steps: usize) -> impl Iterator<Item = LinearRgb> {
        let step = 2.0 * reach / steps as f64;
        (0..steps).map(move |k| self.color_at(-reach + (k as f64 + 0.5) * step))
    }

    fn color_at(&self, t: f64) -> LinearRgb {
        filter::sample_bilinear_clamped(
            self.photo,
            self.foot.x + self.outward.x * t,
            self.foot.y + self.outward.y * t,
        )
    }

    /// Mean colour on one side (-1 inside, 1 outside), from the reach on outwards.
    fn mean_beyond(&self, side: f64, reach: f64, steps: usize) -> LinearRgb {
        let step = 2.0 * reach / steps as f64;
        (0..steps / 2)
            .map(|k| self.color_at(side * (reach + k as f64 * step)))
            .fold(LinearRgb::BLACK, |sum, p| sum + p)
            .scale(2.0 / steps as f32)
    }
}
