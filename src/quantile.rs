//! Medians and other quantiles.

use std::cmp::Ordering;

/// The value in the middle; of an even number the higher of the two, none of none.
pub(crate) fn median<T: Copy>(
    values: impl Iterator<Item = T>,
    order: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    quantile(values.collect(), 0.5, order)
}

/// The value that a share, 0 to 1, of the others lies below; none where there is none.
pub(crate) fn quantile<T: Copy>(
    mut values: Vec<T>,
    share: f64,
    order: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    let rank = (values.len() as f64 * share) as usize;
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, order).1)
}
