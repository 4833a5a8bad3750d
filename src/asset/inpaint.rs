//! Painting over what must not be seen in a photo.

use crate::camera::square_from_corners;
use crate::filter::sample_bilinear_clamped;
use crate::geom::{Homography, Point2};
use crate::image::{Image, Roi};
use crate::pixel::{LinearRgb, Mix};

/// A square as a picture shows it, from wherever that was taken.
pub(super) struct SeenSquare {
    corners_px: [Point2<f64>; 4],
    picture_from_square: Homography,
    square_from_picture: Homography,
}

impl SeenSquare {
    /// A square by its corners, pixels, with a margin around it that is a share of its side; none
    /// for corners on a line.
    pub(super) fn new(corners_px: &[Point2<f64>; 4], margin: f64) -> Option<Self> {
        let (low, high) = (-margin, 1.0 + margin);
        let inner = square_from_corners(corners_px);
        let corners_px = [[low, low], [high, low], [high, high], [low, high]]
            .map(|corner| inner.map(corner.into()));
        let picture_from_square = square_from_corners(&corners_px);
        Some(Self {
            corners_px,
            picture_from_square,
            square_from_picture: picture_from_square.inverse()?,
        })
    }

    /// Whether a point of the picture is in it.
    pub(super) fn contains(&self, point: Point2<f64>) -> bool {
        self.place_of(point).is_some()
    }

    /// Points on its sides, a pixel apart or less.
    pub(super) fn border(&self) -> impl Iterator<Item = Point2<f64>> {
        let corners = self.corners_px;
        (0..4).flat_map(move |i| points_between(corners[i], corners[(i + 1) % 4]))
    }

    /// Where in the unit square a point of the picture is; none outside.
    fn place_of(&self, point: Point2<f64>) -> Option<Point2<f64>> {
        let place = self.square_from_picture.map(point);
        let is_inside = place.iter().all(|at| (0.0..=1.0).contains(at));
        is_inside.then_some(place)
    }

    /// The pixels of a picture that it may reach.
    fn roi(&self, (w, h): (usize, usize)) -> Roi {
        Roi::spanning(
            span(self.corners_px.map(|c| c.x), w),
            span(self.corners_px.map(|c| c.y), h),
        )
    }
}

fn points_between(a: Point2<f64>, b: Point2<f64>) -> impl Iterator<Item = Point2<f64>> {
    let steps = (b - a).norm().ceil().max(1.0);
    (0..steps as usize).map(move |i| a + (b - a) * (i as f64 / steps))
}

/// The whole numbers below `end` between some values.
fn span(values: [f64; 4], end: usize) -> std::ops::Range<usize> {
    let low = values.into_iter().fold(f64::MAX, f64::min).floor();
    let high = values.into_iter().fold(f64::MIN, f64::max).ceil();
    let [low, high] = [low, high].map(|v| v.clamp(0.0, end as f64) as usize);
    low..high.max(low)
}

/// Puts what its four sides show, as `screen` has it, in place of a square.
pub(super) fn inpaint(
    picture: &mut Image<LinearRgb>,
    square: &SeenSquare,
    screen: impl Fn(LinearRgb) -> LinearRgb,
) {
    let source = picture.clone();
    let side = |s, t| screen(seen_at(&source, square, s, t));
    let patch = CoonsPatch::new(&side);
    let part = square.roi(source.size());
    for y in part.y..part.y + part.height {
        for x in part.x..part.x + part.width {
            if let Some(place) = square.place_of(Point2::new(x as f64 + 0.5, y as f64 + 0.5)) {
                picture[(x, y)] = patch.at(place);
            }
        }
    }
}

/// A Coons patch between the sides of a square: no edge is left.
struct CoonsPatch<'a, S> {
    side: &'a S,
    /// Top left, top right, bottom left, bottom right.
    corners: [LinearRgb; 4],
}

impl<'a, S: Fn(f64, f64) -> LinearRgb> CoonsPatch<'a, S> {
    fn new(side: &'a S) -> Self {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[s, t]| side(s, t));
        Self { side, corners }
    }

    fn at(&self, place: Point2<f64>) -> LinearRgb {
        let side = self.side;
        let (s, t) = (place.x as f32, place.y as f32);
        let [top_left, top_right, bottom_left, bottom_right] = self.corners;
        let across = side(0.0, place.y).mixed(side(1.0, place.y), s);
        let down = side(place.x, 0.0).mixed(side(place.x, 1.0), t);
        let top = top_left.mixed(top_right, s);
        let bottom = bottom_left.mixed(bottom_right, s);
        across
            .add_scaled(1.0, down)
            .add_scaled(-1.0, top.mixed(bottom, t))
    }
}

/// What a picture shows at a place of the unit square; beyond the picture its nearest pixel.
fn seen_at(picture: &Image<LinearRgb>, square: &SeenSquare, s: f64, t: f64) -> LinearRgb {
    let at = square.picture_from_square.map(Point2::new(s, t));
    sample_bilinear_clamped(picture, at.x, at.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_is_painted_over_without_an_edge_however_it_is_turned() {
        let slope = |x: usize, y: usize| {
            LinearRgb::new(0.05, 0.3 + 0.001 * x as f32 + 0.0005 * y as f32, 0.1)
        };
        for corners in [
            [[20.0, 10.0], [50.0, 10.0], [50.0, 40.0], [20.0, 40.0]],
            [[40.0, 8.0], [62.0, 30.0], [40.0, 52.0], [18.0, 30.0]],
        ] {
            let corners = corners.map(Point2::from);
            let marker = SeenSquare::new(&corners, 0.0).unwrap();
            let paper = SeenSquare::new(&corners, 0.1).unwrap();
            let mut picture = Image::from_fn(80, 60, |x, y| {
                match marker.contains(Point2::new(x as f64 + 0.5, y as f64 + 0.5)) {
                    true => LinearRgb::WHITE,
                    false => slope(x, y),
                }
            });
            inpaint(&mut picture, &paper, |seen| seen);
            let off = picture.zip_map(&Image::from_fn(80, 60, slope), |a, b| (a.g - b.g).abs());
            assert!(off.pixels().iter().all(|off| *off < 1e-5));
            // One that reaches beyond the picture.
            inpaint(
                &mut picture,
                &SeenSquare::new(&corners, 2.0).unwrap(),
                |seen| seen,
            );
        }
    }
}
