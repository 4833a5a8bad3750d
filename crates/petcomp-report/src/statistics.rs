//! Means and quantiles.

/// The value at a share of the sorted values, from 0 for the least to 1 for the greatest; 0 for an
/// empty list.
///
/// For an even number of values, the median is the upper of the middle two.
pub(crate) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    quantiles(values, [share])[0]
}

/// Several of them.
pub(crate) fn quantiles<const N: usize>(
    values: impl IntoIterator<Item = f64>,
    shares: [f64; N],
) -> [f64; N] {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    shares.map(|share| {
        let rank = libm::round(share * sorted.len().saturating_sub(1) as f64) as usize;
        sorted.get(rank).copied().unwrap_or(0.0)
    })
}

/// The mean of a number over some things; 0 if there are none.
pub(crate) fn mean_of<T>(things: &[T], number: impl Fn(&T) -> f64) -> f64 {
    things.iter().map(number).sum::<f64>() / things.len().max(1) as f64
}

/// Median and 95 % quantile.
pub(crate) fn median_and_95(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    quantiles(values, [0.5, 0.95])
}

/// Median and greatest.
pub(crate) fn median_and_worst(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    quantiles(values, [0.5, 1.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_list() {
        assert_eq!(quantile([3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(median_and_worst([4.0, 1.0, 3.0, 2.0]), [3.0, 4.0]);
        assert_eq!(median_and_95([]), [0.0; 2]);
    }
}
