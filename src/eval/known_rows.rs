//! Rows of numbers in a label, of which the same may stand there twice.

use std::collections::HashSet;

/// The rows of a label so far.
#[derive(Debug, Default)]
pub(crate) struct KnownRows(HashSet<Vec<u64>>);

impl KnownRows {
    /// Adds a row; false where an equal one is there.
    pub(crate) fn insert(&mut self, numbers: impl IntoIterator<Item = f64>) -> bool {
        // The two zeros are equal: 0 more makes the positive one of both.
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
