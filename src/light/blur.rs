//! The blur of a photograph: how soft its sharpest edges are.

use crate::filter::gaussian_blur;
use crate::geom::Vector2;
use crate::image::Image;
use crate::light::inner_pixels;
use crate::pixel::LinearRgb;
use crate::quantile::quantile;
use crate::scene::Blur;

/// Blur that is put on top, pixels: what it takes from an edge tells how soft the edge was.
const ADDED_SIGMA_PX: f32 = 1.0;
/// Share of the pixels that are steep enough to look at.
const STEEP_SHARE: f64 = 0.03;
/// An edge with other edges within this distance is none that could be measured, pixels.
const CLEAR_PX: isize = 4;
/// Pixels from the middle of an edge to where it must have ended.
const EDGE_PX: isize = 3;
/// Slope at that distance, as a share of the edge's, that is still flat.
const FLAT_SHARE: f32 = 0.12;
/// Most slope the other way, which lines have and edges have not.
const TURN_SHARE: f32 = -0.1;
/// Fewer edges say nothing.
const MIN_EDGES: usize = 20;
/// Longest side of the squares that a picture is looked at in, pixels: in photos of 640 x 480 they
/// show blurs of up to some 5 pixels.
const MAX_SIDE_PX: usize = 4;
/// Variance that this method finds in edges that nothing but their pixels blurs, px^2; measured
/// on rectangles drawn at all angles, pixels averaged over 8 x 8 points.
const PIXEL_VARIANCE: f64 = 0.347;
/// Blur over what is found of it beyond that, on the same rectangles with Gaussians of 0.3 to 1 px.
const BLUR_RATIO: f64 = 1.05;

/// The blur of a photograph beyond that of its pixels, from its green channel: [`Blur::NONE`] for
/// one with too few edges.
///
/// # Method
/// Slopes before and after another blur (S. Zhuo and T. Sim, "Defocus map estimation from a single
/// image", 2011), at the steepest edges of the picture that stand alone; the lower quartile, since
/// things have soft edges of their own. Where too few stand alone they are too soft for their
/// pixels, and are looked at in squares of 2, 3 or 4 pixels: on a plain surface the soft rim of a
/// shadow is then mistaken for the photo's blur.
pub fn plate_blur(plate: &Image<LinearRgb>) -> Blur {
    let found = (1..=MAX_SIDE_PX).find_map(|side| blur_in_squares(plate, side));
    found.map_or(Blur::NONE, Blur::Known)
}

/// The blur, pixels, that squares of so many pixels' side show; none with too few edges.
fn blur_in_squares(plate: &Image<LinearRgb>, side: usize) -> Option<f64> {
    let sigmas = sigmas_in_squares(plate, side);
    if sigmas.len() < MIN_EDGES {
        return None;
    }
    let found = f64::from(quantile(sigmas, 0.25, f32::total_cmp)?);
    let variance = (found * found - PIXEL_VARIANCE).max(0.0);
    Some(side as f64 * BLUR_RATIO * variance.sqrt())
}

/// Those of the edges in squares of so many pixels' side, laid in every way that there is.
fn sigmas_in_squares(plate: &Image<LinearRgb>, side: usize) -> Vec<f32> {
    let ways = (0..side * side).map(|i| [i % side, i / side]);
    ways.flat_map(|first| edge_sigmas(&green_of_squares(plate, side, first)))
        .collect()
}

/// The mean green of squares of so many pixels' side, the first one at `left`, `top`.
fn green_of_squares(plate: &Image<LinearRgb>, side: usize, [left, top]: [usize; 2]) -> Image<f32> {
    let columns = plate.width().saturating_sub(left) / side;
    let rows = plate.height().saturating_sub(top) / side;
    Image::from_fn(columns, rows, |x, y| {
        let pixel = |i: usize| plate[(left + side * x + i % side, top + side * y + i / side)];
        let sum: f32 = (0..side * side).map(|i| pixel(i).g).sum();
        sum / (side * side) as f32
    })
}

/// Standard deviations of the steep edges that stand alone, pixels.
fn edge_sigmas(green: &Image<f32>) -> Vec<f32> {
    let (sharp, soft) = (Slopes(green), gaussian_blur(green, ADDED_SIGMA_PX));
    let edges = sharp.edges();
    edges
        .filter_map(|edge| sigma_at(edge, &Slopes(&soft)))
        .collect()
}

/// Standard deviation of an edge, pixels, from how much less steep it became.
fn sigma_at(edge: Edge, soft: &Slopes) -> Option<f32> {
    let ratio = edge.slope.norm() / soft.at(edge.x, edge.y).norm();
    let sigma = ADDED_SIGMA_PX / (ratio * ratio - 1.0).sqrt();
    (ratio > 1.0 && sigma.is_finite()).then_some(sigma)
}

/// The steepest place across an edge.
struct Edge {
    x: usize,
    y: usize,
    slope: Vector2<f32>,
}

struct Slopes<'a>(&'a Image<f32>);

impl Slopes<'_> {
    /// By central differences; the pixel has four neighbours.
    fn at(&self, x: usize, y: usize) -> Vector2<f32> {
        let Self(image) = self;
        let along_x = image[(x + 1, y)] - image[(x - 1, y)];
        let along_y = image[(x, y + 1)] - image[(x, y - 1)];
        Vector2::new(along_x, along_y) / 2.0
    }

    /// The steep edges that stand alone.
    fn edges(&self) -> impl Iterator<Item = Edge> {
        let steep = self.steep();
        let candidates = self.inner_pixels().map(|(x, y)| Edge {
            x,
            y,
            slope: self.at(x, y),
        });
        candidates.filter(move |edge| edge.slope.norm() > steep && self.stands_alone(edge))
    }

    /// Pixels around which an edge can be seen whole.
    fn inner_pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        inner_pixels(self.0.size(), CLEAR_PX as usize + 1)
    }

    /// The slope that few pixels have; infinite where there are none.
    fn steep(&self) -> f32 {
        let slopes = self.inner_pixels().map(|(x, y)| self.at(x, y).norm());
        let finite = slopes.filter(|slope| slope.is_finite()).collect();
        quantile(finite, 1.0 - STEEP_SHARE, f32::total_cmp).unwrap_or(f32::INFINITY)
    }

    /// It is the steepest place around, and flat on both sides: an edge and no line.
    fn stands_alone(&self, edge: &Edge) -> bool {
        let normal = edge.slope / edge.slope.norm();
        let share = |d: isize| self.slope_along(edge, &normal, d) / edge.slope.norm();
        self.is_steepest(edge)
            && [-1, 1].into_iter().all(|side| {
                (EDGE_PX..=CLEAR_PX).all(|d| share(side * d).abs() < FLAT_SHARE)
                    && share(side * (EDGE_PX - 1)) > TURN_SHARE
            })
    }

    fn is_steepest(&self, edge: &Edge) -> bool {
        let own = edge.slope.norm();
        let mut around = (0..9).map(|i| (edge.x + i % 3 - 1, edge.y + i / 3 - 1));
        around.all(|(x, y)| self.at(x, y).norm() <= own)
    }

    /// The slope across the edge, some pixels from its middle.
    fn slope_along(&self, edge: &Edge, normal: &Vector2<f32>, d: isize) -> f32 {
        let moved =
            |from: usize, by: f32| from.saturating_add_signed((d as f32 * by).round() as isize);
        self.at(moved(edge.x, normal.x), moved(edge.y, normal.y))
            .dot(normal)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::scene::Draws;

    /// Half planes at all angles, seen through pixels that are squares, in a Gaussian's blur.
    pub(in crate::light) fn edges(sigma_px: f32) -> Image<LinearRgb> {
        const POINTS: usize = 8;
        let cell = 40;
        let fine = Image::from_fn(160 * POINTS, 120 * POINTS, |x, y| {
            let (x, y) = (x as f64 / POINTS as f64, y as f64 / POINTS as f64);
            let number = (x as usize / cell) + 4 * (y as usize / cell);
            let angle = number as f64 * 0.53 + 0.1;
            let (dx, dy) = (x % cell as f64 - 20.0, y % cell as f64 - 20.0);
            if dx * angle.cos() + dy * angle.sin() > 0.0 {
                0.7
            } else {
                0.2
            }
        });
        let soft = gaussian_blur(&fine, sigma_px * POINTS as f32);
        Image::from_fn(160, 120, |x, y| {
            let points = (0..POINTS * POINTS)
                .map(|i| soft[(x * POINTS + i % POINTS, y * POINTS + i / POINTS)]);
            let mean = points.sum::<f32>() / (POINTS * POINTS) as f32;
            let grain = Draws::new(1, (y * 160 + x) as u64).unit("grain") as f32 - 0.5;
            LinearRgb::grey(mean + 0.01 * grain)
        })
    }

    #[test]
    fn the_blur_that_was_put_in_is_found() {
        for sigma_px in [0.3, 0.5, 0.8, 1.2, 2.0, 3.0] {
            let Blur::Known(found) = plate_blur(&edges(sigma_px)) else {
                panic!("nothing found at {sigma_px}")
            };
            assert!(
                (found - f64::from(sigma_px)).abs() < 0.1,
                "{sigma_px}: {found}"
            );
        }
        assert!(matches!(plate_blur(&edges(0.0)), Blur::Known(found) if found < 0.15));
    }

    #[test]
    fn too_little_to_see_is_no_blur() {
        let grain = |i: u64| LinearRgb::grey(Draws::new(1, i).unit("grain") as f32);
        for plate in [
            Image::new(2, 2),
            Image::from_fn(160, 120, |x, y| grain((y * 160 + x) as u64)),
            Image::filled(60, 60, LinearRgb::grey(0.4)),
            Image::filled(60, 60, LinearRgb::grey(f32::NAN)),
        ] {
            assert_eq!(plate_blur(&plate), Blur::NONE);
        }
    }
}
