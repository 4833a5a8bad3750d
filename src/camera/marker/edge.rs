//! Corners of a dark square to a fraction of a pixel: where its fitted sides meet.

use super::dictionary::MarkerCells;
use crate::camera::rectangle::square_from_corners;
use crate::filter::sample_bilinear_clamped;
use crate::geom::{Homography, Line, Point2, Vector2, corners_between};
use crate::image::Image;

/// Stretches along each side, and the part of it near its corners that is not looked at.
const SIDE_PROBES: usize = 32;
const CORNER_PART: f64 = 0.12;
/// Samples per pixel across a side.
const SAMPLES_PER_PX: f64 = 4.0;
/// Shortest and longest way across an edge that is looked at to either side, pixels; the longest
/// grows where edges are out of focus.
const MIN_REACH_PX: f64 = 1.2;
pub(super) const MOST_REACH_PX: f64 = 5.0;
/// Edges whose light rises over more of that way, root mean square, are cut off by it: their centre
/// of gravity is drawn to the middle of the probe. A rise that is even over all of it has 0.58.
const WIDE_EDGE_SHARE: f64 = 0.45;
/// That way for edges inside the pattern, in cells.
const INNER_REACH_CELLS: f64 = 0.45;
/// White that has grown by more, pixels, has another cause; fewer edges than these are not
/// conclusive.
const MAX_GROWTH_PX: f64 = 1.0;
const MIN_EDGES: usize = 6;
/// Times the sides are fitted anew, at most; corners that move by less stay.
const MAX_ROUNDS: usize = 6;
const SETTLED_PX: f64 = 0.01;
/// Standard deviation of corners that still move, in their last steps: those of an edge as wide as
/// its probe shrink by 0.7 from one to the next, and so are off by 2.3 of them at most.
const STEPS_OFF: f64 = 1.0;
/// Noise of a corner of a marker that is seen as sharp as can be, pixels.
const MIN_SIGMA_PX: f64 = 0.03;
/// Errors of the outline over those of the cells' edges, which are measured by fewer pixels: on
/// rendered views of 0 to 59 degrees, sharp and blurred, it is 0.4 to 0.8.
const OUTLINE_ERROR_SHARE: f64 = 0.5;
/// Probes farther than this from the fitted line do not belong to it, pixels.
const MAX_OFF_LINE_PX: f64 = 0.7;

/// What counts as an edge in a photo.
#[derive(Clone, Copy)]
pub(super) struct EdgeSearch<'a> {
    /// The photo's luminance, scene-linear.
    pub(super) light: &'a Image<f32>,
    /// How far a side is looked for to either side of its place, as a share of the square as it is
    /// seen across that side.
    pub(super) reach: f64,
    /// Across an edge light rises by more than this, scene-linear.
    pub(super) min_rise: f64,
    /// How far it is looked for at most, pixels.
    pub(super) most_reach_px: f64,
}

impl EdgeSearch<'_> {
    fn clamped_reach(&self, px: f64) -> f64 {
        px.clamp(MIN_REACH_PX, self.most_reach_px)
    }

    /// Looks twice as far where the marker allows it.
    fn widened(self) -> Self {
        Self {
            most_reach_px: 2.0 * self.most_reach_px,
            ..self
        }
    }
}

/// Corners where the fitted sides of a dark quadrangle meet.
pub(super) struct Outline<'a> {
    pub(super) px: [Point2<f64>; 4],
    /// What they were found with: it looks as far as the edges are wide.
    search: EdgeSearch<'a>,
    /// By how much one of them moved in the end, pixels.
    last_step_px: f64,
}

/// Corners of a dark square, and how well they are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct RefinedCorners {
    pub(super) px: [Point2<f64>; 4],
    /// Standard deviation of a coordinate, pixels.
    pub(super) sigma_px: f64,
}

/// The corners where the fitted sides of a dark quadrangle meet; none where a side shows no edge.
pub(super) fn refined<'a>(search: EdgeSearch<'a>, rough: &[Point2<f64>; 4]) -> Option<Outline<'a>> {
    let mut outline = Outline::fitted(search, rough)?;
    while outline.has_cut_off_edges() {
        match Outline::fitted(outline.search.widened(), &outline.px) {
            Some(wider) => outline = wider,
            None => break,
        }
    }
    Some(outline)
}

impl<'a> Outline<'a> {
    fn fitted(search: EdgeSearch<'a>, rough: &[Point2<f64>; 4]) -> Option<Self> {
        let mut outline = Self {
            px: *rough,
            search,
            last_step_px: f64::INFINITY,
        };
        // From the second time on the probes stand where the sides are.
        for _ in 0..MAX_ROUNDS {
            let before = outline.px;
            outline.px = corners_between(&fitted_sides(&search, &before)?)?;
            outline.last_step_px = longest_step(&before, &outline.px);
            if outline.last_step_px < SETTLED_PX {
                break;
            }
        }
        Some(outline)
    }

    /// Its edges are wider than it is looked for them, and looking farther is possible.
    fn has_cut_off_edges(&self) -> bool {
        let sides = [0, 1, 2, 3].map(|first| QuadSide::new(&self.search, &self.px, first));
        let spread = sides.iter().map(|side| side.spread(&self.search));
        let wide = WIDE_EDGE_SHARE * WIDE_EDGE_SHARE;
        sides.iter().any(QuadSide::is_capped) && spread.sum::<f64>() / 4.0 > wide
    }

    /// Standard deviation of corners that have not settled, pixels.
    fn unsettled_px(&self) -> f64 {
        if self.last_step_px < SETTLED_PX {
            0.0
        } else {
            STEPS_OFF * self.last_step_px
        }
    }
}

fn longest_step(before: &[Point2<f64>; 4], after: &[Point2<f64>; 4]) -> f64 {
    let steps = (0..4).map(|i| (after[i] - before[i]).norm());
    steps.fold(0.0, f64::max)
}

/// The line along each side of a quadrangle; none where a side shows no edge.
fn fitted_sides(search: &EdgeSearch, corners: &[Point2<f64>; 4]) -> Option<[Line; 4]> {
    Some([
        fitted_side(search, corners, 0)?,
        fitted_side(search, corners, 1)?,
        fitted_side(search, corners, 2)?,
        fitted_side(search, corners, 3)?,
    ])
}

/// The corners of a marker, corrected by the edges between its cells.
///
/// In a picture that is too bright for the sensor white has grown over black: a pixel that is half
/// white is as white as one that is all white, and every edge moves into the dark. The cells show
/// by how much: each edge between them that rises along an axis has moved back, each that falls,
/// forward, while the grid they should lie on has shrunk with the outline. Least squares over all
/// edges of the pattern. How far they are off after that is the uncertainty of the outline: blur
/// moves both where cells are narrow. That of an outline that has not settled comes on top.
pub(super) fn by_cells<const CELLS: usize>(
    outline: &Outline,
    cells: &MarkerCells<CELLS>,
) -> Option<RefinedCorners> {
    let corners = &outline.px;
    let edges = EdgeShifts::measure(&outline.search, corners, &cells.white);
    let growth = if cells.is_overexposed() {
        edges.growth()
    } else {
        0.0
    };
    let lines = [0, 1, 2, 3].map(|i| moved_side(corners, i, growth));
    let off = OUTLINE_ERROR_SHARE * edges.rms_px(growth) * mean_square_spread(&lines).sqrt();
    Some(RefinedCorners {
        px: corners_between(&lines)?,
        sigma_px: libm::hypot(libm::hypot(MIN_SIGMA_PX, off), outline.unsettled_px()),
    })
}

/// By how much the corners between four lines are farther off than the lines: lines that meet at an
/// acute angle meet far away when one is off.
fn mean_square_spread(lines: &[Line; 4]) -> f64 {
    let squares = (0..4).map(|i| lines[(i + 3) % 4].normal.perp(&lines[i].normal).powi(-2));
    squares.sum::<f64>() / 4.0
}

/// The line through a side, moved outwards.
fn moved_side(corners: &[Point2<f64>; 4], first: usize, outwards_px: f64) -> Line {
    let normal = outward_normal(corners[first], corners[(first + 1) % 4]);
    Line {
        normal,
        offset: normal.dot(&corners[first].coords) + outwards_px,
    }
}

/// How far the edges between the cells of a marker are from where its corners put them.
struct EdgeShifts {
    /// For each edge by how much a growth of white by a pixel would move it, and by how much it is
    /// moved, both towards where it rises along its axis, pixels.
    moved: Vec<[f64; 2]>,
}

impl EdgeShifts {
    fn measure<const CELLS: usize>(
        search: &EdgeSearch,
        corners: &[Point2<f64>; 4],
        white: &[[bool; CELLS]; CELLS],
    ) -> Self {
        let photo_from_square = square_from_corners(corners);
        Self {
            moved: inner_edges(white)
                .iter()
                .filter_map(|edge| edge.shift(search, &photo_from_square))
                .collect(),
        }
    }

    /// How far white has grown over black, pixels; 0 where too few edges were found.
    fn growth(&self) -> f64 {
        if self.moved.len() < MIN_EDGES {
            return 0.0;
        }
        let sums = self.moved.iter();
        let (xy, xx) = sums.fold((0.0, 0.0), |(xy, xx), [x, y]| (xy + x * y, xx + x * x));
        (xy / xx).clamp(-MAX_GROWTH_PX, MAX_GROWTH_PX)
    }

    /// Root mean square distance of the edges from their places when white has grown so far,
    /// pixels; of too few edges a pixel.
    fn rms_px(&self, growth: f64) -> f64 {
        if self.moved.len() < MIN_EDGES {
            return 1.0;
        }
        let off = self.moved.iter().map(|[x, y]| y - growth * x);
        let squares: f64 = off.map(|off| off * off).sum();
        (squares / self.moved.len() as f64).sqrt()
    }
}

/// An edge between a black and a white cell.
struct InnerEdge<const CELLS: usize> {
    /// It is crossed on the way from the first corner to the fourth, not to the second.
    upright: bool,
    /// The row or column of the two cells.
    across: usize,
    /// The line of the grid it lies on.
    along: usize,
    /// 1 from black to white, -1 from white to black.
    rising: f64,
}

impl<const CELLS: usize> InnerEdge<CELLS> {
    /// The edge between two cells, where one is black and the other white.
    fn between(
        white: &[[bool; CELLS]; CELLS],
        upright: bool,
        across: usize,
        along: usize,
    ) -> Option<Self> {
        let [before, after] = [along - 1, along].map(|i| match upright {
            true => white[i][across],
            false => white[across][i],
        });
        (before != after).then_some(Self {
            upright,
            across,
            along,
            rising: if after { 1.0 } else { -1.0 },
        })
    }

    /// Where the middle of the edge is in the photo, or would be at another line of the grid.
    fn position(&self, photo_from_square: &Homography, along: f64) -> Point2<f64> {
        let cells = CELLS as f64;
        let (along, across) = (along / cells, (self.across as f64 + 0.5) / cells);
        photo_from_square.map(match self.upright {
            true => Point2::new(across, along),
            false => Point2::new(along, across),
        })
    }

    /// By how much a growth of white by a pixel would move the edge, and by how much it is moved;
    /// none where it is not found.
    fn shift(&self, search: &EdgeSearch, photo_from_square: &Homography) -> Option<[f64; 2]> {
        let along = self.along as f64;
        let foot = self.position(photo_from_square, along);
        let step = self.position(photo_from_square, along + 0.5)
            - self.position(photo_from_square, along - 0.5);
        let reach = search.clamped_reach(INNER_REACH_CELLS * step.norm());
        let moved = crossing(search, foot, step.normalize() * self.rising, reach)?;
        let per_growth = 2.0 * along / CELLS as f64 - self.rising - 1.0;
        Some([per_growth, moved * self.rising])
    }
}

fn inner_edges<const CELLS: usize>(white: &[[bool; CELLS]; CELLS]) -> Vec<InnerEdge<CELLS>> {
    let mut edges = Vec::new();
    for upright in [false, true] {
        for across in 1..CELLS - 1 {
            let line =
                (1..CELLS).filter_map(|along| InnerEdge::between(white, upright, across, along));
            edges.extend(line);
        }
    }
    edges
}

/// A side of a dark quadrangle as it is looked for.
struct QuadSide {
    ends: [Point2<f64>; 2],
    outward: Vector2<f64>,
    /// How far it is looked for to either side, pixels.
    reach: f64,
    /// The same if the marker alone decided.
    marker_reach: f64,
}

impl QuadSide {
    /// The side from a corner to the next, dark on its right-hand side (clockwise corners, y down).
    fn new(search: &EdgeSearch, corners: &[Point2<f64>; 4], first: usize) -> Self {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| corners[(first + i) % 4]);
        let outward = outward_normal(a, b);
        // From a steep side a marker is much longer than high, and so are its cells.
        let across = (outward.dot(&(a - d)) + outward.dot(&(b - c))) / 2.0;
        let marker_reach = search.reach * across;
        Self {
            ends: [a, b],
            outward,
            reach: search.clamped_reach(marker_reach),
            marker_reach,
        }
    }

    fn is_capped(&self) -> bool {
        self.reach < self.marker_reach
    }

    /// Where its probes stand.
    fn feet(&self) -> impl Iterator<Item = Point2<f64>> {
        let [a, b] = self.ends;
        (0..SIDE_PROBES).map(move |i| a + (b - a) * probe_part(i))
    }

    /// How light rises along each probe that crosses an edge.
    fn rises(&self, search: &EdgeSearch) -> impl Iterator<Item = Rise> {
        self.feet()
            .map(move |foot| Rise::along(search, foot, self.outward, self.reach))
            .filter(move |rise| rise.edge(search, self.reach).is_some())
    }

    /// Mean square distance of where light rises from the edge, for a reach of 1; 0 where it does
    /// not rise.
    fn spread(&self, search: &EdgeSearch) -> f64 {
        let (mut light, mut square) = (0.0, 0.0);
        for rise in self.rises(search) {
            light += rise.light;
            square += rise.square_from_edge();
        }
        if light > 0.0 {
            square / (light * self.reach * self.reach)
        } else {
            0.0
        }
    }
}

/// The edge near a side.
fn fitted_side(search: &EdgeSearch, corners: &[Point2<f64>; 4], first: usize) -> Option<Line> {
    let side = QuadSide::new(search, corners, first);
    let points = side.feet().filter_map(|foot| {
        Some(foot + side.outward * crossing(search, foot, side.outward, side.reach)?)
    });
    line_through_most(points.collect())
}

/// The unit vector to the left of the way from a corner to the next.
fn outward_normal(from: Point2<f64>, to: Point2<f64>) -> Vector2<f64> {
    let along = to - from;
    Vector2::new(along.y, -along.x).normalize()
}

/// Where a probe stands on its side, 0 to 1.
fn probe_part(i: usize) -> f64 {
    CORNER_PART + (1.0 - 2.0 * CORNER_PART) * (i as f64 + 0.5) / SIDE_PROBES as f64
}

/// The line through the probes of a side, without those that are off it; none where half of them
/// are.
fn line_through_most(mut points: Vec<Point2<f64>>) -> Option<Line> {
    for _ in 0..2 {
        let line = Line::through(&points)?;
        points.retain(|p| line.distance(*p).abs() < MAX_OFF_LINE_PX);
    }
    if points.len() < SIDE_PROBES / 2 {
        None
    } else {
        Line::through(&points)
    }
}

/// Where the light rises along a direction: the centre of gravity of its slope, which blur does not
/// move.
fn crossing(
    search: &EdgeSearch,
    foot: Point2<f64>,
    direction: Vector2<f64>,
    reach: f64,
) -> Option<f64> {
    Rise::along(search, foot, direction, reach).edge(search, reach)
}

/// How light rises along a probe.
#[derive(Default)]
struct Rise {
    /// By how much, scene-linear.
    light: f64,
    /// That times the distance from the probe's middle, and times its square.
    moment: f64,
    square: f64,
}

impl Rise {
    fn along(search: &EdgeSearch, foot: Point2<f64>, direction: Vector2<f64>, reach: f64) -> Self {
        let steps = (2.0 * reach * SAMPLES_PER_PX).ceil() as usize;
        let (mut rise, mut before) = (Self::default(), 0.0);
        for i in 0..=steps {
            let at = foot + direction * along_probe(i as f64, steps, reach);
            let now = f64::from(sample_bilinear_clamped(search.light, at.x, at.y));
            if i > 0 {
                rise.add(now - before, along_probe(i as f64 - 0.5, steps, reach));
            }
            before = now;
        }
        rise
    }

    fn add(&mut self, light: f64, distance: f64) {
        self.light += light;
        self.moment += light * distance;
        self.square += light * distance * distance;
    }

    /// Its centre of gravity; none where it is none of an edge.
    fn edge(&self, search: &EdgeSearch, reach: f64) -> Option<f64> {
        let edge = self.moment / self.light;
        (self.light > search.min_rise && edge.abs() <= reach).then_some(edge)
    }

    /// Light times the square of the distance from its centre of gravity.
    fn square_from_edge(&self) -> f64 {
        self.square - self.moment * self.moment / self.light
    }
}

/// The position of a sample along a probe of `steps` steps, from its middle.
fn along_probe(i: f64, steps: usize, reach: f64) -> f64 {
    -reach + 2.0 * reach * i / steps as f64
}
