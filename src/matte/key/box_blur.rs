//! Box blur with Blender's two windows, sums in Blender's order.

use super::calm::{Calm, Extremes, RUN_COLUMNS};
use super::model::Behaviour;
use super::options::{Blur, KeyOptions};
use super::rows::{Pad, RowWindow, Rows, Source, rows_around, window_rows};
use super::running_blur::{BoxReach, RunningBlur};

/// A plane blurred by a box of `size` (at least 1), in the way that the options ask for.
pub(super) fn box_blurred<'a>(
    source: impl Rows + 'a,
    options: &KeyOptions,
    size: u32,
    picture: (usize, usize),
) -> Source<'a> {
    let (behaviour, size) = (options.profile.behaviour(), size as usize);
    match options.blur {
        Blur::Exact => Box::new(BoxBlur::new(source, behaviour, size, picture)),
        Blur::RunningSum => {
            let reach = BoxKernel::new(behaviour, size, picture).reach();
            Box::new(RunningBlur::new(source, reach, picture))
        }
    }
}

/// A plane blurred by a box, along x and then along y.
struct BoxBlur<S> {
    source: S,
    kernel: BoxKernel,
    height: usize,
    padded: Vec<f32>,
    window: RowWindow,
    /// Extremes of the source's latest row, and of the rows blurred along x.
    calm_source: Calm,
    calm: Calm,
}

/// The window of a blur.
pub(super) enum BoxKernel {
    /// Cut off at the border: the mean of the samples inside, `radius` to each side.
    CutOff { radius: usize, columns: Vec<f32> },
    /// Repeating the border: the weights of the centre and of the samples at distance 1, 2, ...,
    /// and what they make of a plane of 1.
    Repeat { weights: Vec<f32>, of_ones: f32 },
}

impl BoxKernel {
    pub(super) fn new(behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        if behaviour.repeats_border() {
            let weights = weights(size);
            let of_ones = weights[1..].iter().fold(weights[0], |sum, w| sum + w + w);
            return Self::Repeat { weights, of_ones };
        }
        // Beyond the picture's own size a window that is cut off at the border finds nothing more.
        let radius = (size - 1).min(width.max(height) - 1);
        Self::CutOff {
            radius,
            columns: (0..width)
                .map(|x| rows_around(x, radius, width).len() as f32)
                .collect(),
        }
    }

    /// The samples whose weight is not 0.
    pub(super) fn reach(&self) -> BoxReach {
        let (radius, repeat) = match self {
            Self::CutOff { radius, .. } => (*radius, false),
            Self::Repeat { weights, .. } => {
                (weights.iter().filter(|w| **w > 0.0).count() - 1, true)
            }
        };
        BoxReach { radius, repeat }
    }

    pub(super) fn radius(&self) -> usize {
        match self {
            Self::CutOff { radius, .. } => *radius,
            Self::Repeat { weights, .. } => weights.len() - 1,
        }
    }
}

/// Weights of a box that repeats the border: 1 as far as `size / 2`, over their sum.
fn weights(size: usize) -> Vec<f32> {
    let radius = size as f32 / 2.0;
    let scale = 1.0 / radius;
    let taps =
        (1..=radius.ceil() as usize).map(|i| if i as f32 * scale <= 1.0 { 1.0 } else { 0.0 });
    let mut weights: Vec<f32> = std::iter::once(1.0).chain(taps).collect();
    let total: f32 = 1.0 + 2.0 * weights[1..].iter().sum::<f32>();
    weights.iter_mut().for_each(|w| *w /= total);
    weights
}

impl<S: Rows> BoxBlur<S> {
    /// A blur of `size` (at least 1) over a plane of that width and height.
    fn new(source: S, behaviour: Behaviour, size: usize, (width, height): (usize, usize)) -> Self {
        let kernel = BoxKernel::new(behaviour, size, (width, height));
        let capacity = window_rows(kernel.radius(), height);
        Self {
            source,
            height,
            padded: vec![0.0; width + 2 * kernel.radius()],
            window: RowWindow::new(width, capacity),
            calm_source: Calm::new(width, 1),
            calm: Calm::new(width, capacity),
            kernel,
        }
    }
}

impl<S: Rows> Rows for BoxBlur<S> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let Self {
            source,
            kernel,
            height,
            padded,
            window,
            calm_source,
            calm,
        } = self;
        window.cover_rows(rows_around(y, kernel.radius(), *height), |y, row| {
            let inside = kernel.radius()..kernel.radius() + row.len();
            source.row(y, &mut padded[inside.clone()]);
            calm_source.note_row(0, &padded[inside]);
            kernel.along_x(padded, calm_source, row);
            calm.note_row(y, row);
        });
        kernel.along_y(window, calm, (y, *height), out);
    }
}

impl BoxKernel {
    /// A plane of 0 stays what it is, and so nearly does a plane of 1.
    fn settled_value(&self, near: Extremes) -> Option<f32> {
        let of_ones = if let Self::Repeat { of_ones, .. } = self {
            *of_ones
        } else {
            1.0
        };
        let bits = near.only_value()?.to_bits();
        if bits == 0.0f32.to_bits() {
            Some(0.0)
        } else {
            (bits == 1.0f32.to_bits()).then_some(of_ones)
        }
    }

    fn along_x(&self, padded: &mut [f32], calm: &mut Calm, out: &mut [f32]) {
        let rows = self.samples_in_order(padded);
        calm.fill_row(
            out,
            (0, 0..1, self.radius()),
            |_, near| self.settled_value(near),
            |columns, out| self.add_along_x(&rows, columns.start, out),
        );
    }

    fn along_y(
        &self,
        window: &RowWindow,
        calm: &mut Calm,
        (y, height): (usize, usize),
        out: &mut [f32],
    ) {
        let rows = self.rows_in_order(window, (y, height));
        calm.fill_row(
            out,
            (y, rows_around(y, self.radius(), height), 0),
            |_, near| self.settled_value(near),
            |columns, out| self.add_along_y(&rows, columns.start, out),
        );
    }

    /// The samples of a row between margins in the order in which they are added: rows that begin with the first pixel's.
    pub(super) fn samples_in_order<'p>(&self, padded: &'p mut [f32]) -> Vec<&'p [f32]> {
        let (radius, repeat) = (self.radius(), matches!(self, Self::Repeat { .. }));
        Pad::repeat_or(repeat, 0.0).fill_margins(padded, radius);
        let width = padded.len() - 2 * radius;
        let at = |offset: usize| &padded[offset..offset + width];
        match self {
            Self::CutOff { .. } => (0..=2 * radius).map(at).collect(),
            Self::Repeat { .. } => from_the_middle(radius)
                .map(|i| at(radius.wrapping_add_signed(i)))
                .collect(),
        }
    }

    /// The rows around row `y` in the order in which they are added. Blender counts rows from the bottom, so sums run
    /// upwards.
    pub(super) fn rows_in_order<'w>(
        &self,
        window: &'w RowWindow,
        (y, height): (usize, usize),
    ) -> Vec<&'w [f32]> {
        let radius = self.radius();
        match self {
            Self::CutOff { .. } => rows_around(y, radius, height)
                .rev()
                .map(|y| window.row(y))
                .collect(),
            Self::Repeat { .. } => from_the_middle(radius)
                .map(|i| window.row(y.saturating_add_signed(-i).min(height - 1)))
                .collect(),
        }
    }

    /// Blurs columns from a first one on along x.
    pub(super) fn add_along_x(&self, rows: &[&[f32]], first: usize, out: &mut [f32]) {
        match self {
            Self::CutOff { columns, .. } => {
                mean_of_rows(out, rows, first, &columns[first..first + out.len()]);
            }
            Self::Repeat { weights, .. } => weighted_sum(out, rows, first, weights),
        }
    }

    /// Blurs columns from a first one on, at most [`RUN_COLUMNS`], along y.
    pub(super) fn add_along_y(&self, rows: &[&[f32]], first: usize, out: &mut [f32]) {
        match self {
            Self::CutOff { .. } => {
                let counts = [rows.len() as f32; RUN_COLUMNS];
                mean_of_rows(out, rows, first, &counts[..out.len()]);
            }
            Self::Repeat { weights, .. } => weighted_sum(out, rows, first, weights),
        }
    }
}

/// Offsets from the centre outwards, at each distance the one ahead first.
pub(super) fn from_the_middle(radius: usize) -> impl Iterator<Item = isize> {
    std::iter::once(0).chain((1..=radius as isize).flat_map(|i| [i, -i]))
}

/// Columns whose sums stay in registers while rows are added up.
const SUMMED_COLUMNS: usize = 64;

/// As many columns of a row, from that one on.
#[inline(always)]
fn columns_at(row: &[f32], first: usize) -> &[f32; SUMMED_COLUMNS] {
    row[first..]
        .first_chunk()
        .expect("rows are as long as what they are added to")
}

/// Adds up rows in order, from a first column on, over how many samples of each sum lie inside the picture.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn mean_of_rows(out: &mut [f32], rows: &[&[f32]], first: usize, inside: &[f32]) {
    // Longer than elsewhere: compiled for each vector width in one piece.
    let (groups, rest) = out.as_chunks_mut::<SUMMED_COLUMNS>();
    let done = groups.len() * SUMMED_COLUMNS;
    for (out, start) in groups.iter_mut().zip((0..).step_by(SUMMED_COLUMNS)) {
        let mut sums = [0.0; SUMMED_COLUMNS];
        for row in rows {
            let row = columns_at(row, first + start);
            (0..SUMMED_COLUMNS).for_each(|k| sums[k] += row[k]);
        }
        // A copy, so that it is plain that what is written is nothing that is read.
        let counts = *columns_at(inside, start);
        (0..SUMMED_COLUMNS).for_each(|k| sums[k] /= counts[k]);
        *out = sums;
    }
    for (x, out) in (done..).zip(rest) {
        *out = rows.iter().fold(0.0, |sum, row| sum + row[first + x]) / inside[x];
    }
}

/// Adds up weighted rows from a first column on: 0, the centre, then two at each distance. The 0 is
/// Blender's, and makes 0 of -0.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn weighted_sum(out: &mut [f32], rows: &[&[f32]], first: usize, weights: &[f32]) {
    let pairs = rows[1..].as_chunks::<2>().0;
    let (groups, rest) = out.as_chunks_mut::<SUMMED_COLUMNS>();
    let done = groups.len() * SUMMED_COLUMNS;
    for (out, start) in groups.iter_mut().zip((first..).step_by(SUMMED_COLUMNS)) {
        let mut sums = *columns_at(rows[0], start);
        (0..SUMMED_COLUMNS).for_each(|k| sums[k] = 0.0 + sums[k] * weights[0]);
        for (pair, w) in pairs.iter().zip(&weights[1..]) {
            let [a, b] = pair.map(|row| columns_at(row, start));
            (0..SUMMED_COLUMNS).for_each(|k| sums[k] = sums[k] + w * a[k] + w * b[k]);
        }
        *out = sums;
    }
    for (x, out) in (first + done..).zip(rest) {
        let taps = pairs.iter().zip(&weights[1..]);
        *out = taps.fold(0.0 + weights[0] * rows[0][x], |sum, ([a, b], w)| {
            sum + w * a[x] + w * b[x]
        });
    }
}
