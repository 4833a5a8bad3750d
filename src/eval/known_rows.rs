//! Rows of numbers in a label, to detect duplicates.

use std::collections::HashSet;

/// The rows of a label read so far.
#[derive(Debug, Default)]
pub(crate) struct KnownRows(HashSet<Vec<u64>>);

impl KnownRows {
    /// Adds a row; false if there is already an equal one.
    pub(crate) fn insert(&mut self, numbers: impl IntoIterator<Item = f64>) -> bool {
        // The two zeros are equal: adding 0 turns both into the positive one.
        let bits = numbers.into_iter().map(|number| (number + 0.0).to_bits());
        self.0.insert(bits.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_known_by_all_its_numbers() {
        let mut known = KnownRows::default();
        let rows: [&[f64]; 5] = [&[1.0, 0.0], &[1.0], &[1.0, -0.0], &[0.0, 1.0], &[1.0]];
        let new = rows.map(|row| known.insert(row.iter().copied()));
        assert_eq!(new, [true, true, false, true, false]);
    }
}
