//! How far lines of sight are displaced, and where that is known.

use super::display::Display;
use super::stripes::SeenStripes;
use super::view::View;
use crate::image::{Image, Mask};
use crate::matte::median::median;
use nalgebra::{DMatrix, DVector};

/// The refraction of an object in the view.
pub(super) struct Bend {
    /// How far from where it would end without the object a line of sight ends, pixels of the
    /// display; 0 where it is not known.
    pub(super) displacement_px: Image<[f64; 2]>,
    pub(super) known: Mask,
    /// Contrast of the stripes through the object, of what its transmittance leaves of it: less
    /// where it scatters.
    pub(super) modulation: Image<f32>,
    /// How far the empty display is from where it should be, root mean square, pixels of the
    /// display.
    pub(super) residual_px: f64,
}

/// Less contrast than this share of what is left by the transmittance says nothing.
const MIN_MODULATION: f32 = 0.1;
/// Nor does less than this share of the empty display's.
const MIN_AMPLITUDE: f32 = 0.02;
/// A displacement of more than this standard error, pixels of the view, is not known.
const MAX_ERROR_PX: f64 = 1.0;
/// A displacement that differs from the median around it by more than this share of a fine period
/// is a wrong period.
const MAX_JUMP: f64 = 0.5;
/// Half width of what is around.
const AROUND_PX: isize = 3;
/// Degree of the polynomial that corrects a lens.
const DEGREE: usize = 3;
/// Pixels between samples of that fit.
const SAMPLE_STEP: usize = 6;
/// Share of the fit's residuals that are dropped as outliers.
const DROPPED_SHARE: f64 = 0.1;

/// What is known of the object and the display, beside the stripes.
pub(super) struct BendInput<'a> {
    pub(super) display: &'a Display,
    pub(super) view: &'a View,
    pub(super) seen: &'a SeenStripes,
    /// The stripes without the object, where they were photographed.
    pub(super) empty: Option<&'a SeenStripes>,
    /// Pixels that surely show the empty display.
    pub(super) free: &'a Mask,
    /// Grey transmittance of the object.
    pub(super) transmittance: &'a Image<f32>,
    /// Grey light of white over black.
    pub(super) light: &'a Image<f32>,
}

impl BendInput<'_> {
    pub(super) fn solve(&self) -> Bend {
        let expected = self.expected();
        let residual_px = self.residual_px(&expected);
        let contrast = self.contrast();
        let modulation = self.modulation(contrast);
        let strong = self.strong(&modulation, contrast, residual_px);
        let difference = self.seen.at_px.zip_map(&expected, difference);
        let jump_px = MAX_JUMP * self.display.period_px(true);
        let known = without_jumps(&difference, &strong, jump_px);
        Bend {
            displacement_px: difference
                .zip_map(&known, |d, known| if known { d } else { [0.0; 2] }),
            known,
            modulation,
            residual_px,
        }
    }

    /// Where the stripes are seen well enough.
    fn strong(&self, modulation: &Image<f32>, contrast: f32, residual_px: f64) -> Mask {
        let least = self.least_amplitude(residual_px);
        let relative = self.seen.amplitude.zip_map(self.light, |a, light| {
            a / (contrast * light).max(f32::MIN_POSITIVE)
        });
        modulation.zip3_map(&relative, &self.seen.consistent, |m, a, consistent| {
            consistent && m >= MIN_MODULATION && a >= least
        })
    }

    /// Where lines of sight end without the object, pixels of the display.
    fn expected(&self) -> Image<[f64; 2]> {
        let fitted = self.fitted();
        let Some(empty) = self.empty else {
            return fitted;
        };
        fitted.zip3_map(
            &empty.at_px,
            &empty.consistent,
            |fitted, seen, consistent| {
                if consistent { seen } else { fitted }
            },
        )
    }

    /// The places of the view, corrected by a polynomial that the free pixels give.
    fn fitted(&self) -> Image<[f64; 2]> {
        let seen = self.empty.unwrap_or(self.seen);
        let corrections = [0, 1].map(|axis| self.correction(seen, axis));
        let (w, h) = self.view.size;
        Image::from_fn(w, h, |x, y| {
            let (at, basis) = (self.view.display_at(x, y), self.basis(x, y));
            [0, 1].map(|axis| at[axis] + dot(&basis, &corrections[axis]))
        })
    }

    /// Coefficients of the correction along an axis.
    fn correction(&self, seen: &SeenStripes, axis: usize) -> Vec<f64> {
        let mut samples = self.samples(seen, axis);
        let first = least_squares(&samples);
        let off = |(basis, value): &(Vec<f64>, f64)| (value - dot(basis, &first)).abs();
        samples.sort_by(|a, b| off(a).total_cmp(&off(b)));
        samples.truncate(((1.0 - DROPPED_SHARE) * samples.len() as f64) as usize);
        least_squares(&samples)
    }

    /// The basis at free pixels, and how far the place that is seen there is off.
    fn samples(&self, seen: &SeenStripes, axis: usize) -> Vec<(Vec<f64>, f64)> {
        let (w, h) = self.view.size;
        let grid = (0..h)
            .step_by(SAMPLE_STEP)
            .flat_map(|y| (0..w).step_by(SAMPLE_STEP).map(move |x| (x, y)));
        let free = grid.filter(|&at| self.free[at] && seen.consistent[at]);
        let off = free.map(|(x, y)| {
            (
                self.basis(x, y),
                seen.at_px[(x, y)][axis] - self.view.display_at(x, y)[axis],
            )
        });
        off.collect()
    }

    /// Monomials of a pixel's place, -1 to 1.
    fn basis(&self, x: usize, y: usize) -> Vec<f64> {
        let (w, h) = self.view.size;
        let [u, v] = [(x, w), (y, h)].map(|(i, n)| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
        let powers = (0..=DEGREE).flat_map(|i| (0..=DEGREE - i).map(move |j| (i, j)));
        powers
            .map(|(i, j)| u.powi(i as i32) * v.powi(j as i32))
            .collect()
    }

    fn free_pixels(&self) -> impl Iterator<Item = usize> + '_ {
        let pixels = self.free.pixels().iter().zip(self.seen.consistent.pixels());
        pixels
            .enumerate()
            .filter(|(_, (free, consistent))| **free && **consistent)
            .map(|(i, _)| i)
    }

    fn residual_px(&self, expected: &Image<[f64; 2]>) -> f64 {
        let squares = self.free_pixels().map(|i| {
            let (seen, expected) = (self.seen.at_px.pixels()[i], expected.pixels()[i]);
            (0..2).map(|k| (seen[k] - expected[k]).powi(2)).sum::<f64>() / 2.0
        });
        let (sum, count) = squares.fold((0.0, 0.0), |(sum, n), square| (sum + square, n + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    }

    /// Amplitude of the fine stripes on the empty display, as a share of its light.
    fn contrast(&self) -> f32 {
        let shares = self
            .free_pixels()
            .map(|i| self.seen.amplitude.pixels()[i] / self.light.pixels()[i].max(1e-6));
        median(shares, f32::total_cmp).unwrap_or(0.5)
    }

    fn modulation(&self, contrast: f32) -> Image<f32> {
        let left = self
            .transmittance
            .zip_map(self.light, |v, light| contrast * v * light);
        self.seen
            .amplitude
            .zip_map(&left, |a, left| (a / left.max(1e-4)).min(1.0))
    }

    /// The amplitude, as a share of the empty display's, at which a place is certain enough.
    fn least_amplitude(&self, residual_px: f64) -> f32 {
        let error_px = residual_px / self.view.display_px;
        MIN_AMPLITUDE.max((error_px / MAX_ERROR_PX) as f32)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Coefficients of the basis that fit best; zeros where there are too few samples.
fn least_squares(samples: &[(Vec<f64>, f64)]) -> Vec<f64> {
    let count = samples.first().map_or(0, |(basis, _)| basis.len());
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for (basis, value) in samples {
        let basis = DVector::from_column_slice(basis);
        normal += &basis * basis.transpose();
        right += &basis * *value;
    }
    let solution = normal.cholesky().map(|c| c.solve(&right));
    solution.map_or_else(|| vec![0.0; count], |s| s.iter().copied().collect())
}

/// The known pixels whose displacement is near the median around them.
fn without_jumps(displacement: &Image<[f64; 2]>, known: &Mask, most: f64) -> Mask {
    let (w, h) = known.size();
    Image::from_fn(w, h, |x, y| {
        known[(x, y)]
            && [0, 1].iter().all(|&axis| {
                let middle = median_around(displacement, known, (x, y), axis);
                middle.is_some_and(|middle| (displacement[(x, y)][axis] - middle).abs() <= most)
            })
    })
}

fn median_around(
    displacement: &Image<[f64; 2]>,
    known: &Mask,
    (x, y): (usize, usize),
    axis: usize,
) -> Option<f64> {
    let around =
        (-AROUND_PX..=AROUND_PX).flat_map(|j| (-AROUND_PX..=AROUND_PX).map(move |i| (i, j)));
    let places = around.map(|(i, j)| (x as isize + i, y as isize + j));
    let near = places.filter(|&(x, y)| known.nearest(x, y));
    let values = near.map(|(x, y)| displacement.nearest(x, y)[axis]);
    median(values, f64::total_cmp)
}
