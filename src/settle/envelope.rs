//! Symmetric matrices with an envelope of zeros away from the diagonal.

/// The lower half of a symmetric matrix: for each row, the entries from its first one to the
/// diagonal.
#[derive(Clone, Debug)]
pub(super) struct EnvelopeMatrix {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl EnvelopeMatrix {
    /// A zero matrix with storage from each row's first entry on.
    pub(super) fn zeros(first: Vec<usize>) -> Self {
        let lengths = first.iter().enumerate().map(|(i, first)| i + 1 - first);
        let rows = lengths.map(|length| vec![0.0; length]).collect();
        Self { first, rows }
    }

    /// Adds to a stored entry, at or left of the diagonal.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column - self.first[row]] += value;
    }

    /// Solves `A x = b` for a positive definite A.
    ///
    /// # Method
    /// Cholesky by rows: entries outside the envelope remain zero (Jennings 1966).
    pub(super) fn solve(mut self, mut b: Vec<f64>) -> Vec<f64> {
        for i in 0..self.rows.len() {
            self.factor_row(i);
            self.substitute_forward(i, &mut b);
        }
        for i in (0..self.rows.len()).rev() {
            self.substitute_backward(i, &mut b);
        }
        b
    }

    fn substitute_forward(&self, i: usize, b: &mut [f64]) {
        let from = self.first[i];
        let (entries, diagonal) = self.rows[i].split_at(i - from);
        b[i] = (b[i] - dot(entries, &b[from..i])) / diagonal[0];
    }

    fn substitute_backward(&self, i: usize, b: &mut [f64]) {
        let from = self.first[i];
        let (entries, diagonal) = self.rows[i].split_at(i - from);
        b[i] /= diagonal[0];
        let x = b[i];
        for (b, entry) in b[from..i].iter_mut().zip(entries) {
            *b -= entry * x;
        }
    }

    fn factor_row(&mut self, i: usize) {
        let from = self.first[i];
        let (above, rest) = self.rows.split_at_mut(i);
        let row = &mut rest[0];
        for j in from..i {
            let first = self.first[j];
            let known = product_before(j, (from, row), (first, &above[j]));
            row[j - from] = (row[j - from] - known) / above[j][j - first];
        }
        let (entries, diagonal) = row.split_at_mut(i - from);
        let square = diagonal[0] - dot(entries, entries);
        diagonal[0] = square.max(f64::MIN_POSITIVE).sqrt();
    }
}

/// The dot product of two rows, each with its first column, up to a column.
fn product_before(column: usize, a: (usize, &[f64]), b: (usize, &[f64])) -> f64 {
    let start = a.0.max(b.0);
    let [a, b] = [a, b].map(|(first, row)| &row[start - first..column - first]);
    dot(a, b)
}

/// In four partial sums, which processors compute in parallel.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    let whole = a.len() / 4 * 4;
    let rest = a[whole..].iter().zip(&b[whole..]);
    sums.iter().sum::<f64>() + rest.map(|(a, b)| a * b).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Draws;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_solution_solves_its_equations() {
        let n = 40;
        let draws = Draws::new(1, 0);
        let first: Vec<usize> = (0..n)
            .map(|i| draws.below(&format!("first[{i}]"), i + 1))
            .collect();
        let mut a = EnvelopeMatrix::zeros(first.clone());
        let mut whole = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in first[i]..=i {
                // Diagonally dominant, hence positive definite.
                let value = draws.unit(&format!("{i},{j}")) + if i == j { n as f64 } else { 0.0 };
                a.add(i, j, value);
                (whole[(i, j)], whole[(j, i)]) = (value, value);
            }
        }
        let b: Vec<f64> = (0..n).map(|i| draws.unit(&format!("b[{i}]"))).collect();
        let x = DVector::from(a.solve(b.clone()));
        assert!((whole * x - DVector::from(b)).amax() < 1e-12);
    }
}
