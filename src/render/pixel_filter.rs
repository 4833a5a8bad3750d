//! The pixel filter.

use std::f64::consts::TAU;

/// Half of the window's width, pixels: Cycles' default filter extends 1.5 to either side.
const WINDOW_RADIUS_PX: f64 = 1.5;

/// Variance of the window, square pixels.
const WINDOW_VARIANCE_PX2: f64 = 0.17266;

/// Coefficients of the Blackman-Harris window (Harris 1978, four terms, 92 dB).
const WINDOW_TERMS: [f64; 4] = [0.35875, -0.48829, 0.14128, -0.01168];

/// Positions, pixels from the centre, of the midpoints (by weight) of `count` equal parts of the
/// window's weight.
///
/// All samples of a pixel then have the same weight.
pub(super) fn filter_quantiles(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| filter_quantile((i as f64 + 0.5) / count as f64))
        .collect()
}

/// The part of the window's width that the positions lack: the standard deviation that the
/// texture's own filter must add.
pub(super) fn residual_sigma(offsets: &[f64]) -> f64 {
    let residual = WINDOW_VARIANCE_PX2 - mean_square(offsets);
    residual.max(0.0).sqrt()
}

fn mean_square(offsets: &[f64]) -> f64 {
    offsets.iter().map(|o| o * o).sum::<f64>() / offsets.len() as f64
}

fn filter_quantile(share: f64) -> f64 {
    // The window is symmetric; bisection to the last bit of a position of order one.
    let (mut low, mut high) = (-WINDOW_RADIUS_PX, WINDOW_RADIUS_PX);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if cumulative_weight(mid) < share {
            low = mid;
        } else {
            high = mid;
        }
    }
    0.5 * (low + high)
}

/// Weight of the window left of `s`; 0 at its left end, 1 at its right end.
fn cumulative_weight(s: f64) -> f64 {
    let t = s / (2.0 * WINDOW_RADIUS_PX) + 0.5;
    let [first, second, third] = [1, 2, 3].map(|k| integrated_term(k, t));
    t + (first + second + third) / WINDOW_TERMS[0]
}

/// The integral up to `t` of a cosine term of the window.
fn integrated_term(k: usize, t: f64) -> f64 {
    WINDOW_TERMS[k] * libm::sin(TAU * k as f64 * t) / (TAU * k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Offsets and residual sigma for r = 1, 2, 3, 4, 6, computed by another program.
    #[test]
    fn quantiles_are_the_published_ones() {
        let table: [(&[f64], f64); 5] = [
            (&[0.0], 0.4155),
            (&[-0.28821, 0.28821], 0.2993),
            (&[-0.41126, 0.0, 0.41126], 0.2448),
            (&[-0.48698, -0.13667, 0.13667, 0.48697], 0.2115),
            (
                &[-0.58171, -0.28821, -0.09031, 0.09031, 0.28821, 0.58171],
                0.1716,
            ),
        ];
        for (offsets, sigma) in table {
            let ours = filter_quantiles(offsets.len());
            assert!(
                ours.iter().zip(offsets).all(|(a, b)| (a - b).abs() < 2e-5),
                "{ours:?}"
            );
            assert!((residual_sigma(&ours) - sigma).abs() < 1e-4);
        }
    }
}
