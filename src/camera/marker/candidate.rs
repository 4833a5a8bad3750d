//! Dark quadrangles: what could be a marker.

use crate::color::linear_to_srgb;
use crate::filter::box_blur;
use crate::geom::{Point2, Vector2};
use crate::image::{Image, Mask};
use crate::pixel::LinearRgb;

/// Half the window of the local mean, in longer picture sides: larger than a marker's border, smaller than its ground.
const WINDOW: f64 = 1.0 / 40.0;
/// Darker than the local mean by this, display-encoded, is dark.
const DARKER: f32 = 0.03;
/// Regions of fewer pixels cannot be read: cells of 2 pixels.
const FEWEST_PIXELS: usize = 100;
/// A quadrangle holds this part of its region's hull, at least.
const FILLED: f64 = 0.88;
/// Shortest side, pixels.
const SHORTEST_PX: f64 = 10.0;

/// Rough corners of every dark quadrangle, clockwise in the picture.
pub(super) fn quads(photo: &Image<LinearRgb>) -> Vec<[Point2<f64>; 4]> {
    if photo.is_empty() {
        return Vec::new();
    }
    let tone = photo.map(|p| linear_to_srgb(p.luminance()));
    let radius = (WINDOW * photo.width().max(photo.height()) as f64)
        .ceil()
        .max(5.0) as usize;
    let ground = box_blur(&tone, radius);
    let dark = tone.zip_map(&ground, |t, g| t < g - DARKER);
    regions(dark)
        .into_iter()
        .filter_map(|region| quad(&region))
        .collect()
}

/// The outermost pixels of every connected dark region, row by row: its left and right ends.
fn regions(mut dark: Mask) -> Vec<Vec<Point2<f64>>> {
    let (w, h) = dark.size();
    let mut found = Vec::new();
    let mut stack = Vec::new();
    for start in 0..w * h {
        if !dark.pixels()[start] {
            continue;
        }
        let (mut pixels, mut ends) = (
            0,
            std::collections::BTreeMap::<usize, (usize, usize)>::new(),
        );
        dark.pixels_mut()[start] = false;
        stack.push(start);
        while let Some(at) = stack.pop() {
            let (x, y) = (at % w, at / w);
            pixels += 1;
            let end = ends.entry(y).or_insert((x, x));
            *end = (end.0.min(x), end.1.max(x));
            let next = [
                (x > 0, at.wrapping_sub(1)),
                (x + 1 < w, at + 1),
                (y > 0, at.wrapping_sub(w)),
                (y + 1 < h, at + w),
            ];
            for (_, neighbour) in next.into_iter().filter(|(inside, _)| *inside) {
                if std::mem::take(&mut dark.pixels_mut()[neighbour]) {
                    stack.push(neighbour);
                }
            }
        }
        if pixels >= FEWEST_PIXELS {
            found.push(outer_corners(&ends));
        }
    }
    found
}

/// The corners of the first and last pixel of each row.
fn outer_corners(ends: &std::collections::BTreeMap<usize, (usize, usize)>) -> Vec<Point2<f64>> {
    let corners = ends.iter().flat_map(|(&y, &(x0, x1))| {
        let (top, bottom) = (y as f64, y as f64 + 1.0);
        let (left, right) = (x0 as f64, x1 as f64 + 1.0);
        [[left, top], [right, top], [left, bottom], [right, bottom]].map(Point2::from)
    });
    corners.collect()
}

/// The four corners of a region that is nearly a quadrangle.
fn quad(outline: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    let mean = outline
        .iter()
        .fold(Vector2::zeros(), |sum, p| sum + p.coords)
        / outline.len() as f64;
    let farthest = |from: Point2<f64>| {
        outline
            .iter()
            .copied()
            .max_by(|a, b| (a - from).norm().total_cmp(&(b - from).norm()))
    };
    let a = farthest(mean.into())?;
    let c = farthest(a)?;
    let beside = |p: &Point2<f64>| (c - a).perp(&(p - a));
    let b = outline
        .iter()
        .copied()
        .min_by(|p, q| beside(p).total_cmp(&beside(q)))?;
    let d = outline
        .iter()
        .copied()
        .max_by(|p, q| beside(p).total_cmp(&beside(q)))?;
    // b lies to the left of the way from a to c, so that a, b, c, d run clockwise where y runs down.
    let corners = [a, b, c, d];
    let sides = [0, 1, 2, 3].map(|i| (corners[(i + 1) % 4] - corners[i]).norm());
    let area = polygon_area(&corners);
    let hull = hull_area(outline);
    (sides.into_iter().all(|s| s >= SHORTEST_PX) && area >= FILLED * hull).then_some(corners)
}

fn polygon_area(corners: &[Point2<f64>]) -> f64 {
    let twice = (0..corners.len()).map(|i| {
        corners[i]
            .coords
            .perp(&corners[(i + 1) % corners.len()].coords)
    });
    twice.sum::<f64>() / 2.0
}

/// Area of the convex hull, by Andrew's monotone chain.
fn hull_area(points: &[Point2<f64>]) -> f64 {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let chain = |points: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(p - a)) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut sorted.iter().copied());
    hull.extend(chain(&mut sorted.iter().rev().copied()));
    polygon_area(&hull).abs()
}
