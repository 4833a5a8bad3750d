//! Polynomials of the position, one a channel, for the logarithm of the screen.

use super::cells::{Cell, SIGMA_OF_MEDIAN, cell_side, median};
use super::{PlateOptions, refused};
use crate::error::Result;
use crate::image::Image;
use crate::pixel::LinearRgb;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A polynomial in x and y of a total degree for each channel of the screen's logarithm.
#[derive(Clone, Debug)]
pub(super) struct Polynomial {
    pub(super) degree: usize,
    coefficients: [DVector<f64>; 3],
}

/// A channel that is darker than this share of the brightest is held there: the logarithm of nothing is not fitted.
const DARKEST: f64 = 1e-4;
/// Rounds of reweighting.
const ROUNDS: usize = 8;
/// Residual in standard deviations beyond which a cell does not count at all (Tukey's biweight, 95 % efficient).
const TUKEY: f64 = 4.685;
/// The same for what is darker than the fit, in standard deviations of what is brighter: objects darken the screen around
/// them far and wide and never brighten it, so that the brighter cells tell the noise, and the darker the shadow.
const SHADOWED: f64 = 1.5;
/// Relative noise of a cell below which nothing is an outlier: the coding of an 8-bit picture.
const FINEST: f64 = 2e-3;
/// Cells a coefficient, at least.
const CELLS_A_COEFFICIENT: usize = 4;
/// Sectors around the middle of what is hidden; one after the other is left out of the fits that choose the degree.
const SECTORS: usize = 8;
/// So many neighbouring cells err alike: shadows and reflections are as wide as a sixth of a picture of 48 x 26 cells.
const ALIKE: f64 = 200.0;

/// A cell as the fit sees it: the monomials of its place, lower degrees first, its channels' logarithms, and the sector it
/// lies in.
struct Sample {
    sector: usize,
    basis: Vec<f64>,
    log: [f64; 3],
}

impl Polynomial {
    pub(super) fn fit(cells: &[Cell], size: (usize, usize), opts: &PlateOptions) -> Result<Self> {
        let hidden = hidden(cells, size);
        let samples = samples(cells, size, middle(&hidden, size), opts.max_degree)?;
        let all: Vec<&Sample> = samples.iter().collect();
        let channel = brightest(&all);
        let enough = |degree: usize| samples.len() >= CELLS_A_COEFFICIENT * terms(degree);
        let degrees = (0..=opts.max_degree).filter(|&d| d == 0 || enough(d));
        let scored = degrees.map(|degree| (degree, expected_error(&all, &hidden, degree, channel, size)));
        let (degree, _) = scored.fold((0, f64::MAX), |best, next| if next.1 < best.1 { next } else { best });
        Ok(Self { degree, coefficients: [0, 1, 2].map(|c| robust(&all, degree, c).0) })
    }

    /// The screen in every pixel.
    pub(super) fn image(&self, size: (usize, usize)) -> Image<LinearRgb> {
        let (w, h) = size;
        let mut out = Image::new(w, h);
        let u: Vec<f32> = (0..w).map(|x| place([x as f64 + 0.5, 0.0], size)[0] as f32).collect();
        out.par_rows_mut().enumerate().for_each(|(y, row): (usize, &mut [LinearRgb])| {
            let v = place([0.0, y as f64 + 0.5], size)[1];
            let [r, g, b] = [0, 1, 2].map(|c| exponentials(&self.along(c, v), &u));
            for (pixel, (r, (g, b))) in row.iter_mut().zip(r.into_iter().zip(g.into_iter().zip(b))) {
                *pixel = LinearRgb::new(r, g, b);
            }
        });
        out
    }

    /// Coefficients of the polynomial in x that is left of a channel in one row.
    fn along(&self, channel: usize, v: f64) -> Vec<f32> {
        let mut along = vec![0.0_f64; self.degree + 1];
        for (&[i, j], k) in exponents(self.degree).iter().zip(self.coefficients[channel].iter()) {
            along[i] += k * v.powi(j as i32);
        }
        along.into_iter().map(|k| k as f32).collect()
    }
}

/// The exponential of a polynomial, lowest coefficient first, at many places: whole rows, so that they are vectorised.
fn exponentials(coefficients: &[f32], at: &[f32]) -> Vec<f32> {
    let mut values = vec![0.0_f32; at.len()];
    for k in coefficients.iter().rev() {
        values.iter_mut().zip(at).for_each(|(value, u)| *value = *value * u + k);
    }
    values.iter_mut().for_each(|value| *value = exp(*value));
    values
}

/// Added to a number and taken away again it leaves the nearest whole one: its unit in the last place is 1.
const ROUNDER: f32 = 1.5 * (1 << 23) as f32;
/// The logarithm of 2 as the sum of a number of few bits, of which any multiple here is exact, and a small rest.
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];
/// Where the result would be too small or too large for a normal number.
const EXP_RANGE: [f32; 2] = [-87.0, 88.0];

/// `e^x` to two units in the last place, without the branches of `libm` that keep it from being vectorised.
///
/// `e^x = 2^k e^r` with `|r| <= ln 2 / 2`, the latter by its series.
fn exp(x: f32) -> f32 {
    let x = x.clamp(EXP_RANGE[0], EXP_RANGE[1]);
    let k = x * std::f32::consts::LOG2_E + ROUNDER - ROUNDER;
    let r = x - k * LN_2[0] - k * LN_2[1];
    let series = [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let small = series.into_iter().fold(0.0, |sum, factor| sum * r + factor);
    // The bits of 2^k: the exponent of a float stands above its 23 others, 127 too large.
    small * f32::from_bits(((k as i32).wrapping_add(127) as u32) << 23)
}

fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The powers of x and y up to a total degree.
fn exponents(degree: usize) -> Vec<[usize; 2]> {
    (0..=degree).flat_map(|total| (0..=total).map(move |j| [total - j, j])).collect()
}

/// A position in units of half the longer side, from the centre.
fn place([x, y]: [f64; 2], (w, h): (usize, usize)) -> [f64; 2] {
    let half = 0.5 * w.max(h) as f64;
    [(x - 0.5 * w as f64) / half, (y - 0.5 * h as f64) / half]
}

/// The middles of the cells that do not show the screen; of a screen that is all seen, none.
fn hidden(cells: &[Cell], (w, h): (usize, usize)) -> Vec<[f64; 2]> {
    let side = cell_side((w, h));
    let (columns, rows) = (w.div_ceil(side), h.div_ceil(side));
    let mut seen = vec![false; columns * rows];
    cells.iter().for_each(|cell| seen[cell.index[1] * columns + cell.index[0]] = true);
    let middle = |i: usize| [i % columns, i / columns].map(|k| (k as f64 + 0.5) * side as f64);
    (0..seen.len()).filter(|&i| !seen[i]).map(middle).collect()
}

/// The mean of some places; the middle of the picture where there are none.
fn middle(places: &[[f64; 2]], (w, h): (usize, usize)) -> [f64; 2] {
    if places.is_empty() {
        return [0.5 * w as f64, 0.5 * h as f64];
    }
    [0, 1].map(|axis| places.iter().map(|p| p[axis]).sum::<f64>() / places.len() as f64)
}

/// The sector that a place lies in, of a picture made square.
fn sector([x, y]: [f64; 2], around: [f64; 2], (w, h): (usize, usize)) -> usize {
    let turn = 0.5 + libm::atan2((y - around[1]) / h as f64, (x - around[0]) / w as f64) / std::f64::consts::TAU;
    ((turn * SECTORS as f64) as usize) % SECTORS
}

fn monomials([u, v]: [f64; 2], exponents: &[[usize; 2]]) -> Vec<f64> {
    exponents.iter().map(|&[i, j]| u.powi(i as i32) * v.powi(j as i32)).collect()
}

fn samples(cells: &[Cell], size: (usize, usize), around: [f64; 2], max_degree: usize) -> Result<Vec<Sample>> {
    let brightest = cells.iter().flat_map(|cell| cell.color).fold(0.0, f64::max);
    if cells.is_empty() {
        return Err(refused("the object leaves no background to fit the screen to"));
    }
    if brightest <= 0.0 {
        return Err(refused("the background is black; a screen plate needs light on the screen"));
    }
    let exponents = exponents(max_degree);
    let sample = |cell: &Cell| Sample {
        sector: sector(cell.at_px, around, size),
        basis: monomials(place(cell.at_px, size), &exponents),
        log: cell.color.map(|c| libm::log(c.max(DARKEST * brightest))),
    };
    Ok(cells.iter().map(sample).collect())
}

/// The channel whose logarithm sums to most: the others have its shape and more noise.
fn brightest(samples: &[&Sample]) -> usize {
    let brightness = |c: usize| samples.iter().map(|s| s.log[c]).sum::<f64>();
    (1..3).fold(0, |best, c| if brightness(c) > brightness(best) { c } else { best })
}

/// What a polynomial of a degree can be expected to be off where the object hides the screen, squared.
///
/// # Method
/// Sector by sector, the median error of cells that a fit to the others leaves: that is what going on into the unseen
/// costs. Under the object it grows by the polynomial's leverage there, `b (B' W B)^-1 b`, as often as cells err alike.
fn expected_error(
    samples: &[&Sample],
    hidden: &[[f64; 2]],
    degree: usize,
    channel: usize,
    size: (usize, usize),
) -> f64 {
    let left_out = |sector: usize| {
        let (asked, left): (Vec<&Sample>, Vec<&Sample>) = samples.iter().partition(|s| s.sector != sector);
        let possible = asked.len() >= terms(degree) && !left.is_empty();
        possible.then(|| {
            let (k, _) = robust(&asked, degree, channel);
            median(left.iter().map(|s| (s.log[channel] - value(&k, s)).abs())).unwrap_or(0.0)
        })
    };
    let errors: Vec<f64> = (0..SECTORS).filter_map(left_out).collect();
    let error = (errors.iter().sum::<f64>() / errors.len().max(1) as f64).max(FINEST);
    error * error * (1.0 + ALIKE * leverage(samples, hidden, degree, channel, size))
}

/// Mean variance of a polynomial at some places, for a variance of 1 of every cell that it is fitted to.
fn leverage(samples: &[&Sample], places: &[[f64; 2]], degree: usize, channel: usize, size: (usize, usize)) -> f64 {
    let weights = robust(samples, degree, channel).1;
    let Some(normal) = normal_equations(samples, channel, &weights, terms(degree)).0.cholesky() else {
        return f64::MAX;
    };
    let inverse = normal.inverse();
    let exponents = exponents(degree);
    let variance = |at: &[f64; 2]| {
        let basis = DVector::from_vec(monomials(place(*at, size), &exponents));
        basis.dot(&(&inverse * &basis))
    };
    places.iter().map(variance).sum::<f64>() / places.len().max(1) as f64
}

/// The polynomial where a sample is; the basis may go on to higher degrees.
fn value(k: &DVector<f64>, sample: &Sample) -> f64 {
    k.iter().zip(&sample.basis).map(|(k, b)| k * b).sum()
}

/// Iteratively reweighted least squares for one channel: the coefficients, and what every sample counts in the end.
fn robust(samples: &[&Sample], degree: usize, channel: usize) -> (DVector<f64>, Vec<f64>) {
    let mut weights = vec![1.0; samples.len()];
    let mut k = DVector::zeros(terms(degree));
    for _ in 0..ROUNDS {
        k = solved(samples, channel, &weights, terms(degree));
        let residuals: Vec<f64> = samples.iter().map(|s| s.log[channel] - value(&k, s)).collect();
        let spread = |set: &dyn Fn(f64) -> bool| {
            let chosen = residuals.iter().filter(|r| set(**r)).map(|r| r.abs());
            (SIGMA_OF_MEDIAN * median(chosen).unwrap_or(0.0)).max(FINEST)
        };
        let (above, below) = (TUKEY * spread(&|_| true), SHADOWED * spread(&|r| r > 0.0));
        let reach = |r: f64| if r > 0.0 { above } else { below };
        weights = residuals.iter().map(|r| (1.0 - (r / reach(*r)).powi(2)).max(0.0).powi(2)).collect();
    }
    (k, weights)
}

/// Weighted least squares by the first `n` monomials.
fn solved(samples: &[&Sample], channel: usize, weights: &[f64], n: usize) -> DVector<f64> {
    let (normal, right) = normal_equations(samples, channel, weights, n);
    normal.cholesky().map_or_else(|| DVector::zeros(n), |c| c.solve(&right))
}

/// Their lower half, which is all that Cholesky reads, a trace of the identity added so that too few cells are no disaster.
fn normal_equations(samples: &[&Sample], channel: usize, weights: &[f64], n: usize) -> (DMatrix<f64>, DVector<f64>) {
    let (mut normal, mut right) = (DMatrix::identity(n, n) * RIDGE, DVector::zeros(n));
    for (sample, weight) in samples.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        for i in 0..n {
            let scaled = weight * sample.basis[i];
            right[i] += scaled * sample.log[channel];
            (0..=i).for_each(|j| normal[(i, j)] += scaled * sample.basis[j]);
        }
    }
    (normal, right)
}

/// Far below what a single cell adds.
const RIDGE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_that_of_libm_to_two_units() {
        for i in -8600..8700 {
            let x = i as f32 * 0.01 + 0.001;
            let (found, expected) = (f64::from(exp(x)), libm::exp(f64::from(x)));
            assert!((found / expected - 1.0).abs() < 2.5e-7, "e^{x}: {found}, expected {expected}");
        }
        assert!(exp(f32::INFINITY) < 2e38 && exp(f32::NEG_INFINITY) > 0.0 && exp(0.0) == 1.0);
    }
}
