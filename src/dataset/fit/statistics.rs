//! Samples with weights, and distances between them.

use crate::eval::{Interval, drawn};

/// Rounds of every bootstrap.
pub(super) const ROUNDS: u64 = 200;
/// Share of the rounds that must agree on the sign of a statistic for it to be significant: its
/// 97.5 % interval is on one side of zero. A key depends on two of them, mean and variance, and
/// stays unchanged in more than 9 of 10 cases if there is no difference.
pub(super) const SAME_SIGN: f64 = 0.9875;

/// A value and how often it occurs, in any unit.
pub(super) type Weighted = (f64, f64);

/// Mean and variance of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl Moments {
    /// None for values without weight.
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

/// The smaller of the next two values.
fn least(a: Option<&Weighted>, b: Option<&Weighted>) -> Option<f64> {
    let next = a.into_iter().chain(b).map(|(value, _)| *value);
    next.reduce(f64::min)
}

/// How many of the sorted values equal this one; their weight is added to `below`.
fn take_equal(values: &[Weighted], value: f64, below: &mut f64) -> usize {
    let equal = values.iter().take_while(|(v, _)| *v == value);
    equal.inspect(|(_, weight)| *below += weight).count()
}

/// Values of pictures or falls, which are resampled as a whole: ascending, each with the index of
/// its picture.
pub(super) struct Grouped(Vec<(Weighted, usize)>);

impl Grouped {
    pub(super) fn new(pictures: &[Vec<Weighted>]) -> Self {
        let placed = pictures.iter().enumerate();
        let values =
            placed.flat_map(|(place, values)| values.iter().map(move |value| (*value, place)));
        let mut values: Vec<(Weighted, usize)> = values.collect();
        values.sort_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
        Self(values)
    }

    /// The values of each picture once.
    pub(super) fn all(&self) -> Vec<Weighted> {
        self.0.iter().map(|(value, _)| *value).collect()
    }

    /// The values of a round: `times[i]` is how often picture `i` was drawn.
    pub(super) fn redrawn(&self, times: &[u32]) -> Vec<Weighted> {
        let there = self.0.iter().filter(|(_, place)| times[*place] > 0);
        there
            .map(|((value, weight), place)| (*value, weight * f64::from(times[*place])))
            .collect()
    }
}

/// How often each of `count` pictures is drawn in every round of a bootstrap.
pub(super) fn rounds(count: usize, seed: u64) -> impl Iterator<Item = Vec<u32>> {
    (0..ROUNDS).map(move |round| drawn(count, seed, round))
}

/// The same, but first places are drawn and then the pictures of each: `counts[i]` of place `i`.
pub(super) fn rounds_within(counts: &[usize], seed: u64) -> impl Iterator<Item = Vec<u32>> {
    let place = move |i: usize, round| drawn(counts[i], seed ^ (1 + i as u64), round);
    rounds(counts.len(), seed)
        .zip(0..)
        .map(move |(places, round)| {
            let pictures = places.iter().enumerate().flat_map(|(i, times)| {
                let pictures = place(i, round).into_iter();
                pictures.map(move |n| times * n)
            });
            pictures.collect()
        })
}

/// A statistic, and its values in the rounds of a bootstrap.
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

    /// Whether enough rounds agree on which side of zero it is.
    pub(super) fn is_decided(&self) -> bool {
        let same = self.rounds.iter().filter(|v| **v * self.value > 0.0);
        same.count() as f64 >= SAME_SIGN * self.rounds.len() as f64
    }

    /// Excludes zero if the statistic is significant.
    pub(super) fn interval(&self) -> Interval {
        let mut rounds = self.rounds.clone();
        rounds.sort_by(f64::total_cmp);
        let beyond = ((1.0 - SAME_SIGN) * rounds.len() as f64) as usize;
        let low = rounds.get(beyond).copied();
        let high = rounds.iter().rev().nth(beyond).copied();
        Interval {
            value: self.value,
            low: low.unwrap_or(self.value),
            high: high.unwrap_or(self.value),
        }
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
        let told = |value: f64, below: i32| {
            let rounds = (0..200).map(|i| f64::from(i - below) + 0.5);
            let told = Bootstrapped::new(value, rounds);
            (told.is_decided(), told.interval().low > 0.0)
        };
        assert_eq!(told(1.0, 2), (true, true));
        assert_eq!(told(1.0, 3), (false, false));
        assert_eq!(told(0.0, 2), (false, true));
    }
}
