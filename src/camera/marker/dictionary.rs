//! The dictionary: which cells of each marker are white.

use crate::camera::rectangle::square_from_corners;
use crate::filter::sample_nearest;
use crate::geom::{Homography, Point2};
use crate::image::Image;

/// Cells per side of the pattern, and of the marker with its black border.
const PATTERN_CELLS: usize = 4;
const MARKER_CELLS: usize = PATTERN_CELLS + 2;
/// Wrong bits that are corrected: the least distance between two markers is 4.
const MAX_WRONG_BITS: u32 = 1;
/// White has to be this many times brighter than black.
const MIN_CONTRAST: f32 = 1.6;

/// From here on a white cell counts as too bright for the sensor, scene-linear.
const OVEREXPOSED_LIGHT: f32 = 0.95;

/// `DICT_4X4_50` of OpenCV 5.0 (`getPredefinedDictionary`, `getBitsFromByteList`): row by row from
/// the top left, the highest bit first, 1 is white.
const DICT_4X4_50: [u16; 50] = [
    0xb532, 0x0f9a, 0x332d, 0x9946, 0x549e, 0x79cd, 0x9e2e, 0xc4f2, 0xfeda, 0xcf56, 0xf991, 0x11a7,
    0x0eb7, 0x2a0f, 0x24b1, 0x263e, 0x4665, 0x6600, 0x6c5e, 0x76af, 0x868b, 0xb02b, 0xccd5, 0xdd82,
    0xfe47, 0x9471, 0xace4, 0xa554, 0x2123, 0x346f, 0x4415, 0x57b2, 0x9ecf, 0xf0cb, 0x08ae, 0x0929,
    0x1875, 0x04ff, 0x0df6, 0x1c5a, 0x1718, 0x2a28, 0x328c, 0x38b2, 0x24e8, 0x2eeb, 0x2d3f, 0x4b64,
    0x502e, 0x5013,
];

/// The cells of a marker with a black border, as read.
pub(super) struct MarkerCells<const CELLS: usize> {
    /// Which of them are white, row by row from the first corner.
    pub(super) white: [[bool; CELLS]; CELLS],
    /// The light of the brightest.
    pub(super) bright: f32,
}

impl<const CELLS: usize> MarkerCells<CELLS> {
    /// White is as bright as the picture's format allows.
    pub(super) fn is_overexposed(&self) -> bool {
        self.bright >= OVEREXPOSED_LIGHT
    }
}

/// The marker between four corners, as read.
pub(super) struct MarkerReading {
    pub(super) id: u32,
    /// How many corners the printed top left is further on.
    pub(super) turns: usize,
    pub(super) cells: MarkerCells<MARKER_CELLS>,
}

/// The marker between four corners (clockwise).
pub(super) fn read(light: &Image<f32>, corners: &[Point2<f64>; 4]) -> Option<MarkerReading> {
    let cells = read_cells(light, corners)?;
    let (id, turns) = lookup(pattern_code(&cells.white))?;
    Some(MarkerReading { id, turns, cells })
}

/// The cells of the marker between four corners (clockwise); none where they are of one
/// light or its border is not black.
pub(super) fn read_cells<const CELLS: usize>(
    light: &Image<f32>,
    corners: &[Point2<f64>; 4],
) -> Option<MarkerCells<CELLS>> {
    let cells: [[f32; CELLS]; CELLS] = cell_means(light, corners)?;
    let (dark, bright) = extremes(cells.as_flattened());
    let middle = (dark + bright) / 2.0;
    let white = cells.map(|line| line.map(|cell| cell > middle));
    let is_clear = bright >= MIN_CONTRAST * dark && has_black_border(&white);
    is_clear.then_some(MarkerCells { white, bright })
}

fn extremes(light: &[f32]) -> (f32, f32) {
    (
        light.iter().copied().fold(f32::MAX, f32::min),
        light.iter().copied().fold(0.0, f32::max),
    )
}

/// The light of each cell between four corners; none where the photo does not show one.
fn cell_means<const CELLS: usize>(
    light: &Image<f32>,
    corners: &[Point2<f64>; 4],
) -> Option<[[f32; CELLS]; CELLS]> {
    let photo_from_square = square_from_corners(corners);
    let mut cells = [[0.0; CELLS]; CELLS];
    for (row, line) in cells.iter_mut().enumerate() {
        for (column, cell) in line.iter_mut().enumerate() {
            *cell = cell_mean::<CELLS>(light, &photo_from_square, [column, row])?;
        }
    }
    Some(cells)
}

fn has_black_border<const CELLS: usize>(white: &[[bool; CELLS]; CELLS]) -> bool {
    let last = CELLS - 1;
    let is_white = |i: usize| white[0][i] || white[last][i] || white[i][0] || white[i][last];
    !(0..CELLS).any(is_white)
}

/// The bits of the pattern inside the border.
fn pattern_code(white: &[[bool; MARKER_CELLS]; MARKER_CELLS]) -> u16 {
    let inside = 1..MARKER_CELLS - 1;
    let lines = white[inside.clone()].iter();
    let bits = lines.flat_map(|line| &line[inside.clone()]);
    bits.fold(0, |code, &white| (code << 1) | u16::from(white))
}

/// The mean of nine samples inside a cell (column and row).
fn cell_mean<const CELLS: usize>(
    light: &Image<f32>,
    photo_from_square: &Homography,
    cell: [usize; 2],
) -> Option<f32> {
    let mut sum = 0.0;
    for i in 0..9 {
        let at = photo_from_square.map(sample_position::<CELLS>(cell, [i % 3, i / 3]));
        sum += sample_nearest(light, at.x, at.y)?;
    }
    Some(sum / 9.0)
}

/// Where in the unit square a cell's sample (column and row, of three each) is.
fn sample_position<const CELLS: usize>(cell: [usize; 2], sample: [usize; 2]) -> Point2<f64> {
    [0, 1]
        .map(|axis| (cell[axis] as f64 + 0.3 + 0.2 * sample[axis] as f64) / CELLS as f64)
        .into()
}

/// Number of a marker, and by how many quarters its pattern was turned.
fn lookup(code: u16) -> Option<(u32, usize)> {
    let codes = std::iter::successors(Some(code), |&code| Some(turned(code)));
    codes.take(4).enumerate().find_map(|(turns, code)| {
        let mut known = DICT_4X4_50.iter();
        let id = known.position(|&known| (known ^ code).count_ones() <= MAX_WRONG_BITS)?;
        Some((id as u32, turns))
    })
}

/// The pattern turned by a quarter anticlockwise: as read from the next corner clockwise.
fn turned(code: u16) -> u16 {
    let mut turned = 0;
    for row in 0..PATTERN_CELLS {
        for column in 0..PATTERN_CELLS {
            let bit = PATTERN_CELLS * column + PATTERN_CELLS - 1 - row;
            turned = turned << 1 | code >> (15 - bit) & 1;
        }
    }
    turned
}

/// A cell of the printed sheet (marker and a white margin of one cell) is white.
#[cfg(test)]
pub(super) fn is_white(id: u32, column: usize, row: usize) -> bool {
    let inner = |i: usize| (2..2 + PATTERN_CELLS).contains(&i);
    let margin = |i: usize| i == 0 || i == MARKER_CELLS + 1;
    let bit =
        || DICT_4X4_50[id as usize] >> (15 - (PATTERN_CELLS * (row - 2) + column - 2)) & 1 == 1;
    margin(column) || margin(row) || (inner(column) && inner(row) && bit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_quarter_turns_are_none() {
        assert_eq!((0..4).fold(0xb532, |code, _| turned(code)), 0xb532);
        assert_ne!(turned(0xb532), 0xb532);
    }

    #[test]
    fn markers_differ_in_at_least_four_bits_from_others_and_themselves_in_every_rotation() {
        for (i, &a) in DICT_4X4_50.iter().enumerate() {
            for (j, &b) in DICT_4X4_50.iter().enumerate().skip(i) {
                let mut b = b;
                for turns in 0..4 {
                    let is_itself = i == j && turns == 0;
                    assert!(is_itself || (a ^ b).count_ones() >= 4, "{a:x} {b:x}");
                    b = turned(b);
                }
            }
        }
    }
}
