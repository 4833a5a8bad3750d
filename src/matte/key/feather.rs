//! Feather: the matte grows along a falloff, and blends into a Gaussian blur of itself where it
//! does.

use super::box_blur::from_the_middle;
use super::calm::{Calm, Extremes, RUN_COLUMNS};
use super::model::Behaviour;
use super::options::{Falloff, KeyOptions};
use super::rows::{Pad, RowWindow, Rows, Source, rows_around, window_rows};

/// Blender's half-width of the unit Gaussian, in units of its own sigma.
const GAUSSIAN_REACH: f32 = 3.0 * 1.6;
/// Twice the variance of that Gaussian.
const TWICE_VARIANCE: f32 = 2.0 * 1.6 * 1.6;

/// A matte feathered along x and then along y.
pub(super) struct Feather<'a> {
    source: Source<'a>,
    kernel: FeatherKernel,
    height: usize,
    /// The row with margins that no candidate comes from.
    candidates: Vec<f32>,
    /// The row with margins that add nothing to a sum.
    samples: Vec<f32>,
    /// Total Gaussian weight inside the picture, for every column.
    columns: Vec<f32>,
    window: RowWindow,
    /// Extremes of the source's latest row, and of the rows feathered along x.
    calm_source: Calm,
    calm: Calm,
}

/// The two tables, by distance, and what the profile does with them.
struct FeatherKernel {
    gauss: Vec<f32>,
    falloff: Vec<f32>,
    /// Offsets in the order in which samples are visited.
    order: Vec<isize>,
    behaviour: Behaviour,
    inward: bool,
}

impl FeatherKernel {
    fn new(options: &KeyOptions) -> Self {
        let distance = options.feather_distance.unsigned_abs() as usize;
        let step = 1.0 / distance as f32;
        let behaviour = options.profile.behaviour();
        let falloff = (0..=distance)
            .map(|i| falloff_weight(options.feather_falloff, 1.0 - i as f32 * step))
            .collect();
        Self {
            gauss: gaussian_table(distance, behaviour),
            falloff,
            order: visiting_order(distance, behaviour),
            behaviour,
            inward: options.feather_distance < 0,
        }
    }

    fn radius(&self) -> usize {
        self.gauss.len() - 1
    }
}

/// Gaussian weights by distance, over their sum as the profile rounds it.
fn gaussian_table(distance: usize, behaviour: Behaviour) -> Vec<f32> {
    let step = 1.0 / distance as f32;
    let mut gauss: Vec<f32> = (0..=distance)
        .map(|i| gaussian_weight(i as f32 * step))
        .collect();
    let total = if behaviour.repeats_border() {
        total_from_centre(&gauss)
    } else {
        total_from_left(&gauss)
    };
    for weight in &mut gauss {
        match behaviour {
            Behaviour::V45 => *weight /= total,
            Behaviour::V34 | Behaviour::V42 => *weight *= 1.0 / total,
        }
    }
    gauss
}

/// Offsets in the order in which the profile visits samples.
fn visiting_order(radius: usize, behaviour: Behaviour) -> Vec<isize> {
    match behaviour {
        // At each distance the one behind first.
        Behaviour::V45 => from_the_middle(radius).map(|ahead| -ahead).collect(),
        Behaviour::V34 | Behaviour::V42 => (-(radius as isize)..=radius as isize).collect(),
    }
}

fn total_from_centre(gauss: &[f32]) -> f32 {
    gauss[1..].iter().fold(gauss[0], |sum, g| sum + 2.0 * g)
}

fn total_from_left(gauss: &[f32]) -> f32 {
    gauss
        .iter()
        .rev()
        .chain(&gauss[1..])
        .fold(0.0, |sum, g| sum + g)
}

/// The Gaussian at a share `t` of the feather distance, single precision but for the exponential,
/// which is rounded once.
fn gaussian_weight(t: f32) -> f32 {
    let q = t * GAUSSIAN_REACH;
    let height = 1.0 / (std::f32::consts::PI * TWICE_VARIANCE).sqrt();
    height * libm::exp(f64::from(-(q * q / TWICE_VARIANCE))) as f32
}

/// Blender's falloff curves.
fn falloff_weight(curve: Falloff, u: f32) -> f32 {
    match curve {
        Falloff::Smooth => 3.0 * u * u - 2.0 * u * u * u,
        Falloff::Sphere => (2.0 * u - u * u).sqrt(),
        Falloff::Root => u.sqrt(),
        Falloff::InverseSquare => u * (2.0 - u),
        Falloff::Sharp => u * u,
        Falloff::Linear => u,
    }
}

impl<'a> Feather<'a> {
    pub(super) fn new(
        source: Source<'a>,
        (width, height): (usize, usize),
        options: &KeyOptions,
    ) -> Self {
        let kernel = FeatherKernel::new(options);
        let margined = vec![0.0; width + 2 * kernel.radius()];
        let capacity = window_rows(kernel.radius(), height);
        Self {
            source,
            height,
            candidates: margined.clone(),
            samples: margined,
            columns: (0..width).map(|x| kernel.weight_inside(x, width)).collect(),
            window: RowWindow::new(width, capacity),
            calm_source: Calm::new(width, 1),
            calm: Calm::new(width, capacity),
            kernel,
        }
    }
}

impl Rows for Feather<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let Self {
            source,
            kernel,
            height,
            candidates,
            samples,
            columns,
            window,
            calm_source,
            calm,
        } = self;
        let radius = kernel.radius();
        window.cover_rows(rows_around(y, radius, *height), |y, row| {
            let inside = radius..radius + row.len();
            let given = &mut samples[inside.clone()];
            source.row(y, given);
            kernel.invert_if_inward(given);
            calm_source.note_row(0, given);
            candidates[inside.clone()].copy_from_slice(given);
            kernel.fill_margins(candidates, samples);
            kernel.along_x([candidates, samples], columns, calm_source, row);
            // The pass along x ends by turning its result back, the pass along y begins by turning
            // it again.
            kernel.invert_if_inward(row);
            kernel.invert_if_inward(row);
            calm.note_row(y, row);
        });
        kernel.along_y(window, calm, (y, *height), out);
        kernel.invert_if_inward(out);
    }
}

/// A row of candidates and the same row as samples of a sum, with the falloff and the Gaussian
/// weight at its distance.
type Tap<'r> = ([&'r [f32]; 2], [f32; 2]);

impl FeatherKernel {
    /// Feathering inwards is feathering the background outwards.
    fn invert_if_inward(&self, row: &mut [f32]) {
        if self.inward {
            row.iter_mut().for_each(|m| *m = 1.0 - *m);
        }
    }

    /// Fills what stands to both sides of a row.
    fn fill_margins(&self, candidates: &mut [f32], samples: &mut [f32]) {
        let repeat = self.behaviour.repeats_border();
        for (padded, value) in [(candidates, f32::NAN), (samples, 0.0)] {
            Pad::repeat_or(repeat, value).fill_margins(padded, self.radius());
        }
    }

    /// The Gaussian weights whose samples lie inside the picture, added up in the order of the
    /// visit.
    fn weight_inside(&self, at: usize, length: usize) -> f32 {
        rows_around(at, self.radius(), length)
            .fold(0.0, |sum, other| sum + self.gauss[other.abs_diff(at)])
    }

    /// Nothing can beat a block that is all at the greatest value of its window.
    fn settled_value(own: Extremes, near: Extremes) -> Option<f32> {
        (own.least >= near.greatest && near.least >= 0.0 && near.greatest < f32::INFINITY)
            .then_some(own.least + 0.0)
    }

    fn along_x(
        &self,
        [candidates, samples]: [&[f32]; 2],
        totals: &[f32],
        calm: &mut Calm,
        out: &mut [f32],
    ) {
        let radius = self.radius();
        calm.fill_row(
            out,
            (0, 0..1, radius),
            Self::settled_value,
            |columns, out| {
                let shifted = |side: isize| {
                    let offset = radius.wrapping_add_signed(side);
                    let at = columns.start + offset..columns.end + offset;
                    [&candidates[at.clone()], &samples[at]]
                };
                self.visit_taps(&self.order, shifted, &totals[columns.clone()], out);
            },
        );
    }

    /// The order of the samples that lie inside, `up` rows above the bottom. Windows that are cut
    /// off keep the middle of the order, which runs upwards for them.
    fn order_inside(&self, up: usize, height: usize) -> &[isize] {
        match self.behaviour {
            Behaviour::V45 => &self.order[..],
            _ => {
                &self.order[self.radius().saturating_sub(up)..]
                    [..rows_around(up, self.radius(), height).len()]
            }
        }
    }

    /// Blender counts rows from the bottom, so an offset of 1 is one row up.
    fn along_y(
        &self,
        window: &RowWindow,
        calm: &mut Calm,
        (y, height): (usize, usize),
        out: &mut [f32],
    ) {
        let up = height - 1 - y;
        let total = self.weight_inside(up, height);
        let order = self.order_inside(up, height);
        calm.fill_row(
            out,
            (y, rows_around(y, self.radius(), height), 0),
            Self::settled_value,
            |columns, out| {
                let row = |side: isize| {
                    let row = &window.row(y.saturating_add_signed(-side).min(height - 1))
                        [columns.clone()];
                    [row, row]
                };
                self.visit_taps(order, row, &[total; RUN_COLUMNS][..columns.len()], out);
            },
        );
    }

    /// Visits every sample of the window in order, and blends: the best candidate where there was
    /// one, elsewhere more and more of the Gaussian mean.
    fn visit_taps<'r>(
        &self,
        order: &[isize],
        row: impl Fn(isize) -> [&'r [f32]; 2],
        totals: &[f32],
        out: &mut [f32],
    ) {
        // Longer than elsewhere: three buffers on the stack are lent to one loop for every kind of
        // window.
        let tap = |side: isize| -> Tap<'r> {
            let i = side.unsigned_abs();
            (row(side), [self.falloff[i], self.gauss[i]])
        };
        let len = out.len();
        let mut found = ([0.0; RUN_COLUMNS], [1.0; RUN_COLUMNS], [0.0; RUN_COLUMNS]);
        let (best, weight, blur) = (
            &mut found.0[..len],
            &mut found.1[..len],
            &mut found.2[..len],
        );
        best.copy_from_slice(row(0)[0]);
        let state = [best, weight, blur];
        if self.behaviour == Behaviour::V45 {
            offer_all::<false, _>(state, order, tap);
            blend_row(&found, &[1.0; RUN_COLUMNS][..len], out);
        } else {
            offer_all::<true, _>(state, order, tap);
            blend_row(&found, totals, out);
        }
    }
}

/// `best weight + blur (1 - weight)`, the blur being a sum over the total of its weights.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn blend_row(
    (best, weight, blur): &([f32; RUN_COLUMNS], [f32; RUN_COLUMNS], [f32; RUN_COLUMNS]),
    totals: &[f32],
    out: &mut [f32],
) {
    for ((((o, best), weight), blur), total) in
        out.iter_mut().zip(best).zip(weight).zip(blur).zip(totals)
    {
        *o = best * weight + blur / total * (1.0 - weight);
    }
}

/// Taps offered in one go, so that what was found stays in registers; the order is that of one at a
/// time.
const TAPS_AT_ONCE: usize = 4;

/// Offers all taps in order to the pixels of a row: best candidate, its weight, sum of the blur.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2",
    "x86_64+avx2",
    "aarch64+neon"
))]
fn offer_all<'r, const LIMITED: bool, F: Fn(isize) -> Tap<'r>>(
    state: [&mut [f32]; 3],
    order: &[isize],
    tap: F,
) {
    let [best, weight, blur] = state;
    let groups = order.chunks_exact(TAPS_AT_ONCE);
    let rest = groups.remainder();
    for group in groups {
        let taps = [tap(group[0]), tap(group[1]), tap(group[2]), tap(group[3])];
        offer_taps::<LIMITED, TAPS_AT_ONCE>(best, weight, blur, taps);
    }
    for side in rest {
        offer_taps::<LIMITED, 1>(best, weight, blur, [tap(*side)]);
    }
}

/// `LIMITED` candidates must beat the best even before they fall off.
#[inline(always)]
fn offer_taps<const LIMITED: bool, const N: usize>(
    best: &mut [f32],
    weight: &mut [f32],
    blur: &mut [f32],
    taps: [Tap<'_>; N],
) {
    // Longer than elsewhere: all that happens to a pixel stands in one loop, which is made vectors
    // of.
    let len = best.len();
    let (weight, blur) = (&mut weight[..len], &mut blur[..len]);
    let rows = taps.map(|([candidates, samples], _)| (&candidates[..len], &samples[..len]));
    for x in 0..len {
        let (mut b, mut w, mut sum) = (best[x], weight[x], blur[x]);
        for (&(candidates, samples), (_, [falloff, gauss])) in rows.iter().zip(&taps) {
            let candidate = candidates[x];
            let offer = candidate * falloff;
            let wins = (offer > b) & (!LIMITED | (candidate > b));
            b = if wins { offer } else { b };
            w = if wins { *falloff } else { w };
            sum += samples[x] * gauss;
        }
        (best[x], weight[x], blur[x]) = (b, w, sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[expect(
        clippy::excessive_precision,
        reason = "numbers with the nine digits that Blender prints"
    )]
    #[test]
    fn the_tables_are_the_published_ones() {
        let options = KeyOptions {
            feather_distance: 3,
            ..KeyOptions::default()
        };
        let unscaled: Vec<f32> = (0..=3)
            .map(|i| gaussian_weight(i as f32 * (1.0 / 3.0)))
            .collect();
        assert_eq!(
            unscaled,
            [0.249338925, 0.151231691, 0.0337443464, 0.00276990514]
        );
        assert_eq!(
            FeatherKernel::new(&options).falloff,
            [1.0, 0.740740657, 0.259259224, 0.0]
        );
    }
}
