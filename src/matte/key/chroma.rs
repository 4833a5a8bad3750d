//! Chroma pre-blur: the colour difference signals of a photo blurred, its brightness left sharp.
//!
//! The signals are those of ITU-R BT.709 with studio swing, in the rounding of Blender's own table.
//! Its two matrices are not exact inverses of each other: even without blurring, colours move by up
//! to 7e-4 per unit.

use super::box_blur::BoxKernel;
use super::model::{Behaviour, Model, Robust, V34, V45};
use super::options::{Blur, KeyOptions, Profile};
use super::photo::Photo;
use super::rows::{Rows, Window, rows_around, window_rows};
use super::running_blur::RunningBlur;
use crate::image::ImageView;
use crate::pixel::PremulRgba;
use std::ops::Range;

/// Code value 1.0.
const CODE_MAX: f32 = 255.0;
/// Blender multiplies by this float or divides by 255, depending on its version.
const PER_CODE_MAX: f32 = 1.0 / 255.0;
/// Offset of brightness, code values.
const LUMA_OFFSET: f32 = 16.0;
/// Zero of the colour differences, code values.
const NEUTRAL_CODE: f32 = 128.0;
/// Weights of R, G, B in brightness.
const LUMA_WEIGHTS: [f32; 3] = [0.183, 0.614, 0.062];
/// Weights of R, G, B in the blue and the red difference.
const DIFFERENCES: [[f32; 3]; 2] = [[-0.101, -0.338, 0.439], [0.439, -0.399, -0.040]];

/// One signal in code values.
#[inline(always)]
fn code_value(p: PremulRgba, w: [f32; 3], offset: f32) -> f32 {
    w[0] * (p.r * CODE_MAX) + w[1] * (p.g * CODE_MAX) + w[2] * (p.b * CODE_MAX) + offset
}

/// Code values to unit scale.
#[inline(always)]
fn to_unit(code: f32, behaviour: Behaviour) -> f32 {
    if behaviour == Behaviour::V45 {
        code / CODE_MAX
    } else {
        code * PER_CODE_MAX
    }
}

/// Blue and red difference of a colour in unit scale, 128/255 being neutral.
pub(in crate::matte) fn differences(p: PremulRgba, is_late: bool) -> [f32; 2] {
    let behaviour = late_behaviour(is_late);
    DIFFERENCES.map(|w| to_unit(code_value(p, w, NEUTRAL_CODE), behaviour))
}

#[inline(always)]
fn late_behaviour(is_late: bool) -> Behaviour {
    if is_late {
        Behaviour::V45
    } else {
        Behaviour::V34
    }
}

/// All three signals of a colour in unit scale.
pub(in crate::matte) fn to_ycc(p: PremulRgba, is_late: bool) -> [f32; 3] {
    let luma = code_value(p, LUMA_WEIGHTS, LUMA_OFFSET);
    let [cb, cr] = differences(p, is_late);
    [to_unit(luma, late_behaviour(is_late)), cb, cr]
}

/// The colour of three signals in unit scale.
pub(in crate::matte) fn from_ycc(signals: [f32; 3]) -> [f32; 3] {
    let [y, cb, cr] = signals.map(|s| s * CODE_MAX);
    color_from_codes(y, cb, cr, 1.0).color().channels()
}

/// The colour of three signals in code values.
#[inline(always)]
fn color_from_codes(y: f32, cb: f32, cr: f32, alpha: f32) -> PremulRgba {
    let (l, cb, cr) = (
        1.164 * (y - LUMA_OFFSET),
        cb - NEUTRAL_CODE,
        cr - NEUTRAL_CODE,
    );
    let (r, g, b) = (l + 1.793 * cr, l - 0.534 * cr - 0.213 * cb, l + 2.115 * cb);
    PremulRgba::new(r / CODE_MAX, g / CODE_MAX, b / CODE_MAX, alpha)
}

/// The pixel with other colour differences, unit scale.
#[inline(always)]
pub(super) fn recolored<M: Model>(p: PremulRgba, cb: f32, cr: f32) -> PremulRgba {
    let p = M::seen(p);
    let luma = code_value(p, LUMA_WEIGHTS, LUMA_OFFSET);
    // Blender 4.5 alone leaves brightness out of the journey to unit scale and back.
    let luma = if M::IS_LATE {
        luma
    } else {
        luma * PER_CODE_MAX * CODE_MAX
    };
    color_from_codes(luma, cb * CODE_MAX, cr * CODE_MAX, p.a)
}

/// Where the colour differences of a photo come from.
#[derive(Clone, Copy)]
struct Differences<'a, P> {
    photo: ImageView<'a, P>,
    careful: bool,
    behaviour: Behaviour,
}

impl<P: Photo> Differences<'_, P> {
    /// Writes both differences of row `y`, unit scale.
    fn row(&self, y: usize, [cb, cr]: [&mut [f32]; 2]) {
        let pixels = self.photo.row(y);
        match (self.behaviour, self.careful) {
            (Behaviour::V45, _) => difference_rows::<P, V45>(pixels, cb, cr),
            (_, true) => difference_rows::<P, Robust>(pixels, cb, cr),
            _ => difference_rows::<P, V34>(pixels, cb, cr),
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
        let p = M::seen(p.premul());
        let behaviour = late_behaviour(M::IS_LATE);
        [*cb, *cr] = DIFFERENCES.map(|w| to_unit(code_value(p, w, NEUTRAL_CODE), behaviour));
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
    windows: [Window; 2],
    /// Finished rows.
    ready: [Window; 2],
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
            windows: [(); 2].map(|()| Window::new(width, capacity + ROWS_AT_ONCE)),
            ready: [(); 2].map(|()| Window::new(width, ROWS_AT_ONCE)),
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
    window: &Window,
    (rows, height): (Range<usize>, usize),
    out: &mut Window,
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
        let (behaviour, width) = (options.profile.behaviour(), photo.width());
        let careful = options.profile == Profile::Robust;
        let both = Differences {
            photo,
            careful,
            behaviour,
        };
        let kernel = BoxKernel::new(behaviour, options.blur_pre as usize, photo.size());
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
