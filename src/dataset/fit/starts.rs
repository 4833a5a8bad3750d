//! How objects start and slide: the spread and the friction whose falls leave labels where the real
//! ones are.

use super::counts::{LabelOdds, object_weights, redrawn_falls};
use super::falls::{Fall, log_size};
use super::statistics::{Grouped, Moments, Weighted, earth_mover, rounds};
use crate::dataset::fit::range_text;
use crate::dataset::page::beside::in_pixels;
use crate::eval::iou;
use crate::scene::{Collider, Range, Recipe};
use std::collections::BTreeMap;

/// A key of the recipe that decides where objects come to rest, and the values that are tried.
pub(super) struct Lever {
    pub(super) key: &'static str,
    pub(super) values: &'static [f64],
    pub(super) set: fn(&mut Recipe, Range),
    /// Its value in a recipe, and a fitted one, as TOML.
    pub(super) before: fn(&Recipe) -> String,
    pub(super) text: fn(Range) -> String,
}

/// In the order in which they are fitted.
pub(super) const LEVERS: [Lever; 3] = [SPREAD, FRICTION, COLLIDER];

/// From a heap to the whole surface.
const SPREAD: Lever = Lever {
    key: "scene.start.spread",
    values: &[0.0, 0.25, 0.5, 0.75, 1.0],
    set: |recipe, range| recipe.start.spread = Some(range),
    before: |recipe| {
        let spread = recipe.start.spread;
        spread.map_or_else(|| "none".into(), range_text)
    },
    text: range_text,
};

/// From objects that slide and roll apart to objects that heap up.
const FRICTION: Lever = Lever {
    key: "scene.friction",
    values: &[0.01, 0.03, 0.1, 0.3],
    set: |recipe, range| recipe.friction = range,
    before: |recipe| range_text(recipe.friction),
    text: range_text,
};

/// A box around a photo needs more room than its outline. There is one other value.
const COLLIDER: Lever = Lever {
    key: "scene.collider",
    values: &[1.0],
    set: |recipe, _| recipe.collider = Collider::Hull,
    before: |recipe| match recipe.collider {
        Collider::Box => "\"box\"".into(),
        Collider::Hull => "\"hull\"".into(),
    },
    text: |_| "\"hull\"".into(),
};

impl Lever {
    /// Whether the recipe leaves it open: a histogram of positions replaces a spread.
    pub(super) fn applies_to(&self, recipe: &Recipe) -> bool {
        self.key != SPREAD.key || recipe.start.positions.is_empty()
    }
}

/// Share of the rounds of a bootstrap in which the best value must be nearer than the recipe's.
const AGREEMENT: f64 = 0.9;
/// Values within these shares of the rounds of a bootstrap are the fitted range.
const KEPT: [f64; 2] = [0.1, 0.9];
/// Number of measures of places: see [`places_of`].
const MEASURES: usize = 5;

/// Values of each picture.
pub(super) type ByPicture = Vec<Vec<f64>>;

/// The number and places of a picture's labels: centres from the left and from the top, distance of
/// each from its nearest neighbour, and its largest overlap with another.
pub(super) fn places_of<'a>(
    pictures: impl Iterator<Item = &'a [[f64; 4]]>,
) -> [ByPicture; MEASURES] {
    let mut places: [ByPicture; MEASURES] = Default::default();
    for boxes in pictures {
        places[0].push(boxes.iter().map(|b| b[0]).collect());
        places[1].push(boxes.iter().map(|b| b[1]).collect());
        places[2].push(nearest_distances(boxes));
        places[3].push(overlaps(boxes));
        places[4].push(vec![boxes.len() as f64]);
    }
    places
}

fn nearest_distances(boxes: &[[f64; 4]]) -> Vec<f64> {
    of_each(boxes, |a, b| (a[0] - b[0]).hypot(a[1] - b[1]), f64::min)
}

/// Greatest intersection over union of each box with another.
pub(super) fn overlaps(boxes: &[[f64; 4]]) -> Vec<f64> {
    of_each(boxes, share_iou, f64::max)
}

/// The best value over pairs of each box and another; nothing for a single box.
fn of_each(
    boxes: &[[f64; 4]],
    of_pair: fn(&[f64; 4], &[f64; 4]) -> f64,
    better: fn(f64, f64) -> f64,
) -> Vec<f64> {
    let others = |i: usize| boxes.iter().enumerate().filter(move |(j, _)| *j != i);
    let best = |(i, a)| others(i).map(|(_, b)| of_pair(a, b)).reduce(better);
    boxes.iter().enumerate().filter_map(best).collect()
}

fn share_iou(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    // In a picture of one pixel, shares are pixels.
    iou(&in_pixels(*a, [1.0; 2]), &in_pixels(*b, [1.0; 2]))
}

/// A value of a lever, its falls, and the numbers of objects that explain the real labels with it.
pub(super) struct Candidate {
    /// None for the recipe's own value.
    pub(super) value: Option<f64>,
    pub(super) falls: Vec<Fall>,
    pub(super) odds: LabelOdds,
    pub(super) weights: Vec<f64>,
    pub(super) places: [Grouped; MEASURES],
}

impl Candidate {
    pub(super) fn new(value: Option<f64>, falls: Vec<Fall>, times: &[f64]) -> Self {
        let odds = LabelOdds::new(&falls, times.len() - 1);
        let weights = object_weights(&odds, times);
        let of_falls = odds.fall_weights(&falls, &weights);
        let by_fall = places_of(falls.iter().map(|fall| fall.boxes.as_slice()));
        let places = by_fall.map(|values| weighted(&values, &of_falls));
        Self {
            value,
            falls,
            odds,
            weights,
            places,
        }
    }

    /// Sizes of the boxes of its falls, by the photo of the place.
    pub(super) fn log_sizes(&self) -> Vec<Vec<Vec<Weighted>>> {
        let of_falls = self.odds.fall_weights(&self.falls, &self.weights);
        let mut by_plate: BTreeMap<&str, Vec<Vec<Weighted>>> = BTreeMap::new();
        for (fall, weight) in self.falls.iter().zip(of_falls).filter(|(_, w)| *w > 0.0) {
            let sizes = fall.boxes.iter().map(|b| (log_size(b), weight));
            by_plate
                .entry(&fall.plate)
                .or_default()
                .push(sizes.collect());
        }
        by_plate.into_values().collect()
    }

    fn distance(&self, real: &Places) -> f64 {
        apart_on_average(&self.places.each_ref().map(Grouped::all), real)
    }

    /// The distance of its falls when redrawn; those of other candidates are drawn alike.
    fn redrawn_distance(&self, real: &Places, round: (u64, u64)) -> f64 {
        let times = redrawn_falls(&self.falls, round);
        let own = self.places.each_ref().map(|values| values.redrawn(&times));
        apart_on_average(&own, real)
    }
}

/// Values with the weights of their pictures; those of weight 0 are omitted.
fn weighted(by_picture: &[Vec<f64>], weights: &[f64]) -> Grouped {
    let pairs = by_picture.iter().zip(weights);
    let pictures = pairs.map(|(values, weight)| {
        let there = values.iter().filter(|_| *weight > 0.0);
        there.map(|value| (*value, *weight)).collect()
    });
    Grouped::new(&pictures.collect::<Vec<_>>())
}

/// Values of all pictures, ascending.
type Places = [Vec<Weighted>; MEASURES];

/// Mean earth mover's distance of places from the real ones, in standard deviations of the latter.
fn apart_on_average(own: &Places, real: &Places) -> f64 {
    let pairs = own.iter().zip(real);
    let distances: Vec<f64> = pairs.filter_map(|(own, real)| apart(own, real)).collect();
    distances.iter().sum::<f64>() / distances.len().max(1) as f64
}

/// None if all real values are the same, or there are none; infinite if only the real ones have
/// values.
fn apart(own: &[Weighted], real: &[Weighted]) -> Option<f64> {
    let sigma = Moments::new(real)?.variance.sqrt();
    let distance = || match own.is_empty() {
        true => f64::INFINITY,
        false => earth_mover(own, real) / sigma,
    };
    (sigma > 0.0).then(distance)
}

/// The value of a lever that fits best.
pub(super) struct FittedLever {
    /// Its index among the candidates.
    pub(super) best: usize,
    /// The range of values, unless the pictures do not decide against the recipe's.
    pub(super) range: Option<Range>,
    /// Distance of each candidate from the real pictures.
    pub(super) distances: Vec<f64>,
    /// Share of the rounds of a bootstrap in which the best is nearer than the recipe's.
    pub(super) agreement: f64,
}

/// Chooses between candidates, of which the first is the recipe's own, by the boxes of real
/// pictures.
pub(super) fn choose(
    candidates: &[Candidate],
    real: &[ByPicture; MEASURES],
    seed: u64,
) -> FittedLever {
    let pictures = vec![1.0; real[0].len()];
    let real = real.each_ref().map(|values| weighted(values, &pictures));
    let whole = real.each_ref().map(Grouped::all);
    let distances: Vec<f64> = candidates.iter().map(|c| c.distance(&whole)).collect();
    let rounds = rounds(pictures.len(), seed).zip(0..).map(|(times, round)| {
        let real = real.each_ref().map(|values| values.redrawn(&times));
        let candidates = candidates.iter();
        candidates
            .map(|c| c.redrawn_distance(&real, (!seed, round)))
            .collect()
    });
    let rounds: Vec<Vec<f64>> = rounds.collect();
    let best = least_place(&distances);
    let agreement = share_nearer(&rounds, best);
    FittedLever {
        best,
        range: (agreement >= AGREEMENT).then(|| kept_values(candidates, best, &rounds)),
        distances,
        agreement,
    }
}

/// Share of the rounds in which a candidate is nearer than the recipe's own.
fn share_nearer(rounds: &[Vec<f64>], best: usize) -> f64 {
    let nearer = rounds.iter().filter(|round| round[best] < round[0]);
    nearer.count() as f64 / rounds.len() as f64
}

fn least_place(distances: &[f64]) -> usize {
    let places = distances.iter().enumerate();
    let least = places.min_by(|a, b| a.1.total_cmp(b.1));
    least.map_or(0, |(place, _)| place)
}

/// The range of the values that fit best in most rounds, the best one included.
fn kept_values(candidates: &[Candidate], best: usize, rounds: &[Vec<f64>]) -> Range {
    let chosen = rounds
        .iter()
        .filter_map(|round| candidates[least_place(round)].value);
    let mut values: Vec<f64> = chosen.collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    let ends = KEPT.map(|share| values.get((share * last).round() as usize).copied());
    let own = candidates[best].value.unwrap_or_default();
    let [low, high] = ends.map(|end| end.unwrap_or(own));
    Range::new(low.min(own), high.max(own))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Draws;

    /// Pictures of four labels each, within `reach` of the middle.
    fn pictures(reach: f64, seed: u64) -> Vec<Vec<[f64; 4]>> {
        let share = |k: u64, path: String| 0.5 + reach * (Draws::new(seed, k).unit(&path) - 0.5);
        let place = |k, i| {
            [
                share(k, format!("{i}x")),
                share(k, format!("{i}y")),
                0.1,
                0.1,
            ]
        };
        (0..20)
            .map(|k| (0..4).map(|i| place(k, i)).collect())
            .collect()
    }

    fn candidate(value: Option<f64>, reach: f64) -> Candidate {
        candidate_of(value, pictures(reach, 1))
    }

    fn candidate_of(value: Option<f64>, pictures: Vec<Vec<[f64; 4]>>) -> Candidate {
        let falls = pictures.into_iter().map(|boxes| Fall {
            objects: 4,
            boxes,
            plate: String::new(),
        });
        Candidate::new(value, falls.collect(), &[0.0, 0.0, 0.0, 0.0, 20.0])
    }

    fn chosen(candidates: &[Candidate], real: &[Vec<[f64; 4]>], seed: u64) -> FittedLever {
        choose(candidates, &places_of(real.iter().map(Vec::as_slice)), seed)
    }

    #[test]
    fn the_spread_that_leaves_labels_there_is_chosen() {
        let mut candidates = vec![candidate(None, 0.6)];
        candidates.extend(
            SPREAD
                .values
                .iter()
                .map(|s| candidate(Some(*s), 0.2 + 0.8 * s)),
        );
        let fitted = |reach: f64| chosen(&candidates, &pictures(reach, 2), 3);
        let wide = fitted(1.0).range.unwrap();
        assert!(wide.min >= 0.75 && wide.max == 1.0, "{wide:?}");
        let heap = fitted(0.2).range.unwrap();
        assert!(heap.min == 0.0 && heap.max <= 0.25, "{heap:?}");
        // Spread 0.5 is as good as the recipe's.
        assert_eq!(fitted(0.6).range, None);
    }

    #[test]
    fn falls_of_the_recipe_itself_leave_a_lever() {
        let changed = |seed: &u64| {
            let falls = |reach: f64| pictures(reach, *seed).split_off(12);
            let others = [0.7, 0.9].map(|reach| candidate_of(Some(reach), falls(reach)));
            let mut candidates = vec![candidate_of(None, falls(0.8))];
            candidates.extend(others);
            let fitted = chosen(&candidates, &pictures(0.8, !seed), *seed);
            fitted.range.is_some()
        };
        let changed = (0..100).filter(changed).count();
        assert!(changed <= 10, "{changed} of 100");
    }

    #[test]
    fn labels_that_are_alone_are_far_from_such_that_are_not() {
        let alone = candidate_of(None, vec![vec![[0.5, 0.5, 0.1, 0.1]]; 9]);
        let candidates = [alone, candidate(Some(0.5), 0.6)];
        let fitted = chosen(&candidates, &pictures(1.0, 2), 3);
        assert_eq!((fitted.best, fitted.agreement), (1, 1.0));
    }

    #[test]
    fn boxes_overlap_by_the_share_of_both() {
        let boxes = [
            [0.5, 0.5, 0.2, 0.2],
            [0.6, 0.5, 0.2, 0.2],
            [0.1, 0.1, 0.1, 0.1],
        ];
        let expected = [1.0 / 3.0, 1.0 / 3.0, 0.0];
        let found = overlaps(&boxes);
        assert!(
            (0..3).all(|i| (found[i] - expected[i]).abs() < 1e-12),
            "{found:?}"
        );
        assert!(overlaps(&boxes[..1]).is_empty());
    }
}
