//! Values that are unlike the rest, in robust standard deviations.

use crate::quantile::median;
use std::collections::BTreeMap;

/// A value for every row.
pub(crate) struct Feature<'a> {
    /// Its name: `objects`.
    pub(crate) name: &'a str,
    /// One for each row; those that are not finite are ignored.
    pub(crate) values: Vec<f64>,
}

/// A row that is unlike the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlier {
    /// Index of the row.
    pub row: usize,
    /// How far it is from the median, in robust standard deviations.
    pub deviations: f64,
    /// The reason: `objects 17, typically 8`.
    pub why: String,
}

/// Threshold, in deviations, above which a value is an outlier ([Iglewicz and Hoaglin 1993]).
///
/// [Iglewicz and Hoaglin 1993]: https://www.itl.nist.gov/div898/handbook/eda/section3/eda35h.htm
const MIN_DEVIATIONS: f64 = 3.5;

/// Ratio of a normal distribution's standard deviation to its median and mean absolute deviation.
const SIGMA_PER_MEDIAN_DEVIATION: f64 = 1.4826;
const SIGMA_PER_MEAN_DEVIATION: f64 = 1.2533;

/// The rows that are outliers in at least one feature, the most extreme first.
///
/// # Method
/// The modified z-score of Iglewicz and Hoaglin: distance from the median over the median absolute
/// deviation, or over the mean one if most values are the same.
pub(crate) fn outliers(features: &[Feature<'_>]) -> Vec<Outlier> {
    let mut all: Vec<Outlier> = worst_by_row(features).into_values().collect();
    all.sort_by(|a, b| b.deviations.total_cmp(&a.deviations));
    all
}

fn worst_by_row(features: &[Feature<'_>]) -> BTreeMap<usize, Outlier> {
    let mut worst: BTreeMap<usize, Outlier> = BTreeMap::new();
    for outlier in features.iter().flat_map(Feature::outliers) {
        let known = worst.get(&outlier.row);
        if known.is_none_or(|known| outlier.deviations > known.deviations) {
            worst.insert(outlier.row, outlier);
        }
    }
    worst
}

impl Feature<'_> {
    /// The rows that are outliers in this feature.
    fn outliers(&self) -> Vec<Outlier> {
        let Some((median, scale)) = median_and_scale(&self.values) else {
            return Vec::new();
        };
        let values = self.values.iter().enumerate();
        values
            .filter_map(|(row, value)| self.outlier(row, *value, median, scale))
            .collect()
    }

    fn outlier(&self, row: usize, value: f64, median: f64, scale: f64) -> Option<Outlier> {
        let deviations = (value - median).abs() / scale;
        let (shown, typical) = (short(value), short(median));
        // A value that reads the same as the typical one is no outlier.
        (shown != typical && deviations > MIN_DEVIATIONS).then(|| Outlier {
            row,
            deviations,
            why: format!("{} {shown}, typically {typical}", self.name),
        })
    }
}

/// Median and robust standard deviation; none if all values are the same.
fn median_and_scale(values: &[f64]) -> Option<(f64, f64)> {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let middle = median(finite.iter().copied(), f64::total_cmp)?;
    let off: Vec<f64> = finite.iter().map(|v| (v - middle).abs()).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let by_median = SIGMA_PER_MEDIAN_DEVIATION * median(off.into_iter(), f64::total_cmp)?;
    let scale = if by_median > 0.0 {
        by_median
    } else {
        SIGMA_PER_MEAN_DEVIATION * mean
    };
    (scale > 0.0).then_some((middle, scale))
}

/// A number with at most two decimals.
pub(crate) fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feature(name: &str, values: Vec<f64>) -> Feature<'_> {
        Feature { name, values }
    }

    #[test]
    fn what_is_far_off_is_named_with_what_is_usual() {
        let values = vec![8.0, 7.0, 9.0, 8.0, 8.0, 40.0, 7.0, f64::NAN];
        let features = [feature("objects", values), feature("same", vec![1.0; 8])];
        let found = outliers(&features);
        assert_eq!(found.len(), 1);
        assert_eq!(
            (found[0].row, found[0].why.as_str()),
            (5, "objects 40, typically 8")
        );
        assert_eq!(outliers(&[]), []);
        assert_eq!(outliers(&[feature("", vec![])]), []);
    }

    #[test]
    fn what_reads_the_same_is_not_unlike() {
        let mut values = vec![100.0; 99];
        values.push(99.999);
        assert_eq!(outliers(&[feature("seen, %", values)]), []);
    }

    #[test]
    fn one_that_differs_from_all_the_same_is_found() {
        let mut values = vec![0.0; 99];
        values.push(3.0);
        assert_eq!(outliers(&[feature("retries", values)])[0].row, 99);
    }
}
