//! Polynomials of the position, one a channel, for the logarithm of the screen.

use super::PlateOptions;
use super::cells::{self, Cell};
use crate::error::Result;
use crate::image::Image;
use crate::matte::check::refused;
use crate::matte::screen::{is_keyable, strongest_channel};
use crate::pixel::LinearRgb;
use crate::quantile::{median, quantile};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A polynomial in x and y for each channel of the screen's logarithm, each of a total degree of its
/// own: two lamps of different colours may light the screen evenly in one channel alone.
#[derive(Clone, Debug)]
pub(super) struct Polynomial {
    /// The highest of the three degrees.
    pub(super) degree: usize,
    /// By which share a hot spot is brighter than the lowest degree that fits most of the screen; 0
    /// without one.
    pub(super) hot_spot: f32,
    /// By which share most of the screen is darker than the fit, where bands, folds or shadows drew
    /// it to what is bright between them; 0 elsewhere.
    pub(super) overshoot: f32,
    /// What is added to each channel before its logarithm.
    lifts: [f64; 3],
    coefficients: [DVector<f64>; 3],
}

/// A channel that is darker than this share of the brightest is held there: the logarithm of
/// nothing is not fitted.
const MIN_BRIGHTNESS: f64 = 1e-4;
/// Rounds of reweighting.
const REWEIGHTING_ROUNDS: usize = 8;
/// Residual in standard deviations beyond which a cell does not count at all (Tukey's biweight, 95
/// % efficient).
const TUKEY_SIGMAS: f64 = 4.685;
/// The same for what is darker than the fit, in standard deviations of what is brighter: objects
/// darken the screen around them far and wide and never brighten it, so that the brighter cells
/// show the noise, and the darker ones the shadow.
const SHADOW_SIGMAS: f64 = 1.5;
/// Relative noise of a cell below which nothing is an outlier: the coding of an 8-bit picture.
const CELL_NOISE: f64 = 2e-3;
/// Cells a coefficient, at least.
const MIN_CELLS_PER_COEFFICIENT: usize = 4;
/// One cell in this many is left out of the fit that chooses the degree.
const HELD_OUT_STRIDE: usize = 3;

/// What is brighter by more than this share than the light that fits most of the screen is a hot
/// spot: at most 0.03 on 24 rendered photos under several lamps, 0.1 to 0.36 with a spot on them.
const MIN_HOT_SPOT: f32 = 0.08;
/// The share of the screen that is darker than what is taken for a hot spot: a speck is none.
const BELOW_HOT_SPOT: f64 = 0.95;
/// A fit that most of the screen is darker than by more than this share is that of its bright parts:
/// at most 0.08 on 24 rendered photos, 0.10 to 0.24 with bands of 10 % and more, or folds.
const MIN_OVERSHOOT: f32 = 0.09;

/// How bright a coloured screen is, by its strongest channel, 1 as its plate. Sheen makes it paler;
/// what has no colour is paper on it.
fn shade(seen: LinearRgb, screen: LinearRgb) -> Option<f32> {
    let key = strongest_channel(screen);
    let is_screen = is_keyable(screen) && is_keyable(seen) && strongest_channel(seen) == key;
    is_screen.then(|| seen.channels()[key] / screen.channels()[key])
}

/// A value that exceeds a bound, or 0.
fn if_above(bound: f32, value: f32) -> f32 {
    if value > bound { value } else { 0.0 }
}

/// A cell as the fit sees it: the monomials of its place, lower degrees first, and its channels'
/// logarithms.
struct FitSample {
    basis: Vec<f64>,
    log: [f64; 3],
}

impl Polynomial {
    /// Fits all channels, each with the lowest degree that is good enough.
    ///
    /// A hot spot on less than half of the cells does not count in the errors by which the degrees are
    /// chosen. But where there is one, the lowest degrees are wrong, and those that fit most of the
    /// screen better are taken, if there are any.
    pub(super) fn fit(
        cells: &[Cell],
        size: (usize, usize),
        options: &PlateOptions,
    ) -> Result<Self> {
        let lifts = [0, 1, 2].map(|c| lift(cells, c));
        let samples = samples(cells, lifts, size, options.max_degree)?;
        let [enough, best] = chosen_degrees(&samples, options);
        let lowest = Self::of_degrees(enough, &samples, lifts);
        let hot_spot = lowest.hot_spot_over(cells, &samples);
        let fitted = if hot_spot > 0.0 && best != enough {
            Self::of_degrees(best, &samples, lifts)
        } else {
            lowest
        };
        let overshoot = fitted.overshoot_over(cells, &samples);
        Ok(Self {
            hot_spot,
            overshoot,
            ..fitted
        })
    }

    fn of_degrees(degrees: [usize; 3], samples: &[FitSample], lifts: [f64; 3]) -> Self {
        let all: Vec<&FitSample> = samples.iter().collect();
        Self {
            degree: degrees.into_iter().max().unwrap_or(0),
            hot_spot: 0.0,
            overshoot: 0.0,
            lifts,
            coefficients: [0, 1, 2].map(|c| robust_fit(&all, degrees[c], c)),
        }
    }

    /// By which share a hot spot is brighter than the fit; 0 without one. Objects darken the screen
    /// around them, but for the caustics of clear ones.
    fn hot_spot_over(&self, cells: &[Cell], samples: &[FitSample]) -> f32 {
        let bright = self.shade_below(BELOW_HOT_SPOT, cells, samples);
        if_above(MIN_HOT_SPOT, bright - 1.0)
    }

    /// By which share most of the screen is darker than the fit; 0 where that is chance.
    fn overshoot_over(&self, cells: &[Cell], samples: &[FitSample]) -> f32 {
        if_above(MIN_OVERSHOOT, 1.0 - self.shade_below(0.5, cells, samples))
    }

    /// The shade that a share of the screen is darker than, 1 as the fit.
    fn shade_below(&self, share: f64, cells: &[Cell], samples: &[FitSample]) -> f32 {
        let pairs = cells.iter().zip(samples);
        let shades = pairs.filter_map(|(cell, sample)| {
            let seen = cell.color.map(|v| v as f32).into();
            shade(seen, self.color(sample))
        });
        quantile(shades.collect(), share, f32::total_cmp).unwrap_or(1.0)
    }

    /// The screen where a sample is.
    fn color(&self, sample: &FitSample) -> LinearRgb {
        let log = |c: usize| value(&self.coefficients[c], sample);
        [0, 1, 2]
            .map(|c| (libm::exp(log(c)) - self.lifts[c]) as f32)
            .into()
    }

    /// The screen in every pixel.
    pub(super) fn image(&self, size: (usize, usize)) -> Image<LinearRgb> {
        let mut out = Image::new(size.0, size.1);
        let columns = (0..size.0).map(|x| normalized([x as f64 + 0.5, 0.0], size)[0] as f32);
        let u: Vec<f32> = columns.collect();
        out.par_rows_mut().enumerate().for_each(|(y, row)| {
            self.fill_row(normalized([0.0, y as f64 + 0.5], size)[1], &u, row)
        });
        out
    }

    fn fill_row(&self, v: f64, u: &[f32], row: &mut [LinearRgb]) {
        let [r, g, b] = [0, 1, 2].map(|c| exponentials(&self.row_coefficients(c, v), u));
        let [lift_r, lift_g, lift_b] = self.lifts.map(|lift| lift as f32);
        for (pixel, (r, (g, b))) in row.iter_mut().zip(r.into_iter().zip(g.into_iter().zip(b))) {
            *pixel = LinearRgb::new(r - lift_r, g - lift_g, b - lift_b);
        }
    }

    /// Coefficients of the polynomial in x that is left of a channel in one row.
    fn row_coefficients(&self, channel: usize, v: f64) -> Vec<f32> {
        let mut along = vec![0.0_f64; self.degree + 1];
        for (&[i, j], k) in exponents(self.degree)
            .iter()
            .zip(self.coefficients[channel].iter())
        {
            along[i] += k * v.powi(j as i32);
        }
        along.into_iter().map(|k| k as f32).collect()
    }
}

/// The exponential of a polynomial, lowest coefficient first, at many places: whole rows, so that
/// they are vectorised.
fn exponentials(coefficients: &[f32], at: &[f32]) -> Vec<f32> {
    let mut values = vec![0.0_f32; at.len()];
    for k in coefficients.iter().rev() {
        values
            .iter_mut()
            .zip(at)
            .for_each(|(value, u)| *value = *value * u + k);
    }
    values.iter_mut().for_each(|value| *value = exp(*value));
    values
}

/// Added to a number and taken away again it leaves the nearest integer: its unit in the last place
/// is 1.
const NEAREST_INTEGER: f32 = 1.5 * (1 << 23) as f32;
/// The logarithm of 2 as the sum of a number of few bits, of which any multiple here is exact, and
/// a small rest.
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];
/// Where the result would be too small or too large for a normal number.
const EXP_RANGE: [f32; 2] = [-87.0, 88.0];

/// `e^x` to two units in the last place, without the branches of `libm` that keep it from being
/// vectorised.
///
/// `e^x = 2^k e^r` with `|r| <= ln 2 / 2`, the latter by its series.
fn exp(x: f32) -> f32 {
    let x = x.clamp(EXP_RANGE[0], EXP_RANGE[1]);
    let k = x * std::f32::consts::LOG2_E + NEAREST_INTEGER - NEAREST_INTEGER;
    let r = x - k * LN_2[0] - k * LN_2[1];
    let series = [
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let small = series.into_iter().fold(0.0, |sum, factor| sum * r + factor);
    // The bits of 2^k: the exponent of a float stands above its 23 others, 127 too large.
    small * f32::from_bits(((k as i32).wrapping_add(127) as u32) << 23)
}

fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The powers of x and y up to a total degree.
fn exponents(degree: usize) -> Vec<[usize; 2]> {
    (0..=degree)
        .flat_map(|total| (0..=total).map(move |j| [total - j, j]))
        .collect()
}

/// A position in units of half the longer side, from the centre.
fn normalized([x, y]: [f64; 2], (w, h): (usize, usize)) -> [f64; 2] {
    let half = 0.5 * w.max(h) as f64;
    [(x - 0.5 * w as f64) / half, (y - 0.5 * h as f64) / half]
}

/// What is added to a channel before its logarithm. A screen outside the gamut of Rec. 709 has less
/// than no light in one: its least then lies as far above 0 as it lay below.
fn lift(cells: &[Cell], channel: usize) -> f64 {
    let values = cells.iter().map(|cell| cell.color[channel]);
    match values.clone().sum::<f64>() < 0.0 {
        true => -2.0 * values.fold(0.0, f64::min),
        false => 0.0,
    }
}

fn samples(
    cells: &[Cell],
    lifts: [f64; 3],
    size: (usize, usize),
    max_degree: usize,
) -> Result<Vec<FitSample>> {
    let exponents = exponents(max_degree);
    let darkest = MIN_BRIGHTNESS * brightest_channel(cells)?;
    let samples = cells.iter().map(|cell| FitSample {
        basis: monomials(&exponents, normalized(cell.at_px, size)),
        log: [0, 1, 2].map(|c| libm::log((cell.color[c] + lifts[c]).max(darkest))),
    });
    Ok(samples.collect())
}

/// The brightest channel of any cell: more than 0.
fn brightest_channel(cells: &[Cell]) -> Result<f64> {
    if cells.is_empty() {
        let what = "the object leaves no background to fit the screen to";
        return Err(refused(what));
    }
    let brightest = cells.iter().flat_map(|cell| cell.color).fold(0.0, f64::max);
    if brightest <= 0.0 {
        let what = "the background is black; a screen plate needs light on the screen";
        return Err(refused(what));
    }
    Ok(brightest)
}

fn monomials(exponents: &[[usize; 2]], [u, v]: [f64; 2]) -> Vec<f64> {
    exponents
        .iter()
        .map(|&[i, j]| u.powi(i as i32) * v.powi(j as i32))
        .collect()
}

/// For each channel the lowest degree that no higher one beats by the least gain; and for each the
/// best one.
fn chosen_degrees(samples: &[FitSample], options: &PlateOptions) -> [[usize; 3]; 2] {
    let split = HeldOut::new(samples);
    let degrees = usable_degrees(samples.len(), options.max_degree);
    let chosen = [0, 1, 2].map(|channel| {
        let errors: Vec<f64> = degrees.iter().map(|&d| split.error(d, channel)).collect();
        lowest_and_best(&degrees, &errors, options.least_gain)
    });
    [0, 1].map(|i| chosen.map(|of_channel| of_channel[i]))
}

/// The lowest degree that no higher one beats by the least gain, and the best one, by their errors at
/// cells that are left out.
fn lowest_and_best(degrees: &[usize], errors: &[f64], least_gain: f64) -> [usize; 2] {
    let best = errors.iter().copied().fold(f64::MAX, f64::min);
    let best = best.max(CELL_NOISE);
    let enough = best / (1.0 - least_gain).max(f64::MIN_POSITIVE);
    [enough, best].map(|most| {
        let lowest = errors.iter().position(|e| *e <= most);
        degrees[lowest.unwrap_or(degrees.len() - 1)]
    })
}

/// The degrees whose coefficients this number of cells can determine.
fn usable_degrees(cells: usize, max_degree: usize) -> Vec<usize> {
    (0..=max_degree)
        .filter(|&d| d == 0 || cells >= MIN_CELLS_PER_COEFFICIENT * terms(d))
        .collect()
}

/// Samples parted in those that are fitted and those that the fit is judged by.
struct HeldOut<'a> {
    fitted: Vec<&'a FitSample>,
    left_out: Vec<&'a FitSample>,
}

impl<'a> HeldOut<'a> {
    fn new(samples: &'a [FitSample]) -> Self {
        let numbered = samples.iter().enumerate();
        let fitted = numbered.filter(|(i, _)| i % HELD_OUT_STRIDE != 0);
        Self {
            fitted: fitted.map(|(_, sample)| sample).collect(),
            left_out: samples.iter().step_by(HELD_OUT_STRIDE).collect(),
        }
    }

    /// Median absolute error of a channel at the cells that were left out.
    fn error(&self, degree: usize, channel: usize) -> f64 {
        if self.fitted.len() < terms(degree) {
            return f64::MAX;
        }
        let k = robust_fit(&self.fitted, degree, channel);
        let errors = self
            .left_out
            .iter()
            .map(|s| (s.log[channel] - value(&k, s)).abs());
        median(errors, f64::total_cmp).unwrap_or(f64::MAX)
    }
}

/// The polynomial where a sample is; the basis may go on to higher degrees.
fn value(k: &DVector<f64>, sample: &FitSample) -> f64 {
    k.iter().zip(&sample.basis).map(|(k, b)| k * b).sum()
}

/// Iteratively reweighted least squares for one channel.
fn robust_fit(samples: &[&FitSample], degree: usize, channel: usize) -> DVector<f64> {
    let mut weights = vec![1.0; samples.len()];
    let mut k = DVector::zeros(terms(degree));
    for _ in 0..REWEIGHTING_ROUNDS {
        k = least_squares(samples, channel, &weights, terms(degree));
        let residuals = samples.iter().map(|s| s.log[channel] - value(&k, s));
        weights = biweights(&residuals.collect::<Vec<_>>());
    }
    k
}

/// Tukey's weights, narrower on the dark side.
fn biweights(residuals: &[f64]) -> Vec<f64> {
    let above = TUKEY_SIGMAS * robust_sigma(residuals.iter());
    let below = SHADOW_SIGMAS * robust_sigma(residuals.iter().filter(|r| **r > 0.0));
    residuals
        .iter()
        .map(|&r| biweight(r / if r > 0.0 { above } else { below }))
        .collect()
}

/// Tukey's weight of a residual in units of its reach.
fn biweight(r: f64) -> f64 {
    (1.0 - r.powi(2)).max(0.0).powi(2)
}

/// Standard deviation by the median of the absolute values, at least the noise of a cell.
fn robust_sigma<'a>(residuals: impl Iterator<Item = &'a f64>) -> f64 {
    cells::robust_sigma(residuals.map(|r| r.abs())).max(CELL_NOISE)
}

/// Weighted least squares by the first `n` monomials, a trace of the identity added so that too few
/// cells are no disaster.
fn least_squares(
    samples: &[&FitSample],
    channel: usize,
    weights: &[f64],
    n: usize,
) -> DVector<f64> {
    let (mut normal, mut right) = (DMatrix::identity(n, n) * RIDGE_WEIGHT, DVector::zeros(n));
    let weighted = samples.iter().zip(weights);
    for (sample, weight) in weighted.filter(|(_, weight)| **weight > 0.0) {
        for i in 0..n {
            let scaled = weight * sample.basis[i];
            right[i] += scaled * sample.log[channel];
            // The lower half is all that Cholesky reads.
            (0..=i).for_each(|j| normal[(i, j)] += scaled * sample.basis[j]);
        }
    }
    normal
        .cholesky()
        .map_or_else(|| DVector::zeros(n), |c| c.solve(&right))
}

/// Far below what a single cell adds.
const RIDGE_WEIGHT: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_libm_to_two_units() {
        for i in -8600..8700 {
            let x = i as f32 * 0.01 + 0.001;
            let (found, expected) = (f64::from(exp(x)), libm::exp(f64::from(x)));
            assert!(
                (found / expected - 1.0).abs() < 2.5e-7,
                "e^{x}: {found}, expected {expected}"
            );
        }
        assert!(exp(f32::INFINITY) < 2e38 && exp(f32::NEG_INFINITY) > 0.0 && exp(0.0) == 1.0);
    }
}
