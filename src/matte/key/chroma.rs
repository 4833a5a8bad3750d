//! Chroma pre-blur: the colour difference signals of a photo blurred, its brightness left sharp.

use super::box_blur::BoxKernel;
use super::model::{Model, Robust, V34, V45};
use super::options::{Blur, KeyOptions, Profile};
use super::photo::Photo;
use super::rows::{RowWindow, Rows, rows_around, window_rows};
use super::running_blur::RunningBlur;
use super::ycc::differences;
use crate::image::ImageView;
use std::ops::Range;

/// Where the colour differences of a photo come from.
#[derive(Clone, Copy)]
struct Differences<'a, P> {
    photo: ImageView<'a, P>,
    profile: Profile,
}

impl<P: Photo> Differences<'_, P> {
    /// Writes both differences of row `y`, unit scale.
    fn row(&self, y: usize, [cb, cr]: [&mut [f32]; 2]) {
        let pixels = self.photo.row(y);
        match self.profile {
            Profile::Blender45 => difference_rows::<P, V45>(pixels, cb, cr),
            Profile::Robust => difference_rows::<P, Robust>(pixels, cb, cr),
            Profile::Blender34 | Profile::Blender42 => difference_rows::<P, V34>(pixels, cb, cr),
        }
    }
}

#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn difference_rows<P: Photo, M: Model>(pixels: &[P], cb: &mut [f32], cr: &mut [f32]) {
    for ((p, cb), cr) in pixels.iter().zip(cb).zip(cr) {
        [*cb, *cr] = differences(M::seen(p.premul()), M::IS_LATE);
    }
}

/// Rows of one of the colour differences.
struct Difference<'a, P> {
    both: Differences<'a, P>,
    red: bool,
    other: Vec<f32>,
}

impl<P: Photo> Rows for Difference<'_, P> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let other = &mut self.other[..];
        self.both
            .row(y, if self.red { [other, out] } else { [out, other] });
    }
}

/// Both colour differences blurred by a box, sums in Blender's order. Grain is everywhere in them, so that nothing is
/// calm.
struct ExactBlur<'a, P> {
    both: Differences<'a, P>,
    kernel: BoxKernel,
    padded: [Vec<f32>; 2],
    windows: [RowWindow; 2],
    /// Finished rows.
    ready: [RowWindow; 2],
}

/// Rows that are blurred along y together: they share most of what they add up, while it is in the first cache.
const ROWS_AT_ONCE: usize = 4;
/// Columns of them at a time: those of a window of twenty rows fit the first cache.
const COLUMNS_AT_ONCE: usize = 256;

impl<'a, P: Photo> ExactBlur<'a, P> {
    fn new(both: Differences<'a, P>, kernel: BoxKernel) -> Self {
        let (width, height) = both.photo.size();
        let (radius, capacity) = (kernel.radius(), window_rows(kernel.radius(), height));
        Self {
            both,
            padded: [(); 2].map(|()| vec![0.0; width + 2 * radius]),
            windows: [(); 2].map(|()| RowWindow::new(width, capacity + ROWS_AT_ONCE)),
            ready: [(); 2].map(|()| RowWindow::new(width, ROWS_AT_ONCE)),
            kernel,
        }
    }

    /// Both differences of row `y`.
    fn row(&mut self, y: usize) -> [&[f32]; 2] {
        let (_, height) = self.both.photo.size();
        if !self.ready[0].has_row(y) {
            let rows = y..(y + ROWS_AT_ONCE).min(height);
            let radius = self.kernel.radius();
            let last = rows_around(rows.end - 1, radius, height).end;
            self.cover_rows(y.saturating_sub(radius)..last);
            for (window, ready) in self.windows.iter().zip(&mut self.ready) {
                add_rows(&self.kernel, window, (rows.clone(), height), ready);
            }
        }
        self.ready.each_ref().map(|rows| rows.row(y))
    }

    /// Makes rows that are blurred along x present.
    fn cover_rows(&mut self, rows: Range<usize>) {
        let Self {
            both,
            kernel,
            padded,
            windows: [blue, red],
            ..
        } = self;
        blue.cover_rows(rows, |y, blue_row| {
            let inside = kernel.radius()..kernel.radius() + blue_row.len();
            both.row(y, padded.each_mut().map(|row| &mut row[inside.clone()]));
            red.cover_rows(y..y + 1, |_, red_row| {
                for (padded, out) in padded.iter_mut().zip([&mut *blue_row, red_row]) {
                    kernel.add_along_x(&kernel.samples_in_order(padded), 0, out);
                }
            });
        });
    }
}

/// Blurs a few rows along y.
fn add_rows(
    kernel: &BoxKernel,
    window: &RowWindow,
    (rows, height): (Range<usize>, usize),
    out: &mut RowWindow,
) {
    let taps: Vec<_> = rows
        .clone()
        .map(|y| kernel.rows_in_order(window, (y, height)))
        .collect();
    out.cover_rows(rows.clone(), |_, _| ());
    let width = window.row(rows.start).len();
    for first in (0..width).step_by(COLUMNS_AT_ONCE) {
        for (y, taps) in rows.clone().zip(&taps) {
            let columns = first..(first + COLUMNS_AT_ONCE).min(width);
            kernel.add_along_y(taps, first, &mut out.row_mut(y)[columns]);
        }
    }
}

/// The two ways to blur.
enum BlurOf<'a, P> {
    Exact(ExactBlur<'a, P>),
    RunningSum([RunningBlur<Difference<'a, P>>; 2]),
}

/// Rows of the blurred colour differences of a photo.
pub(super) struct ChromaBlur<'a, P> {
    blur: BlurOf<'a, P>,
    rows: [Vec<f32>; 2],
}

impl<'a, P: Photo> ChromaBlur<'a, P> {
    pub(super) fn new(photo: ImageView<'a, P>, options: &KeyOptions) -> Self {
        let (profile, width) = (options.profile, photo.width());
        let both = Differences { photo, profile };
        let size = options.blur_pre as usize;
        let kernel = BoxKernel::new(profile.behaviour(), size, photo.size());
        let blur = match options.blur {
            Blur::Exact => BlurOf::Exact(ExactBlur::new(both, kernel)),
            Blur::RunningSum => BlurOf::RunningSum([false, true].map(|red| {
                let other = vec![0.0; width];
                RunningBlur::new(
                    Difference { both, red, other },
                    kernel.reach(),
                    photo.size(),
                )
            })),
        };
        let rows = [(); 2].map(|()| vec![0.0; width]);
        Self { blur, rows }
    }

    /// Both differences of row `y`, unit scale.
    pub(super) fn row(&mut self, y: usize) -> [&[f32]; 2] {
        match &mut self.blur {
            BlurOf::Exact(blur) => blur.row(y),
            BlurOf::RunningSum(blurs) => {
                for (blur, row) in blurs.iter_mut().zip(&mut self.rows) {
                    blur.row(y, row);
                }
                self.rows.each_ref().map(Vec::as_slice)
            }
        }
    }
}
