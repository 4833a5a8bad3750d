//! Edges of the matte, and the levels that clip everything but them.

use super::calm::{Calm, Extremes};
use super::model::Behaviour;
use super::options::KeyOptions;
use super::rows::{Pad, RowWindow, Rows, Source, looked_at, rows_around, window_rows};

/// Share of a pixel's neighbours that must be alike for it not to be an edge; Blender's constant.
const ALIKE_SHARE: f32 = 0.9;

/// How far a profile searches for edges.
#[derive(Clone, Copy, Debug, PartialEq)]
enum EdgeReach {
    /// Nowhere: every pixel gets this answer.
    Nowhere(f32),
    /// In a square window of this half-size.
    Window(usize),
}

impl EdgeReach {
    fn new(behaviour: Behaviour, radius: usize) -> Self {
        match (behaviour, radius) {
            (Behaviour::V34 | Behaviour::V42, 0) => Self::Nowhere(0.0),
            (Behaviour::V34, 1) => Self::Nowhere(1.0),
            (Behaviour::V34, _) => Self::Window(radius - 1),
            (Behaviour::V42 | Behaviour::V45, _) => Self::Window(radius),
        }
    }
}

/// Searches a matte for edges: pixels too few of whose neighbours are like them.
struct EdgeSearch<'a> {
    source: Source<'a>,
    behaviour: Behaviour,
    tolerance: f32,
    reach: EdgeReach,
    height: usize,
    window: RowWindow,
    calm: Calm,
    /// How many columns of the search window lie inside the picture.
    columns: Vec<f32>,
}

impl<'a> EdgeSearch<'a> {
    fn new(source: Source<'a>, (width, height): (usize, usize), options: &KeyOptions) -> Self {
        let behaviour = options.profile.behaviour();
        let reach = EdgeReach::new(behaviour, options.edge_kernel_radius as usize);
        let half = if let EdgeReach::Window(half) = reach {
            half
        } else {
            0
        };
        let columns = (0..width)
            .map(|x| rows_around(x, half, width).len() as f32)
            .collect();
        let capacity = window_rows(half, height);
        let window = RowWindow::new(width + 2 * half, capacity);
        let calm = Calm::new(width, capacity);
        Self {
            source,
            behaviour,
            tolerance: options.edge_kernel_tolerance,
            reach,
            height,
            window,
            calm,
            columns,
        }
    }

    /// Writes row `y` of the searched matte, and 1 at its edges, 0 elsewhere.
    fn row(&mut self, y: usize, matte: &mut [f32], edges: &mut [f32]) {
        match self.reach {
            EdgeReach::Window(half) => self.search_row(y, half, matte, edges),
            EdgeReach::Nowhere(answer) => {
                self.source.row(y, matte);
                edges.fill(answer);
            }
        }
    }

    fn search_row(&mut self, y: usize, half: usize, matte: &mut [f32], edges: &mut [f32]) {
        let (width, height, repeat) = (matte.len(), self.height, self.behaviour.repeats_border());
        // Longer than elsewhere: window, source and notes are borrowed at once, and each row is
        // searched while it is cached.
        let pad = Pad::repeat_or(repeat, f32::NAN);
        self.window
            .cover_rows(rows_around(y, half, height), |y, row| {
                self.source.row(y, &mut row[half..half + width]);
                self.calm.note_row(y, &row[half..half + width]);
                pad.fill_margins(row, half);
            });
        matte.copy_from_slice(&self.window.row(y)[half..half + width]);
        let rows = rows_around(y, half, height);
        // Where the whole window is alike no pixel is an edge; a lone pixel has no neighbours to be
        // like.
        let alike = |_, near: Extremes| {
            (near.greatest - near.least < self.tolerance && width * height > 1).then_some(0.0)
        };
        let seen = rows.len() as f32;
        self.calm
            .fill_row(edges, (y, rows, half), alike, |columns, edges| {
                edges.fill(0.0);
                for near in looked_at(y, half, height, repeat) {
                    let samples = &self.window.row(near)[columns.start..columns.end + 2 * half];
                    count_alike(edges, &matte[columns.clone()], samples, self.tolerance);
                }
                let window = (seen, &self.columns[columns.clone()], half);
                mark_edges(
                    edges,
                    &matte[columns],
                    window,
                    self.tolerance,
                    self.behaviour,
                );
            });
    }
}

#[inline(always)]
fn edge_value(found: bool) -> f32 {
    if found { 1.0 } else { 0.0 }
}

#[inline(always)]
fn alike_value(a: f32, b: f32, tolerance: f32) -> f32 {
    if (a - b).abs() < tolerance { 1.0 } else { 0.0 }
}

/// Counts, for every pixel of a row, the samples of a padded row that lie in its window and are
/// like it.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn count_alike(counts: &mut [f32], matte: &[f32], padded: &[f32], tolerance: f32) {
    for samples in padded.windows(matte.len()) {
        for ((count, m), s) in counts.iter_mut().zip(matte).zip(samples) {
            *count += alike_value(*s, *m, tolerance);
        }
    }
}

/// Turns numbers of alike samples into 1 at edges and 0 elsewhere; `rows` and `columns` of the
/// window of half-size `half` lie inside the picture.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn mark_edges(
    counts: &mut [f32],
    matte: &[f32],
    (rows, columns, half): (f32, &[f32], usize),
    tolerance: f32,
    behaviour: Behaviour,
) {
    // Longer than elsewhere: a loop for each behaviour, all compiled for each vector width.
    let pixels = counts.iter_mut().zip(matte).zip(columns);
    let all = ((2 * half + 1) * (2 * half + 1)) as f32;
    match behaviour {
        Behaviour::V34 => pixels.for_each(|((count, m), columns)| {
            let others = *count - alike_value(*m, *m, tolerance);
            let samples = columns * rows - 1.0;
            *count = edge_value((others < (ALIKE_SHARE * samples).ceil()) | (samples == 0.0));
        }),
        Behaviour::V42 => pixels.for_each(|((count, _), columns)| {
            *count = edge_value(*count < (ALIKE_SHARE * (columns * rows)).ceil());
        }),
        Behaviour::V45 => {
            pixels.for_each(|((count, _), _)| *count = edge_value(*count < ALIKE_SHARE * all))
        }
    }
}

/// The matte with everything but its edges clipped to the black and white level.
pub(super) struct Clip<'a> {
    search: EdgeSearch<'a>,
    black: f32,
    white: f32,
    edges: Vec<f32>,
}

impl<'a> Clip<'a> {
    /// Whether the levels can change anything.
    pub(super) fn is_wanted(options: &KeyOptions) -> bool {
        let levels_differ = options.profile.behaviour() != Behaviour::V45
            || options.clip_black != options.clip_white;
        (options.clip_black > 0.0 || options.clip_white < 1.0) && levels_differ
    }

    pub(super) fn new(source: Source<'a>, size: (usize, usize), options: &KeyOptions) -> Self {
        let search = EdgeSearch::new(source, size, options);
        Self {
            search,
            black: options.clip_black,
            white: options.clip_white,
            edges: vec![0.0; size.0],
        }
    }
}

impl Rows for Clip<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.search.row(y, out, &mut self.edges);
        clip_row(
            out,
            &self.edges,
            [self.black, self.white],
            self.search.behaviour,
        );
    }
}

/// Clips all pixels of a row that are not edges.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn clip_row(matte: &mut [f32], edges: &[f32], [black, white]: [f32; 2], behaviour: Behaviour) {
    let pixels = matte.iter_mut().zip(edges);
    if behaviour == Behaviour::V45 {
        pixels.for_each(|(m, e)| {
            *m = if *e > 0.0 {
                *m
            } else {
                remapped_to_levels(*m, black, white)
            }
        });
    } else {
        pixels.for_each(|(m, e)| {
            *m = if *e > 0.0 {
                *m
            } else {
                clipped_to_levels(*m, black, white)
            }
        });
    }
}

/// 0 below black, 1 from white on, linear between; a threshold where white is not above black.
#[inline(always)]
fn clipped_to_levels(m: f32, black: f32, white: f32) -> f32 {
    let between = (m - black) / (white - black);
    let bright = if m >= white { 1.0 } else { between };
    if m < black { 0.0 } else { bright }
}

/// Black to 0 and white to 1, whichever is larger, held between.
#[inline(always)]
fn remapped_to_levels(m: f32, black: f32, white: f32) -> f32 {
    let v = (m - black) / (white - black);
    let v = if v < 0.0 { 0.0 } else { v };
    if v > 1.0 { 1.0 } else { v }
}

/// The edges themselves: 1 at edges, 0 elsewhere.
pub(super) struct Edges<'a> {
    search: EdgeSearch<'a>,
    searched: Vec<f32>,
}

impl<'a> Edges<'a> {
    pub(super) fn new(source: Source<'a>, size: (usize, usize), options: &KeyOptions) -> Self {
        Self {
            search: EdgeSearch::new(source, size, options),
            searched: vec![0.0; size.0],
        }
    }
}

impl Rows for Edges<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        self.search.row(y, &mut self.searched, out);
    }
}
