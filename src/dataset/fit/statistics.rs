//! Samples with weights, and how far two of them are from each other.

use crate::eval::{Interval, drawn, interval};

/// Rounds of every bootstrap.
pub(super) const ROUNDS: u64 = 200;
/// Share of the rounds that must agree on the sign of a statistic before it is decided: its
/// interval of 95 % is on one side of zero.
const SAME_SIGN: f64 = 0.975;

/// A value and how often it occurs, in any unit.
pub(super) type Weighted = (f64, f64);

/// Mean and variance of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl Moments {
    /// None of values without weight.
    pub(super) fn new(values: &[Weighted]) -> Option<Self> {
        let weight = weight_of(values);
        let sum: f64 = values.iter().map(|(value, weight)| weight * value).sum();
        if weight <= 0.0 {
            return None;
        }
        let mean = sum / weight;
        let squares = values.iter().map(|(v, weight)| weight * (v - mean).powi(2));
        Some(Self {
            mean,
            variance: squares.sum::<f64>() / weight,
        })
    }
}

/// Earth mover's distance of two weighted samples, both sorted.
///
/// # Method
/// The area between their distribution functions.
pub(super) fn earth_mover(a: &[Weighted], b: &[Weighted]) -> f64 {
    let [whole_a, whole_b] = [weight_of(a), weight_of(b)];
    let (mut i, mut j, mut below_a, mut below_b) = (0, 0, 0.0, 0.0);
    let (mut area, mut last) = (0.0, None);
    while let Some(next) = least(a.get(i), b.get(j)) {
        let width = next - last.unwrap_or(next);
        area += width * f64::abs(below_a / whole_a - below_b / whole_b);
        last = Some(next);
        i += take_equal(&a[i..], next, &mut below_a);
        j += take_equal(&b[j..], next, &mut below_b);
    }
    area
}

fn weight_of(values: &[Weighted]) -> f64 {
    values.iter().map(|(_, weight)| weight).sum()
}

/// The smaller of two values that are next.
fn least(a: Option<&Weighted>, b: Option<&Weighted>) -> Option<f64> {
    let next = a.into_iter().chain(b).map(|(value, _)| *value);
    next.reduce(f64::min)
}

/// How many of sorted values are this one; their weight is added to what lies below.
fn take_equal(values: &[Weighted], value: f64, below: &mut f64) -> usize {
    let equal = values.iter().take_while(|(v, _)| *v == value);
    equal.inspect(|(_, weight)| *below += weight).count()
}

/// Values of groups, drawn again with their groups: `times[i]` is how often group `i` is there.
pub(super) fn redrawn(groups: &[Vec<Weighted>], times: &[u32]) -> Vec<Weighted> {
    let pairs = groups.iter().zip(times).filter(|(_, times)| **times > 0);
    pairs
        .flat_map(|(values, times)| values.iter().map(|(v, w)| (*v, w * f64::from(*times))))
        .collect()
}

/// Values that all weigh the same.
pub(super) fn equally_weighted(values: &[f64]) -> Vec<Weighted> {
    values.iter().map(|value| (*value, 1.0)).collect()
}

pub(super) fn sort_by_value(mut values: Vec<Weighted>) -> Vec<Weighted> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    values
}

/// How often each of `count` pictures is drawn in every round of a bootstrap.
pub(super) fn rounds(count: usize, seed: u64) -> impl Iterator<Item = Vec<u32>> {
    (0..ROUNDS).map(move |round| drawn(count, seed, round))
}

/// A statistic, and what it is in the rounds of a bootstrap.
pub(super) struct Bootstrapped {
    pub(super) value: f64,
    rounds: Vec<f64>,
}

impl Bootstrapped {
    pub(super) fn new(value: f64, rounds: impl Iterator<Item = f64>) -> Self {
        Self {
            value,
            rounds: rounds.collect(),
        }
    }

    /// Most rounds agree on which side of zero it lies.
    pub(super) fn is_decided(&self) -> bool {
        let same = self.rounds.iter().filter(|v| **v * self.value > 0.0);
        same.count() as f64 >= SAME_SIGN * self.rounds.len() as f64
    }

    /// Holds 95 of 100 rounds.
    pub(super) fn interval(&self) -> Interval {
        interval(self.value, self.rounds.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earth_is_moved_as_far_as_samples_are_apart() {
        let sample = |values: &[f64]| values.iter().map(|v| (*v, 1.0)).collect::<Vec<_>>();
        let (a, b) = (sample(&[0.0, 1.0, 4.0]), sample(&[2.5, 3.5, 6.5]));
        assert!((earth_mover(&a, &b) - 2.5).abs() < 1e-12);
        assert_eq!(earth_mover(&a, &a), 0.0);
        // Half of the earth stays where it is, the other half moves by 3; weights have any unit.
        let moved = [(0.0, 5.0), (3.0, 5.0)];
        assert!((earth_mover(&sample(&[0.0]), &moved) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn moments_are_those_of_the_definition() {
        let moments = Moments::new(&[(1.0, 3.0), (5.0, 1.0)]).unwrap();
        assert_eq!((moments.mean, moments.variance), (2.0, 3.0));
        assert_eq!(Moments::new(&[]), None);
    }

    #[test]
    fn what_most_rounds_agree_on_is_decided() {
        let rounds = |below: usize| (0..100).map(move |i| if i < below { -1.0 } else { 1.0 });
        assert!(Bootstrapped::new(1.0, rounds(2)).is_decided());
        assert!(!Bootstrapped::new(1.0, rounds(3)).is_decided());
        assert!(!Bootstrapped::new(0.0, rounds(50)).is_decided());
    }
}
