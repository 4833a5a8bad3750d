//! Planes that exist a few rows at a time.
//!
//! Every stage of the keyer turns one plane of matte values into another. A stage that kept whole
//! planes would send a 4K frame through main memory again and again; instead each stage is asked
//! for one row, asks the stage before it for the rows that this takes, and keeps those that the
//! next row needs again. A frame then passes through main memory once.
//!
//! For this the functions of rows are longer than elsewhere: they borrow the buffers of their stage
//! all at once, and loops that a compiler is to make vectors of stand in one piece.

use std::ops::Range;

/// A plane of single values, computed row by row on demand, from the top down.
pub(super) trait Rows {
    /// Writes row `y`.
    fn row(&mut self, y: usize, out: &mut [f32]);
}

/// A stage's source: whatever is left of it in the chain.
pub(super) type Source<'a> = Box<dyn Rows + 'a>;

impl Rows for Source<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        (**self).row(y, out);
    }
}

/// The last few rows of a plane.
pub(super) struct RowWindow {
    row_len: usize,
    capacity: usize,
    next: usize,
    values: Vec<f32>,
}

impl RowWindow {
    /// Room for `capacity` rows of `row_len` values.
    pub(super) fn new(row_len: usize, capacity: usize) -> Self {
        Self {
            row_len,
            capacity,
            next: 0,
            values: vec![0.0; row_len * capacity],
        }
    }

    /// Makes the rows of a range present; those that are missing are made, the oldest forgotten.
    ///
    /// Ranges must not move up, nor be longer than the capacity.
    pub(super) fn cover_rows(
        &mut self,
        range: Range<usize>,
        mut make: impl FnMut(usize, &mut [f32]),
    ) {
        debug_assert!(range.len() <= self.capacity);
        self.next = self.next.max(range.start);
        while self.next < range.end {
            make(self.next, self.row_mut(self.next));
            self.next += 1;
        }
    }

    /// Whether a row is present, if it is no older than the window reaches.
    pub(super) fn has_row(&self, y: usize) -> bool {
        y < self.next
    }

    /// A row that is present, to be written.
    pub(super) fn row_mut(&mut self, y: usize) -> &mut [f32] {
        let slot = self.slot(y);
        &mut self.values[slot]
    }

    /// A row that is present.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values[self.slot(y)]
    }

    #[inline(always)]
    fn slot(&self, y: usize) -> Range<usize> {
        let start = y % self.capacity * self.row_len;
        start..start + self.row_len
    }
}

/// The rows within `radius` of `y` in a picture of `height` rows.
pub(super) fn rows_around(y: usize, radius: usize, height: usize) -> Range<usize> {
    y.saturating_sub(radius)..y.saturating_add(radius).saturating_add(1).min(height)
}

/// The rows that a window of that radius looks at, from the top: cut off at the border, or
/// repeating it.
pub(super) fn looked_at(
    y: usize,
    radius: usize,
    height: usize,
    repeat: bool,
) -> impl DoubleEndedIterator<Item = usize> {
    let (y, radius, last) = (y as isize, radius as isize, height as isize - 1);
    let (first, end) = (y - radius, y + radius);
    let rows = if repeat {
        first..=end
    } else {
        first.max(0)..=end.min(last)
    };
    rows.map(move |row| row.clamp(0, last) as usize)
}

/// Rows a window must hold for that radius.
pub(super) fn window_rows(radius: usize, height: usize) -> usize {
    radius
        .saturating_mul(2)
        .saturating_add(1)
        .min(height)
        .max(1)
}

/// What stands beside a row where a window reaches over the picture's border.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pad {
    /// The border pixel, again and again.
    Repeat,
    /// One value.
    Value(f32),
}

impl Pad {
    /// The border repeated, or else a value.
    pub(super) fn repeat_or(repeat: bool, value: f32) -> Self {
        if repeat {
            Self::Repeat
        } else {
            Self::Value(value)
        }
    }

    /// Fills both margins of a padded row whose middle is there.
    pub(super) fn fill_margins(self, padded: &mut [f32], margin: usize) {
        let len = padded.len();
        let (left, right) = match self {
            Self::Repeat => (padded[margin], padded[len - margin - 1]),
            Self::Value(v) => (v, v),
        };
        padded[..margin].fill(left);
        padded[len - margin..].fill(right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_makes_each_row_once() {
        let mut made = Vec::new();
        let mut window = RowWindow::new(2, 3);
        for y in 0..6 {
            window.cover_rows(rows_around(y, 1, 6), |y, row| {
                made.push(y);
                row.fill(y as f32);
            });
            for near in rows_around(y, 1, 6) {
                assert_eq!(window.row(near), [near as f32; 2]);
            }
        }
        assert_eq!(made, [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn a_window_that_starts_below_the_top_makes_nothing_above() {
        let mut window = RowWindow::new(1, 3);
        window.cover_rows(rows_around(10, 1, 20), |y, row| row[0] = y as f32);
        assert_eq!(window.row(9), [9.0]);
        assert_eq!(window.next, 12);
    }

    #[test]
    fn a_window_is_cut_off_or_repeats_the_border() {
        assert_eq!(looked_at(0, 2, 2, false).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(
            looked_at(0, 2, 2, true).collect::<Vec<_>>(),
            [0, 0, 0, 1, 1]
        );
    }

    #[test]
    fn margins_repeat_or_hold_a_value() {
        let mut row = [0.0, 0.0, 1.0, 2.0, 0.0, 0.0];
        Pad::Repeat.fill_margins(&mut row, 2);
        assert_eq!(row, [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        Pad::Value(9.0).fill_margins(&mut row, 2);
        assert_eq!(row, [9.0, 9.0, 1.0, 2.0, 9.0, 9.0]);
    }
}
