//! Average precision from a precision curve, by its two definitions.

use super::rank::Running;

/// Recalls at which precision is sampled: 0, 0.01 .. 1.
pub(super) const RECALL_POINTS: usize = 101;

/// The area under the interpolated precision envelope, by trapezoids over 101 recalls.
///
/// The curve starts at precision 1 for recall 0 and ends at precision 0 for recall 1, so a perfect
/// detector has 0.995.
///
/// # Method
/// As YOLOv5 computes it (its file `utils/metrics.py`, function `compute_ap`, method `interp`).
pub(super) fn trapezoid(recall: &[f64], precision: &[f64]) -> f64 {
    let read = envelope_samples(recall, precision);
    let strips = 0..RECALL_POINTS - 1;
    strips.map(|i| strip_area(i, [read[i], read[i + 1]])).sum()
}

/// The area between the `i`-th recall and the next one.
#[inline]
fn strip_area(i: usize, heights: [f64; 2]) -> f64 {
    (recall_at(i + 1) - recall_at(i)) * (heights[1] + heights[0]) / 2.0
}

/// The precision envelope at each of the recalls, linear between its points.
fn envelope_samples(recall: &[f64], precision: &[f64]) -> [f64; RECALL_POINTS] {
    let xs = with_ends(0.0, recall, 1.0);
    let mut ys = with_ends(1.0, precision, 0.0);
    make_envelope(&mut ys);
    let mut after = 0;
    std::array::from_fn(|i| {
        let later = xs[after..].iter();
        after += later.take_while(|&&at| at <= recall_at(i)).count();
        between(recall_at(i), after, &xs, &ys)
    })
}

fn with_ends(first: f64, values: &[f64], last: f64) -> Vec<f64> {
    [&[first], values, &[last]].concat()
}

/// The mean of the precision envelope at 101 recalls, each sampled at the first detection that
/// reaches it.
///
/// # Method
/// As the COCO tools compute it (`COCOeval.accumulate`).
pub(super) fn mean_of_samples(recall: &[f64], precision: &[f64]) -> f64 {
    samples(recall, precision).into_iter().sum::<f64>() / RECALL_POINTS as f64
}

/// The precision envelope at recalls of 0, 0.01 .. 1.
pub(super) fn samples(recall: &[f64], precision: &[f64]) -> [f64; RECALL_POINTS] {
    let mut ys = precision.to_vec();
    make_envelope(&mut ys);
    std::array::from_fn(|i| {
        let reached = first_reaching(recall_at(i), recall);
        ys.get(reached).copied().unwrap_or(0.0)
    })
}

#[inline]
fn first_reaching(recall: f64, recalls: &[f64]) -> usize {
    recalls.partition_point(|&r| r < recall)
}

/// Recall and precision after each detection; `epsilon` keeps the divisions defined.
pub(super) fn recall_and_precision(
    sums: &Running,
    truths: f64,
    epsilon: [f64; 2],
) -> (Vec<f64>, Vec<f64>) {
    let truths = truths + epsilon[0];
    let recalls = sums.right.iter().map(|right| right / truths);
    let both = sums.right.iter().zip(&sums.wrong);
    let precisions = both.map(|(right, wrong)| right / (right + wrong + epsilon[1]));
    (recalls.collect(), precisions.collect())
}

/// Piecewise linear interpolation like NumPy's `interp`; of equal positions the last one counts.
pub(super) fn interpolated(x: f64, xs: &[f64], ys: &[f64]) -> f64 {
    between(x, xs.partition_point(|&at| at <= x), xs, ys)
}

/// The same if the first position beyond `x` is already known.
fn between(x: f64, after: usize, xs: &[f64], ys: &[f64]) -> f64 {
    match after {
        0 => ys[0],
        n if n == xs.len() => ys[n - 1],
        // The value that the line has there, without its division.
        n if ys[n] == ys[n - 1] => ys[n],
        n => on_line(x, [xs[n - 1], xs[n]], [ys[n - 1], ys[n]]),
    }
}

#[inline]
fn on_line(x: f64, xs: [f64; 2], ys: [f64; 2]) -> f64 {
    (ys[1] - ys[0]) / (xs[1] - xs[0]) * (x - xs[0]) + ys[0]
}

/// Replaces each value with the maximum of itself and those after it.
fn make_envelope(values: &mut [f64]) {
    let mut best = f64::NEG_INFINITY;
    for value in values.iter_mut().rev() {
        best = best.max(*value);
        *value = best;
    }
}

pub(super) fn recall_at(i: usize) -> f64 {
    if i + 1 == RECALL_POINTS {
        1.0
    } else {
        i as f64 * 0.01
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_everything_found_without_error_is_half() {
        let (recall, precision) = ([0.25, 0.5], [1.0, 1.0]);
        // Recalls 0 to 0.5 are 51 of 101 samples.
        assert!((mean_of_samples(&recall, &precision) - 51.0 / 101.0).abs() < 1e-12);
        // From 0.5 on the line falls to 0 at 1, which adds half of the other half.
        assert!((trapezoid(&recall, &precision) - 0.75).abs() < 1e-12);
    }

    #[test]
    fn precision_later_on_lifts_what_was_before() {
        let mut values = [0.1, 0.5, 0.2, 0.3];
        make_envelope(&mut values);
        assert_eq!(values, [0.5, 0.5, 0.3, 0.3]);
    }

    #[test]
    fn reading_between_outside_and_at_doubled_places() {
        let (xs, ys) = ([0.0, 1.0, 1.0, 2.0], [0.0, 1.0, 3.0, 5.0]);
        assert_eq!(
            [-1.0, 0.5, 1.0, 1.5, 9.0].map(|x| interpolated(x, &xs, &ys)),
            [0.0, 0.5, 3.0, 4.0, 5.0]
        );
    }
}
