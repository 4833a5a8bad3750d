//! Moves an outline to where the photo itself changes, to a fraction of a pixel.

use crate::filter;
use crate::geom::{Point2, Vector2, sides};
use crate::image::Image;
use crate::matte::Outline;
use crate::matte::outline::ring_length;
use crate::pixel::LinearRgb;
use crate::quantile::median;
use rayon::prelude::*;

/// How far to either side of the outline the change is searched for, in pixels of the picture that
/// was searched.
const PROFILE_REACH_PX: f64 = 1.5;
/// How far inside the outline a change that still rises at the end of the profile is followed,
/// likewise: the outline of a blurred object lies outside it by the width of its edge.
const INNER_REACH_PX: f64 = 4.0;
/// Where the outside is taken from, beyond the reach, likewise.
const OUTSIDE_PX: f64 = 2.0;
/// Steps of a profile to a pixel of the search.
const STEPS_PER_PX: usize = 4;
/// Length of a step, pixels of the search.
const STEP_PX: f64 = 1.0 / STEPS_PER_PX as f64;
/// Profiles are averaged over this many pixels of the photo along the outline.
const LANE_COUNT: i32 = 3;
/// A change counts from this many times the noise on the outside.
const MIN_CHANGE_SIGMAS: f32 = 5.0;
/// .. and from this share of the strongest one nearby: less is a shadow before the object.
const MIN_CHANGE_SHARE: f32 = 0.2;
/// How many times as large the change must be a step farther inside to be followed beyond the reach.
const MIN_RISE: f32 = 1.08;
/// Least noise: a step of an 8-bit picture.
const ROUNDING_STEP: f32 = 1.0 / 255.0;
/// Points to either side whose median a displacement becomes.
const MEDIAN_REACH: usize = 2;

/// An outline whose points lie where the photo changes halfway from the outside to the object's
/// rim.
///
/// `roots` are the square roots of the photo, `scale` is its pixels for one of the picture that was
/// searched. Points without a clear change stay.
///
/// # Method
/// Along the normal through each point, from the outside inwards: the first local maximum of the
/// difference from the outside (of square roots, all channels) that stands out of the noise; the
/// outline is where the difference has half that value. A difference that still rises clearly at the
/// inner end is followed farther inwards. Displacements pass a median of five along the outline. A
/// blurred step of light has half its height at its true place, whatever the blur; one of square
/// roots farther to its darker side, the more it is blurred.
pub(super) fn snapped(outline: &Outline, roots: &Image<LinearRgb>, scale: f64) -> Outline {
    let rings = outline
        .rings
        .iter()
        .map(|ring| snapped_ring(ring, roots, scale));
    Outline {
        rings: rings.collect(),
    }
}

fn snapped_ring(ring: &[Point2<f64>], roots: &Image<LinearRgb>, scale: f64) -> Vec<Point2<f64>> {
    let ring = evenly_spaced(ring, scale.max(1.0));
    if ring.len() < 2 * MEDIAN_REACH + 1 {
        return ring;
    }
    let points = edge_points(&ring, 2);
    let found = displacements(&points, roots, scale);
    points
        .iter()
        .enumerate()
        .map(|(i, point)| point.displaced(median_around(&found, i), roots.size(), scale))
        .collect()
}

/// How far outwards the photo changes at each point, where it clearly does, pixels of the search.
fn displacements(points: &[EdgePoint], roots: &Image<LinearRgb>, scale: f64) -> Vec<Option<f64>> {
    let profiles: Vec<EdgeProfile> = points
        .par_iter()
        .map(|point| EdgeProfile::new(roots, point, scale))
        .collect();
    let least = least_change(&profiles);
    profiles.iter().map(|p| p.half_way(least)).collect()
}

/// The points of a ring, with normals across the chords between the neighbours `reach` points away.
pub(super) fn edge_points(ring: &[Point2<f64>], reach: usize) -> Vec<EdgePoint> {
    let n = ring.len();
    (0..n)
        .map(|i| EdgePoint::new(ring[i], [ring[(i + n - reach) % n], ring[(i + reach) % n]]))
        .collect()
}

/// The least change that is no noise, from the median noise of all profiles.
fn least_change(profiles: &[EdgeProfile]) -> f32 {
    let noise = median(profiles.iter().map(|p| p.noise), f32::total_cmp);
    MIN_CHANGE_SIGMAS * noise.unwrap_or(0.0).max(ROUNDING_STEP)
}

/// Median of what was found at a point of a ring and its neighbours; 0 where nothing was.
fn median_around(found: &[Option<f64>], i: usize) -> f64 {
    let n = found.len();
    let near = (0..=2 * MEDIAN_REACH).filter_map(|k| found[(i + n + k - MEDIAN_REACH) % n]);
    median(near, f64::total_cmp).unwrap_or(0.0)
}

/// A point of an outline and the unit normal to its outside.
pub(super) struct EdgePoint {
    at: Point2<f64>,
    normal: Vector2<f64>,
}

impl EdgePoint {
    /// A point of a ring that goes clockwise as seen, and two neighbours of it, the earlier one
    /// first.
    fn new(at: Point2<f64>, [before, after]: [Point2<f64>; 2]) -> Self {
        let along = after - before;
        let normal = Vector2::new(along.y, -along.x)
            .try_normalize(0.0)
            .unwrap_or_default();
        Self { at, normal }
    }

    /// The mean of a few pixels along the outline at a distance `t` outwards, pixels of the search.
    pub(super) fn mean_at(&self, roots: &Image<LinearRgb>, t: f64, scale: f64) -> LinearRgb {
        let lanes = (-(LANE_COUNT / 2)..=LANE_COUNT / 2).map(|lane| {
            let p = self.lane_position(lane, t, scale);
            filter::sample_bilinear_clamped(roots, p.x, p.y)
        });
        lanes
            .fold(LinearRgb::BLACK, |sum, p| sum + p)
            .scale(1.0 / LANE_COUNT as f32)
    }

    /// The position at a distance `t` outwards on a profile beside that through the point.
    #[inline]
    fn lane_position(&self, lane: i32, t: f64, scale: f64) -> Point2<f64> {
        self.at + self.normal * (t * scale) + self.tangent() * (f64::from(lane) * scale / 2.0)
    }

    #[inline]
    fn tangent(&self) -> Vector2<f64> {
        Vector2::new(-self.normal.y, self.normal.x)
    }

    /// The point moved outwards; what reaches the border of the photo stays there.
    fn displaced(&self, by: f64, (w, h): (usize, usize), scale: f64) -> Point2<f64> {
        let (w, h) = (w as f64, h as f64);
        if is_near_border(self.at.x, w, scale) || is_near_border(self.at.y, h, scale) {
            return self.at;
        }
        let moved = self.at + self.normal * (by * scale);
        Point2::new(moved.x.clamp(0.0, w), moved.y.clamp(0.0, h))
    }
}

fn is_near_border(v: f64, len: f64, scale: f64) -> bool {
    v <= scale || v >= len - scale
}

/// Number of steps of a profile over a length, pixels of the search.
fn steps(length_px: f64) -> usize {
    (length_px * STEPS_PER_PX as f64) as usize
}

/// The colours along the normal beyond the reach of a profile.
fn outside_colors(roots: &Image<LinearRgb>, point: &EdgePoint, scale: f64) -> Vec<LinearRgb> {
    (0..steps(OUTSIDE_PX))
        .map(|k| point.mean_at(roots, PROFILE_REACH_PX + k as f64 * STEP_PX, scale))
        .collect()
}

/// Difference from the outside along a normal, from the outside inwards.
struct EdgeProfile {
    /// One value per step.
    change: Vec<f32>,
    /// Deviation of the samples on the outside.
    noise: f32,
}

impl EdgeProfile {
    fn new(roots: &Image<LinearRgb>, point: &EdgePoint, scale: f64) -> Self {
        let (mean, noise) = mean_and_deviation(&outside_colors(roots, point, scale));
        let change_at = |k: usize| {
            let inwards = point.mean_at(roots, PROFILE_REACH_PX - k as f64 * STEP_PX, scale);
            distance(inwards, mean)
        };
        let mut change: Vec<f32> = (0..=steps(2.0 * PROFILE_REACH_PX)).map(change_at).collect();
        for k in change.len()..=steps(PROFILE_REACH_PX + INNER_REACH_PX) {
            let next = change_at(k);
            if next <= MIN_RISE * change[k - 1] {
                break;
            }
            change.push(next);
        }
        Self { change, noise }
    }

    /// Where the first clear change is half done: outwards from the outline, pixels of the search.
    fn half_way(&self, least: f32) -> Option<f64> {
        let rim = self.rim(least)?;
        let half = 0.5 * self.change[rim];
        let k = (1..=rim).find(|&k| self.change[k] >= half)?;
        let (before, after) = (self.change[k - 1], self.change[k]);
        let part = f64::from((half - before) / (after - before));
        (before < half).then(|| PROFILE_REACH_PX - (k as f64 - 1.0 + part) / STEPS_PER_PX as f64)
    }

    /// The first local maximum that is a clear change.
    fn rim(&self, least: f32) -> Option<usize> {
        let change = &self.change;
        let most = change.iter().fold(0.0f32, |most, c| most.max(*c));
        let least = least.max(MIN_CHANGE_SHARE * most);
        (0..change.len()).find(|&k| change[k] >= least && self.does_not_rise_after(k))
    }

    fn does_not_rise_after(&self, k: usize) -> bool {
        let next = self.change.get(k + 1);
        next.is_none_or(|next| *next <= self.change[k])
    }
}

/// The mean of some colours, and the root mean square of their distances from it.
fn mean_and_deviation(colors: &[LinearRgb]) -> (LinearRgb, f32) {
    let n = colors.len() as f32;
    let sum = colors.iter().fold(LinearRgb::BLACK, |sum, p| sum + *p);
    let mean = sum.scale(1.0 / n);
    let distances = colors.iter().map(|p| distance(*p, mean));
    let square: f32 = distances.map(|off| off * off).sum();
    (mean, (square / n).sqrt())
}

/// Euclidean distance of two colours.
pub(super) fn distance(a: LinearRgb, b: LinearRgb) -> f32 {
    let d = a + b.scale(-1.0);
    (d.r * d.r + d.g * d.g + d.b * d.b).sqrt()
}

/// Points of a ring at equal distances of about `spacing`.
pub(super) fn evenly_spaced(ring: &[Point2<f64>], spacing: f64) -> Vec<Point2<f64>> {
    let length = ring_length(ring);
    let step = length / (length / spacing).round().max(1.0);
    let (mut points, mut walked, mut next) = (Vec::new(), 0.0, 0.0);
    for [a, b] in sides(ring) {
        let side = (b - a).norm();
        while next < walked + side && next < length - 0.5 * step {
            points.push(a + (b - a) * ((next - walked) / side));
            next += step;
        }
        walked += side;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of radius 30.3 with a blurred edge.
    fn photo() -> Image<LinearRgb> {
        let disc = Image::from_fn(100, 90, |x, y| {
            let r = (x as f64 + 0.5 - 50.0).hypot(y as f64 + 0.5 - 45.0);
            let inside = (30.3 - r + 0.5).clamp(0.0, 1.0) as f32;
            LinearRgb::new(0.04, 0.4, 0.08).scale(1.0 - inside) + LinearRgb::grey(0.5 * inside)
        });
        filter::gaussian_blur(&disc, 0.8)
    }

    fn circle(radius: f64) -> Outline {
        let at = |i: usize| {
            let a = std::f64::consts::TAU * i as f64 / 200.0;
            Point2::new(50.0 + radius * libm::cos(a), 45.0 + radius * libm::sin(a))
        };
        Outline::from_ring((0..200).map(at).collect())
    }

    #[test]
    fn an_outline_a_pixel_off_comes_to_the_edge() {
        for radius in [29.3, 30.3, 31.3] {
            let snapped = snapped(&circle(radius), &photo(), 1.0);
            let worst = snapped.rings[0]
                .iter()
                .map(|p| ((p.x - 50.0).hypot(p.y - 45.0) - 30.3).abs())
                .fold(0.0, f64::max);
            // From a pixel outside, the reach ends before the blurred edge has its full height:
            // half of less lies farther out.
            assert!(worst < 0.6, "from {radius}: {worst} px off");
        }
    }

    #[test]
    fn an_outline_around_a_blurred_edge_comes_to_it() {
        let blurred = filter::gaussian_blur(&photo(), 0.8);
        let snapped = snapped(&circle(32.6), &blurred, 1.0);
        let radius = (snapped.area() / std::f64::consts::PI).sqrt();
        assert!((radius - 30.3).abs() < 0.5, "radius {radius}");
    }

    #[test]
    fn an_outline_over_nothing_stays() {
        let even = Image::filled(100, 90, LinearRgb::grey(0.3));
        let area = |outline: &Outline| outline.area();
        assert!(
            (area(&snapped(&circle(30.0), &even, 1.0)) / area(&circle(30.0)) - 1.0).abs() < 0.005
        );
    }
}
