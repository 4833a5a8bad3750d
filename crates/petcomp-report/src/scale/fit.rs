//! A cost as a sum of what things cost each: least squares without negative prices.

use super::{ScaleMeasurements, ScalePoint, missing};
use nalgebra::{DMatrix, DVector};
use petcomp::Result;

/// What each thing costs, and how far measurements are from that.
#[derive(Clone, Debug, PartialEq)]
pub struct CostFit {
    /// What is paid for.
    pub terms: Vec<&'static str>,
    /// The price of each; 0 for what does not show.
    pub prices: Vec<f64>,
    /// Measured over fitted, less 1, for each measurement.
    pub residuals: Vec<f64>,
    /// The same with a fit that has not seen the measurement: what a forecast must expect.
    pub unseen: Vec<f64>,
}

/// Time and memory of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CostModel {
    /// Seconds of a processor per picture, of points on one thread.
    pub time: CostFit,
    /// Most bytes of a process, of all points.
    pub memory: CostFit,
}

/// Light is looked up on a lattice that is finest along the sides of cards, however small these are in the picture, and every
/// place of it looks through as many layers as may lie above; and any card may stand in another's light.
const TIME: [&str; 6] = [
    "picture",
    "megapixel",
    "card",
    "megapixel of a layer",
    "1000 px of card sides under a layer",
    "pair of cards",
];
/// Textures of cards are held with a border, and light with what lies above it: cards that overlap.
const MEMORY: [&str; 5] = [
    "process",
    "megapixel in hand",
    "megapixel of a layer in hand",
    "1000 px of card sides in hand",
    "pair of cards that overlap in hand",
];

/// What a picture has of each term of its time.
fn time_terms(point: &ScalePoint) -> Vec<f64> {
    let (pixels, cards, layers) = (
        point.case.megapixels(),
        point.case.cards as f64,
        point.layers,
    );
    vec![
        1.0,
        pixels,
        cards,
        pixels * layers,
        sides(point) * layers,
        pairs(point),
    ]
}

/// What a process has of each term of its memory.
fn memory_terms(point: &ScalePoint) -> Vec<f64> {
    let (pixels, overlaps) = (
        point.case.megapixels(),
        point.case.cards as f64 * point.layers,
    );
    let in_hand = [pixels, pixels * point.layers, sides(point), overlaps]
        .map(|v| point.case.threads as f64 * v);
    std::iter::once(1.0).chain(in_hand).collect()
}

/// Thousands of pixels along the sides of all cards, were each a square: the root of each card's megapixels.
fn sides(point: &ScalePoint) -> f64 {
    let cards = point.case.cards as f64;
    cards * (point.case.megapixels() * point.layers / cards.max(1.0)).sqrt()
}

fn pairs(point: &ScalePoint) -> f64 {
    let cards = point.case.cards as f64;
    0.5 * cards * (cards - 1.0)
}

impl CostModel {
    /// Fits both costs.
    ///
    /// # Errors
    /// Without points, or none on one thread.
    pub fn fit(measured: &ScaleMeasurements) -> Result<Self> {
        let of = |terms: &[&'static str],
                  row: fn(&ScalePoint) -> Vec<f64>,
                  value: fn(&ScalePoint) -> f64,
                  points: Vec<&ScalePoint>| {
            let rows: Vec<_> = points.iter().map(|point| row(point)).collect();
            let values: Vec<_> = points.iter().map(|point| value(point)).collect();
            CostFit::new(terms, &rows, &values).ok_or_else(|| missing("no points to fit"))
        };
        let alone = measured
            .points
            .iter()
            .filter(|point| point.case.threads == 1)
            .collect();
        Ok(Self {
            time: of(&TIME, time_terms, |point| point.cpu_seconds, alone)?,
            memory: of(
                &MEMORY,
                memory_terms,
                |point| point.peak_bytes,
                measured.points.iter().collect(),
            )?,
        })
    }

    /// Seconds of a processor for a picture like a point's.
    pub fn seconds(&self, point: &ScalePoint) -> f64 {
        self.time.at(&time_terms(point))
    }

    /// Most bytes of a process that makes pictures like a point's.
    pub fn bytes(&self, point: &ScalePoint) -> f64 {
        self.memory.at(&memory_terms(point))
    }
}

impl CostFit {
    /// Fits prices to measured costs, a row for each of how much it has of each term; none without a measurement above 0.
    ///
    /// # Method
    /// Non-negative least squares of relative errors, since costs span decades. The best fit with some prices at 0 and the
    /// others free is looked for among all sets of prices, of which there are few; that it exists is a theorem of Lawson
    /// and Hanson ("Solving Least Squares Problems", 1974, chapter 23).
    pub fn new(terms: &[&'static str], rows: &[Vec<f64>], values: &[f64]) -> Option<Self> {
        let sound: Vec<usize> = (0..values.len()).filter(|&i| values[i] > 0.0).collect();
        let prices = prices(rows, values, &sound)?;
        let off = |prices: &[f64], i: usize| values[i] / dot(prices, &rows[i]) - 1.0;
        let unseen = |i: usize| {
            let others: Vec<_> = sound.iter().copied().filter(|&k| k != i).collect();
            super::fit::prices(rows, values, &others)
                .map_or(f64::INFINITY, |prices| off(&prices, i))
        };
        Some(Self {
            terms: terms.to_vec(),
            residuals: (0..values.len()).map(|i| off(&prices, i)).collect(),
            unseen: (0..values.len()).map(unseen).collect(),
            prices,
        })
    }

    /// The cost of something that has so much of each term.
    pub fn at(&self, row: &[f64]) -> f64 {
        dot(&self.prices, row)
    }

    /// The share by which nine in ten measurements that were not fitted are off, at most.
    pub fn spread(&self) -> f64 {
        const NINE_IN_TEN: f64 = 0.9;
        let mut off: Vec<f64> = self.unseen.iter().map(|r| r.abs()).collect();
        off.sort_by(f64::total_cmp);
        let rank = (off.len() as f64 * NINE_IN_TEN).ceil() as usize;
        off.get(rank.saturating_sub(1))
            .copied()
            .unwrap_or(f64::INFINITY)
    }
}

fn dot(prices: &[f64], row: &[f64]) -> f64 {
    prices.iter().zip(row).map(|(p, x)| p * x).sum()
}

/// Prices of the terms by some of the measurements; none without any.
fn prices(rows: &[Vec<f64>], values: &[f64], used: &[usize]) -> Option<Vec<f64>> {
    let terms = rows.get(*used.first()?)?.len();
    let sets = (1..1_usize << terms)
        .map(|set| (0..terms).filter(|k| set >> k & 1 == 1).collect::<Vec<_>>());
    let fitted = sets.filter_map(|set| free(rows, values, used, &set));
    let best = fitted
        .filter(|(prices, _)| prices.iter().all(|p| *p >= 0.0))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(prices, _)| prices)
}

/// Least squares with some prices free and the others 0; and the sum of squared relative errors.
fn free(
    rows: &[Vec<f64>],
    values: &[f64],
    used: &[usize],
    set: &[usize],
) -> Option<(Vec<f64>, f64)> {
    let share = |i: usize, k: usize| rows[used[i]][set[k]] / values[used[i]];
    let a = DMatrix::from_fn(used.len(), set.len(), share);
    // Columns of one length, so that a term of few per thousand is not taken for rounding.
    let lengths: Vec<f64> = a
        .column_iter()
        .map(|column| column.norm().max(f64::MIN_POSITIVE))
        .collect();
    let even = DMatrix::from_fn(used.len(), set.len(), |i, k| a[(i, k)] / lengths[k]);
    let one = DVector::repeat(used.len(), 1.0);
    let x = even.clone().svd(true, true).solve(&one, 1e-12).ok()?;
    let error = (&even * &x - one).norm_squared();
    let mut prices = vec![0.0; rows[used[0]].len()];
    set.iter()
        .zip(x.iter().zip(&lengths))
        .for_each(|(&k, (x, length))| prices[k] = x / length);
    Some((prices, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["one", "x", "x squared"];

    fn rows() -> Vec<Vec<f64>> {
        (0..12)
            .map(|i| vec![1.0, f64::from(i), f64::from(i * i)])
            .collect()
    }

    #[test]
    fn prices_that_were_paid_are_found_again() {
        let values: Vec<_> = rows()
            .iter()
            .map(|row| dot(&[0.5, 2e-4, 3.0], row))
            .collect();
        let fit = CostFit::new(&NAMES, &rows(), &values).unwrap();
        assert!(
            fit.prices
                .iter()
                .zip([0.5, 2e-4, 3.0])
                .all(|(p, q)| (p / q - 1.0).abs() < 1e-6),
            "{:?}",
            fit.prices
        );
        assert!(fit.spread() < 1e-6 && (fit.at(&[1.0, 2.0, 4.0]) - 12.5004).abs() < 1e-6);
    }

    #[test]
    fn nothing_has_a_negative_price() {
        let values: Vec<_> = rows().iter().map(|row| 5.0 - 0.2 * row[1]).collect();
        let fit = CostFit::new(&NAMES, &rows(), &values).unwrap();
        assert!(fit.prices.iter().all(|p| *p >= 0.0) && fit.prices[0] > 0.0);
        assert!(
            fit.residuals.iter().any(|r| r.abs() > 0.1),
            "and the residuals say so"
        );
    }

    #[test]
    fn the_spread_is_that_of_measurements_that_were_not_fitted() {
        let noisy = |i: usize| if i.is_multiple_of(2) { 1.1 } else { 0.9 };
        let values: Vec<_> = rows()
            .iter()
            .enumerate()
            .map(|(i, row)| noisy(i) * (1.0 + row[1]))
            .collect();
        let fit = CostFit::new(&NAMES, &rows(), &values).unwrap();
        assert!((0.05..0.5).contains(&fit.spread()), "{}", fit.spread());
        let seen = fit.residuals.iter().map(|r| r * r).sum::<f64>();
        assert!(fit.unseen.iter().map(|r| r * r).sum::<f64>() > seen);
    }

    #[test]
    fn too_little_to_fit_is_told() {
        assert!(CostFit::new(&NAMES, &[], &[]).is_none());
        let one = CostFit::new(&NAMES, &rows()[1..2], &[3.0]).unwrap();
        assert!(one.residuals[0].abs() < 1e-9 && one.spread() == f64::INFINITY);
    }
}
