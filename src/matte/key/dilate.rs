//! Dilate and erode: the largest or smallest value within a disc.
//!
//! A row of the disc is a run of samples, and the extreme of a run is that of two shorter runs that
//! overlap. So every row of the source is kept with the extremes of all runs of 1, 2, 4, ...
//! samples, and a disc of any size takes two look-ups a row instead of a sum over its area.

use super::calm::{Calm, Extremes};
use super::model::Behaviour;
use super::options::{KeyOptions, Profile};
use super::rows::{Pad, RowWindow, Rows, Source, rows_around, window_rows};
use std::ops::Range;

/// Blender up to 4.3 offers the disc no more than a window of this half-size, one short to the
/// right and upwards.
const MIN_LOPSIDED_DISTANCE: usize = 3;

/// A matte grown or shrunk by a disc.
pub(super) struct Dilate<'a> {
    source: Source<'a>,
    shape: DiscSamples,
    extreme: Extreme,
    height: usize,
    /// For every row its runs of 1, 2, 4, ... samples, one after the other.
    window: RowWindow,
    calm: Calm,
    width: usize,
}

/// Which samples of a disc are looked at.
#[derive(Clone, Copy, Debug)]
struct DiscSamples {
    distance: usize,
    /// The right and the top tip are missing.
    lopsided: bool,
}

impl DiscSamples {
    /// How far the disc reaches to the left and to the right, `dy` rows from its centre (upwards
    /// positive).
    fn row_reach(self, dy: isize) -> Option<(usize, usize)> {
        let d = self.distance;
        let cut = self.lopsided && d >= MIN_LOPSIDED_DISTANCE;
        let half = (d * d).checked_sub(dy.unsigned_abs().pow(2))?.isqrt();
        let above = cut && dy == d as isize;
        (!above).then(|| (half, if cut { half.min(d - 1) } else { half }))
    }
}

/// Which extreme is sought, and from where.
#[derive(Clone, Copy, Debug)]
struct Extreme {
    largest: bool,
    start: f32,
}

impl Extreme {
    fn new(largest: bool, unlimited: bool) -> Self {
        let start = match (unlimited, largest) {
            (true, true) => f32::MIN,
            (true, false) => f32::MAX,
            (false, true) => 0.0,
            (false, false) => 1.0,
        };
        Self { largest, start }
    }
    /// The extreme of two samples; the first stays where they are equal or one is NaN.
    #[inline(always)]
    fn pick(self, a: f32, b: f32) -> f32 {
        let replaces = if self.largest { b > a } else { b < a };
        if replaces { b } else { a }
    }
}

impl<'a> Dilate<'a> {
    pub(super) fn new(
        source: Source<'a>,
        (width, height): (usize, usize),
        options: &KeyOptions,
    ) -> Self {
        let distance = options.dilate_distance.unsigned_abs() as usize;
        let unlimited = options.profile.behaviour() == Behaviour::V45;
        let shape = DiscSamples {
            distance,
            lopsided: !unlimited && options.profile != Profile::Robust,
        };
        let runs = (2 * distance + 1).ilog2() as usize + 1;
        let capacity = window_rows(distance, height);
        let window = RowWindow::new((width + 2 * distance) * runs, capacity);
        Self {
            source,
            shape,
            extreme: Extreme::new(options.dilate_distance > 0, unlimited),
            height,
            window,
            calm: Calm::new(width, capacity),
            width,
        }
    }

    /// Makes the runs of the rows around row `y` present.
    fn cover_rows(&mut self, y: usize) {
        let Self {
            source,
            shape,
            extreme,
            height,
            window,
            calm,
            width,
        } = self;
        let margin = shape.distance;
        let stride = *width + 2 * margin;
        window.cover_rows(rows_around(y, margin, *height), |y, runs| {
            let inside = &mut runs[margin..margin + *width];
            source.row(y, inside);
            limit_row(inside, *extreme);
            calm.note_row(y, inside);
            Pad::Value(extreme.start).fill_margins(&mut runs[..stride], margin);
            double_runs(runs, stride, *extreme);
        });
    }

    /// The extremes of two runs of row `near`, for every pixel of some columns, that together reach from `left` to
    /// `right` of it.
    fn two_runs(
        &self,
        near: usize,
        (left, right): (usize, usize),
        columns: &Range<usize>,
    ) -> [&[f32]; 2] {
        let margin = self.shape.distance;
        let stride = self.width + 2 * margin;
        let level = (left + right + 1).ilog2() as usize;
        let runs = &self.window.row(near)[level * stride..][..stride];
        [margin - left, margin + right + 1 - (1 << level)]
            .map(|first| &runs[first + columns.start..first + columns.end])
    }

    /// Widens a few columns of row `y`.
    fn compute(&self, y: usize, columns: &Range<usize>, out: &mut [f32]) {
        out.fill(self.extreme.start);
        for near in rows_around(y, self.shape.distance, self.height) {
            if let Some(reach) = self.shape.row_reach(y as isize - near as isize) {
                let [a, b] = self.two_runs(near, reach, columns);
                widen_row(out, a, b, self.extreme);
            }
        }
    }
}

impl Rows for Dilate<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.cover_rows(y);
        let reach = self.shape.distance;
        let window = (y, rows_around(y, reach, self.height), reach);
        // Lent to itself for the moment.
        let mut calm = std::mem::take(&mut self.calm);
        let alike = |_, near: Extremes| near.only_value();
        calm.fill_row(out, window, alike, |columns, out| {
            self.compute(y, &columns, out);
        });
        self.calm = calm;
    }
}

/// Fills the runs of 2, 4, ... samples from the run of 1.
fn double_runs(runs: &mut [f32], stride: usize, extreme: Extreme) {
    for level in 1..runs.len() / stride {
        let (shorter, longer) = runs.split_at_mut(level * stride);
        let shorter = &shorter[(level - 1) * stride..];
        let half = 1 << (level - 1);
        pair_row(
            &mut longer[..stride - half],
            &shorter[..stride - half],
            &shorter[half..],
            extreme,
        );
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn limit_row(row: &mut [f32], extreme: Extreme) {
    for v in row {
        *v = extreme.pick(extreme.start, *v);
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn pair_row(out: &mut [f32], a: &[f32], b: &[f32], extreme: Extreme) {
    for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
        *o = extreme.pick(*a, *b);
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn widen_row(out: &mut [f32], a: &[f32], b: &[f32], extreme: Extreme) {
    for ((o, a), b) in out.iter_mut().zip(a).zip(b) {
        *o = extreme.pick(*o, extreme.pick(*a, *b));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Dot;
    impl Rows for Dot {
        fn row(&mut self, y: usize, out: &mut [f32]) {
            out.fill(0.0);
            out[5] = if y == 5 { 1.0 } else { 0.0 };
        }
    }

    fn dilated_dot(profile: Profile, distance: i32) -> Vec<String> {
        let options = KeyOptions {
            dilate_distance: distance,
            ..KeyOptions::for_profile(profile)
        };
        let mut dilate = Dilate::new(Box::new(Dot), (11, 11), &options);
        let mut row = [0.0; 11];
        let picture = |y| {
            dilate.row(y, &mut row);
            row.map(|v| if v > 0.0 { '#' } else { '.' })
                .iter()
                .collect()
        };
        (0..11).map(picture).collect()
    }

    #[test]
    fn a_dilated_dot_lacks_its_left_and_bottom_tip_in_old_profiles() {
        let dot = dilated_dot(Profile::Blender34, 3);
        assert_eq!(dot[2], ".....#.....");
        assert_eq!(dot[5], "...######..");
        assert_eq!(dot[8], "...........");
    }

    #[test]
    fn a_dilated_dot_is_a_disc_in_the_others() {
        for profile in [Profile::Blender45, Profile::Robust] {
            let dot = dilated_dot(profile, 3);
            assert_eq!(dot[2], ".....#.....");
            assert_eq!(dot[5], "..#######..");
            assert_eq!(dot[8], ".....#.....");
        }
    }
}
