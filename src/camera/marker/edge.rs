//! Corners of a dark square to a fraction of a pixel: where its fitted sides meet.

use super::dictionary::CELLS;
use crate::camera::rectangle::square_from_corners;
use crate::geom::{Line, Point2, Vector2};
use crate::image::Image;

/// Stretches along each side, and the part of it near its corners that is not looked at.
const PROBES: usize = 32;
const CORNER_PART: f64 = 0.12;
/// Samples per pixel across a side.
const STEPS_PER_PX: f64 = 4.0;
/// How far across is looked, in cells of the marker as they are seen across that side: its border is one cell wide, and so
/// should be the paper's margin.
const REACH_CELLS: f64 = 0.6;
/// Longest and shortest such reach, pixels.
const REACH_PX: std::ops::RangeInclusive<f64> = 1.2..=5.0;
/// The same for edges inside the pattern.
const INNER_REACH_CELLS: f64 = 0.45;
/// White that has grown by more, pixels, is another fault; fewer edges than these do not tell.
const MOST_GROWTH_PX: f64 = 1.0;
const FEWEST_EDGES: usize = 6;
/// So often the sides are fitted anew at most; corners that move by less stay.
const MOST_ROUNDS: usize = 6;
const SETTLED_PX: f64 = 0.01;
/// Noise of a corner of a marker that is seen as sharp as can be, pixels.
const LEAST_SIGMA_PX: f64 = 0.03;
/// Errors of the outline beside those of the cells' edges, which are told by fewer pixels: on rendered views of 0 to 59
/// degrees, sharp and blurred, it is 0.4 to 0.8.
const SIDE_SHARE: f64 = 0.5;
/// Probes farther than this from the fitted line do not belong to it, pixels.
const OFF_LINE_PX: f64 = 0.7;

/// Corners of a dark square, and how well they are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    pub(super) px: [Point2<f64>; 4],
    /// Standard deviation of a coordinate, pixels.
    pub(super) sigma_px: f64,
}

/// The corners where the fitted sides of a dark quadrangle meet; none where a side shows no edge.
pub(super) fn refined(light: &Image<f32>, rough: &[Point2<f64>; 4]) -> Option<[Point2<f64>; 4]> {
    let mut corners = *rough;
    // From the second time on the probes stand where the sides are.
    for _ in 0..MOST_ROUNDS {
        let mut lines = [Line {
            normal: Vector2::zeros(),
            offset: 0.0,
        }; 4];
        for (i, line) in lines.iter_mut().enumerate() {
            *line = side(light, &corners, i)?;
        }
        let before = corners;
        for i in 0..4 {
            corners[i] = lines[(i + 3) % 4].meeting(&lines[i])?;
        }
        if (0..4).all(|i| (corners[i] - before[i]).norm() < SETTLED_PX) {
            break;
        }
    }
    Some(corners)
}

/// The corners of a marker by what its cells tell of them.
///
/// In a picture that is too bright for the sensor white has grown over black: a pixel that is half white is as white as one
/// that is all white, and every edge moves into the dark. The cells tell by how much: each edge between them that rises
/// along an axis has moved back, each that falls, forward, while the grid they should lie on has shrunk with the outline.
/// Least squares over all edges of the pattern. How far they are off after that is how far the outline can be believed:
/// blur moves both where cells are narrow.
pub(super) fn by_cells(
    light: &Image<f32>,
    corners: &[Point2<f64>; 4],
    white: &[[bool; CELLS]; CELLS],
    is_overexposed: bool,
) -> Option<Corners> {
    let cells = Cells::of(light, corners, white);
    let growth = if is_overexposed { cells.growth() } else { 0.0 };
    let lines = [0, 1, 2, 3].map(|i| {
        let along = corners[(i + 1) % 4] - corners[i];
        let normal = Vector2::new(along.y, -along.x).normalize();
        Line {
            normal,
            offset: normal.dot(&corners[i].coords) + growth,
        }
    });
    let mut px = *corners;
    for i in 0..4 {
        px[i] = lines[(i + 3) % 4].meeting(&lines[i])?;
    }
    let off = cells.off(growth);
    // Lines that meet at an acute angle meet far away when one is off.
    let spread = (0..4)
        .map(|i| lines[(i + 3) % 4].normal.perp(&lines[i].normal).powi(-2))
        .sum::<f64>()
        / 4.0;
    Some(Corners {
        px,
        sigma_px: libm::hypot(LEAST_SIGMA_PX, SIDE_SHARE * off * spread.sqrt()),
    })
}

/// How far the edges between the cells of a marker are from where its corners put them.
struct Cells {
    /// For each edge by how much a growth of white by a pixel would move it, and by how much it is moved, both towards
    /// where it rises along its axis, pixels.
    moved: Vec<[f64; 2]>,
}

impl Cells {
    fn of(light: &Image<f32>, corners: &[Point2<f64>; 4], white: &[[bool; CELLS]; CELLS]) -> Self {
        let photo_from_square = square_from_corners(corners);
        let place = |edge: &InnerEdge, along: f64| {
            let (along, across) = (
                along / CELLS as f64,
                (edge.across as f64 + 0.5) / CELLS as f64,
            );
            photo_from_square.map(if edge.upright {
                Point2::new(across, along)
            } else {
                Point2::new(along, across)
            })
        };
        let moved = |edge: &InnerEdge| {
            let along = edge.along as f64;
            let (foot, step) = (
                place(edge, along),
                place(edge, along + 0.5) - place(edge, along - 0.5),
            );
            let reach = (INNER_REACH_CELLS * step.norm()).clamp(*REACH_PX.start(), *REACH_PX.end());
            let moved = crossing(light, foot, step.normalize() * edge.rising, reach)?;
            Some([
                2.0 * along / CELLS as f64 - edge.rising - 1.0,
                moved * edge.rising,
            ])
        };
        Self {
            moved: inner_edges(white).iter().filter_map(moved).collect(),
        }
    }

    /// How far white has grown over black, pixels; 0 where too few edges tell.
    fn growth(&self) -> f64 {
        let (xy, xx) = self
            .moved
            .iter()
            .fold((0.0, 0.0), |(xy, xx), [x, y]| (xy + x * y, xx + x * x));
        if self.moved.len() < FEWEST_EDGES {
            0.0
        } else {
            (xy / xx).clamp(-MOST_GROWTH_PX, MOST_GROWTH_PX)
        }
    }

    /// Root mean square distance of the edges from their places when white has grown so far, pixels; of too few edges a
    /// pixel.
    fn off(&self, growth: f64) -> f64 {
        let squares = self
            .moved
            .iter()
            .map(|[x, y]| (y - growth * x) * (y - growth * x));
        if self.moved.len() < FEWEST_EDGES {
            1.0
        } else {
            (squares.sum::<f64>() / self.moved.len() as f64).sqrt()
        }
    }
}

/// An edge between a black and a white cell.
struct InnerEdge {
    /// It is crossed on the way from the first corner to the fourth, not to the second.
    upright: bool,
    /// The row or column of the two cells.
    across: usize,
    /// The line of the grid it lies on.
    along: usize,
    /// 1 from black to white, -1 from white to black.
    rising: f64,
}

fn inner_edges(white: &[[bool; CELLS]; CELLS]) -> Vec<InnerEdge> {
    let mut edges = Vec::new();
    for (upright, across, along) in [false, true]
        .into_iter()
        .flat_map(|u| (1..CELLS - 1).flat_map(move |x| (1..CELLS).map(move |a| (u, x, a))))
    {
        let cell = |i: usize| {
            if upright {
                white[i][across]
            } else {
                white[across][i]
            }
        };
        if cell(along - 1) != cell(along) {
            edges.push(InnerEdge {
                upright,
                across,
                along,
                rising: if cell(along) { 1.0 } else { -1.0 },
            });
        }
    }
    edges
}

/// The edge near the side from a corner to the next, dark on its right-hand side (clockwise corners, y down).
fn side(light: &Image<f32>, corners: &[Point2<f64>; 4], first: usize) -> Option<Line> {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| corners[(first + i) % 4]);
    let along = b - a;
    let outward = Vector2::new(along.y, -along.x).normalize();
    // From a steep side a marker is much longer than high, and so are its cells.
    let across = (outward.dot(&(a - d)) + outward.dot(&(b - c))) / 2.0;
    let reach = (REACH_CELLS * across / CELLS as f64).clamp(*REACH_PX.start(), *REACH_PX.end());
    let probe = |i: usize| {
        let part = CORNER_PART + (1.0 - 2.0 * CORNER_PART) * (i as f64 + 0.5) / PROBES as f64;
        let foot = a + along * part;
        Some(foot + outward * crossing(light, foot, outward, reach)?)
    };
    let mut points: Vec<_> = (0..PROBES).filter_map(probe).collect();
    for _ in 0..2 {
        let line = Line::through(&points)?;
        points.retain(|p| line.distance(*p).abs() < OFF_LINE_PX);
    }
    if points.len() < PROBES / 2 {
        None
    } else {
        Line::through(&points)
    }
}

/// Where the light rises along a direction: the centre of gravity of its slope, which blur does not move.
fn crossing(
    light: &Image<f32>,
    foot: Point2<f64>,
    direction: Vector2<f64>,
    reach: f64,
) -> Option<f64> {
    let steps = (2.0 * reach * STEPS_PER_PX).ceil() as usize;
    let place = |i: f64| -reach + 2.0 * reach * i / steps as f64;
    let value = |i: usize| {
        let at = foot + direction * place(i as f64);
        f64::from(bilinear(light, at.x - 0.5, at.y - 0.5))
    };
    let (mut rise, mut moment, mut before) = (0.0, 0.0, value(0));
    for i in 1..=steps {
        let now = value(i);
        rise += now - before;
        moment += (now - before) * place(i as f64 - 0.5);
        before = now;
    }
    let edge = moment / rise;
    (rise > 0.02 && edge.abs() <= reach).then_some(edge)
}

/// The value between pixel centres at integers; outside as the nearest pixel inside.
fn bilinear(light: &Image<f32>, x: f64, y: f64) -> f32 {
    let (i, j) = (x.floor(), y.floor());
    let (u, v) = ((x - i) as f32, (y - j) as f32);
    let at = |di: isize, dj: isize| light.nearest(i as isize + di, j as isize + dj);
    (at(0, 0) * (1.0 - u) + at(1, 0) * u) * (1.0 - v) + (at(0, 1) * (1.0 - u) + at(1, 1) * u) * v
}
