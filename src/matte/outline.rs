//! Outline: what an object covers, as closed lines that may have holes.

use crate::geom::{Point2, doubled_area, sides};
use crate::image::Image;
use crate::pixel::Coverage;
use contour::{Contour, ContourBuilder};
use geo::orient::Direction;
use geo::{Area, ConvexHull, Coord, MultiPoint, Orient, Point, Polygon};
use rayon::prelude::*;

/// The border of what an object covers, in pixel-corner coordinates.
///
/// Rings do not cross. Those around the object go clockwise as seen, those around holes the other
/// way; none repeats its first point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// The rings, each directly followed by its holes.
    pub rings: Vec<Vec<Point2<f64>>>,
}

/// Value at which a coverage becomes inside.
const HALF_COVERED: f64 = 0.5;
/// Rings around less than this are rounding, square pixels.
const MIN_RING_AREA_PX: f64 = 1.0;

impl Outline {
    /// The lines along which a coverage is one half.
    ///
    /// # Method
    /// Marching squares with linear interpolation between pixel centres (crate `contour`).
    pub fn around(coverage: &Image<Coverage>) -> Self {
        Self {
            rings: contours(coverage)
                .iter()
                .flat_map(large_polygons)
                .flat_map(|polygon| open_rings(polygon.orient(Direction::Default)))
                .collect(),
        }
    }

    /// A single ring, clockwise as seen.
    pub(super) fn from_ring(ring: Vec<Point2<f64>>) -> Self {
        Self { rings: vec![ring] }
    }

    /// The convex hull, clockwise as seen.
    pub fn hull(&self) -> Vec<Point2<f64>> {
        let points = self.rings.iter().flatten().map(|p| Point::new(p.x, p.y));
        let (ring, _) = points.collect::<MultiPoint>().convex_hull().into_inner();
        points_of(ring.0.get(1..).unwrap_or_default())
    }

    /// Area inside, square pixels, without the holes.
    pub fn area(&self) -> f64 {
        let rings = self.rings.iter();
        rings.map(|ring| 0.5 * doubled_area(ring)).sum()
    }

    /// Area over that of the convex hull, 0 to 1 (OpenCV's solidity); 1 where there is nothing.
    pub fn solidity(&self) -> f64 {
        match 0.5 * doubled_area(&self.hull()) {
            whole if whole > 0.0 => self.area() / whole,
            _ => 1.0,
        }
    }

    /// How wide a long strip of this area and outline would be: twice the area over the length of
    /// its rings, pixels; 0 where there is nothing.
    pub fn width(&self) -> f64 {
        let around: f64 = self.rings.iter().map(|ring| ring_length(ring)).sum();
        if around > 0.0 {
            2.0 * self.area() / around
        } else {
            0.0
        }
    }

    /// Every point moved by a function.
    pub fn map(&self, f: impl Fn(Point2<f64>) -> Point2<f64>) -> Self {
        Self {
            rings: self
                .rings
                .iter()
                .map(|ring| ring.iter().copied().map(&f).collect())
                .collect(),
        }
    }

    /// The share of every pixel that lies inside.
    pub fn coverage(&self, width: usize, height: usize) -> Image<Coverage> {
        let sides = self.sides_by_row(height);
        let mut image = Image::new(width, height);
        image
            .par_rows_mut()
            .zip(&sides)
            .enumerate()
            .for_each(|(y, (row, sides))| cover_row(row, y, sides));
        image
    }

    /// The sides of the rings that pass through each row of pixels.
    fn sides_by_row(&self, height: usize) -> Vec<Vec<RingSide>> {
        let mut rows = vec![Vec::new(); height];
        for ring in &self.rings {
            for side in sides(ring) {
                let [top, bottom] = rows_crossed(side);
                for row in rows.iter_mut().take(bottom.saturating_add(1)).skip(top) {
                    row.push(side);
                }
            }
        }
        rows
    }
}

fn contours(coverage: &Image<Coverage>) -> Vec<Contour> {
    let values: Vec<f64> = coverage.pixels().iter().map(|c| c.0.into()).collect();
    // Fails only where the number of values is not that of the pixels.
    ContourBuilder::new(coverage.width(), coverage.height(), true)
        .contours(&values, &[HALF_COVERED])
        .unwrap_or_default()
}

/// The polygons of a contour that are more than rounding.
fn large_polygons(contour: &Contour) -> impl Iterator<Item = &Polygon> {
    let polygons = contour.geometry().0.iter();
    polygons.filter(|polygon| polygon.unsigned_area() >= MIN_RING_AREA_PX)
}

/// Two neighbouring points of a ring.
type RingSide = [Point2<f64>; 2];

/// The first and the last row of pixels that a side passes through.
fn rows_crossed([a, b]: RingSide) -> [usize; 2] {
    [a.y.min(b.y), a.y.max(b.y)].map(|y| y.max(0.0) as usize)
}

/// The rings of a polygon without their repeated first points.
fn open_rings(polygon: Polygon) -> impl Iterator<Item = Vec<Point2<f64>>> {
    let (outer, holes) = polygon.into_inner();
    std::iter::once(outer)
        .chain(holes)
        .map(|ring| points_of(&ring.0[..ring.0.len().saturating_sub(1)]))
}

pub(super) fn points_of(coordinates: &[Coord]) -> Vec<Point2<f64>> {
    coordinates.iter().map(|c| Point2::new(c.x, c.y)).collect()
}

pub(super) fn ring_length(ring: &[Point2<f64>]) -> f64 {
    sides(ring).map(|[a, b]| (b - a).norm()).sum()
}

/// Scan lines per row of pixels; each contributes exact spans, so only slanted sides are
/// approximated.
const SCAN_LINES: usize = 8;
/// The coverage of one of them.
const LINE_COVERAGE: f32 = 1.0 / SCAN_LINES as f32;

/// Where a side crosses the horizontal line at `y`.
#[inline]
fn crossing([a, b]: &RingSide, y: f64) -> Option<f64> {
    ((a.y <= y) != (b.y <= y)).then(|| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x))
}

/// Adds what the insides of rings with these sides cover of row `y`.
fn cover_row(row: &mut [Coverage], y: usize, sides: &[RingSide]) {
    for line in 0..SCAN_LINES {
        let at = y as f64 + (line as f64 + 0.5) / SCAN_LINES as f64;
        let mut xs: Vec<f64> = sides.iter().filter_map(|side| crossing(side, at)).collect();
        xs.sort_by(f64::total_cmp);
        for span in xs.chunks_exact(2) {
            add_span(row, span[0], span[1]);
        }
    }
}

/// The column of a row of `len` pixels that holds a coordinate, or the nearest to it.
#[inline]
fn column(x: f64, len: usize) -> usize {
    (x.max(0.0) as usize).min(len)
}

/// Adds what one scan line covers from `x0` to `x1`.
fn add_span(row: &mut [Coverage], x0: f64, x1: f64) {
    let len = row.len();
    let (first, end) = (column(x0, len), column(x1.ceil(), len));
    // Between its ends a span covers whole pixels.
    let whole = column(x0.ceil(), len)..column(x1, len);
    let whole = if whole.is_empty() { end..end } else { whole };
    for pixel in &mut row[whole.clone()] {
        pixel.0 += LINE_COVERAGE;
    }
    for x in (first..whole.start).chain(whole.end..end) {
        row[x].0 += overlap(x, x0, x1) * LINE_COVERAGE;
    }
}

/// The part of pixel `x` that lies from `x0` to `x1`.
#[inline]
fn overlap(x: usize, x0: f64, x1: f64) -> f32 {
    let length = x1.min((x + 1) as f64) - x0.max(x as f64);
    length.clamp(0.0, 1.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of radius 12 to 20 around (32, 30), antialiased.
    fn ring() -> Image<Coverage> {
        Image::from_fn(64, 60, |x, y| {
            let r = (x as f64 + 0.5 - 32.0).hypot(y as f64 + 0.5 - 30.0);
            Coverage(((20.5 - r).clamp(0.0, 1.0) * (r - 11.5).clamp(0.0, 1.0)) as f32)
        })
    }

    #[test]
    fn a_ring_has_an_outline_and_a_hole() {
        let outline = Outline::around(&ring());
        assert_eq!(outline.rings.len(), 2);
        let area = std::f64::consts::PI * (400.0 - 144.0);
        assert!(
            (outline.area() / area - 1.0).abs() < 0.01,
            "{} against {area}",
            outline.area()
        );
        assert!(doubled_area(&outline.rings[0]) > 0.0 && doubled_area(&outline.rings[1]) < 0.0);
    }

    #[test]
    fn a_ring_is_less_solid_than_what_it_lies_around() {
        assert!((Outline::around(&ring()).solidity() - (1.0 - 144.0 / 400.0)).abs() < 0.01);
        assert_eq!(Outline::default().solidity(), 1.0);
    }

    #[test]
    fn coverage_and_outline_are_each_others_inverse() {
        let there = ring();
        let back = Outline::around(&there).coverage(64, 60);
        let off = there
            .pixels()
            .iter()
            .zip(back.pixels())
            .map(|(a, b)| (a.0 - b.0).abs())
            .fold(0.0, f32::max);
        assert!(off < 0.25, "{off}: the outline is straight inside a pixel");
        let mean = there.zip_map(&back, |a, b| Coverage((a.0 - b.0).abs()));
        assert!(
            mean.pixels().iter().map(|c| c.0).sum::<f32>() / mean.pixels().len() as f32 <= 0.005
        );
    }

    #[test]
    fn the_hull_has_no_hollow() {
        let ell = Image::from_fn(40, 40, |x, y| {
            (5..35).contains(&x) && (5..35).contains(&y) && (x < 15 || y > 25)
        });
        let hull = Outline::from_ring(Outline::around(&ell.to_coverage()).hull());
        let [full, corner] = [900.0, 0.5 * 20.0 * 21.0];
        assert!(
            (hull.area() - (full - corner)).abs() < 40.0,
            "{}",
            hull.area()
        );
    }

    #[test]
    fn coverage_sums_to_the_area_also_of_what_lies_outside() {
        let sum = |ring: &[[f64; 2]], side: usize| -> f32 {
            let outline = Outline::from_ring(ring.iter().map(|p| Point2::from(*p)).collect());
            let coverage = outline.coverage(side, side);
            coverage.pixels().iter().map(|c| c.0).sum()
        };
        let triangle = sum(&[[1.0, 1.0], [9.0, 2.5], [3.0, 8.0]], 10);
        assert!(
            (f64::from(triangle) - 0.5 * (8.0 * 7.0 - 2.0 * 1.5)).abs() < 0.1,
            "{triangle}"
        );
        assert_eq!(
            sum(&[[-5.0, -5.0], [2.0, -5.0], [2.0, 2.0], [-5.0, 2.0]], 4),
            4.0
        );
        let thin = sum(&[[1.25, 0.0], [1.5, 0.0], [1.5, 4.0], [1.25, 4.0]], 4);
        assert_eq!(thin, 1.0);
    }

    #[test]
    fn what_reaches_the_border_ends_there() {
        let half = Image::from_fn(20, 10, |x, _| x < 8);
        let outline = Outline::around(&half.to_coverage());
        assert!((outline.area() - 80.0).abs() < 1.0, "{}", outline.area());
    }

    #[test]
    fn nothing_has_no_outline() {
        let none = Outline::around(&Image::new(5, 4));
        assert!(none.rings.is_empty() && none.hull().is_empty() && none.area() == 0.0);
        assert!(none.coverage(3, 2).pixels().iter().all(|c| c.0 == 0.0));
    }
}
