//! The probability of a sum of squares.

/// Another explanation counts where its chi squared is no worse, or better, by this: 1 % of two
/// degrees of freedom.
pub(crate) const CHI2_99: f64 = 9.2;

/// Probability that a chi squared of `dof` degrees of freedom exceeds `x`; none without degrees of
/// freedom.
///
/// # Method
/// Exact, by the recurrence from two degrees to the next: each adds `(x/2)^(k/2) exp(-x/2) /
/// gamma(k/2 + 1)`.
pub(crate) fn exceeds(x: f64, dof: usize) -> Option<f64> {
    let half = x / 2.0;
    let (first, start) = match dof {
        0 => return None,
        n if n % 2 == 0 => (2, libm::exp(-half)),
        _ => (1, libm::erfc(half.sqrt())),
    };
    let tail = (first..dof)
        .step_by(2)
        .fold(start, |tail, k| tail + recurrence_term(half, k));
    Some(tail.min(1.0))
}

/// What the tail gains from `k` degrees of freedom to two more, by half of chi squared.
fn recurrence_term(half: f64, k: usize) -> f64 {
    let order = k as f64 / 2.0;
    if half > 0.0 {
        libm::exp(order * libm::log(half) - half - libm::lgamma(order + 1.0))
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::exceeds;

    #[test]
    fn textbook_quantiles_come_out() {
        // NIST/SEMATECH e-Handbook, table 1.3.6.7.4: upper 1 % points.
        for (dof, x) in [
            (1, 6.635),
            (2, 9.210),
            (3, 11.345),
            (4, 13.277),
            (5, 15.086),
            (10, 23.209),
            (100, 135.807),
        ] {
            let p = exceeds(x, dof).unwrap();
            assert!((p - 0.01).abs() < 1e-5, "{dof}: {p}");
        }
        assert_eq!(exceeds(3.0, 0), None);
        assert_eq!(exceeds(0.0, 3), Some(1.0));
    }
}
