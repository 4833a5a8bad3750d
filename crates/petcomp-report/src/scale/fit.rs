//! A cost as a sum of prices: non-negative least squares.

use super::{ScaleMeasurements, ScalePoint, missing_error};
use nalgebra::{DMatrix, DVector};
use petcomp::Result;

/// Singular values below this are zero: columns have length 1.
const SINGULAR_EPSILON: f64 = 1e-12;

/// Prices of each term, and the deviations of measurements from the fit.
pub(super) struct CostFit {
    /// The terms.
    pub(super) terms: Vec<&'static str>,
    /// The price of each term; 0 if it has no visible effect.
    pub(super) prices: Vec<f64>,
    /// Measured over fitted, less 1, for each measurement.
    pub(super) residuals: Vec<f64>,
    /// The same with a fit that excludes the measurement: the error to expect of a forecast.
    pub(super) unseen: Vec<f64>,
}

/// Time and memory of a picture.
pub(super) struct CostModel {
    /// CPU seconds per picture, from points on one thread.
    pub(super) time: CostFit,
    /// Peak bytes of a process, from all points.
    pub(super) memory: CostFit,
}

/// A term of the cost, and its amount for a point.
type Term = (&'static str, fn(&ScalePoint) -> f64);

/// Light is computed on a lattice that is finest along the sides of cards, however small these are
/// in the picture, and every node looks through all layers that may be above it; any card may also
/// stand in another's light.
const TIME_TERMS: [Term; 6] = [
    ("picture", |_| 1.0),
    ("megapixel", |p| p.case.megapixels()),
    ("card", |p| p.case.cards as f64),
    ("megapixel of a layer", |p| p.case.megapixels() * p.layers),
    ("1000 px of card sides under a layer", |p| {
        card_sides(p) * p.layers
    }),
    ("pair of cards", card_pairs),
];

/// Textures of cards are held with a border, and light with the cards above it that overlap.
const MEMORY_TERMS: [Term; 5] = [
    ("process", |_| 1.0),
    ("megapixel in progress", |p| in_hand(p, p.case.megapixels())),
    ("megapixel of a layer in progress", |p| {
        in_hand(p, p.case.megapixels() * p.layers)
    }),
    ("1000 px of card sides in progress", |p| {
        in_hand(p, card_sides(p))
    }),
    ("pair of cards that overlap in progress", |p| {
        in_hand(p, p.case.cards as f64 * p.layers)
    }),
];

/// The amount of a picture, times the number of threads.
fn in_hand(point: &ScalePoint, of_picture: f64) -> f64 {
    point.case.threads as f64 * of_picture
}

/// Thousands of pixels along the sides of all cards, if each were a square: the root of each card's
/// megapixels.
fn card_sides(point: &ScalePoint) -> f64 {
    let cards = point.case.cards as f64;
    cards * (point.case.megapixels() * point.layers / cards.max(1.0)).sqrt()
}

fn card_pairs(point: &ScalePoint) -> f64 {
    let cards = point.case.cards as f64;
    0.5 * cards * (cards - 1.0)
}

/// The amount of each term for a point.
fn amounts(terms: &[Term], point: &ScalePoint) -> Vec<f64> {
    terms.iter().map(|(_, amount)| amount(point)).collect()
}

impl CostModel {
    /// Fits both costs.
    pub(super) fn fit(measured: &ScaleMeasurements) -> Result<Self> {
        let all: Vec<_> = measured.points.iter().collect();
        let single = measured.single_threaded();
        Ok(Self {
            time: fit_terms(&TIME_TERMS, &single, |point| point.cpu_seconds)?,
            memory: fit_terms(&MEMORY_TERMS, &all, |point| point.peak_bytes)?,
        })
    }

    /// CPU seconds for a picture like a point's.
    pub(super) fn seconds(&self, point: &ScalePoint) -> f64 {
        self.time.cost_of(&amounts(&TIME_TERMS, point))
    }

    /// Peak bytes of a process that generates pictures like a point's.
    pub(super) fn bytes(&self, point: &ScalePoint) -> f64 {
        self.memory.cost_of(&amounts(&MEMORY_TERMS, point))
    }
}

fn fit_terms(
    terms: &[Term],
    points: &[&ScalePoint],
    cost: fn(&ScalePoint) -> f64,
) -> Result<CostFit> {
    let names: Vec<_> = terms.iter().map(|(name, _)| *name).collect();
    let rows: Vec<_> = points.iter().map(|point| amounts(terms, point)).collect();
    let costs: Vec<_> = points.iter().map(|point| cost(point)).collect();
    CostFit::new(&names, &rows, &costs).ok_or_else(|| missing_error("no points to fit"))
}

impl CostFit {
    /// Fits prices to measured costs, with a row of amounts of each term for every cost; none
    /// without a measurement above 0.
    ///
    /// # Method
    /// Non-negative least squares of relative errors, since costs span decades. The best fit with
    /// some prices at 0 and the others free is searched among all sets of prices, of which there
    /// are few; that it exists is a theorem of Lawson and Hanson ("Solving Least Squares Problems",
    /// 1974, chapter 23).
    pub(super) fn new(terms: &[&'static str], rows: &[Vec<f64>], costs: &[f64]) -> Option<Self> {
        let data = Costs { rows, costs };
        let prices = data.fit_without(None)?;
        let all = 0..costs.len();
        Some(Self {
            terms: terms.to_vec(),
            residuals: all.clone().map(|i| data.residual(&prices, i)).collect(),
            unseen: all.map(|i| data.unseen_residual(i)).collect(),
            prices,
        })
    }

    /// The cost of these amounts of each term.
    pub(super) fn cost_of(&self, amounts: &[f64]) -> f64 {
        dot(&self.prices, amounts)
    }

    /// The relative error that nine in ten held-out measurements do not exceed.
    pub(super) fn spread(&self) -> f64 {
        const NINE_IN_TEN: f64 = 0.9;
        let mut off: Vec<f64> = self.unseen.iter().map(|r| r.abs()).collect();
        off.sort_by(f64::total_cmp);
        let rank = (off.len() as f64 * NINE_IN_TEN).ceil() as usize;
        off.get(rank.saturating_sub(1))
            .copied()
            .unwrap_or(f64::INFINITY)
    }
}

fn dot(prices: &[f64], amounts: &[f64]) -> f64 {
    prices.iter().zip(amounts).map(|(p, x)| p * x).sum()
}

/// Measured costs, each with its amounts of each term.
struct Costs<'a> {
    rows: &'a [Vec<f64>],
    costs: &'a [f64],
}

/// Prices, and the sum of squared relative errors.
type PricesAndError = (Vec<f64>, f64);

impl Costs<'_> {
    fn residual(&self, prices: &[f64], i: usize) -> f64 {
        self.costs[i] / dot(prices, &self.rows[i]) - 1.0
    }

    /// The residual of a measurement with prices fitted to the others.
    fn unseen_residual(&self, i: usize) -> f64 {
        let prices = self.fit_without(Some(i));
        prices.map_or(f64::INFINITY, |prices| self.residual(&prices, i))
    }

    fn positive(&self) -> Vec<usize> {
        let all = 0..self.costs.len();
        all.filter(|&i| self.costs[i] > 0.0).collect()
    }

    /// Prices fitted to all measurements above 0 except one; none without any.
    fn fit_without(&self, left_out: Option<usize>) -> Option<Vec<f64>> {
        let mut used = self.positive();
        used.retain(|i| Some(*i) != left_out);
        let terms = self.rows.get(*used.first()?)?.len();
        subsets(terms)
            .filter_map(|free| self.least_squares(&used, &free))
            .filter(|(prices, _)| prices.iter().all(|p| *p >= 0.0))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(prices, _)| prices)
    }

    /// Least squares with some prices free and the others at 0.
    fn least_squares(&self, used: &[usize], free: &[usize]) -> Option<PricesAndError> {
        let mut shares = DMatrix::from_fn(used.len(), free.len(), |i, k| {
            self.rows[used[i]][free[k]] / self.costs[used[i]]
        });
        let lengths = normalize_columns(&mut shares);
        let (x, error) = solve_ones(&shares)?;
        let mut prices = vec![0.0; self.rows[used[0]].len()];
        for (&k, (x, length)) in free.iter().zip(x.iter().zip(&lengths)) {
            prices[k] = x / length;
        }
        Some((prices, error))
    }
}

/// All non-empty sets of terms.
fn subsets(terms: usize) -> impl Iterator<Item = Vec<usize>> {
    let sets = 1..1_usize << terms;
    sets.map(move |set| (0..terms).filter(|k| set >> k & 1 == 1).collect())
}

/// Normalises columns to length 1, so that a term of few per thousand is not mistaken for rounding;
/// returns their lengths.
fn normalize_columns(matrix: &mut DMatrix<f64>) -> Vec<f64> {
    let columns = matrix.column_iter_mut();
    columns
        .map(|mut column| {
            let length = column.norm().max(f64::MIN_POSITIVE);
            column /= length;
            length
        })
        .collect()
}

/// The vector whose product with a matrix is closest to ones, and the remaining squared error.
fn solve_ones(matrix: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
    let ones = DVector::repeat(matrix.nrows(), 1.0);
    let svd = matrix.clone().svd(true, true);
    let x = svd.solve(&ones, SINGULAR_EPSILON).ok()?;
    let error = (matrix * &x - ones).norm_squared();
    Some((x, error))
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
        assert!(fit.spread() < 1e-6 && (fit.cost_of(&[1.0, 2.0, 4.0]) - 12.5004).abs() < 1e-6);
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
    fn too_little_to_fit_is_reported() {
        assert!(CostFit::new(&NAMES, &[], &[]).is_none());
        let one = CostFit::new(&NAMES, &rows()[1..2], &[3.0]).unwrap();
        assert!(one.residuals[0].abs() < 1e-9 && one.spread() == f64::INFINITY);
    }
}
