//! Rectangles of pixels, in which a picture is rendered.

use crate::geom::Vector3;
use crate::render::ranges::ranges_meet;
use std::ops::Range;

/// A rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct PixelBlock {
    /// Columns.
    pub(super) x: Range<usize>,
    /// Rows.
    pub(super) y: Range<usize>,
}

impl PixelBlock {
    /// Cuts a picture into square tiles, row by row; those at its ends are smaller.
    pub(super) fn tiles_of(width: usize, height: usize, side: usize) -> Vec<Self> {
        pieces_of(height, side)
            .flat_map(|y| pieces_of(width, side).map(move |x| Self { x, y: y.clone() }))
            .collect()
    }

    /// Whether they have a pixel in common.
    pub(super) fn meets(&self, other: &Self) -> bool {
        ranges_meet(&self.x, &other.x) && ranges_meet(&self.y, &other.y)
    }

    /// Whether all its pixels are also the other's.
    pub(super) fn is_within(&self, other: &Self) -> bool {
        let within = |own: &Range<usize>, other: &Range<usize>| {
            other.start <= own.start && own.end <= other.end
        };
        within(&self.x, &other.x) && within(&self.y, &other.y)
    }

    /// Index of one of its pixels, row by row.
    #[inline(always)]
    pub(super) fn number_of(&self, x: usize, y: usize) -> usize {
        (y - self.y.start) * self.x.len() + x - self.x.start
    }

    /// Number of pixels.
    pub(super) fn len(&self) -> usize {
        self.x.len() * self.y.len()
    }

    /// Centres of the four corner pixels, as `(x, y, 1)`.
    pub(super) fn corners(&self) -> [Vector3<f64>; 4] {
        let [left, right] = outermost_centers(&self.x);
        let [top, bottom] = outermost_centers(&self.y);
        [[left, top], [right, top], [left, bottom], [right, bottom]]
            .map(|[x, y]| Vector3::new(x, y, 1.0))
    }

    /// Its own four corners, at the outer edges of its pixels.
    pub(super) fn ends(&self) -> [[f64; 2]; 4] {
        let [left, right] = [self.x.start, self.x.end].map(|x| x as f64);
        let [top, bottom] = [self.y.start, self.y.end].map(|y| y as f64);
        [[left, top], [right, top], [left, bottom], [right, bottom]]
    }

    /// Its middle.
    pub(super) fn middle(&self) -> [f64; 2] {
        [&self.x, &self.y].map(|side| 0.5 * (side.start + side.end) as f64)
    }

    /// Two halves across the longer side.
    pub(super) fn halves(&self) -> [Self; 2] {
        if self.x.len() >= self.y.len() {
            halves_of(&self.x).map(|x| Self {
                x,
                y: self.y.clone(),
            })
        } else {
            halves_of(&self.y).map(|y| Self {
                x: self.x.clone(),
                y,
            })
        }
    }
}

fn pieces_of(len: usize, side: usize) -> impl Iterator<Item = Range<usize>> {
    (0..len)
        .step_by(side)
        .map(move |start| start..(start + side).min(len))
}

fn outermost_centers(range: &Range<usize>) -> [f64; 2] {
    [range.start as f64 + 0.5, range.end as f64 - 0.5]
}

fn halves_of(range: &Range<usize>) -> [Range<usize>; 2] {
    let middle = range.start + range.len() / 2;
    [range.start..middle, middle..range.end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        let tiles = PixelBlock::tiles_of(37, 17, 32);
        assert_eq!(tiles.iter().map(PixelBlock::len).sum::<usize>(), 37 * 17);
    }
}
