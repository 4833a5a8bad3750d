//! Where objects of a recipe come to rest, how many there are and how large they look: fitted to
//! labels by falls.

use super::counts::{self, LabelOdds, label_histogram, redrawn_histogram};
use super::falls::{Fall, FallPlan, log_size};
use super::knobs::{Difference, SCALE, three_digits};
use super::measured::MeasuredSet;
use super::starts::{self, Candidate, FittedLever, LEVERS, Lever, places_of};
use super::statistics::{Bootstrapped, Moments, Weighted, rounds};
use super::{FittedKey, Fitting, range_text, unfitted};
use crate::error::{Error, Result};
use crate::eval::interval;
use crate::scene::{Count, Range, Recipe};
use std::collections::BTreeSet;

/// Numbers of objects that fall, each about a third larger than the previous one; used as far as
/// the real numbers of labels need.
pub(super) const OBJECT_COUNTS: [usize; 17] = [
    1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48, 64, 85, 113, 151, 200,
];
/// From this number of objects on, labels that hardly increase end the series: a heap shows no
/// more. Not the first time, which may be chance.
const MIN_SATURATED: usize = 8;
const SATURATED_RATIO: f64 = 1.05;
const MAX_FLAT: usize = 2;
/// By chance a share of pictures is farther than this from its expectation, in standard deviations,
/// in 2.5 % of cases.
const CHANCE_SIGMAS: f64 = 2.24;
/// How many times as many falls are made once it is known how objects fall.
pub(super) const MORE_FALLS: u64 = 4;

impl Fitting<'_> {
    /// Fits scale, spread, friction, scale again (objects in a heap look another size) and number
    /// of objects (whose share of 0 is that of negatives), in this order, and returns the weights
    /// of the numbers.
    pub(super) fn fit_places(&mut self, real: &MeasuredSet) -> Result<Vec<f64>> {
        let boxes = real.boxes();
        let counts: Vec<usize> = boxes.iter().map(Vec::len).collect();
        let times = label_histogram(&counts);
        let mut own = self.candidate(None, &times)?;
        let mut scale = self.fit_scale(&boxes, &own);
        if scale.fitted.is_some() {
            own = self.candidate(None, &times)?;
        }
        for lever in &LEVERS {
            own = self.fit_lever(lever, &boxes, own, &times)?;
        }
        if self.refine_scale(&mut scale, &boxes, &own) {
            own = self.candidate(None, &times)?;
        }
        self.keys.push(scale);
        let own = self.with_more_falls(own, &times)?;
        self.fit_objects(&counts, &own);
        Ok(own.weights)
    }

    fn candidate(&self, value: Option<(&Lever, f64)>, times: &[f64]) -> Result<Candidate> {
        let mut recipe = self.config.scene.clone();
        if let Some((lever, value)) = value {
            (lever.set)(&mut recipe, Range::fixed(value));
        }
        let falls = self.falls(&recipe, times.len() - 1)?;
        Ok(Candidate::new(value.map(|(_, value)| value), falls, times))
    }

    /// Falls of more and more objects, until even few labels exceed the maximum that is needed, or
    /// the number of labels no longer increases.
    fn falls(&self, recipe: &Recipe, most_labels: usize) -> Result<Vec<Fall>> {
        let step = || self.steps.step();
        let plan = self.fall_plan(0..self.options.falls as u64, &step);
        let (mut falls, mut most, mut flat) = (Vec::new(), 0.0, 0);
        for objects in self.counts_with_room(recipe) {
            let more = plan.falls(recipe, objects)?;
            let Some([mean, sigma]) = label_moments(&more) else {
                continue;
            };
            falls.extend(more);
            let rises = objects < MIN_SATURATED || mean > SATURATED_RATIO * most;
            flat = if rises { 0 } else { flat + 1 };
            most = mean.max(most);
            if flat == MAX_FLAT || mean - sigma > most_labels as f64 {
                break;
            }
        }
        match falls.is_empty() {
            true => Err(Error::Unsettled {
                what: "no objects came to rest in any fall".into(),
            }),
            false => Ok(falls),
        }
    }

    fn fall_plan<'a>(
        &'a self,
        each: std::ops::Range<u64>,
        step: &'a (dyn Fn() + Sync),
    ) -> FallPlan<'a> {
        FallPlan {
            pipeline: &self.pipeline,
            seed: self.options.seed,
            each,
            step,
        }
    }

    /// A candidate for estimating its number of objects: with few falls, chance would be mistaken
    /// for more or fewer objects.
    fn with_more_falls(&self, own: Candidate, times: &[f64]) -> Result<Candidate> {
        let step = || self.steps.step();
        let first = self.options.falls as u64;
        let plan = self.fall_plan(first..MORE_FALLS * first, &step);
        let numbers: BTreeSet<usize> = own.falls.iter().map(|fall| fall.objects).collect();
        let mut falls = own.falls;
        for objects in numbers {
            falls.extend(plan.falls(&self.config.scene, objects)?);
        }
        Ok(Candidate::new(None, falls, times))
    }

    /// The numbers of objects for which there are enough assets and room.
    fn counts_with_room(&self, recipe: &Recipe) -> impl Iterator<Item = usize> {
        let counts = OBJECT_COUNTS.into_iter();
        counts.take_while(|objects| self.has_room(recipe, *objects))
    }

    fn has_room(&self, recipe: &Recipe, objects: usize) -> bool {
        let recipe = Recipe {
            objects: Count::fixed(objects as u32),
            ..recipe.clone()
        };
        self.pipeline.check_room_with(&recipe).is_ok()
    }

    /// Fits the size of objects.
    fn fit_scale(&mut self, boxes: &[Vec<[f64; 4]>], own: &Candidate) -> FittedKey {
        let difference = self.scale_difference(boxes, own);
        self.fit_knob(&SCALE, difference.as_ref())
    }

    /// Fits it once more; returns whether it has changed.
    fn refine_scale(
        &mut self,
        key: &mut FittedKey,
        boxes: &[Vec<[f64; 4]>],
        own: &Candidate,
    ) -> bool {
        if key.fitted.is_none() {
            *key = self.fit_scale(boxes, own);
            return key.fitted.is_some();
        }
        let difference = self.scale_difference(boxes, own);
        let moved = difference.and_then(|d| SCALE.moved(&self.config.scene, &d, 1.0));
        let moved = moved.and_then(|range| Some((range, self.with_range(&SCALE, range).ok()?)));
        let Some((range, scene)) = moved else {
            return false;
        };
        self.config.scene = scene;
        key.fitted = Some(range_text(range));
        true
    }

    fn scale_difference(&self, boxes: &[Vec<[f64; 4]>], own: &Candidate) -> Option<Difference> {
        let sizes = |boxes: &Vec<[f64; 4]>| boxes.iter().map(|b| (log_size(b), 1.0)).collect();
        let real: Vec<Vec<Weighted>> = boxes.iter().map(sizes).collect();
        Difference::new(&real, &own.log_sizes(), self.options.seed)
    }

    /// Fits where objects come to rest by a lever, and returns the recipe's own candidate.
    fn fit_lever(
        &mut self,
        lever: &Lever,
        boxes: &[Vec<[f64; 4]>],
        own: Candidate,
        times: &[f64],
    ) -> Result<Candidate> {
        if !lever.applies_to(&self.config.scene) {
            self.keys.push(self.unfitted_lever(lever));
            return Ok(own);
        }
        let candidates = self.candidates(lever, own, times)?;
        let places = places_of(boxes.iter().map(Vec::as_slice));
        let fitted = starts::choose(&candidates, &places, self.options.seed);
        self.keys.push(FittedKey {
            fitted: fitted.range.map(lever.text),
            why: describe_lever(lever, &candidates, &fitted),
            ..self.unfitted_lever(lever)
        });
        self.take_lever(lever, candidates, &fitted, times)
    }

    /// Sets the fitted values, and returns the recipe's own candidate from then on.
    fn take_lever(
        &mut self,
        lever: &Lever,
        mut candidates: Vec<Candidate>,
        fitted: &FittedLever,
        times: &[f64],
    ) -> Result<Candidate> {
        let Some(range) = fitted.range else {
            return Ok(candidates.swap_remove(0));
        };
        (lever.set)(&mut self.config.scene, range);
        match range.min == range.max {
            true => Ok(Candidate {
                value: None,
                ..candidates.swap_remove(fitted.best)
            }),
            // The falls of the best single value are not those of the range.
            false => self.candidate(None, times),
        }
    }

    fn unfitted_lever(&self, lever: &Lever) -> FittedKey {
        let before = (lever.before)(&self.config.scene);
        unfitted(lever.key, before, "start.positions is given".into())
    }

    /// The recipe's own candidate, and those of a lever's values.
    fn candidates(&self, lever: &Lever, own: Candidate, times: &[f64]) -> Result<Vec<Candidate>> {
        let values = lever.values.iter();
        let tried = values.map(|value| self.candidate(Some((lever, *value)), times));
        [Ok(own)].into_iter().chain(tried).collect()
    }

    fn fit_objects(&mut self, counts: &[usize], own: &Candidate) {
        let scene = &mut self.config.scene;
        let before = counts::recipe_weights(scene, own.odds.most_objects());
        let redrawn = redrawn_counts(counts, own, self.options.seed);
        let empty = EmptyShare::new(counts, own, &redrawn);
        let gain = gain_over(&before, counts, own, &redrawn);
        let why = describe_objects(counts, own, &redrawn, &gain);
        let mut objects = unfitted("scene.objects", count_text(&scene.objects), why);
        let why = empty.describe(counts);
        let mut negatives = unfitted("scene.negatives", scene.negatives.to_string(), why);
        let labels = own.odds.mean_labels(&own.weights);
        let is_explained = is_mean_of(counts, labels, self.options.seed);
        if !is_explained {
            objects.why += &unexplained(labels);
            negatives.why += &unexplained(labels);
        }
        let mut decided = [
            empty.is_decided_against(before[0]),
            gain.value > 0.0 && gain.is_decided(),
        ];
        // A count that includes 0 objects contains negatives: neither is right without the other.
        if counts::weights_of(&scene.objects, 1)[0] > 0.0 {
            decided = [decided.contains(&true); 2];
        }
        let [is_empty_decided, are_numbers_decided] = decided.map(|is| is && is_explained);
        if is_empty_decided {
            scene.negatives = three_digits(own.weights[0]);
            negatives.fitted = Some(scene.negatives.to_string());
        }
        if are_numbers_decided {
            scene.objects = counts::count_of(&own.weights);
            objects.fitted = Some(count_text(&scene.objects));
        }
        self.keys.extend([objects, negatives]);
    }
}

/// One round: the likelihoods of labels, how many pictures have each number of them, and the
/// weights of numbers of objects that explain those.
struct RedrawnCounts {
    odds: LabelOdds,
    times: Vec<f64>,
    weights: Vec<f64>,
}

/// Rounds of a bootstrap over the real pictures and over the falls.
fn redrawn_counts(counts: &[usize], own: &Candidate, seed: u64) -> Vec<RedrawnCounts> {
    let most = counts.iter().copied().max().unwrap_or(0);
    let pictures = rounds(counts.len(), seed).zip(0..);
    let redrawn = pictures.map(|(times, round)| {
        let odds = LabelOdds::redrawn(&own.falls, most, (!seed, round));
        let times = redrawn_histogram(counts, &times);
        RedrawnCounts {
            weights: counts::object_weights(&odds, &times),
            odds,
            times,
        }
    });
    redrawn.collect()
}

/// Whether pictures with this mean number of labels could be the real ones.
fn is_mean_of(counts: &[usize], labels: f64, seed: u64) -> bool {
    let mean = |times: &[u32]| {
        let sum: f64 = counts
            .iter()
            .zip(times)
            .map(|(n, t)| *n as f64 * f64::from(*t))
            .sum();
        sum / counts.len() as f64
    };
    let redrawn = rounds(counts.len(), seed).map(|times| mean(&times));
    let interval = interval(mean(&vec![1; counts.len()]), redrawn.collect());
    (interval.low..=interval.high).contains(&labels)
}

/// Share of the real pictures that have no objects.
struct EmptyShare {
    value: f64,
    /// Its values in the rounds of a bootstrap.
    rounds: Vec<f64>,
    pictures: usize,
}

impl EmptyShare {
    fn new(counts: &[usize], own: &Candidate, redrawn: &[RedrawnCounts]) -> Self {
        Self {
            value: own.weights[0],
            rounds: redrawn.iter().map(|r| r.weights[0]).collect(),
            pictures: counts.len(),
        }
    }

    /// Whether a recipe's share differs significantly: by a bootstrap, and by the random variation
    /// of that share, since all rounds agree if no picture is empty.
    fn is_decided_against(&self, before: f64) -> bool {
        let rounds = self.rounds.iter().map(|share| share - before);
        let sigma = (before * (1.0 - before) / self.pictures as f64).sqrt();
        let difference = self.value - before;
        difference.abs() > CHANCE_SIGMAS * sigma
            && Bootstrapped::new(difference, rounds).is_decided()
    }

    fn describe(&self, counts: &[usize]) -> String {
        let interval = interval(self.value, self.rounds.clone());
        let [value, low, high] = [interval.value, interval.low, interval.high].map(|s| 100.0 * s);
        let unlabelled = counts.iter().filter(|labels| **labels == 0).count();
        format!(
            "{unlabelled} of {} pictures have no label, {value:.0} % ({low:.0} to {high:.0}) no objects",
            self.pictures
        )
    }
}

/// Gain in likelihood of a left-out picture by the fitted weights over the previous ones, with as
/// many pictures without objects.
fn gain_over(
    before: &[f64],
    counts: &[usize],
    own: &Candidate,
    redrawn: &[RedrawnCounts],
) -> Bootstrapped {
    let others = counts::with_empty(before, own.weights[0]);
    let gain =
        |odds: &LabelOdds, times: &[f64]| counts::gain_on_pictures_left_out(odds, times, &others);
    let rounds = redrawn.iter().map(|r| gain(&r.odds, &r.times));
    Bootstrapped::new(gain(&own.odds, &label_histogram(counts)), rounds)
}

fn describe_objects(
    counts: &[usize],
    own: &Candidate,
    redrawn: &[RedrawnCounts],
    gain: &Bootstrapped,
) -> String {
    let means = redrawn.iter().map(|r| counts::mean_of(&r.weights));
    let interval = interval(counts::mean_of(&own.weights), means.collect());
    let [low, middle, high] = counts::deciles(&own.weights);
    let likelier = gain.interval();
    format!(
        "{} pictures suggest {:.1} objects on average ({:.1} to {:.1}), percentiles 10, 50 and 90 at {low}, {middle} \
         and {high}; a held-out picture is likelier than with the recipe by a factor of {:.2} ({:.2} to {:.2})",
        counts.len(),
        interval.value,
        interval.low,
        interval.high,
        likelier.value.exp(),
        likelier.low.exp(),
        likelier.high.exp()
    )
}

fn unexplained(labels: f64) -> String {
    format!(
        "; but even these have {labels:.1} labels per picture, unlike the real ones: objects fall differently there \
         (see scene.walls, scene.friction, scene.collider and the assets' thickness), so their number cannot be \
         fitted"
    )
}

fn label_moments(falls: &[Fall]) -> Option<[f64; 2]> {
    let labels: Vec<Weighted> = falls
        .iter()
        .map(|fall| (fall.boxes.len() as f64, 1.0))
        .collect();
    let moments = Moments::new(&labels)?;
    Some([moments.mean, moments.variance.sqrt()])
}

fn describe_lever(lever: &Lever, candidates: &[Candidate], fitted: &FittedLever) -> String {
    let named = |value: Option<f64>| match value {
        Some(value) => (lever.text)(Range::fixed(value)),
        None => "original".into(),
    };
    let pairs = candidates.iter().zip(&fitted.distances);
    let distances: Vec<String> = pairs
        .map(|(candidate, distance)| format!("{} {distance:.2}", named(candidate.value)))
        .collect();
    let best = match fitted.best {
        0 => String::new(),
        best => format!(
            "; {} is closer than the original in {:.0} % of bootstraps",
            named(candidates[best].value),
            100.0 * fitted.agreement
        ),
    };
    format!(
        "distance of labels, their numbers and places, in standard deviations: {}{best}",
        distances.join(", ")
    )
}

fn count_text(count: &Count) -> String {
    match count {
        Count::Uniform(range) => range_text(*range),
        Count::Weighted { values, weights } => {
            let weights: Vec<String> = weights.iter().map(f64::to_string).collect();
            let weights = weights.join(", ");
            format!("{{ values = {values:?}, weights = [{weights}] }}")
        }
    }
}

#[cfg(feature = "settle")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::asset::{self, PhotoEntry, Scale};
    use crate::dataset::fit::{FitOptions, Steps};
    use crate::dataset::{DatasetConfig, Pipeline};
    use crate::{Image, LinearRgb, io};
    use std::path::Path;
    use std::sync::atomic::AtomicBool;

    static NEVER: AtomicBool = AtomicBool::new(false);

    /// A folder of one asset, a red slab.
    fn write_slab(folder: &Path) {
        let slab = Image::from_fn(120, 80, |x, y| {
            match (30..90).contains(&x) && (25..55).contains(&y) {
                true => LinearRgb::new(0.6, 0.05, 0.05),
                false => LinearRgb::new(0.04, 0.4, 0.08),
            }
        });
        let photo = folder.join("slab.png");
        io::write(&photo, &slab).unwrap();
        let entry = PhotoEntry::new(photo, "slab", "cap", Scale::Length(0.2));
        asset::add_photo(folder.join("assets"), &entry, &[], &Default::default()).unwrap();
    }

    /// Of a recipe with these keys of the scene.
    fn fitting(folder: &Path, keys: &str) -> Fitting<'static> {
        write_slab(folder);
        let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples");
        let backgrounds = samples.join("backgrounds");
        let text = format!("backgrounds = {backgrounds:?}\n[scene]\nimage = [240, 180]\n{keys}");
        let recipe = folder.join("recipe.toml");
        io::write_text(&recipe, &text).unwrap();
        let config = DatasetConfig::read(&recipe, &[]).unwrap();
        Fitting {
            pipeline: Pipeline::open(config.clone()).unwrap(),
            belt: None,
            config,
            options: FitOptions {
                falls: 2,
                ..FitOptions::default()
            },
            keys: Vec::new(),
            moved_paths: Vec::new(),
            steps: Steps::new(&|_, _| {}),
            stop: &NEVER,
        }
    }

    #[test]
    fn after_a_fitted_range_the_recipe_is_judged_by_falls_of_that_range() {
        let folder = tempfile::tempdir().unwrap();
        let mut fitting = fitting(folder.path(), "collider = \"hull\"\n");
        let real = [[0.3, 0.4], [0.5, 0.6], [0.6, 0.5]].map(|[x, y]| vec![[x, y, 0.1, 0.1]]);
        let times = label_histogram(&real.each_ref().map(Vec::len));
        let [spread, _, collider] = &LEVERS;
        let heap = fitting.candidate(Some((spread, 0.0)), &times).unwrap();
        let fitted = FittedLever {
            best: 0,
            range: Some(Range::new(0.0, 1.0)),
            distances: Vec::new(),
            agreement: 1.0,
        };
        let own = fitting.take_lever(spread, vec![heap], &fitted, &times);
        // "hull" is the recipe's value.
        let tried = fitting.candidates(collider, own.unwrap(), &times).unwrap();
        let places = places_of(real.iter().map(Vec::as_slice));
        let distances = starts::choose(&tried, &places, 0).distances;
        assert_eq!(distances[0], distances[1]);
        assert!(distances[0].is_finite(), "{distances:?}");
    }
}
