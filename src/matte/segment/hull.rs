//! The convex hull of a set of pixels, and the pixels under a convex polygon.

use crate::geom::Point2;
use crate::image::Image;
use crate::pixel::Coverage;
use geo::{ConvexHull, MultiPoint, Point};

/// Convex hull of the corners of the pixels of a set, in order, clockwise as seen; empty for an empty set.
pub(super) fn convex_hull(set: &Image<bool>) -> Vec<Point2<f64>> {
    let ends = set.rows().enumerate().filter_map(|(y, row)| {
        let first = row.iter().position(|p| *p)?;
        let last = row.iter().rposition(|p| *p)?;
        Some((y as f64, first as f64, (last + 1) as f64))
    });
    let corners = ends.flat_map(|(y, x0, x1)| [(x0, y), (x1, y), (x0, y + 1.0), (x1, y + 1.0)]);
    let corners: MultiPoint = corners.map(Point::from).collect();
    let ring = corners.convex_hull().exterior().clone().into_inner();
    // geo goes counter-clockwise with y up, which is clockwise as seen, and repeats the first point.
    ring.iter().take(ring.len().saturating_sub(1)).map(|c| Point2::new(c.x, c.y)).collect()
}

/// Scan lines per row of pixels; each contributes exact spans, so only slanted edges are approximated.
const LINES: usize = 8;

/// The share of every pixel that lies inside a convex polygon (pixel-corner coordinates).
pub fn coverage(polygon: &[Point2<f64>], width: usize, height: usize) -> Image<Coverage> {
    use rayon::prelude::*;
    let mut image = Image::new(width, height);
    image.par_rows_mut().enumerate().for_each(|(y, row)| {
        for line in 0..LINES {
            let at = y as f64 + (line as f64 + 0.5) / LINES as f64;
            if let Some((x0, x1)) = span(polygon, at) {
                add_span(row, x0, x1);
            }
        }
    });
    image
}

fn add_span(row: &mut [Coverage], x0: f64, x1: f64) {
    let first = (x0.max(0.0) as usize).min(row.len());
    let end = (x1.max(0.0).ceil() as usize).min(row.len());
    for (x, pixel) in row[..end].iter_mut().enumerate().skip(first) {
        let overlap = x1.min((x + 1) as f64) - x0.max(x as f64);
        pixel.0 += overlap.clamp(0.0, 1.0) as f32 / LINES as f32;
    }
}

/// Where the horizontal line at `y` is inside a convex polygon.
fn span(polygon: &[Point2<f64>], y: f64) -> Option<(f64, f64)> {
    let next = polygon.iter().cycle().skip(1);
    let crossings = polygon.iter().zip(next).filter(|(a, b)| (a.y <= y) != (b.y <= y));
    let xs = crossings.map(|(a, b)| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
    xs.fold(None, |span, x| match span {
        None => Some((x, x)),
        Some((low, high)) => Some((x.min(low), x.max(high))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_one_pixel_is_its_square() {
        let set = Image::from_fn(5, 5, |x, y| (x, y) == (2, 3));
        let hull = convex_hull(&set);
        assert_eq!(hull.len(), 4);
        assert!(hull.iter().all(|p| (2.0..=3.0).contains(&p.x) && (3.0..=4.0).contains(&p.y)));
    }

    #[test]
    fn an_empty_set_has_no_hull() {
        assert!(convex_hull(&Image::filled(4, 4, false)).is_empty());
    }

    #[test]
    fn coverage_sums_to_the_area() {
        let triangle = [Point2::new(1.0, 1.0), Point2::new(9.0, 2.5), Point2::new(3.0, 8.0)];
        let sum: f32 = coverage(&triangle, 10, 10).pixels().iter().map(|c| c.0).sum();
        let area = 0.5 * (8.0 * 7.0 - 2.0 * 1.5);
        assert!((f64::from(sum) - area).abs() < 0.1, "{sum} against {area}");
    }

    #[test]
    fn a_polygon_outside_the_picture_covers_its_inside_part() {
        let square = [Point2::new(-5.0, -5.0), Point2::new(2.0, -5.0), Point2::new(2.0, 2.0), Point2::new(-5.0, 2.0)];
        let sum: f32 = coverage(&square, 4, 4).pixels().iter().map(|c| c.0).sum();
        assert_eq!(sum, 4.0);
    }
}
