//! Pictures processed some rows at a time, so that large ones never need to be in memory whole.

use crate::image::{Image, Roi};
use std::ops::Range;

/// Pixels per band; wider pictures have bands of [`MIN_BAND_ROWS`].
const BAND_PIXELS: usize = 1 << 18;
/// Minimum rows per band: the extra rows read around it should not outnumber its own.
const MIN_BAND_ROWS: usize = 64;

/// A picture that produces the pixels of some rows on request.
pub trait RowSource<P>: Sync {
    /// Width and height.
    fn size(&self) -> (usize, usize);

    /// The pixels of these rows.
    fn read_rows(&self, rows: Range<usize>) -> Image<P>;
}

impl<P: Copy + Sync> RowSource<P> for Image<P> {
    fn size(&self) -> (usize, usize) {
        Image::size(self)
    }

    fn read_rows(&self, rows: Range<usize>) -> Image<P> {
        self.crop(Roi::spanning(0..self.width(), rows))
    }
}

/// A picture of given size whose rows a function produces.
pub struct RowsFromFn<F> {
    /// Width and height.
    pub size: (usize, usize),
    /// Produces the pixels of some rows.
    pub make: F,
}

impl<P, F: Fn(Range<usize>) -> Image<P> + Sync> RowSource<P> for RowsFromFn<F> {
    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn read_rows(&self, rows: Range<usize>) -> Image<P> {
        (self.make)(rows)
    }
}

/// The rows of a picture, split into bands.
pub(super) fn bands((width, height): (usize, usize)) -> impl Iterator<Item = Range<usize>> {
    let rows = (BAND_PIXELS / width.max(1)).max(MIN_BAND_ROWS);
    (0..height)
        .step_by(rows)
        .map(move |start| start..(start + rows).min(height))
}

/// A band extended by rows above and below it, within the picture.
pub(super) fn grown(band: &Range<usize>, by: usize, height: usize) -> Range<usize> {
    band.start.saturating_sub(by)..(band.end + by).min(height)
}

/// Rows relative to an image that begins at row `first`.
pub(super) fn rows_from(first: usize, rows: &Range<usize>) -> Range<usize> {
    rows.start - first..rows.end - first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_the_picture() {
        for size in [(1, 1), (7, 0), (0, 9), (3000, 5000), (1 << 21, 200)] {
            let all: Vec<usize> = bands(size).flatten().collect();
            assert!(all.into_iter().eq(0..size.1), "{size:?}");
        }
        assert_eq!(grown(&(2..5), 4, 100), 0..9);
        assert_eq!(grown(&(90..95), 9, 100), 81..100);
    }
}
