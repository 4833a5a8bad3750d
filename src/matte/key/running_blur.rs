//! Box blur by running sums: its cost does not depend on its size, its bits are nearly Blender's.
//!
//! Samples are held to a grid so coarse that sums of them are exact. What enters a sum leaves it
//! without a trace, and a band of rows finds the same sums wherever it starts.

use super::rows::{Pad, RowWindow, Rows, rows_around, window_rows};
use std::ops::Range;

/// Largest magnitude of a sample: that of half precision.
const MAX_SAMPLE: f32 = 65_504.0;
/// Adding and subtracting this rounds a double to multiples of 2^-24; a sum of 4095 samples up to
/// [`MAX_SAMPLE`] then takes 52 of a double's 53 bits.
const GRID_ROUNDER: f64 = 1.5 * (1u64 << 28) as f64;

/// Which samples a box covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxReach {
    /// How many to each side of the centre.
    pub(super) radius: usize,
    /// The border's samples stand in for those beyond it, which otherwise do not count.
    pub(super) repeat: bool,
}

impl BoxReach {
    /// How many samples around `at` count.
    fn sample_count(self, at: usize, length: usize) -> f64 {
        let inside = rows_around(at, self.radius, length).len();
        (if self.repeat {
            2 * self.radius + 1
        } else {
            inside
        }) as f64
    }
}

/// A plane blurred by a box, along x and then along y.
pub(super) struct RunningBlur<S> {
    source: S,
    reach: BoxReach,
    height: usize,
    padded: Vec<f32>,
    /// Rows blurred along x: those in the sums, and the one that is about to leave them.
    window: RowWindow,
    sums: Vec<f64>,
    /// The rows in the sums.
    summed: Range<usize>,
    /// One over how many samples of a row count, for every column.
    shares: Vec<f64>,
}

impl<S: Rows> RunningBlur<S> {
    /// A blur over a plane of that width and height.
    pub(super) fn new(source: S, reach: BoxReach, (width, height): (usize, usize)) -> Self {
        Self {
            source,
            reach,
            height,
            padded: vec![0.0; width + 2 * reach.radius + 1],
            window: RowWindow::new(width, window_rows(reach.radius, height) + 1),
            sums: vec![0.0; width],
            summed: 0..0,
            shares: (0..width)
                .map(|x| 1.0 / reach.sample_count(x, width))
                .collect(),
        }
    }

    /// Makes rows that are blurred along x present.
    fn cover_rows(&mut self, rows: Range<usize>) {
        let Self {
            source,
            reach,
            padded,
            window,
            shares,
            ..
        } = self;
        window.cover_rows(rows, |y, row| {
            let inside = reach.radius..reach.radius + row.len();
            source.row(y, &mut padded[inside.clone()]);
            hold_row(&mut padded[inside]);
            along_x(padded, *reach, shares, row);
        });
    }

    /// How many rows of the window of row `y` repeat the first one, and the last one.
    fn repeated_rows(&self, y: usize) -> [f64; 2] {
        if !self.reach.repeat {
            return [0.0; 2];
        }
        let radius = self.reach.radius;
        let above = radius.saturating_sub(y);
        let below = (y + radius).saturating_sub(self.height - 1);
        [above, below].map(|rows| rows as f64)
    }

    /// Writes row `y`, whose window repeats rows of the border.
    fn row_at_border(&self, y: usize, [above, below]: [f64; 2], share: f64, out: &mut [f32]) {
        // Only windows that reach over the border need its rows, and those hold them.
        let border =
            |missing: f64, row: usize| self.window.row(if missing > 0.0 { row } else { y });
        let borders = border(above, 0).iter().zip(border(below, self.height - 1));
        for ((o, sum), (first, last)) in out.iter_mut().zip(&self.sums).zip(borders) {
            *o = ((sum + above * f64::from(*first) + below * f64::from(*last)) * share) as f32;
        }
    }

    /// Moves the sums to other rows. Sums are exact, so that starting anew gives the same ones.
    fn move_sums(&mut self, rows: Range<usize>) {
        self.cover_rows(rows.clone());
        let (window, sums) = (&self.window, &mut self.sums);
        let keeps = self.summed.end > rows.start && rows.start - self.summed.start <= 1;
        if !keeps {
            sums.fill(0.0);
            self.summed = rows.start..rows.start;
        }
        if self.summed.start < rows.start {
            add_row(sums, window.row(self.summed.start), -1.0);
        }
        (self.summed.end..rows.end).for_each(|y| add_row(sums, window.row(y), 1.0));
        self.summed = rows;
    }
}

impl<S: Rows> Rows for RunningBlur<S> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.move_sums(rows_around(y, self.reach.radius, self.height));
        let share = 1.0 / self.reach.sample_count(y, self.height);
        let repeated = self.repeated_rows(y);
        if repeated != [0.0; 2] {
            return self.row_at_border(y, repeated, share, out);
        }
        for (o, sum) in out.iter_mut().zip(&self.sums) {
            *o = (sum * share) as f32;
        }
    }
}

/// Puts samples on the grid; NaN becomes 0.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn hold_row(samples: &mut [f32]) {
    for s in samples {
        *s = held_sample(f64::from(*s));
    }
}

#[inline(always)]
fn held_sample(v: f64) -> f32 {
    let most = f64::from(MAX_SAMPLE);
    let low = if v < most { v } else { most };
    let inside = if low > -most { low } else { -most };
    let inside = if v.is_nan() { 0.0 } else { inside };
    ((inside + GRID_ROUNDER) - GRID_ROUNDER) as f32
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn add_row(sums: &mut [f64], row: &[f32], sign: f64) {
    sums.iter_mut()
        .zip(row)
        .for_each(|(sum, v)| *sum += sign * f64::from(*v));
}

/// Blurs a row between margins; the last sample of `padded` is never counted.
fn along_x(padded: &mut [f32], reach: BoxReach, shares: &[f64], out: &mut [f32]) {
    let (diameter, end) = (2 * reach.radius + 1, padded.len() - 1);
    Pad::repeat_or(reach.repeat, 0.0).fill_margins(&mut padded[..end], reach.radius);
    let mut sum: f64 = padded[..diameter].iter().map(|v| f64::from(*v)).sum();
    let steps = padded[diameter..].iter().zip(&padded[..]);
    for ((o, share), (enters, leaves)) in out.iter_mut().zip(shares).zip(steps) {
        *o = held_sample(sum * share);
        sum += f64::from(*enters) - f64::from(*leaves);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (13, 9);

    struct Plane(fn(usize, usize) -> f32);
    impl Rows for Plane {
        fn row(&mut self, y: usize, out: &mut [f32]) {
            out.iter_mut()
                .enumerate()
                .for_each(|(x, v)| *v = (self.0)(x, y));
        }
    }

    fn uneven(x: usize, y: usize) -> f32 {
        ((x * 7 + y * 11) % 17) as f32 * 0.37 - 1.5
    }

    fn blurred(plane: fn(usize, usize) -> f32, reach: BoxReach, first: usize) -> Vec<Vec<f32>> {
        let mut blur = RunningBlur::new(Plane(plane), reach, SIZE);
        (first..SIZE.1)
            .map(|y| {
                let mut row = vec![0.0; SIZE.0];
                blur.row(y, &mut row);
                row
            })
            .collect()
    }

    #[test]
    fn a_running_sum_is_the_mean_of_its_window() {
        for (radius, repeat) in [(0, false), (1, false), (3, true), (8, false), (20, true)] {
            for (y, row) in blurred(uneven, BoxReach { radius, repeat }, 0)
                .iter()
                .enumerate()
            {
                for (x, v) in row.iter().enumerate() {
                    let near = |at: usize, length: usize| {
                        super::super::rows::looked_at(at, radius, length, repeat)
                    };
                    let samples: Vec<f64> = near(y, SIZE.1)
                        .flat_map(|j| near(x, SIZE.0).map(move |i| f64::from(uneven(i, j))))
                        .collect();
                    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
                    assert!(
                        (f64::from(*v) - mean).abs() < 3e-7,
                        "{radius} {repeat} {x} {y}"
                    );
                }
            }
        }
    }

    #[test]
    fn sums_are_the_same_wherever_they_start() {
        let wide = |x: usize, y: usize| uneven(x, y) * if x > 6 { 3e4 } else { 1e-7 };
        let reach = BoxReach {
            radius: 2,
            repeat: false,
        };
        assert_eq!(blurred(wide, reach, 0)[4..], blurred(wide, reach, 4)[..]);
    }

    #[test]
    fn what_is_no_number_leaves_no_trace() {
        let odd = |x: usize, y: usize| if (x, y) == (4, 4) { f32::NAN } else { 0.5 };
        let rows = blurred(
            odd,
            BoxReach {
                radius: 1,
                repeat: false,
            },
            0,
        );
        assert_eq!(rows[2], [0.5; 13]);
        assert_eq!((rows[6][4], rows[4][7]), (0.5, 0.5));
        assert!(rows.iter().flatten().all(|v| v.is_finite()));
        assert_eq!(
            (held_sample(f64::INFINITY), held_sample(-1e30)),
            (MAX_SAMPLE, -MAX_SAMPLE)
        );
    }
}
