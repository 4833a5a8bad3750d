//! Symmetric matrices of which only what lies near the diagonal is not zero.

/// The lower half of a symmetric matrix: of each row what lies from its first entry to the diagonal.
#[derive(Clone, Debug)]
pub(super) struct Envelope {
    first: Vec<usize>,
    rows: Vec<Vec<f64>>,
}

impl Envelope {
    /// Zeros, with room from each row's first entry.
    pub(super) fn new(first: Vec<usize>) -> Self {
        let rows = first
            .iter()
            .enumerate()
            .map(|(i, first)| vec![0.0; i + 1 - first])
            .collect();
        Self { first, rows }
    }

    /// Adds to an entry that there is room for, at or left of the diagonal.
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row][column - self.first[row]] += value;
    }

    /// Solves `A x = b` for a positive definite A.
    ///
    /// # Method
    /// Cholesky by rows: what lies outside of the envelope stays zero (Jennings 1966).
    pub(super) fn solve(mut self, mut b: Vec<f64>) -> Vec<f64> {
        for i in 0..self.rows.len() {
            self.factor_row(i);
            let (from, diagonal) = (self.first[i], self.rows[i][i - self.first[i]]);
            b[i] = (b[i] - dot(&self.rows[i][..i - from], &b[from..i])) / diagonal;
        }
        for i in (0..self.rows.len()).rev() {
            let (from, row) = (self.first[i], &self.rows[i]);
            b[i] /= row[i - from];
            let x = b[i];
            b[from..i]
                .iter_mut()
                .zip(row)
                .for_each(|(b, entry)| *b -= entry * x);
        }
        b
    }

    fn factor_row(&mut self, i: usize) {
        let from = self.first[i];
        let (above, rest) = self.rows.split_at_mut(i);
        let row = &mut rest[0];
        for j in from..i {
            let start = from.max(self.first[j]);
            let known = dot(
                &row[start - from..j - from],
                &above[j][start - self.first[j]..j - self.first[j]],
            );
            row[j - from] = (row[j - from] - known) / above[j][j - self.first[j]];
        }
        let (entries, diagonal) = row.split_at_mut(i - from);
        diagonal[0] = (diagonal[0] - dot(entries, entries))
            .max(f64::MIN_POSITIVE)
            .sqrt();
    }
}

/// In four sums, which processors add at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours, rest) = (a.chunks_exact(4).zip(b.chunks_exact(4)), a.len() / 4 * 4);
    for (a, b) in fours {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    sums.iter().sum::<f64>()
        + a[rest..]
            .iter()
            .zip(&b[rest..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
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
        let mut a = Envelope::new(first.clone());
        let mut whole = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in first[i]..=i {
                // Strong on the diagonal, hence positive definite.
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
