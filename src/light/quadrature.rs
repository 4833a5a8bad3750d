//! The Gauss-Legendre rule.

use std::f64::consts::PI;

/// Abscissae in -1..1 and weights (sum 2) of the Gauss-Legendre rule of `n` points.
///
/// # Method
/// Newton's iteration on the Legendre polynomial from Tricomi's estimate of its roots.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| gauss_point(n, root_estimate(n, i)))
        .collect()
}

/// A root of the Legendre polynomial, good to three digits.
fn root_estimate(n: usize, i: usize) -> f64 {
    libm::cos(PI * (n as f64 - i as f64 - 0.25) / (n as f64 + 0.5))
}

fn gauss_point(n: usize, estimate: f64) -> (f64, f64) {
    // Quadratic convergence: 8 steps are plenty from an estimate good to three digits.
    let root = (0..8).fold(estimate, |x, _| {
        let (p, slope) = legendre(n, x);
        x - p / slope
    });
    let (_, slope) = legendre(n, root);
    (root, 2.0 / ((1.0 - root * root) * slope * slope))
}

/// Value and slope of the Legendre polynomial of degree `n`, by its recurrence.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut last, mut p) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (last, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * last) / k);
    }
    (p, n as f64 * (x * p - last) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_points_are_the_textbook_rule() {
        let rule = gauss_legendre(3);
        let expected = [
            (-0.6f64.sqrt(), 5.0 / 9.0),
            (0.0, 8.0 / 9.0),
            (0.6f64.sqrt(), 5.0 / 9.0),
        ];
        for ((x, w), (ex, ew)) in rule.into_iter().zip(expected) {
            assert!((x - ex).abs() < 1e-14 && (w - ew).abs() < 1e-14);
        }
    }

    #[test]
    fn n_points_integrate_degree_2n_minus_1() {
        for n in 1..9 {
            let sum: f64 = gauss_legendre(n)
                .iter()
                .map(|&(x, w)| w * x.powi(2 * n as i32 - 2))
                .sum();
            assert!((sum - 2.0 / (2 * n - 1) as f64).abs() < 1e-13, "{n} points");
        }
    }
}
