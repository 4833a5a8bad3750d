//! Dark quadrangles: what could be a marker.

use crate::color::linear_to_srgb;
use crate::filter::box_blur;
use crate::geom::{Point2, mean_point};
use crate::image::{Image, Mask};
use crate::pixel::LinearRgb;
use geo::{Area, ConvexHull, MultiPoint, Point};
use std::collections::BTreeMap;

/// Half the window of the local mean, in longer picture sides: larger than a marker's border,
/// smaller than its ground.
const WINDOW_SIDES: f64 = 1.0 / 40.0;
/// Darker than the local mean by this, display-encoded, is dark.
const DARK_DIFFERENCE: f32 = 0.03;
/// Regions of fewer pixels cannot be read: cells of 2 pixels.
const MIN_REGION_PIXELS: usize = 100;
/// A quadrangle holds this part of its region's hull, at least.
const MIN_HULL_SHARE: f64 = 0.88;
/// Shortest side, pixels.
const MIN_SIDE_PX: f64 = 10.0;

/// First and last column of each row of a region.
type RowEnds = BTreeMap<usize, (usize, usize)>;

/// Rough corners of every dark quadrangle, clockwise in the picture.
pub(super) fn quads(photo: &Image<LinearRgb>) -> Vec<[Point2<f64>; 4]> {
    if photo.is_empty() {
        return Vec::new();
    }
    dark_regions(dark_pixels(photo))
        .into_iter()
        .filter_map(|region| quad(&region))
        .collect()
}

/// The pixels that are darker than their surroundings.
fn dark_pixels(photo: &Image<LinearRgb>) -> Mask {
    let tone = photo.map(|p| linear_to_srgb(p.luminance()));
    let radius = WINDOW_SIDES * photo.width().max(photo.height()) as f64;
    let ground = box_blur(&tone, radius.ceil().max(5.0) as usize);
    tone.zip_map(&ground, |t, g| t < g - DARK_DIFFERENCE)
}

/// The outer corners of every connected dark region that is large enough.
fn dark_regions(mut dark: Mask) -> Vec<Vec<Point2<f64>>> {
    let mut found = Vec::new();
    for start in 0..dark.pixels().len() {
        if !std::mem::take(&mut dark.pixels_mut()[start]) {
            continue;
        }
        let (pixels, ends) = take_region(&mut dark, start);
        if pixels >= MIN_REGION_PIXELS {
            found.push(outer_corners(&ends));
        }
    }
    found
}

/// Number of pixels and ends of the rows of the region around a pixel, which is taken out of the
/// mask.
fn take_region(dark: &mut Mask, start: usize) -> (usize, RowEnds) {
    let (width, height) = dark.size();
    let (mut pixels, mut ends) = (0, RowEnds::new());
    let mut stack = vec![start];
    while let Some(at) = stack.pop() {
        pixels += 1;
        extend_row(&mut ends, at % width, at / width);
        for neighbour in neighbours(at, [width, height]) {
            if std::mem::take(&mut dark.pixels_mut()[neighbour]) {
                stack.push(neighbour);
            }
        }
    }
    (pixels, ends)
}

fn extend_row(ends: &mut RowEnds, x: usize, y: usize) {
    let (first, last) = ends.entry(y).or_insert((x, x));
    (*first, *last) = ((*first).min(x), (*last).max(x));
}

/// The pixels beside, above and below one that are in the picture.
fn neighbours(at: usize, [width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    let (x, y) = (at % width, at / width);
    [
        (x > 0).then(|| at - 1),
        (x + 1 < width).then_some(at + 1),
        (y > 0).then(|| at - width),
        (y + 1 < height).then_some(at + width),
    ]
    .into_iter()
    .flatten()
}

/// The corners of the first and last pixel of each row.
fn outer_corners(ends: &RowEnds) -> Vec<Point2<f64>> {
    let corners = ends.iter().flat_map(|(&y, &(first, last))| {
        let (top, bottom) = (y as f64, y as f64 + 1.0);
        let (left, right) = (first as f64, last as f64 + 1.0);
        [[left, top], [right, top], [left, bottom], [right, bottom]].map(Point2::from)
    });
    corners.collect()
}

/// The four corners of a region that is nearly a quadrangle.
fn quad(outline: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    let a = farthest(outline, mean_point(outline).into())?;
    let c = farthest(outline, a)?;
    let [b, d] = extremes_beside(outline, a, c)?;
    // b lies to the left of the way from a to c, so that a, b, c, d run clockwise where y runs
    // down.
    let corners = [a, b, c, d];
    let area = (c - a).perp(&(d - b)) / 2.0;
    let fills_hull = area >= MIN_HULL_SHARE * hull_area(outline);
    (has_long_sides(&corners) && fills_hull).then_some(corners)
}

fn has_long_sides(corners: &[Point2<f64>; 4]) -> bool {
    (0..4).all(|i| (corners[(i + 1) % 4] - corners[i]).norm() >= MIN_SIDE_PX)
}

fn farthest(points: &[Point2<f64>], from: Point2<f64>) -> Option<Point2<f64>> {
    points
        .iter()
        .copied()
        .max_by(|a, b| (a - from).norm().total_cmp(&(b - from).norm()))
}

/// The points farthest to the left and to the right of a line.
fn extremes_beside(
    points: &[Point2<f64>],
    a: Point2<f64>,
    c: Point2<f64>,
) -> Option<[Point2<f64>; 2]> {
    let sides = points.iter().map(|&p| (p, (c - a).perp(&(p - a))));
    let (left, _) = sides.clone().min_by(|p, q| p.1.total_cmp(&q.1))?;
    let (right, _) = sides.max_by(|p, q| p.1.total_cmp(&q.1))?;
    Some([left, right])
}

fn hull_area(points: &[Point2<f64>]) -> f64 {
    let points = points.iter().map(|p| Point::new(p.x, p.y));
    points.collect::<MultiPoint>().convex_hull().unsigned_area()
}
