//! An integer count in a recipe: uniform, or from a histogram.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::scene::draw::weighted_place;
use crate::scene::{Distribution, Draws, Range};
use serde::{Deserialize, Serialize};

/// A count, drawn anew for every scene.
///
/// In files an integer, `[min, max]` for integers that are equally likely, or a histogram:
/// `{ values = [5, 6, 8], weights = [3, 12, 1] }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "expected an integer, [min, max] or { values = [...], weights = [...] }"
)]
pub enum Count {
    /// Every integer of a range is equally likely.
    Uniform(Range),
    /// Each value has a probability of its weight over the sum of all weights; counts of a
    /// histogram can be used unchanged.
    Weighted {
        /// The numbers that occur, in ascending order.
        values: Vec<u32>,
        /// How often each occurs, in any unit.
        weights: Vec<f64>,
    },
}

impl Default for Count {
    /// Always 0.
    fn default() -> Self {
        Self::Uniform(Range::default())
    }
}

impl From<Range> for Count {
    fn from(range: Range) -> Self {
        Self::Uniform(range)
    }
}

impl Count {
    /// Always `n`.
    pub fn fixed(n: u32) -> Self {
        Self::Uniform(Range::fixed(n.into()))
    }

    /// Whether it is always 0.
    pub fn is_zero(&self) -> bool {
        self.max() == 0
    }

    /// The largest number that occurs.
    pub fn max(&self) -> usize {
        match self {
            Self::Uniform(range) => range.max as usize,
            Self::Weighted { values, weights } => last_weighted(values, weights) as usize,
        }
    }

    /// The number at a path.
    pub(super) fn draw(&self, draws: &Draws, path: &str) -> usize {
        match self {
            Self::Uniform(range) => range.draw_count(draws, path),
            Self::Weighted { values, weights } => draw_weighted(values, weights, draws, path),
        }
    }

    /// Fails unless every number is an integer within bounds and some number can occur.
    pub(super) fn check(&self, at: &str, bounds: &Bounds) -> Result<()> {
        match self {
            Self::Uniform(range) => range.check_count(at, bounds),
            Self::Weighted { values, weights } => {
                check_values(&format!("{at}.values"), values, bounds)?;
                check_weights(&format!("{at}.weights"), weights, values.len())
            }
        }
    }
}

/// The largest value with a positive weight; 0 if there is none.
fn last_weighted(values: &[u32], weights: &[f64]) -> u32 {
    let pairs = values.iter().zip(weights);
    let weighted = pairs.filter(|(_, weight)| **weight > 0.0);
    weighted.map(|(value, _)| *value).max().unwrap_or(0)
}

/// The value at a path: the first whose weight, added to those before it, is above a uniform share
/// of their sum.
fn draw_weighted(values: &[u32], weights: &[f64], draws: &Draws, path: &str) -> usize {
    let share = draws.unit(path) * weights.iter().sum::<f64>();
    let value = values[weighted_place(weights, share)];
    let ends = [values[0], values[values.len() - 1]].map(f64::from);
    draws.note(path, Distribution::Weighted(ends), value.into());
    value as usize
}

fn check_values(at: &str, values: &[u32], bounds: &Bounds) -> Result<()> {
    if values.is_empty() {
        return Err(Error::value(at, "empty, expected at least one number"));
    }
    for value in values {
        bounds.check(at, (*value).into())?;
    }
    match values.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(pair) => {
            let what = format!("{} before {}, expected ascending numbers", pair[0], pair[1]);
            Err(Error::value(at, what))
        }
        None => Ok(()),
    }
}

/// Bounds of a weight: sums of such weights are exact enough.
const WEIGHT: Bounds = Bounds::new(0.0, 1e15, "a share or a count");

fn check_weights(at: &str, weights: &[f64], expected: usize) -> Result<()> {
    if weights.len() != expected {
        let what = format!("{}, expected {expected}, one for each value", weights.len());
        return Err(Error::value(at, what));
    }
    for weight in weights {
        WEIGHT.check(at, *weight)?;
    }
    if weights.iter().any(|weight| *weight > 0.0) {
        return Ok(());
    }
    Err(Error::value(at, "all 0, expected at least one above 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        n: Count,
    }

    fn read(text: &str) -> std::result::Result<Count, String> {
        let file: File = toml::from_str(text).map_err(|e| e.to_string())?;
        Ok(file.n)
    }

    fn weighted(values: &[u32], weights: &[f64]) -> Count {
        Count::Weighted {
            values: values.into(),
            weights: weights.into(),
        }
    }

    #[test]
    fn a_file_says_a_number_a_range_or_a_histogram_and_reads_back() {
        let forms = [
            ("n = 3", Count::fixed(3)),
            ("n = [4, 12]", Range::new(4.0, 12.0).into()),
            (
                "n = { values = [5, 6, 8], weights = [3, 12.5, 1] }",
                weighted(&[5, 6, 8], &[3.0, 12.5, 1.0]),
            ),
        ];
        for (text, count) in forms {
            assert_eq!(read(text).unwrap(), count, "{text}");
            let written = toml::to_string(&File { n: count.clone() }).unwrap();
            assert_eq!(read(&written).unwrap(), count, "{written}");
        }
        let expected = "expected an integer, [min, max] or { values = [...], weights = [...] }";
        for wrong in [
            "n = 'many'",
            "n = { values = [1.5], weights = [1] }",
            "n = { values = [1], weights = [1], bins = 3 }",
            "n = { values = [1] }",
        ] {
            let told = read(wrong).unwrap_err();
            assert!(told.contains(expected), "{wrong}: {told}");
        }
    }

    #[test]
    fn a_histogram_is_drawn_by_its_weights() {
        let (values, weights) = ([2, 5, 6, 9], [1.0, 0.0, 4.0, 5.0]);
        let count = weighted(&values, &weights);
        let n = 20_000;
        let drawn: Vec<usize> = (0..n).map(|k| count.draw(&Draws::new(3, k), "n")).collect();
        // Chi squared of 3 bins that can occur, 2 degrees of freedom: below 13.8 in 999 of 1000.
        let expected = |weight: f64| n as f64 * weight / 10.0;
        let times = |value: u32| drawn.iter().filter(|d| **d == value as usize).count() as f64;
        let bins = values
            .iter()
            .zip(weights)
            .filter(|(_, weight)| *weight > 0.0);
        let chi2: f64 = bins
            .map(|(value, weight)| (times(*value) - expected(weight)).powi(2) / expected(weight))
            .sum();
        assert!(chi2 < 13.8, "{chi2}");
        assert_eq!((times(5), count.max()), (0.0, 9));
        let twice = weighted(&values, &weights.map(|weight| 2.0 * weight));
        assert!((0..200).all(|k| {
            let draws = Draws::new(3, k);
            twice.draw(&draws, "n") == count.draw(&draws, "n")
        }));
    }

    #[test]
    fn a_number_without_weight_never_occurs() {
        assert!(Count::default().is_zero() && weighted(&[0, 3], &[1.0, 0.0]).is_zero());
        assert!(!weighted(&[0, 3], &[1.0, 1e-9]).is_zero());
    }

    #[test]
    fn a_share_that_rounds_to_the_whole_sum_is_the_last_value_that_occurs() {
        assert_eq!(weighted_place(&[1.0, 2.0, 0.0], 3.0), 1);
    }

    #[test]
    fn what_cannot_be_right_is_told() {
        let most = Bounds::new(0.0, 9.0, "");
        let told = |count: Count| count.check("n", &most).unwrap_err().to_string();
        let cases = [
            (
                weighted(&[], &[]),
                "n.values: empty, expected at least one number",
            ),
            (
                weighted(&[1, 10], &[1.0, 1.0]),
                "n.values: 10, expected 0 to 9",
            ),
            (
                weighted(&[2, 2], &[1.0, 1.0]),
                "n.values: 2 before 2, expected ascending numbers",
            ),
            (
                weighted(&[1, 2], &[1.0]),
                "n.weights: 1, expected 2, one for each value",
            ),
            (
                weighted(&[1, 2], &[0.0, 0.0]),
                "n.weights: all 0, expected at least one above 0",
            ),
            (
                weighted(&[1], &[-1.0]),
                "n.weights: -1, expected 0 to 1e15 (a share or a count)",
            ),
            (
                Range::new(1.0, 2.5).into(),
                "n: [1, 2.5], expected integers",
            ),
        ];
        for (count, expected) in cases {
            assert_eq!(told(count), expected);
        }
        assert!(weighted(&[1], &[f64::NAN]).check("n", &most).is_err());
    }
}
