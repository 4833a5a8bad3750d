//! Corners that a person has clicked, moved to where straight edges of the photo meet.
//!
//! # Method
//! Across each side of the clicked quadrangle profiles of light are taken. Where light changes
//! most, relative to what there is, may be an edge; the line that most profiles agree on, the near
//! ones of them first, is the side (RANSAC over all pairs, Fischler and Bolles 1981), and is fitted
//! to the centres of gravity of the changes in linear light, which blur does not move. Neighbours
//! meet in the corners. Then once more, from these corners and nearer to them.

use crate::filter::sample_bilinear_clamped;
use crate::geom::{Line, Point2, Vector2};
use crate::image::Image;
use crate::pixel::LinearRgb;
use std::ops::Range;

/// Profiles along a side, and the part of it near each corner that is not looked at.
const PROFILES: usize = 48;
const CORNER_PART: f64 = 0.06;
/// Lines a pixel apart whose light makes up a profile: noise is less, and an edge that is not quite
/// parallel still sharp.
const LINES_PER_PROFILE: usize = 5;
/// Samples per pixel of a profile.
const SAMPLES_PER_PX: usize = 4;
/// Edges of a profile that are considered: the strongest.
const MAX_EDGES: usize = 4;
/// A change of light by less than this share of it is no edge, and light that counts as none.
const MIN_CONTRAST: f64 = 0.04;
const DARKNESS: f64 = 0.01;
/// Half the way over which light changes at an edge, pixels.
const EDGE_REACH_PX: f64 = 1.25;
/// Edges this near to a line are on it, pixels.
const ON_LINE_PX: f64 = 1.0;
/// Share of the profiles that have to agree on a line.
const MIN_AGREEMENT: f64 = 0.45;
/// How much nearer lines are preferred: a line at the end of the reach counts for this share.
const FAR_WEIGHT: f64 = 0.4;
/// Pixels of the picture's diagonal for each pixel of the reach, and the least reach.
const DIAGONALS_PER_REACH: f64 = 150.0;
const MIN_REACH_PX: f64 = 6.0;
/// The reach from corners that were moved already.
const FINE_REACH_PX: f64 = 3.0;

/// Where clicked corners belong.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SnappedCorners {
    /// The corners, pixels.
    pub corners_px: [[f64; 2]; 4],
    /// Which sides, from each corner to the next, showed an edge. The others stay where they were.
    pub found: [bool; 4],
}

/// Moves roughly clicked corners (in order around the rectangle, pixels) to where straight edges
/// near the sides between them meet. Sides without an edge stay.
pub fn snap_corners(photo: &Image<LinearRgb>, rough: [[f64; 2]; 4]) -> SnappedCorners {
    let first = snap_within(photo, rough, reach_px(photo.size()));
    let again = snap_within(photo, first.corners_px, FINE_REACH_PX);
    if again.found == first.found {
        again
    } else {
        first
    }
}

fn snap_within(photo: &Image<LinearRgb>, rough: [[f64; 2]; 4], reach: f64) -> SnappedCorners {
    let corners = rough.map(Point2::from);
    let sides = [0, 1, 2, 3].map(|i| [corners[i], corners[(i + 1) % 4]]);
    let edges = sides.map(|ends| edge_near(photo, ends, reach));
    let lines = [0, 1, 2, 3].map(|i| edges[i].or_else(|| Line::through(&sides[i])));
    let corner = |i: usize| {
        edges[(i + 3) % 4].or(edges[i])?;
        let met = lines[(i + 3) % 4]?.meeting(&lines[i]?)?;
        // A corner that flies away is no improvement.
        ((met - corners[i]).norm() < 2.0 * reach).then_some(met)
    };
    SnappedCorners {
        corners_px: [0, 1, 2, 3].map(|i| corner(i).unwrap_or(corners[i]).into()),
        found: edges.map(|edge| edge.is_some()),
    }
}

/// How far from a side its edge is looked for.
fn reach_px((width, height): (usize, usize)) -> f64 {
    let diagonal = libm::hypot(width as f64, height as f64);
    (diagonal / DIAGONALS_PER_REACH).max(MIN_REACH_PX)
}

/// A place where light changes, on one of the profiles across a side.
#[derive(Clone, Copy)]
struct ProfileEdge {
    /// How far along the side, 0 to 1, and across it, pixels.
    along: f64,
    across: f64,
    /// Change of light over light.
    contrast: f64,
}

/// The edge of the photo along the way from one point to another; none where profiles do not agree
/// on one.
fn edge_near(photo: &Image<LinearRgb>, ends: [Point2<f64>; 2], reach: f64) -> Option<Line> {
    let side = Side::new(ends)?;
    let edges: Vec<ProfileEdge> = (0..PROFILES)
        .flat_map(|i| side.edges(photo, probe_part(i), reach))
        .collect();
    let [from, to] = best_line(&edges, reach)?;
    let on_line: Vec<Point2<f64>> = edges
        .iter()
        .filter(|edge| (edge.across - height_at(edge.along, from, to)).abs() < ON_LINE_PX)
        .map(|edge| side.point(edge.along, edge.across))
        .collect();
    let enough = on_line.len() as f64 >= MIN_AGREEMENT * PROFILES as f64;
    Line::through(&on_line).filter(|_| enough)
}

/// Where a profile stands on its side, 0 to 1.
fn probe_part(i: usize) -> f64 {
    CORNER_PART + (1.0 - 2.0 * CORNER_PART) * (i as f64 + 0.5) / PROFILES as f64
}

/// How far across a line is at some part of the way between its ends.
fn height_at(along: f64, from: f64, to: f64) -> f64 {
    from + (to - from) * along
}

/// The line, by how far across it is at both ends, that edges agree on most.
fn best_line(edges: &[ProfileEdge], reach: f64) -> Option<[f64; 2]> {
    let early = edges.iter().filter(|edge| edge.along < 0.35);
    let pairs = early.flat_map(|a| {
        let late = edges.iter().filter(|edge| edge.along > 0.65);
        late.map(move |b| through(a, b))
    });
    let scored = pairs.map(|line| (line, agreement(edges, line, reach)));
    scored
        .max_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(line, _)| line)
}

fn through(a: &ProfileEdge, b: &ProfileEdge) -> [f64; 2] {
    let slope = (b.across - a.across) / (b.along - a.along);
    let from = a.across - slope * a.along;
    [from, from + slope]
}

/// How much contrast lies on a line; far lines need more of it.
fn agreement(edges: &[ProfileEdge], [from, to]: [f64; 2], reach: f64) -> f64 {
    let total: f64 = edges
        .iter()
        .filter(|edge| (edge.across - height_at(edge.along, from, to)).abs() < ON_LINE_PX)
        .map(|edge| edge.contrast.min(1.0))
        .sum();
    let farthest = from.abs().max(to.abs()) / reach;
    total * (1.0 - (1.0 - FAR_WEIGHT) * farthest.min(1.0))
}

/// The way from one corner to the next.
struct Side {
    from: Point2<f64>,
    along: Vector2<f64>,
    normal: Vector2<f64>,
}

impl Side {
    fn new([from, to]: [Point2<f64>; 2]) -> Option<Self> {
        let along = to - from;
        let normal = Vector2::new(-along.y, along.x).try_normalize(1.0)?;
        Some(Self {
            from,
            along,
            normal,
        })
    }

    fn point(&self, along: f64, across: f64) -> Point2<f64> {
        self.from + self.along * along + self.normal * across
    }

    /// The light at some distance across the side, around some part of it.
    fn mean_light(&self, photo: &Image<LinearRgb>, along: f64, across: f64) -> f64 {
        let pixel = 1.0 / self.along.norm();
        let lines = (0..LINES_PER_PROFILE).map(|i| {
            let aside = (i as f64 - (LINES_PER_PROFILE - 1) as f64 / 2.0) * pixel;
            let at = self.point(along + aside, across);
            f64::from(sample_bilinear_clamped(photo, at.x, at.y).luminance())
        });
        lines.sum::<f64>() / LINES_PER_PROFILE as f64
    }

    /// The strongest edges of the profile across the side at some part of it.
    fn edges(&self, photo: &Image<LinearRgb>, along: f64, reach: f64) -> Vec<ProfileEdge> {
        let profile = LightProfile::across(self, photo, along, reach);
        let mut edges: Vec<ProfileEdge> = profile
            .peaks()
            .map(|(across, contrast)| ProfileEdge {
                along,
                across,
                contrast,
            })
            .collect();
        edges.sort_by(|a, b| b.contrast.total_cmp(&a.contrast));
        edges.truncate(MAX_EDGES);
        edges
    }
}

/// Light across a side, from `-reach` on.
struct LightProfile {
    light: Vec<f64>,
    reach: f64,
}

impl LightProfile {
    fn across(side: &Side, photo: &Image<LinearRgb>, along: f64, reach: f64) -> Self {
        // Changes at the very end of the reach are seen whole.
        let reach = reach + EDGE_REACH_PX;
        let count = (2.0 * reach) as usize * SAMPLES_PER_PX + 1;
        let light = (0..count)
            .map(|i| side.mean_light(photo, along, i as f64 / SAMPLES_PER_PX as f64 - reach));
        Self {
            light: light.collect(),
            reach,
        }
    }

    /// Where light changes most among its neighbours, pixels across, and by which share of it.
    ///
    /// The change itself says where: its share of the light is largest beside the edge, in the dark.
    fn peaks(&self) -> impl Iterator<Item = (f64, f64)> {
        let half = half_edge();
        let changes: Vec<f64> = (half..self.light.len().saturating_sub(half))
            .map(|i| self.change(i))
            .collect();
        (0..changes.len()).filter_map(move |k| {
            let near = &changes[neighbours(k, changes.len())];
            let contrast = self.contrast(k + half);
            let is_peak = contrast > MIN_CONTRAST && near.iter().all(|c| *c <= changes[k]);
            is_peak.then(|| (self.center(k + half), contrast))
        })
    }

    /// By how much light changes around a sample.
    fn change(&self, i: usize) -> f64 {
        (self.light[i + half_edge()] - self.light[i - half_edge()]).abs()
    }

    /// By which share of it light changes around a sample.
    fn contrast(&self, i: usize) -> f64 {
        let brighter = self.light[i + half_edge()].max(self.light[i - half_edge()]);
        self.change(i) / (brighter + DARKNESS)
    }

    /// The centre of gravity of the change around a sample, pixels across.
    fn center(&self, i: usize) -> f64 {
        let steps = i - half_edge()..i + half_edge();
        let (rise, moment) = steps.fold((0.0, 0.0), |(rise, moment), k| {
            let step = self.light[k + 1] - self.light[k];
            (rise + step, moment + step * (k as f64 + 0.5))
        });
        moment / rise / SAMPLES_PER_PX as f64 - self.reach
    }
}

/// Samples in half the way over which light changes at an edge.
fn half_edge() -> usize {
    (EDGE_REACH_PX * SAMPLES_PER_PX as f64) as usize
}

fn neighbours(k: usize, count: usize) -> Range<usize> {
    k.saturating_sub(SAMPLES_PER_PX)..(k + SAMPLES_PER_PX + 1).min(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter;

    /// A bright quadrangle in the dark, slightly blurred, with a darker rim outside of it.
    fn picture(corners: [[f64; 2]; 4], rim_px: f64) -> Image<LinearRgb> {
        let corners = corners.map(Point2::from);
        let inside_by = |p: Point2<f64>| {
            let sides = (0..4).map(|i| {
                let along = corners[(i + 1) % 4] - corners[i];
                along.perp(&(p - corners[i])) / along.norm()
            });
            sides.fold(f64::MAX, f64::min)
        };
        let sharp = Image::from_fn(300, 220, |x, y| {
            let by = inside_by(Point2::new(x as f64 + 0.5, y as f64 + 0.5));
            let cover = |at: f64| (by + at + 0.5).clamp(0.0, 1.0) as f32;
            LinearRgb::grey(0.05 + 0.1 * cover(rim_px) + 0.4 * cover(0.0))
        });
        filter::gaussian_blur(&sharp, 0.8)
    }

    const TRUTH: [[f64; 2]; 4] = [[60.3, 40.2], [240.7, 52.6], [228.4, 180.1], [48.9, 171.7]];
    const CLICKED: [[f64; 2]; 4] = [[62.0, 37.5], [243.0, 54.0], [226.0, 183.0], [47.0, 170.0]];

    fn farthest(found: &SnappedCorners) -> f64 {
        let off = (0..4).map(|i| {
            let [x, y] = found.corners_px[i];
            libm::hypot(x - TRUTH[i][0], y - TRUTH[i][1])
        });
        off.fold(0.0, f64::max)
    }

    #[test]
    fn clicked_corners_move_to_a_tenth_of_a_pixel() {
        for rim_px in [0.0, 14.0] {
            let found = snap_corners(&picture(TRUTH, rim_px), CLICKED);
            assert_eq!(found.found, [true; 4]);
            assert!(farthest(&found) < 0.15, "{found:?}");
        }
    }

    #[test]
    fn where_nothing_is_corners_stay() {
        let found = snap_corners(&Image::filled(300, 220, LinearRgb::grey(0.2)), CLICKED);
        assert_eq!((found.corners_px, found.found), (CLICKED, [false; 4]));
    }
}
