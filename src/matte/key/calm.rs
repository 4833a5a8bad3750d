//! Where a plane is calm: extremes of its values, block by block of a row.
//!
//! Most of a matte is exactly 0 or 1, and a window that sees one value only has nothing to compute.
//! The extremes of every block of a row are noted once, when the row is made; what the many windows
//! over it then ask is cheap. The shortcuts taken on that account give the same bits as the
//! computation that they replace.

use std::ops::Range;

/// Columns of a block: a few vectors wide, narrow enough to fit between the edges of a subject.
const BLOCK_COLUMNS: usize = 64;
/// Columns computed at once where a plane is not calm: what the computation keeps fits the first
/// cache.
pub(super) const RUN_COLUMNS: usize = 512;

/// The least and the greatest value of some part of a plane, in the total order of floats: a NaN is
/// an extreme, so that no comparison with it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extremes {
    pub(super) least: f32,
    pub(super) greatest: f32,
}

/// Extremes of the last few rows of a plane.
#[derive(Default)]
pub(super) struct Calm {
    width: usize,
    capacity: usize,
    count: usize,
    /// For every row the keys of the least and the greatest value of its blocks.
    least: Vec<i32>,
    greatest: Vec<i32>,
    /// The same over some window, for the moment, and what that was before its last step.
    over: [Vec<i32>; 2],
    beside: [Vec<i32>; 2],
}

impl Extremes {
    /// The one value, to the bit, that all have.
    #[inline(always)]
    pub(super) fn only_value(self) -> Option<f32> {
        (self.least.to_bits() == self.greatest.to_bits()).then_some(self.least)
    }
}

impl Calm {
    /// Room for `capacity` rows of `width` values.
    pub(super) fn new(width: usize, capacity: usize) -> Self {
        let count = width.div_ceil(BLOCK_COLUMNS);
        let rows = vec![0; count * capacity];
        Self {
            width,
            capacity,
            count,
            least: rows.clone(),
            greatest: rows,
            over: [vec![0; count], vec![0; count]],
            beside: [vec![0; count], vec![0; count]],
        }
    }

    /// Notes the extremes of row `y`.
    pub(super) fn note_row(&mut self, y: usize, row: &[f32]) {
        let slot = self.slot(y);
        note_blocks(row, &mut self.least[slot.clone()], &mut self.greatest[slot]);
    }

    fn slot(&self, y: usize) -> Range<usize> {
        let start = y % self.capacity * self.count;
        start..start + self.count
    }

    /// Gathers the extremes of every block over some rows and the columns within `reach` of it.
    fn gather_window(&mut self, rows: Range<usize>, reach: usize) {
        let [mut least, mut greatest] = std::mem::take(&mut self.over);
        least.fill(i32::MAX);
        greatest.fill(i32::MIN);
        for y in rows {
            let slot = self.slot(y);
            widen_extremes(
                [&mut least, &mut greatest],
                [&self.least[slot.clone()], &self.greatest[slot]],
            );
        }
        // A step to each side per block that the window reaches.
        for _ in 0..reach.div_ceil(BLOCK_COLUMNS).min(self.count) {
            self.beside[0].copy_from_slice(&least);
            self.beside[1].copy_from_slice(&greatest);
            let ([low, high], last) = (&self.beside, self.count - 1);
            widen_extremes(
                [&mut least[1..], &mut greatest[1..]],
                [&low[..last], &high[..last]],
            );
            widen_extremes(
                [&mut least[..last], &mut greatest[..last]],
                [&low[1..], &high[1..]],
            );
        }
        self.over = [least, greatest];
    }

    /// Extremes of the gathered window around a block.
    #[inline(always)]
    fn window_extremes(&self, block: usize) -> Extremes {
        let [least, greatest] = &self.over;
        Extremes {
            least: from_order_key(least[block]),
            greatest: from_order_key(greatest[block]),
        }
    }

    /// Fills row `y` of a result. `settled` is given the extremes of every block and of the window
    /// `rows` x `reach` around it, and may know the one value that the block becomes; all other
    /// columns go to `compute`, at most [`RUN_COLUMNS`] at once.
    pub(super) fn fill_row(
        &mut self,
        out: &mut [f32],
        (y, rows, reach): (usize, Range<usize>, usize),
        settled: impl Fn(Extremes, Extremes) -> Option<f32>,
        mut compute: impl FnMut(Range<usize>, &mut [f32]),
    ) {
        // Longer than elsewhere: one pass over the blocks joins those of the same fate into runs.
        self.gather_window(rows, reach);
        let row = self.slot(y).start;
        let mut finish = |columns: Range<usize>, known: Option<f32>| match known {
            Some(value) => fill_columns(&mut out[columns], value),
            None if columns.is_empty() => (),
            None => compute(columns.clone(), &mut out[columns]),
        };
        let (mut open, mut fate) = (0..0, None);
        for (block, start) in (0..self.width).step_by(BLOCK_COLUMNS).enumerate() {
            let own = Extremes {
                least: from_order_key(self.least[row + block]),
                greatest: from_order_key(self.greatest[row + block]),
            };
            let known = settled(own, self.window_extremes(block));
            let joins = known.map(f32::to_bits) == fate.map(f32::to_bits)
                && (known.is_some() || open.len() + BLOCK_COLUMNS <= RUN_COLUMNS);
            if !joins {
                finish(open, fate);
                (open, fate) = (start..start, known);
            }
            open.end = (start + BLOCK_COLUMNS).min(self.width);
        }
        finish(open, fate);
    }
}

/// A float as an integer of the same order.
#[inline(always)]
fn order_key(v: f32) -> i32 {
    let bits = v.to_bits() as i32;
    bits ^ ((bits >> 31) & i32::MAX)
}

/// The float of a key.
#[inline(always)]
fn from_order_key(key: i32) -> f32 {
    f32::from_bits((key ^ ((key >> 31) & i32::MAX)) as u32)
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn fill_columns(out: &mut [f32], value: f32) {
    out.fill(value);
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn widen_extremes(over: [&mut [i32]; 2], by: [&[i32]; 2]) {
    let ([least, greatest], [low, high]) = (over, by);
    least
        .iter_mut()
        .zip(low)
        .for_each(|(a, b)| *a = (*a).min(*b));
    greatest
        .iter_mut()
        .zip(high)
        .for_each(|(a, b)| *a = (*a).max(*b));
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn note_blocks(row: &[f32], least: &mut [i32], greatest: &mut [i32]) {
    for ((values, least), greatest) in row.chunks(BLOCK_COLUMNS).zip(least).zip(greatest) {
        (*least, *greatest) = (i32::MAX, i32::MIN);
        for v in values {
            *least = (*least).min(order_key(*v));
            *greatest = (*greatest).max(order_key(*v));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_keep_the_order_of_floats() {
        let rising = [
            -f32::NAN,
            f32::NEG_INFINITY,
            -1.0,
            -1e-42,
            -0.0,
            0.0,
            1e-42,
            1.0,
            f32::INFINITY,
            f32::NAN,
        ];
        assert!(rising.windows(2).all(|p| order_key(p[0]) < order_key(p[1])));
        assert!(
            rising
                .iter()
                .all(|&v| from_order_key(order_key(v)).to_bits() == v.to_bits())
        );
    }

    #[test]
    fn every_column_is_either_settled_or_computed_once() {
        let width = 1500;
        let mut calm = Calm::new(width, 1);
        let row: Vec<f32> = (0..width)
            .map(|x| if (x / 100) % 5 == 2 { x as f32 } else { 1.0 })
            .collect();
        calm.note_row(0, &row);
        let mut out = vec![0.0; width];
        let flat = |own: Extremes, _| (own.least == own.greatest).then_some(7.0);
        calm.fill_row(&mut out, (0, 0..1, 0), flat, |columns, part| {
            assert!(columns.len() <= RUN_COLUMNS && columns.len() == part.len());
            part.iter_mut().for_each(|v| *v += 1.0);
        });
        assert!(out.iter().all(|v| *v == 1.0 || *v == 7.0));
        assert!(out.contains(&1.0) && out.contains(&7.0));
    }

    #[test]
    fn a_nan_is_an_extreme() {
        let mut calm = Calm::new(3, 1);
        calm.note_row(0, &[0.0, f32::NAN, 1.0]);
        calm.gather_window(0..1, 0);
        let Extremes { least, greatest } = calm.window_extremes(0);
        assert!(least == 0.0 && greatest.is_nan());
    }
}
