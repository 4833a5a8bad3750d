//! The dictionary: which cells of each marker are white.

use crate::camera::rectangle::square_from_corners;
use crate::filter::sample_nearest;
use crate::geom::Point2;
use crate::image::Image;

/// Cells per side of the pattern, and of the marker with its black border.
const PATTERN: usize = 4;
pub(super) const CELLS: usize = PATTERN + 2;
/// Wrong bits that are forgiven: the least distance between two markers is 4.
const FORGIVEN: u32 = 1;
/// White has to be this many times brighter than black.
const CONTRAST: f32 = 1.6;

/// From here on a white cell counts as too bright for the sensor, scene-linear.
const OVEREXPOSED: f32 = 0.95;

/// `DICT_4X4_50` of OpenCV 5.0 (`getPredefinedDictionary`, `getBitsFromByteList`): row by row from the top left, the
/// highest bit first, 1 is white.
const DICT_4X4_50: [u16; 50] = [
    0xb532, 0x0f9a, 0x332d, 0x9946, 0x549e, 0x79cd, 0x9e2e, 0xc4f2, 0xfeda, 0xcf56, 0xf991, 0x11a7,
    0x0eb7, 0x2a0f, 0x24b1, 0x263e, 0x4665, 0x6600, 0x6c5e, 0x76af, 0x868b, 0xb02b, 0xccd5, 0xdd82,
    0xfe47, 0x9471, 0xace4, 0xa554, 0x2123, 0x346f, 0x4415, 0x57b2, 0x9ecf, 0xf0cb, 0x08ae, 0x0929,
    0x1875, 0x04ff, 0x0df6, 0x1c5a, 0x1718, 0x2a28, 0x328c, 0x38b2, 0x24e8, 0x2eeb, 0x2d3f, 0x4b64,
    0x502e, 0x5013,
];

/// A cell of the printed sheet (marker and a white margin of one cell) is white.
#[cfg(test)]
pub(super) fn is_white(id: u32, column: usize, row: usize) -> bool {
    let inner = |i: usize| (2..2 + PATTERN).contains(&i);
    let margin = |i: usize| i == 0 || i == CELLS + 1;
    let bit = || DICT_4X4_50[id as usize] >> (15 - (PATTERN * (row - 2) + column - 2)) & 1 == 1;
    margin(column) || margin(row) || (inner(column) && inner(row) && bit())
}

/// What stands between four corners.
pub(super) struct Reading {
    pub(super) id: u32,
    /// How many corners the printed top left is further on.
    pub(super) turns: usize,
    /// Which cells are white, row by row from the first corner.
    pub(super) white: [[bool; CELLS]; CELLS],
    /// White is as bright as the picture's format can say.
    pub(super) is_overexposed: bool,
}

/// The marker between four corners (clockwise).
pub(super) fn read(light: &Image<f32>, corners: &[Point2<f64>; 4]) -> Option<Reading> {
    let photo_from_square = square_from_corners(corners);
    let mut cells = [[0.0; CELLS]; CELLS];
    for (row, line) in cells.iter_mut().enumerate() {
        for (column, cell) in line.iter_mut().enumerate() {
            *cell = cell_mean(
                light,
                |u, v| photo_from_square.map(Point2::new(u, v)),
                column,
                row,
            )?;
        }
    }
    let all = cells.as_flattened();
    let (dark, bright) = (
        all.iter().copied().fold(f32::MAX, f32::min),
        all.iter().copied().fold(0.0, f32::max),
    );
    let middle = (dark + bright) / 2.0;
    let white = cells.map(|line| line.map(|cell| cell > middle));
    let border = |i: usize| i == 0 || i == CELLS - 1;
    let mut code = 0;
    for (row, line) in white.iter().enumerate() {
        for (column, &white) in line.iter().enumerate() {
            match border(row) || border(column) {
                true if white => return None,
                true => {}
                false => code = (code << 1) | u16::from(white),
            }
        }
    }
    let (id, turns) = if bright < CONTRAST * dark {
        None
    } else {
        lookup(code)
    }?;
    Some(Reading {
        id,
        turns,
        white,
        is_overexposed: bright >= OVEREXPOSED,
    })
}

/// The mean of nine samples inside a cell.
fn cell_mean(
    light: &Image<f32>,
    place: impl Fn(f64, f64) -> Point2<f64>,
    column: usize,
    row: usize,
) -> Option<f32> {
    let mut sum = 0.0;
    for i in 0..9 {
        let inside = |cell: usize, k: usize| (cell as f64 + 0.3 + 0.2 * k as f64) / CELLS as f64;
        let at = place(inside(column, i % 3), inside(row, i / 3));
        sum += sample_nearest(light, at.x, at.y)?;
    }
    Some(sum / 9.0)
}

fn lookup(mut code: u16) -> Option<(u32, usize)> {
    for turns in 0..4 {
        let near = |&known: &u16| (known ^ code).count_ones() <= FORGIVEN;
        if let Some(id) = DICT_4X4_50.iter().position(near) {
            return Some((id as u32, turns));
        }
        code = turned(code);
    }
    None
}

/// The pattern turned by a quarter anticlockwise: as read from the next corner clockwise.
fn turned(code: u16) -> u16 {
    let bit = |row: usize, column: usize| code >> (15 - (PATTERN * row + column)) & 1;
    let mut turned = 0;
    for row in 0..PATTERN {
        for column in 0..PATTERN {
            turned = turned << 1 | bit(column, PATTERN - 1 - row);
        }
    }
    turned
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
    fn markers_differ_in_at_least_four_bits_in_every_rotation() {
        for (i, &a) in DICT_4X4_50.iter().enumerate() {
            for &b in &DICT_4X4_50[i + 1..] {
                let mut b = b;
                for _ in 0..4 {
                    assert!((a ^ b).count_ones() >= 3, "{i}: {a:x} {b:x}");
                    b = turned(b);
                }
            }
        }
    }
}
