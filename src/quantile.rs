//! Medians and other quantiles.

use std::cmp::Ordering;

/// The median; the higher of the two middle values for an even number, none for an empty list.
pub(crate) fn median<T: Copy>(
    values: impl Iterator<Item = T>,
    order: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    quantile(values.collect(), 0.5, order)
}

/// The value below which a share, 0 to 1, of the others lies; none for an empty list.
pub(crate) fn quantile<T: Copy>(
    mut values: Vec<T>,
    share: f64,
    order: impl FnMut(&T, &T) -> Ordering,
) -> Option<T> {
    let rank = (values.len() as f64 * share) as usize;
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, order).1)
}
