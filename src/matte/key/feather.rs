//! Feather: the matte grows along a falloff, and blends into a Gaussian blur of itself where it does.

use super::model::Behaviour;
use super::options::{Falloff, KeyOptions};
use super::rows::{Pad, Rows, Source, Window, around, window_rows};

/// Blender's half-width of the unit Gaussian, in units of its own sigma.
const REACH: f32 = 3.0 * 1.6;
/// Twice the variance of that Gaussian.
const TWICE_VARIANCE: f32 = 2.0 * 1.6 * 1.6;

/// A matte feathered along x and then along y.
pub(super) struct Feather<'a> {
    source: Source<'a>,
    kernel: Kernel,
    height: usize,
    /// The row with margins that no candidate comes from.
    candidates: Vec<f32>,
    /// The row with margins that add nothing to a sum.
    samples: Vec<f32>,
    sums: Sums,
    /// Total Gaussian weight inside the picture, for every column.
    columns: Vec<f32>,
    window: Window,
}

/// The two tables, by distance, and what the profile does with them.
struct Kernel {
    gauss: Vec<f32>,
    falloff: Vec<f32>,
    behaviour: Behaviour,
    inward: bool,
}

/// What a row of pixels has found so far.
#[derive(Default)]
struct Sums {
    best: Vec<f32>,
    weight: Vec<f32>,
    blur: Vec<f32>,
}

impl Kernel {
    fn new(opts: &KeyOptions) -> Self {
        let distance = opts.feather_distance.unsigned_abs() as usize;
        let step = 1.0 / distance as f32;
        let behaviour = opts.profile.behaviour();
        let mut gauss: Vec<f32> = (0..=distance).map(|i| gaussian(i as f32 * step)).collect();
        let total = if behaviour.repeats_border() { total_from_centre(&gauss) } else { total_from_left(&gauss) };
        match behaviour {
            Behaviour::V45 => gauss.iter_mut().for_each(|g| *g /= total),
            Behaviour::V34 | Behaviour::V42 => gauss.iter_mut().for_each(|g| *g *= 1.0 / total),
        }
        let falloff = (0..=distance).map(|i| fall(opts.feather_falloff, 1.0 - i as f32 * step)).collect();
        Self { gauss, falloff, behaviour, inward: opts.feather_distance < 0 }
    }

    fn radius(&self) -> usize {
        self.gauss.len() - 1
    }
}

fn total_from_centre(gauss: &[f32]) -> f32 {
    gauss[1..].iter().fold(gauss[0], |sum, g| sum + 2.0 * g)
}

fn total_from_left(gauss: &[f32]) -> f32 {
    gauss.iter().rev().chain(&gauss[1..]).fold(0.0, |sum, g| sum + g)
}

/// The Gaussian at a share `t` of the feather distance, single precision but for the exponential, which is rounded once.
fn gaussian(t: f32) -> f32 {
    let q = t * REACH;
    let height = 1.0 / (std::f32::consts::PI * TWICE_VARIANCE).sqrt();
    height * libm::exp(f64::from(-(q * q / TWICE_VARIANCE))) as f32
}

/// Blender's falloff curves.
fn fall(curve: Falloff, u: f32) -> f32 {
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
    pub(super) fn new(source: Source<'a>, (width, height): (usize, usize), opts: &KeyOptions) -> Self {
        let kernel = Kernel::new(opts);
        let radius = kernel.radius();
        let columns = (0..width).map(|x| kernel.weight_inside(x, width)).collect();
        let sums = Sums { best: vec![0.0; width], weight: vec![0.0; width], blur: vec![0.0; width] };
        let margined = vec![0.0; width + 2 * radius];
        let window = Window::new(width, window_rows(radius, height));
        Self { source, kernel, height, candidates: margined.clone(), samples: margined, sums, columns, window }
    }
}

impl Rows for Feather<'_> {
    fn row(&mut self, y: usize, out: &mut [f32]) {
        let Self { source, kernel, height, candidates, samples, sums, columns, window } = self;
        let radius = kernel.radius();
        window.cover(around(y, radius, *height), |y, row| {
            let width = row.len();
            source.row(y, row);
            kernel.turn(row);
            candidates[radius..radius + width].copy_from_slice(row);
            samples[radius..radius + width].copy_from_slice(row);
            let repeat = kernel.behaviour.repeats_border();
            let pad = |value| if repeat { Pad::Repeat } else { Pad::Value(value) };
            pad(f32::NAN).fill(candidates, radius);
            pad(0.0).fill(samples, radius);
            let at = |offset: usize| (&candidates[offset..offset + width], &samples[offset..offset + width]);
            kernel.gather(sums, row, |side| at(radius.wrapping_add_signed(side)));
            kernel.blend(sums, |x| columns[x], row);
            // The pass along x is done and its result turned back; the pass along y turns it again.
            kernel.turn(row);
            kernel.turn(row);
        });
        // Blender counts rows from the bottom, so the sample at `side` is `side` rows further up.
        let at = |side: isize| {
            let row = window.row(y.saturating_add_signed(-side).min(*height - 1));
            (row, row)
        };
        kernel.gather_inside(sums, window.row(y), (*height - 1 - y, *height), at);
        let total = kernel.weight_inside(*height - 1 - y, *height);
        kernel.blend(sums, |_| total, out);
        kernel.turn(out);
    }
}

impl Kernel {
    /// Feathering inwards is feathering the background outwards.
    fn turn(&self, row: &mut [f32]) {
        if self.inward {
            row.iter_mut().for_each(|m| *m = 1.0 - *m);
        }
    }

    /// The Gaussian weights whose samples lie inside the picture, added up in the order of the visit.
    fn weight_inside(&self, at: usize, length: usize) -> f32 {
        around(at, self.radius(), length).fold(0.0, |sum, other| sum + self.gauss[other.abs_diff(at)])
    }

    /// Visits every sample of the window, in the profile's order.
    fn gather<'r>(&self, sums: &mut Sums, centre: &[f32], at: impl Fn(isize) -> (&'r [f32], &'r [f32])) {
        self.gather_inside(sums, centre, (self.radius(), 2 * self.radius() + 1), at);
    }

    /// As [`gather`](Self::gather), for the position `at` of a picture that is `length` long.
    fn gather_inside<'r>(
        &self,
        sums: &mut Sums,
        centre: &[f32],
        (position, length): (usize, usize),
        at: impl Fn(isize) -> (&'r [f32], &'r [f32]),
    ) {
        sums.best.copy_from_slice(centre);
        sums.weight.fill(1.0);
        sums.blur.fill(0.0);
        let radius = self.radius() as isize;
        let mut visit = |side: isize| {
            let (candidates, samples) = at(side);
            let i = side.unsigned_abs();
            let (falloff, gauss) = (self.falloff[i], self.gauss[i]);
            if self.behaviour == Behaviour::V45 {
                sums.visit::<false>(candidates, samples, falloff, gauss);
            } else {
                sums.visit::<true>(candidates, samples, falloff, gauss);
            }
        };
        if self.behaviour == Behaviour::V45 {
            visit(0);
            (1..=radius).for_each(|i| [-i, i].into_iter().for_each(&mut visit));
        } else {
            let position = position as isize;
            (-radius..=radius).filter(|side| (0..length as isize).contains(&(position + side))).for_each(visit);
        }
    }

    /// The best candidate where there was one, elsewhere more and more of the blur.
    fn blend(&self, sums: &Sums, total: impl Fn(usize) -> f32, out: &mut [f32]) {
        let plain = self.behaviour == Behaviour::V45;
        let pixels = out.iter_mut().zip(&sums.best).zip(&sums.weight).zip(&sums.blur);
        for (x, (((o, best), weight), blur)) in pixels.enumerate() {
            let blur = if plain { *blur } else { blur / total(x) };
            *o = best * weight + blur * (1.0 - weight);
        }
    }
}

impl Sums {
    fn visit<const LIMITED: bool>(&mut self, candidates: &[f32], samples: &[f32], falloff: f32, gauss: f32) {
        visit_row::<LIMITED>(&mut self.best, &mut self.weight, &mut self.blur, candidates, samples, [falloff, gauss]);
    }
}

/// Offers a row of samples to the pixels of a row. `LIMITED` ones must beat the best even before they fall off.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512dq+avx512bw+avx512vl+avx2", "x86_64+avx2", "aarch64+neon"))]
fn visit_row<const LIMITED: bool>(
    best: &mut [f32],
    weight: &mut [f32],
    blur: &mut [f32],
    candidates: &[f32],
    samples: &[f32],
    [falloff, gauss]: [f32; 2],
) {
    let state = best.iter_mut().zip(weight).zip(blur);
    for ((((best, weight), blur), c), s) in state.zip(candidates).zip(samples) {
        let offer = c * falloff;
        let wins = (offer > *best) & (!LIMITED | (c > best));
        *best = if wins { offer } else { *best };
        *weight = if wins { falloff } else { *weight };
        *blur += s * gauss;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_the_published_ones() {
        let opts = KeyOptions { feather_distance: 3, ..KeyOptions::default() };
        let unscaled: Vec<f32> = (0..=3).map(|i| gaussian(i as f32 * (1.0 / 3.0))).collect();
        assert_eq!(unscaled, [0.249338925, 0.151231691, 0.0337443464, 0.00276990514]);
        assert_eq!(Kernel::new(&opts).falloff, [1.0, 0.740740657, 0.259259224, 0.0]);
    }
}
