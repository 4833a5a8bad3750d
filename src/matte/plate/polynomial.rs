//! Polynomials of the position, one a channel, for the logarithm of the screen.

use super::cells::{Cell, SIGMA_OF_MEDIAN, median};
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
const ROUNDS: usize = 12;
/// Residual in standard deviations beyond which a cell does not count at all (Tukey's biweight, 95 % efficient).
const TUKEY: f64 = 4.685;
/// Relative noise of a cell below which nothing is an outlier: the coding of an 8-bit picture.
const FINEST: f64 = 2e-3;
/// Cells a coefficient, at least.
const CELLS_A_COEFFICIENT: usize = 4;
/// Every so many-th cell is left out of the fit that chooses the degree.
const LEFT_OUT: usize = 3;

/// A cell as the fit sees it.
struct Sample {
    at: [f64; 2],
    log: [f64; 3],
}

impl Polynomial {
    pub(super) fn fit(cells: &[Cell], size: (usize, usize), opts: &PlateOptions) -> Result<Self> {
        let samples = samples(cells, size)?;
        let most = |degree: usize| samples.len() >= CELLS_A_COEFFICIENT * terms(degree);
        let degrees: Vec<usize> = (0..=opts.max_degree).filter(|&d| d == 0 || most(d)).collect();
        let errors: Vec<f64> = degrees.iter().map(|&degree| left_out_error(&samples, degree)).collect();
        let best = errors.iter().copied().fold(f64::MAX, f64::min).max(FINEST);
        let enough = errors.iter().position(|e| *e <= best / (1.0 - opts.least_gain).max(f64::MIN_POSITIVE));
        let degree = degrees[enough.unwrap_or(degrees.len() - 1)];
        Ok(Self { degree, coefficients: [0, 1, 2].map(|c| robust(&samples, degree, c)) })
    }

    /// The screen in every pixel.
    pub(super) fn image(&self, size: (usize, usize)) -> Image<LinearRgb> {
        let (w, h) = size;
        let mut out = Image::new(w, h);
        out.par_rows_mut().enumerate().for_each(|(y, row): (usize, &mut [LinearRgb])| {
            let along = [0, 1, 2].map(|c| self.along(c, place([0.0, y as f64 + 0.5], size)[1]));
            for (x, pixel) in row.iter_mut().enumerate() {
                let u = place([x as f64 + 0.5, 0.0], size)[0] as f32;
                let value = |c: usize| libm::expf(along[c].iter().rev().fold(0.0_f32, |sum, k| sum * u + k));
                *pixel = LinearRgb::new(value(0), value(1), value(2));
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

fn samples(cells: &[Cell], size: (usize, usize)) -> Result<Vec<Sample>> {
    let brightest = cells.iter().flat_map(|cell| cell.color).fold(0.0, f64::max);
    if cells.is_empty() {
        return Err(refused("the object leaves no background to fit the screen to"));
    }
    if brightest <= 0.0 {
        return Err(refused("the background is black; a screen plate needs light on the screen"));
    }
    let log = |cell: &Cell| cell.color.map(|c| libm::log(c.max(DARKEST * brightest)));
    Ok(cells.iter().map(|cell| Sample { at: place(cell.at_px, size), log: log(cell) }).collect())
}

/// Median absolute error of the cells that a fit to the others leaves, of the channel that is fitted worst.
fn left_out_error(samples: &[Sample], degree: usize) -> f64 {
    let (asked, left): (Vec<_>, Vec<_>) = samples.iter().enumerate().partition(|(i, _)| i % LEFT_OUT != 0);
    let strip = |part: Vec<(usize, &Sample)>| -> Vec<Sample> {
        part.into_iter().map(|(_, s)| Sample { at: s.at, log: s.log }).collect()
    };
    let (asked, left) = (strip(asked), strip(left));
    if asked.len() < terms(degree) {
        return f64::MAX;
    }
    let channel = |c: usize| {
        let k = robust(&asked, degree, c);
        median(left.iter().map(|s| (s.log[c] - value(&k, s.at, degree)).abs())).unwrap_or(f64::MAX)
    };
    (0..3).map(channel).fold(0.0, f64::max)
}

fn value(k: &DVector<f64>, [u, v]: [f64; 2], degree: usize) -> f64 {
    exponents(degree).iter().zip(k.iter()).map(|(&[i, j], k)| k * u.powi(i as i32) * v.powi(j as i32)).sum()
}

/// Iteratively reweighted least squares for one channel.
fn robust(samples: &[Sample], degree: usize, channel: usize) -> DVector<f64> {
    let basis: Vec<DVector<f64>> = samples
        .iter()
        .map(|s| {
            let monomial = |&[i, j]: &[usize; 2]| s.at[0].powi(i as i32) * s.at[1].powi(j as i32);
            DVector::from_vec(exponents(degree).iter().map(monomial).collect())
        })
        .collect();
    let logs: Vec<f64> = samples.iter().map(|s| s.log[channel]).collect();
    let mut weights = vec![1.0; samples.len()];
    let mut k = DVector::zeros(terms(degree));
    for _ in 0..ROUNDS {
        k = solved(&basis, &logs, &weights);
        let residuals: Vec<f64> = basis.iter().zip(&logs).map(|(b, log)| log - b.dot(&k)).collect();
        let sigma = SIGMA_OF_MEDIAN * median(residuals.iter().map(|r| r.abs())).unwrap_or(0.0);
        let reach = TUKEY * sigma.max(FINEST);
        weights = residuals.iter().map(|r| (1.0 - (r / reach).powi(2)).max(0.0).powi(2)).collect();
    }
    k
}

/// Weighted least squares, a trace of the identity added so that too few cells are no disaster.
fn solved(basis: &[DVector<f64>], values: &[f64], weights: &[f64]) -> DVector<f64> {
    let n = basis.first().map_or(0, DVector::len);
    let (mut normal, mut right) = (DMatrix::identity(n, n) * RIDGE, DVector::zeros(n));
    for ((b, value), weight) in basis.iter().zip(values).zip(weights) {
        normal.ger(*weight, b, b, 1.0);
        right.axpy(weight * value, b, 1.0);
    }
    normal.cholesky().map_or_else(|| DVector::zeros(n), |c| c.solve(&right))
}

/// Far below what a single cell adds.
const RIDGE: f64 = 1e-6;
