//! Light of a panorama summed over rectangles, and the panorama cut into few of them.

use super::equirectangular::{sample, uv_to_direction};
use crate::geom::Vector3;
use crate::image::Image;
use crate::pixel::LinearRgb;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Columns and rows that light is summed in: 1.4 degrees. What is smaller, as a sun, keeps its
/// exact direction.
const GRID_CELLS: [usize; 2] = [256, 128];

/// Most pieces that a panorama is cut into.
const MAX_PIECES: usize = 1024;

/// Share of a piece's light that counts wherever it comes from: upright receivers see the sides and
/// the ground too.
const ANY_DIRECTION_SHARE: f64 = 0.25;

/// Parts along either side of a piece that tell which of its light is over a horizon.
const PARTS_PER_SIDE: usize = 8;

/// Light of a part of the sky.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Radiance times direction, integrated over solid angle; red, green, blue.
    pub flux: [Vector3<f64>; 3],
    /// Luminance, integrated over solid angle.
    pub light: f64,
    /// The same, weighted by what a level receiver makes of it.
    weight: f64,
}

/// A rectangle of a panorama and its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// First and last but one column and row of the grid.
    columns: [usize; 2],
    rows: [usize; 2],
    /// Its light.
    pub moments: Moments,
}

impl Moments {
    /// Unit vector to the middle of the light; none where there is no light, or as much from
    /// everywhere.
    pub fn direction(&self) -> Option<Vector3<f64>> {
        self.luminous()
            .try_normalize(1e-9 * self.light)
            .filter(|_| self.light > 0.0)
    }

    /// Irradiance on a receiver that sees all of it; 0 in channels that come from behind on
    /// balance.
    pub fn irradiance(&self, normal: &Vector3<f64>) -> [f64; 3] {
        self.flux.map(|flux| flux.dot(normal).max(0.0))
    }

    /// Side of the square of even light that is spread as widely, radians.
    ///
    /// # Method
    /// Light of angular variance s^2 (sum of both axes) has a mean direction of length `1 - s^2 /
    /// 2`; a square of side b has `s^2 = b^2 / 6`.
    pub fn width(&self) -> f64 {
        let length = if self.light > 0.0 {
            self.luminous().norm() / self.light
        } else {
            1.0
        };
        (12.0 * (1.0 - length).max(0.0)).sqrt()
    }

    fn luminous(&self) -> Vector3<f64> {
        self.flux[0] * 0.2126 + self.flux[1] * 0.7152 + self.flux[2] * 0.0722
    }

    fn plus(&self, o: &Self, sign: f64) -> Self {
        Self {
            flux: std::array::from_fn(|c| self.flux[c] + o.flux[c] * sign),
            light: self.light + sign * o.light,
            weight: self.weight + sign * o.weight,
        }
    }

    fn from_radiance(radiance: LinearRgb, direction: &Vector3<f64>, solid_angle: f64) -> Self {
        let flux = <[f32; 3]>::from(radiance).map(|v| direction * (f64::from(v) * solid_angle));
        let light = f64::from(radiance.luminance()) * solid_angle;
        Self {
            flux,
            light,
            weight: light * (direction.z.max(0.0) + ANY_DIRECTION_SHARE),
        }
    }

    /// What a shadow gets wrong that treats all this light as coming from one direction: as an edge
    /// that is off by the width of the light, of the light's strength, squared and summed.
    fn error(&self) -> f64 {
        self.weight * self.weight * self.width()
    }
}

/// A panorama's light, ready to be summed over any rectangle, and its cuts.
#[derive(Debug)]
pub(super) struct LightSums {
    /// Light above and left of each grid corner.
    corners: Vec<Moments>,
    /// Light of each grid cell over the horizon, for exact irradiance: direction-weighted.
    cells: Vec<Moments>,
    /// Pieces in the order they are cut: the first two are the sky and the ground, then pairs.
    pieces: Vec<Piece>,
    /// Which piece each pair is cut from.
    cuts: Vec<usize>,
}

impl LightSums {
    pub(super) fn new(panorama: &Image<LinearRgb>) -> Self {
        let rows: Vec<Vec<Moments>> = (0..GRID_CELLS[1])
            .into_par_iter()
            .map(|j| grid_row(panorama, j))
            .collect();
        let mut sums = Self {
            corners: summed_area_table(&rows),
            cells: coarse_cells(&rows),
            pieces: Vec::new(),
            cuts: Vec::new(),
        };
        sums.cut();
        sums
    }

    fn piece(&self, columns: [usize; 2], rows: [usize; 2]) -> Piece {
        let [x0, x1] = columns;
        let [y0, y1] = rows;
        let moments = self
            .corner(x1, y1)
            .plus(self.corner(x0, y1), -1.0)
            .plus(self.corner(x1, y0), -1.0)
            .plus(self.corner(x0, y0), 1.0);
        Piece {
            columns,
            rows,
            moments,
        }
    }

    fn corner(&self, i: usize, j: usize) -> &Moments {
        &self.corners[j * (GRID_CELLS[0] + 1) + i]
    }

    /// Cuts the piece with the largest error where that leaves the least, again and again.
    fn cut(&mut self) {
        let half = GRID_CELLS[1] / 2;
        self.pieces = [[0, half], [half, GRID_CELLS[1]]]
            .map(|rows| self.piece([0, GRID_CELLS[0]], rows))
            .to_vec();
        let mut open = vec![true; 2];
        while self.cuts.len() + 2 < MAX_PIECES && self.cut_worst(&mut open) {}
    }

    /// Cuts the worst of the open pieces, if it has more than one cell; it is open no more. Returns
    /// whether there was one.
    fn cut_worst(&mut self, open: &mut Vec<bool>) -> bool {
        let Some(worst) = self.worst_piece(open) else {
            return false;
        };
        open[worst] = false;
        if let Some(halves) = self.halves(&self.pieces[worst]) {
            self.cuts.push(worst);
            self.pieces.extend(halves);
            open.extend([true; 2]);
        }
        true
    }

    /// The first of the open pieces with the largest error; none where there is no error.
    fn worst_piece(&self, open: &[bool]) -> Option<usize> {
        (0..self.pieces.len())
            .filter(|&k| open[k])
            .max_by(|&a, &b| self.error(a).total_cmp(&self.error(b)).then(b.cmp(&a)))
            .filter(|&k| self.error(k) > 0.0)
    }

    fn error(&self, piece: usize) -> f64 {
        self.pieces[piece].moments.error()
    }

    /// The cut across either axis that leaves the least error; none for a single cell.
    fn halves(&self, piece: &Piece) -> Option<[Piece; 2]> {
        let ([x0, x1], [y0, y1]) = (piece.columns, piece.rows);
        let across = (x0 + 1..x1).map(|x| [[x0, x], [x, x1]].map(|c| self.piece(c, piece.rows)));
        let along = (y0 + 1..y1).map(|y| [[y0, y], [y, y1]].map(|r| self.piece(piece.columns, r)));
        across
            .chain(along)
            .min_by(|a, b| total_error(a).total_cmp(&total_error(b)))
    }

    /// At most `count` pieces, together the whole panorama.
    pub(super) fn pieces(&self, count: usize) -> Vec<Piece> {
        let cuts = &self.cuts[..self.cuts.len().min(count.saturating_sub(2))];
        let mut whole = vec![true; 2 + 2 * cuts.len()];
        cuts.iter().for_each(|&k| whole[k] = false);
        self.pieces
            .iter()
            .zip(whole)
            .filter_map(|(piece, whole)| whole.then_some(*piece))
            .collect()
    }

    /// The panorama in even rectangles, `per_side` rows of twice as many.
    pub(super) fn even(&self, per_side: usize) -> Vec<Piece> {
        let rows = per_side.clamp(1, GRID_CELLS[1]);
        let [all_columns, all_rows] = GRID_CELLS.map(|cells| [0, cells]);
        self.parts(
            even_spans(all_columns, 2 * rows),
            even_spans(all_rows, rows),
        )
        .collect()
    }

    /// The light of the parts of a piece that are over a receiver's horizon.
    pub(super) fn light_above(&self, piece: &Piece, normal: &Vector3<f64>) -> Moments {
        let [columns, rows] = [piece.columns, piece.rows]
            .map(|cells| even_spans(cells, PARTS_PER_SIDE.min(cells[1] - cells[0])));
        self.parts(columns, rows)
            .map(|part| part.moments)
            .filter(|light| light.luminous().dot(normal) > 0.0)
            .fold(Moments::default(), |sum, light| sum.plus(&light, 1.0))
    }

    /// The rectangles of some columns and rows, row by row.
    fn parts(
        &self,
        columns: impl Iterator<Item = [usize; 2]> + Clone,
        rows: impl Iterator<Item = [usize; 2]>,
    ) -> impl Iterator<Item = Piece> {
        rows.flat_map(move |row| columns.clone().map(move |column| self.piece(column, row)))
    }

    /// Irradiance on a receiver, nothing in the way.
    pub(super) fn irradiance(&self, normal: &Vector3<f64>) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for cell in &self.cells {
            let e = cell.irradiance(normal);
            (0..3).for_each(|c| sum[c] += e[c]);
        }
        sum
    }
}

/// `count` even parts of some cells.
fn even_spans([start, end]: [usize; 2], count: usize) -> impl Iterator<Item = [usize; 2]> + Clone {
    let cells = end - start;
    (0..count).map(move |k| [k, k + 1].map(|k| start + k * cells / count))
}

fn total_error(halves: &[Piece; 2]) -> f64 {
    halves.iter().map(|p| p.moments.error()).sum()
}

/// Light above and left of each grid corner.
fn summed_area_table(rows: &[Vec<Moments>]) -> Vec<Moments> {
    let stride = GRID_CELLS[0] + 1;
    let mut corners = vec![Moments::default(); stride * (GRID_CELLS[1] + 1)];
    for (j, row) in rows.iter().enumerate() {
        let mut sum = Moments::default();
        for (i, cell) in row.iter().enumerate() {
            sum = sum.plus(cell, 1.0);
            corners[(j + 1) * stride + i + 1] = corners[j * stride + i + 1].plus(&sum, 1.0);
        }
    }
    corners
}

/// Cells of a row of the grid, each the sum over places inside that are denser than the panorama's
/// texels.
fn grid_row(panorama: &Image<LinearRgb>, j: usize) -> Vec<Moments> {
    let (width, height) = panorama.size();
    let across = 2 * width.div_ceil(GRID_CELLS[0]);
    let down = 2 * height.div_ceil(GRID_CELLS[1]);
    let mut cells = vec![Moments::default(); GRID_CELLS[0]];
    for t in 0..down {
        let [top, v, bottom] = [0.0, 0.5, 1.0].map(|part| grid_v(j, t as f64 + part, down));
        let solid_angle = line_solid_angle([top, bottom], GRID_CELLS[0] * across);
        add_line(panorama, v, solid_angle, across, &mut cells);
    }
    cells
}

/// The solid angle of one of `places` places along a line.
fn line_solid_angle([top, bottom]: [f64; 2], places: usize) -> f64 {
    let band = libm::cos(PI * top) - libm::cos(PI * bottom);
    band * TAU / places as f64
}

/// How far down the panorama line `t` of a row of the grid lies, 0 to 1.
fn grid_v(j: usize, t: f64, lines: usize) -> f64 {
    (j as f64 + t / lines as f64) / GRID_CELLS[1] as f64
}

/// Adds places along a line to the cells that they are in, `per_cell` to each.
fn add_line(
    panorama: &Image<LinearRgb>,
    v: f64,
    solid_angle: f64,
    per_cell: usize,
    cells: &mut [Moments],
) {
    for (i, cell) in cells.iter_mut().enumerate() {
        for s in 0..per_cell {
            let u = (i as f64 + (s as f64 + 0.5) / per_cell as f64) / GRID_CELLS[0] as f64;
            *cell = cell.plus(&sample_light(panorama, [u, v], solid_angle), 1.0);
        }
    }
}

#[inline]
fn sample_light(panorama: &Image<LinearRgb>, uv: [f64; 2], solid_angle: f64) -> Moments {
    Moments::from_radiance(sample(panorama, uv), &uv_to_direction(uv), solid_angle)
}

/// Grid cells a side that a coarse cell sums: 5.6 degrees are fine enough for the horizon that cuts
/// them.
const COARSE_CELL_SIDE: usize = 4;

fn coarse_cells(rows: &[Vec<Moments>]) -> Vec<Moments> {
    let [width, height] = GRID_CELLS.map(|cells| cells / COARSE_CELL_SIDE);
    let mut cells = vec![Moments::default(); width * height];
    for (j, row) in rows.iter().enumerate() {
        for (i, cell) in row.iter().enumerate() {
            let sum = &mut cells[(j / COARSE_CELL_SIDE) * width + i / COARSE_CELL_SIDE];
            *sum = sum.plus(cell, 1.0);
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::super::Panorama;
    use super::*;

    fn constant() -> Panorama {
        Panorama::new(Image::filled(64, 32, LinearRgb::new(1.0, 2.0, 0.5))).unwrap()
    }

    /// A dark sky with a sun of one texel (0.35 degrees) and 500000 times its radiance.
    fn sunny() -> Panorama {
        Panorama::new(Image::from_fn(1024, 512, |x, y| {
            LinearRgb::grey(if (x, y) == (300, 131) { 500_000.0 } else { 1.0 })
        }))
        .unwrap()
    }

    fn sum(pieces: &[Piece]) -> f64 {
        pieces.iter().map(|p| p.moments.light).sum()
    }

    #[test]
    fn an_even_sky_gives_pi_times_its_radiance() {
        for normal in [Vector3::z(), Vector3::new(0.48, -0.64, 0.6), -Vector3::x()] {
            let e = constant().irradiance(&normal);
            assert!(
                (e[0] / PI - 1.0).abs() < 2e-3 && (e[1] / e[0] - 2.0).abs() < 1e-9,
                "{normal:?}: {e:?}"
            );
        }
    }

    #[test]
    fn pieces_are_the_whole_sky_however_many() {
        for panorama in [constant(), sunny()] {
            let whole = sum(&panorama.pieces(2));
            for count in [2, 3, 16, 100, 5000] {
                let pieces = panorama.pieces(count);
                assert!(
                    pieces.len() <= count && (sum(&pieces) / whole - 1.0).abs() < 1e-9,
                    "{count}"
                );
            }
            assert!((sum(&panorama.even(20)) / whole - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_sun_is_a_piece_of_its_own_and_keeps_its_direction() {
        let panorama = sunny();
        let sun = uv_to_direction([300.5 / 1024.0, 131.5 / 512.0]);
        let pieces = panorama.pieces(16);
        let brightest = pieces
            .iter()
            .max_by(|a, b| a.moments.light.total_cmp(&b.moments.light))
            .unwrap();
        let off = brightest
            .moments
            .direction()
            .unwrap()
            .angle(&sun)
            .to_degrees();
        assert!(
            off < 0.1 && brightest.moments.width() < 0.05,
            "{off} degrees off, {brightest:?}"
        );
    }

    #[test]
    fn more_pieces_are_smaller() {
        let panorama = constant();
        let widest = |count| {
            panorama
                .pieces(count)
                .iter()
                .map(|p| p.moments.width())
                .fold(0.0, f64::max)
        };
        assert!(widest(16) > widest(64) && widest(64) > widest(256));
    }

    #[test]
    fn darkness_has_pieces_without_direction() {
        let dark = Panorama::new(Image::filled(4, 2, LinearRgb::BLACK)).unwrap();
        assert!(
            dark.pieces(16)
                .iter()
                .all(|p| p.moments.direction().is_none())
        );
        assert_eq!(dark.irradiance(&Vector3::z()), [0.0; 3]);
    }
}
