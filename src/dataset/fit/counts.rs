//! How many objects are in pictures of which only the labels are known.

use super::falls::Fall;
use super::statistics::{Moments, Weighted};
use crate::eval::drawn;
use crate::scene::{Count, Recipe};
use libm::erf;
use std::collections::BTreeMap;

/// Steps of expectation-maximisation; further ones change nothing visible.
const EM_STEPS: usize = 300;
/// Minimum likelihood of a number of labels: falls are few, and no number is impossible.
const LEAST_ODDS: f64 = 1e-6;
/// Minimum standard deviation of a number of labels.
const LEAST_SIGMA: f64 = 0.3;
/// Weights below this count as 0.
const LEAST_WEIGHT: f64 = 0.005;

/// Likelihood of a number of labels for each number of objects, from falls of some numbers of
/// objects: between those, mean and variance are interpolated linearly.
pub(super) struct LabelOdds {
    /// Ascending; the first is 0 objects.
    nodes: Vec<(usize, Moments)>,
    /// `rows[objects][labels]`.
    rows: Vec<Vec<f64>>,
}

impl LabelOdds {
    /// For up to `most` labels.
    pub(super) fn new(falls: &[Fall], most: usize) -> Self {
        Self::weighted(falls, &vec![1.0; falls.len()], most)
    }

    /// The same with [redrawn falls](redrawn_falls).
    pub(super) fn redrawn(falls: &[Fall], most: usize, round: (u64, u64)) -> Self {
        let times = redrawn_falls(falls, round);
        let weights: Vec<f64> = times.into_iter().map(f64::from).collect();
        Self::weighted(falls, &weights, most)
    }

    fn weighted(falls: &[Fall], weights: &[f64], most: usize) -> Self {
        let nodes = nodes_of(falls, weights);
        let last = nodes.last().map_or(0, |(objects, _)| *objects);
        let rows = (0..=last)
            .map(|objects| row(&nodes, objects, most))
            .collect();
        Self { nodes, rows }
    }

    /// The largest number of objects that it covers.
    pub(super) fn most_objects(&self) -> usize {
        self.rows.len() - 1
    }

    /// The probability of a number of labels, given weights of the numbers of objects.
    fn chance(&self, weights: &[f64], labels: usize) -> f64 {
        let rows = weights.iter().zip(&self.rows);
        rows.map(|(weight, row)| weight * row[labels]).sum()
    }

    /// Mean number of labels of a picture, given weights of the numbers of objects.
    pub(super) fn mean_labels(&self, weights: &[f64]) -> f64 {
        let pairs = weights.iter().enumerate();
        pairs
            .map(|(objects, weight)| weight * between(&self.nodes, objects).mean)
            .sum()
    }

    /// The weight of each fall, given weights of the numbers of objects: a fall stands for all
    /// numbers that are nearest to its own.
    pub(super) fn fall_weights(&self, falls: &[Fall], weights: &[f64]) -> Vec<f64> {
        let mut of_node: BTreeMap<usize, f64> = BTreeMap::new();
        for (objects, weight) in weights.iter().enumerate().skip(1) {
            *of_node.entry(self.nearest(objects)).or_default() += weight;
        }
        let mut count: BTreeMap<usize, f64> = BTreeMap::new();
        for fall in falls {
            *count.entry(fall.objects).or_default() += 1.0;
        }
        let weight = |fall: &Fall| of_node.get(&fall.objects).copied().unwrap_or(0.0);
        falls
            .iter()
            .map(|fall| weight(fall) / count[&fall.objects])
            .collect()
    }

    fn nearest(&self, objects: usize) -> usize {
        let nodes = self.nodes.iter().map(|(node, _)| *node).skip(1);
        nodes.min_by_key(|node| node.abs_diff(objects)).unwrap_or(0)
    }
}

/// How often each fall is drawn in a round of a bootstrap, given by its seed and number: for each
/// number of objects, as many as there are.
pub(super) fn redrawn_falls(falls: &[Fall], (seed, round): (u64, u64)) -> Vec<u32> {
    let mut of_node: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, fall) in falls.iter().enumerate() {
        of_node.entry(fall.objects).or_default().push(place);
    }
    let mut times = vec![0; falls.len()];
    for (objects, places) in &of_node {
        let drawn = drawn(places.len(), seed ^ *objects as u64, round);
        for (place, n) in places.iter().zip(drawn) {
            times[*place] = n;
        }
    }
    times
}

fn nodes_of(falls: &[Fall], weights: &[f64]) -> Vec<(usize, Moments)> {
    let mut counts: BTreeMap<usize, Vec<Weighted>> = BTreeMap::new();
    counts.insert(0, vec![(0.0, 1.0)]);
    for (fall, weight) in falls.iter().zip(weights) {
        let labels = fall.boxes.len() as f64;
        counts
            .entry(fall.objects)
            .or_default()
            .push((labels, *weight));
    }
    let nodes = counts.into_iter();
    nodes
        .filter_map(|(objects, labels)| Some((objects, Moments::new(&labels)?)))
        .collect()
}

/// Normal distribution over the possible numbers of labels.
fn row(nodes: &[(usize, Moments)], objects: usize, most: usize) -> Vec<f64> {
    let moments = between(nodes, objects);
    let sigma = moments.variance.sqrt().max(LEAST_SIGMA);
    let below = |x: f64| 0.5 * (1.0 + erf((x - moments.mean) / (sigma * 2_f64.sqrt())));
    let whole = below(objects as f64 + 0.5) - below(-0.5);
    let share = |labels: usize| below(labels as f64 + 0.5) - below(labels as f64 - 0.5);
    (0..=most)
        .map(|labels| match labels <= objects {
            true => LEAST_ODDS + share(labels) / whole.max(f64::MIN_POSITIVE),
            false => LEAST_ODDS,
        })
        .collect()
}

/// Mean and variance at a number of objects, interpolated between its neighbours.
fn between(nodes: &[(usize, Moments)], objects: usize) -> Moments {
    let above = nodes.partition_point(|(node, _)| *node < objects);
    let (high, high_moments) = nodes[above.min(nodes.len() - 1)];
    let (low, low_moments) = nodes[above.saturating_sub(1)];
    if high == low {
        return high_moments;
    }
    let share = (objects - low) as f64 / (high - low) as f64;
    let on_line = |a: f64, b: f64| a + share * (b - a);
    Moments {
        mean: on_line(low_moments.mean, high_moments.mean),
        variance: on_line(low_moments.variance, high_moments.variance),
    }
}

/// How many pictures have each number of labels.
pub(super) fn label_histogram(counts: &[usize]) -> Vec<f64> {
    redrawn_histogram(counts, &vec![1; counts.len()])
}

/// The same when each picture is drawn `times` times.
pub(super) fn redrawn_histogram(counts: &[usize], times: &[u32]) -> Vec<f64> {
    let most = counts.iter().copied().max().unwrap_or(0);
    let mut histogram = vec![0.0; most + 1];
    for (labels, times) in counts.iter().zip(times) {
        histogram[*labels] += f64::from(*times);
    }
    histogram
}

/// The weights of numbers of objects that best explain how many pictures have each number of
/// labels.
///
/// # Method
/// Expectation-maximisation from equal weights, smoothed by (1, 2, 1) / 4 in every step ([Silverman
/// et al. 1990]): otherwise a few pictures would leave a few peaks. Pictures without objects are a
/// separate kind and are not smoothed.
///
/// [Silverman et al. 1990]: https://doi.org/10.1111/j.2517-6161.1990.tb01788.x
pub(super) fn object_weights(odds: &LabelOdds, times: &[f64]) -> Vec<f64> {
    // Only a picture without labels may be one without objects.
    let empty = if times[0] > 0.0 { 1.0 } else { 0.0 };
    let mut weights = vec![1.0; odds.rows.len()];
    weights[0] = empty;
    for _ in 0..EM_STEPS {
        weights = smoothed(&maximised(odds, times, &weights));
        normalise(&mut weights);
    }
    weights
}

/// The share of the pictures that each number of objects explains.
fn maximised(odds: &LabelOdds, times: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut explained = vec![0.0; weights.len()];
    for (labels, times) in times.iter().enumerate().filter(|(_, times)| **times > 0.0) {
        let chance = odds.chance(weights, labels);
        for ((sum, weight), row) in explained.iter_mut().zip(weights).zip(&odds.rows) {
            *sum += times * weight * row[labels] / chance.max(f64::MIN_POSITIVE);
        }
    }
    explained
}

/// Weights averaged with their neighbours, except that of no objects; what would go beyond the ends
/// stays.
fn smoothed(weights: &[f64]) -> Vec<f64> {
    let last = weights.len() - 1;
    let at = |i: usize| weights[i.clamp(1, last)];
    let averaged = (1..=last).map(|i| (at(i - 1) + 2.0 * at(i) + at(i + 1)) / 4.0);
    std::iter::once(weights[0]).chain(averaged).collect()
}

fn normalise(weights: &mut [f64]) {
    let sum: f64 = weights.iter().sum();
    for weight in weights {
        *weight /= sum.max(f64::MIN_POSITIVE);
    }
}

/// Mean gain in log-likelihood (natural logarithm) of each picture by weights fitted to all
/// pictures but this one, over other weights. Both have the others' share without objects.
pub(super) fn gain_on_pictures_left_out(odds: &LabelOdds, times: &[f64], others: &[f64]) -> f64 {
    let seen = times.iter().enumerate().filter(|(_, times)| **times > 0.0);
    let gains = seen.map(|(labels, n)| {
        let mut rest = times.to_vec();
        rest[labels] -= 1.0;
        let fitted = with_empty(&object_weights(odds, &rest), others[0]);
        let [fitted, others] = [&fitted, others].map(|weights| odds.chance(weights, labels));
        n * (fitted.max(LEAST_ODDS) / others.max(LEAST_ODDS)).ln()
    });
    gains.sum::<f64>() / times.iter().sum::<f64>()
}

/// The weights that a recipe gives to numbers of objects up to `most`; negatives count as 0
/// objects.
pub(super) fn recipe_weights(recipe: &Recipe, most: usize) -> Vec<f64> {
    let weights = weights_of(&recipe.objects, most);
    let filled = (1.0 - recipe.negatives) * (1.0 - weights[0]);
    with_empty(&weights, 1.0 - filled)
}

/// The same weights with another share without objects.
pub(super) fn with_empty(weights: &[f64], share: f64) -> Vec<f64> {
    let mut weights = weights.to_vec();
    weights[0] = 0.0;
    normalise(&mut weights);
    for weight in &mut weights {
        *weight *= 1.0 - share;
    }
    weights[0] = share;
    weights
}

/// The weights of numbers of objects up to `most`.
pub(super) fn weights_of(count: &Count, most: usize) -> Vec<f64> {
    let mut weights = vec![0.0; most + 1];
    match count {
        Count::Uniform(range) => {
            for n in range.min as usize..=range.max as usize {
                weights[n.min(most)] += 1.0;
            }
        }
        Count::Weighted {
            values,
            weights: given,
        } => {
            for (n, weight) in values.iter().zip(given) {
                weights[(*n as usize).min(most)] += weight;
            }
        }
    }
    normalise(&mut weights);
    weights
}

/// Weights in the form of a recipe, in tenths of a percent, without negligible ones and that of no
/// objects.
pub(super) fn count_of(weights: &[f64]) -> Count {
    let weights = with_empty(weights, 0.0);
    let pairs = weights.iter().enumerate();
    let kept: Vec<_> = pairs.filter(|(_, w)| **w >= LEAST_WEIGHT).collect();
    Count::Weighted {
        values: kept.iter().map(|(n, _)| *n as u32).collect(),
        weights: kept.iter().map(|(_, w)| (1000.0 * **w).round()).collect(),
    }
}

/// First, fifth and ninth decile of the number of objects.
pub(super) fn deciles(weights: &[f64]) -> [usize; 3] {
    [0.1, 0.5, 0.9].map(|share| {
        let mut sum = 0.0;
        let reached = weights.iter().position(|weight| {
            sum += weight;
            sum >= share - 1e-9
        });
        reached.unwrap_or(weights.len() - 1)
    })
}

pub(super) fn mean_of(weights: &[f64]) -> f64 {
    let terms = weights.iter().enumerate().map(|(n, w)| n as f64 * w);
    terms.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Draws, Range};

    /// Falls in which each object has a label with this probability.
    fn falls(chance: f64) -> Vec<Fall> {
        let objects = [1, 2, 4, 6, 9, 13, 18, 24];
        let all = objects
            .into_iter()
            .flat_map(|n| (0..60).map(move |k| (n, k)));
        all.map(|(n, k)| fall(n, labels(n, k, chance))).collect()
    }

    fn fall(objects: usize, labels: usize) -> Fall {
        Fall {
            objects,
            plate: String::new(),
            boxes: vec![[0.5, 0.5, 0.1, 0.1]; labels],
        }
    }

    fn labels(objects: usize, k: u64, chance: f64) -> usize {
        let draws = Draws::new(objects as u64, k);
        let unit = |i: usize| draws.unit(&i.to_string());
        (0..objects).filter(|i| unit(*i) < chance).count()
    }

    #[test]
    fn numbers_of_objects_are_found_from_numbers_of_labels() {
        // 5 to 15 objects, of which 0.4 have a label.
        let counts: Vec<usize> = (0..200)
            .map(|k| labels(5 + (k % 11) as usize, 1000 + k, 0.4))
            .collect();
        let times = label_histogram(&counts);
        let odds = LabelOdds::new(&falls(0.4), times.len() - 1);
        let weights = object_weights(&odds, &times);
        let [low, middle, high] = deciles(&weights);
        assert!((mean_of(&weights) - 10.0).abs() < 0.8, "{weights:?}");
        assert!(
            (4..=7).contains(&low) && (9..=11).contains(&middle),
            "{low} {middle}"
        );
        assert!((13..=17).contains(&high), "{high}");
    }

    #[test]
    fn what_holds_already_gains_nothing() {
        let counts: Vec<usize> = (0..20).map(|k| labels(8, 1000 + k, 0.5)).collect();
        let times = label_histogram(&counts);
        let odds = LabelOdds::new(&falls(0.5), times.len() - 1);
        let gain = |count: Count| {
            let others = weights_of(&count, odds.most_objects());
            gain_on_pictures_left_out(&odds, &times, &others)
        };
        assert!(gain(Count::fixed(8)) < 0.0);
        assert!(gain(Count::fixed(16)) > 0.5);
    }

    #[test]
    fn labels_that_no_fall_leaves_are_explained_by_what_comes_nearest() {
        let heaps = [1, 4, 8]
            .into_iter()
            .flat_map(|n| (0..9).map(move |_| fall(n, 1)));
        let odds = LabelOdds::new(&heaps.collect::<Vec<_>>(), 6);
        let weights = object_weights(&odds, &label_histogram(&[5, 6, 6]));
        assert!(
            (weights.iter().sum::<f64>() - 1.0).abs() < 1e-9,
            "{weights:?}"
        );
        assert!((odds.mean_labels(&weights) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn only_pictures_without_labels_may_be_without_objects() {
        let odds = LabelOdds::new(&falls(0.5), 4);
        assert_eq!(object_weights(&odds, &[0.0, 3.0, 2.0])[0], 0.0);
        assert!(object_weights(&odds, &[9.0, 0.0, 1.0])[0] > 0.2);
    }

    #[test]
    fn empty_pictures_are_none_with_one_object() {
        let odds = LabelOdds::new(&falls(1.0), 5);
        let weights = object_weights(&odds, &[25.0, 0.0, 0.0, 8.0, 8.0, 9.0]);
        assert!((weights[0] - 0.5).abs() < 0.01, "{weights:?}");
        assert!(weights[1] < LEAST_WEIGHT, "{weights:?}");
        let Count::Weighted { values, .. } = count_of(&weights) else {
            panic!("no histogram")
        };
        assert!(values[0] > 1, "{values:?}");
    }

    #[test]
    fn negatives_and_a_number_of_0_have_no_objects() {
        let recipe = Recipe {
            objects: Range::new(0.0, 3.0).into(),
            negatives: 0.5,
            ..Recipe::default()
        };
        let weights = recipe_weights(&recipe, 4);
        assert_eq!(weights, [0.625, 0.125, 0.125, 0.125, 0.0]);
        assert_eq!(with_empty(&weights, 0.25), [0.25, 0.25, 0.25, 0.25, 0.0]);
    }

    #[test]
    fn weights_are_those_of_the_recipe_and_back() {
        let weights = weights_of(&Range::new(2.0, 5.0).into(), 24);
        assert_eq!(weights[2..6], [0.25; 4]);
        let Count::Weighted { values, weights } = count_of(&weights) else {
            panic!("no histogram")
        };
        assert_eq!((values, weights), (vec![2, 3, 4, 5], vec![250.0; 4]));
        assert_eq!(deciles(&[0.05, 0.2, 0.5, 0.25]), [1, 2, 3]);
    }
}
