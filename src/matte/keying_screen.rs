//! Keying Screen: a plate from a few points where the screen is seen.

use super::check::check_value;
use crate::error::Result;
use crate::image::Image;
use crate::pixel::LinearRgb;
use nalgebra::Point2;

/// A point of the photo and the screen's colour there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenPoint {
    /// Where, pixels from the top left.
    pub at_px: Point2<f64>,
    /// Scene-linear.
    pub color: LinearRgb,
}

/// Width of the Gaussian around a point at smoothness 0, in widths of the picture; Blender's.
const SHARPEST_SIGMA: f64 = 0.15;
/// What smoothness 1 adds to it; Blender's.
const SMOOTHNESS_SIGMA: f64 = 0.85;

/// Creates a plate from points, as Blender 4.5 does: a mean of all points, weighted by a Gaussian
/// of their distance.
///
/// `smoothness` is 0 to 1. The plate does not pass through the colours of the points; distances are
/// measured in widths and heights of the picture. Points outside the picture are skipped.
///
/// # Method
/// `sum(w color) / sum(w)` with `w = exp(-d^2 / sigma^2)`, `sigma = 0.15 + 0.85 smoothness`, in
/// double precision.
///
/// # Errors
/// [`Error::Value`](crate::Error::Value) where no point lies in the picture, for the colour of one
/// that does and is not finite, or `smoothness` outside 0 to 1.
pub fn keying_screen(
    (width, height): (usize, usize),
    points: &[ScreenPoint],
    smoothness: f64,
) -> Result<Image<LinearRgb>> {
    check_value((0.0..=1.0).contains(&smoothness), "smoothness", || {
        format!("{smoothness}, expected 0 to 1")
    })?;
    let size = [width as f64, height as f64];
    check_colors(points, size)?;
    let points = points_inside(points, width, height)?;
    let sigma = SHARPEST_SIGMA + SMOOTHNESS_SIGMA * smoothness;
    Ok(Image::from_fn(width, height, |x, y| {
        screen_color(&points, [x as f64 + 0.5, y as f64 + 0.5], size, sigma)
    }))
}

fn check_colors(points: &[ScreenPoint], size: [f64; 2]) -> Result<()> {
    let points = points.iter().enumerate();
    let mut inside = points.filter(|(_, p)| p.is_inside(size));
    inside.try_for_each(|(i, p)| {
        check_value(p.color.is_finite(), &format!("points[{i}]"), || {
            format!("{:?}, expected finite numbers", p.color.channels())
        })
    })
}

/// The points that lie in the picture, at least one.
fn points_inside(points: &[ScreenPoint], width: usize, height: usize) -> Result<Vec<ScreenPoint>> {
    let mut inside = points.to_vec();
    inside.retain(|p| p.is_inside([width as f64, height as f64]));
    check_value(!inside.is_empty(), "points", || {
        format!("none inside the {width} x {height} pixels, expected at least 1")
    })?;
    Ok(inside)
}

impl ScreenPoint {
    fn is_inside(&self, [w, h]: [f64; 2]) -> bool {
        (0.0..=w).contains(&self.at_px.x) && (0.0..=h).contains(&self.at_px.y)
    }

    /// Squared distance in widths and heights of the picture.
    #[inline(always)]
    fn square_distance(&self, [x, y]: [f64; 2], [w, h]: [f64; 2]) -> f64 {
        ((self.at_px.x - x) / w).powi(2) + ((self.at_px.y - y) / h).powi(2)
    }
}

/// The plate at one place.
fn screen_color(points: &[ScreenPoint], at: [f64; 2], size: [f64; 2], sigma: f64) -> LinearRgb {
    let squares = points.iter().map(|p| p.square_distance(at, size));
    // Measured from the nearest point, the weights of far pixels do not all vanish; their ratios
    // are the same.
    let nearest = squares.clone().fold(f64::INFINITY, f64::min);
    let weights = squares.map(|square| libm::exp((nearest - square) / (sigma * sigma)));
    weighted_mean(weights.zip(points.iter().map(|p| p.color)))
}

fn weighted_mean(parts: impl Iterator<Item = (f64, LinearRgb)>) -> LinearRgb {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (weight, color) in parts {
        for (sum, channel) in sum.iter_mut().zip(color.channels()) {
            *sum += weight * f64::from(channel);
        }
        total += weight;
    }
    LinearRgb::from(sum.map(|v| (v / total) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: ScreenPoint = ScreenPoint {
        at_px: Point2::new(2.0, 5.0),
        color: LinearRgb::new(0.1, 0.6, 0.2),
    };
    const RIGHT: ScreenPoint = ScreenPoint {
        at_px: Point2::new(18.0, 5.0),
        color: LinearRgb::new(0.2, 0.8, 0.3),
    };

    #[test]
    fn one_point_makes_an_even_plate() {
        let plate = keying_screen((20, 10), &[LEFT], 0.0).unwrap();
        assert!(plate.pixels().iter().all(|&c| c == LEFT.color));
    }

    #[test]
    fn between_two_points_the_plate_is_their_mean() {
        let plate = keying_screen((20, 10), &[LEFT, RIGHT], 0.3).unwrap();
        let middle = (plate[(9, 4)].g + plate[(10, 4)].g) / 2.0;
        assert!((middle - 0.7).abs() < 1e-6);
        assert!(plate[(0, 4)].g < plate[(19, 4)].g);
    }

    #[test]
    fn weights_follow_the_formula() {
        let plate = keying_screen((20, 10), &[LEFT, RIGHT], 0.0).unwrap();
        let weight = |p: ScreenPoint| {
            let (dx, dy) = ((p.at_px.x - 6.5) / 20.0, (p.at_px.y - 1.5) / 10.0);
            (-(dx * dx + dy * dy) / 0.15f64.powi(2)).exp()
        };
        let (a, b) = (weight(LEFT), weight(RIGHT));
        let want = (a * 0.6 + b * 0.8) / (a + b);
        assert!((f64::from(plate[(6, 1)].g) - want).abs() < 1e-7);
    }

    #[test]
    fn a_plate_needs_a_point_in_the_picture() {
        let outside = ScreenPoint {
            at_px: Point2::new(-1.0, 0.0),
            ..LEFT
        };
        assert!(keying_screen((20, 10), &[outside], 0.0).is_err());
    }

    #[test]
    fn a_colour_that_is_not_finite_is_refused_by_its_point() {
        let lost = ScreenPoint {
            color: LinearRgb::new(f32::INFINITY, 0.0, 0.5),
            ..RIGHT
        };
        let refusal = keying_screen((20, 10), &[LEFT, lost], 0.0).unwrap_err();
        assert_eq!(
            refusal.to_string(),
            "points[1]: [inf, 0.0, 0.5], expected finite numbers"
        );
        let outside = ScreenPoint {
            at_px: Point2::new(-1.0, 0.0),
            ..lost
        };
        let plate = keying_screen((20, 10), &[outside, LEFT], 0.0).unwrap();
        assert_eq!(plate[(0, 0)], LEFT.color);
    }
}
