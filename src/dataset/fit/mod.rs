//! A recipe fitted to the real place: by a few labelled pictures of it, or by its plates alone.
//!
//! Labels tell of what is labelled, and what is obstructed has none: how many objects there were is
//! not their number. So objects of the recipe fall and are labelled, without pixels, for numbers of
//! objects and for ways to start; the weights of those numbers are what explains the real labels
//! best ([`counts`]), and the spread is that whose labels lie as the real ones do ([`starts`]).
//! Ranges of camera and light are fitted by the mean and the variance of what they add to
//! ([`knobs`]), measured around the labels on pictures of the recipe as on the real ones. What the
//! pictures do not decide, by a bootstrap over them, stays as it is.

mod counts;
mod falls;
mod knobs;
mod measured;
mod plates;
mod recipe_text;
mod report;
mod starts;
mod statistics;

use crate::dataset::environment_maps::seen_from;
use crate::dataset::paths::folder_of;
use crate::dataset::{DatasetConfig, Format, LabelConfig, Pictures, Pipeline, Yolo, generate};
use crate::error::{Error, Result};
use crate::io;
use crate::plot::Page;
use crate::scene::{Count, Range, Recipe};
use counts::label_histogram;
use falls::{Fall, FallPlan, log_size, stopped};
use knobs::{Difference, KNOBS, Knob, SCALE};
use measured::MeasuredSet;
use plates::MeasuredPlate;
use recipe_text::KeyText;
use report::Compared;
use starts::{Candidate, LEVERS, Lever, places_of};
use statistics::{Weighted, rounds};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Numbers of objects that fall, each about a third more than the one before; as far as the real
/// numbers of labels need.
const OBJECT_COUNTS: [usize; 17] = [
    1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48, 64, 85, 113, 151, 200,
];
/// From so many objects on, labels that hardly become more end the row: a heap shows no more.
const MIN_SATURATED: usize = 8;
const SATURATED: f64 = 1.05;

/// How finely a recipe is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FitOptions {
    /// Seed of all that is drawn. Default: 0.
    pub seed: u64,
    /// Pictures made of the recipe before and after. Default: 48.
    pub pictures: u64,
    /// Falls of each number of objects, for each way to start. Default: 12.
    pub falls: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            pictures: 48,
            falls: 12,
        }
    }
}

/// What is fitted to what.
#[derive(Clone, Debug)]
pub struct FitPlan {
    /// The recipe's file.
    pub recipe: PathBuf,
    /// Labelled pictures of the place: a YOLO dataset, or a folder of images with labels. None
    /// takes what the plates tell.
    pub real: Option<PathBuf>,
    /// The file that the fitted recipe is to be written to.
    pub output: PathBuf,
    /// How finely.
    pub options: FitOptions,
}

/// A key that was looked at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FittedKey {
    /// Its path in the recipe.
    pub key: String,
    /// Its value before, as TOML.
    pub before: String,
    /// Its value now; none where it is as it was.
    pub fitted: Option<String>,
    /// What decided.
    pub why: String,
}

/// A fitted recipe.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Its text.
    pub text: String,
    /// Whether the text has the comments of the recipe that was fitted.
    pub has_comments: bool,
    /// The keys that were looked at.
    pub keys: Vec<FittedKey>,
    /// Every distribution before and after, beside the real one.
    pub page: Page,
}

/// Fits a recipe: a pure function of the files and the options.
///
/// # Errors
/// A recipe, folder or label that cannot be read; no picture with a label file;
/// [`Error::Interrupted`] once the flag is true.
pub fn fit(
    plan: &FitPlan,
    progress: &(dyn Fn(u64, u64) + Sync),
    stop: &'static AtomicBool,
) -> Result<Fit> {
    let config = DatasetConfig::read(&plan.recipe, &[])?;
    let pipeline = Pipeline::open(config.clone())?.stopped_by(stop);
    let plates = plates::measured_plates(&pipeline)?;
    let fitting = Fitting {
        moved_paths: moved_paths(&config, &plan.recipe, &plan.output)?,
        pipeline,
        config,
        options: plan.options,
        keys: Vec::new(),
        steps: Steps::new(progress),
        stop,
    };
    match &plan.real {
        None => fitting.to_plates(&plates, plan),
        Some(folder) => fitting.to_pictures(folder, &plates, plan),
    }
}

/// A recipe on its way.
struct Fitting<'a> {
    /// Of the recipe as it was.
    pipeline: Pipeline,
    /// The recipe as far as it is fitted.
    config: DatasetConfig,
    options: FitOptions,
    keys: Vec<FittedKey>,
    /// What names files, for the fitted recipe's folder.
    moved_paths: Vec<KeyText>,
    steps: Steps<'a>,
    stop: &'static AtomicBool,
}

impl Fitting<'_> {
    fn to_plates(mut self, plates: &[MeasuredPlate], plan: &FitPlan) -> Result<Fit> {
        self.keys = plates::match_objects(&mut self.config, plates);
        self.keys
            .extend(plates::vary_light(&mut self.config, plates));
        let mut page = report::begin("Recipe fitted to its plates", &self.keys);
        page.text(PLATES_ALONE)
            .heading("Plates")
            .table(&plates::table(plates));
        self.finish(plan, page)
    }

    fn to_pictures(
        mut self,
        folder: &Path,
        plates: &[MeasuredPlate],
        plan: &FitPlan,
    ) -> Result<Fit> {
        let real = MeasuredSet::read(folder, self.config.scene.image[0])?;
        check_labels(folder, &real)?;
        self.steps.expect(self.expected_steps());
        let before = self.rendered()?;
        let weights = self.fit_places(&real)?;
        self.keys
            .extend(plates::match_objects(&mut self.config, plates));
        self.fit_camera(&real, &before)?;
        let after = self.rendered()?;
        let mut page = report::begin("Recipe fitted to real pictures", &self.keys);
        report::add_counts(&mut page, &weights);
        let sets = Compared {
            real: &real,
            before: &before,
            after: &after,
        };
        report::add_comparison(&mut page, &sets);
        page.heading("Plates").table(&plates::table(plates));
        self.finish(plan, page)
    }

    /// About so many falls and pictures.
    fn expected_steps(&self) -> u64 {
        let row = (OBJECT_COUNTS.len() / 2 + 2) * self.options.falls;
        let tried: usize = LEVERS.iter().map(|lever| lever.values.len()).sum();
        (row * (1 + tried)) as u64 + 3 * self.options.pictures
    }

    fn finish(self, plan: &FitPlan, page: Page) -> Result<Fit> {
        let mut keys = self.moved_paths;
        let fitted = self.keys.iter();
        keys.extend(fitted.filter_map(|key| Some((key.key.clone(), key.fitted.clone()?))));
        let text = io::read_text(&plan.recipe)?;
        let edited = recipe_text::with_keys(&text, &keys).map_err(|e| e.in_file(&plan.recipe));
        let (text, has_comments) = edited?;
        Ok(Fit {
            text,
            has_comments,
            keys: self.keys,
            page,
        })
    }

    /// Pictures of the recipe as far as it is fitted, written and read as a trainer would.
    fn rendered(&self) -> Result<MeasuredSet> {
        let folder = tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))?;
        let pipeline = Pipeline::open(plain_pictures(&self.config))?.stopped_by(self.stop);
        let (count, seed) = (self.options.pictures, self.options.seed);
        let plan = pipeline.plan(count, seed, folder.path())?;
        let made = generate(
            &plan,
            |k| pipeline.sample(seed, k).inspect(|_| self.steps.step()),
            &|_| {},
            self.stop,
        );
        match made {
            Err(Error::Interrupted { .. }) => Err(stopped()),
            made => made,
        }?;
        MeasuredSet::read(folder.path(), self.config.scene.image[0])
    }
}

const PLATES_ALONE: &str = "Without labelled pictures of the place nothing tells how many objects there are, where they lie, how \
    large they look, nor what noise, blur and exposure the camera has that will look at them: give some, 5 to 50.";

/// The recipe's pictures with boxes and nothing beside them.
fn plain_pictures(config: &DatasetConfig) -> DatasetConfig {
    DatasetConfig {
        labels: LabelConfig {
            formats: vec![Format::Yolo],
            yolo: Yolo {
                boxes: config.labels.yolo.boxes,
                ..Yolo::default()
            },
            ..config.labels.clone()
        },
        pictures: Pictures {
            exr: false,
            ..config.pictures
        },
        ..config.clone()
    }
}

fn check_labels(folder: &Path, real: &MeasuredSet) -> Result<()> {
    if real.set.boxes().next().is_some() {
        return Ok(());
    }
    Err(Error::file(
        folder,
        "no label, expected images with YOLO labels",
    ))
}

/// What names files, where the fitted recipe lies in another folder.
fn moved_paths(config: &DatasetConfig, recipe: &Path, output: &Path) -> Result<Vec<KeyText>> {
    let (from, to) = (io::absolute(recipe)?, io::absolute(output)?);
    let to = folder_of(&to);
    if folder_of(&from) == to {
        return Ok(Vec::new());
    }
    let mut keys = Vec::new();
    for (key, folder) in [
        ("assets", &config.assets),
        ("backgrounds", &config.backgrounds),
    ] {
        let folder = io::relative(&io::absolute(folder)?, to);
        keys.push((key.to_owned(), text_of(&folder.to_string_lossy())));
    }
    let files = config.scene.environment.files.iter();
    let files: Result<Vec<String>> = files
        .map(|file| seen_from(to, &config.folder, file))
        .collect();
    let files: Vec<String> = files?.iter().map(|file| text_of(file)).collect();
    if !files.is_empty() {
        keys.push((
            "scene.environment.files".into(),
            format!("[{}]", files.join(", ")),
        ));
    }
    Ok(keys)
}

/// A string as TOML.
fn text_of(text: &str) -> String {
    toml::Value::String(text.into()).to_string()
}

fn range_text(range: Range) -> String {
    match range.min == range.max {
        true => range.min.to_string(),
        false => format!("[{}, {}]", range.min, range.max),
    }
}

fn count_text(count: &Count) -> String {
    match count {
        Count::Uniform(range) => range_text(*range),
        Count::Weighted { values, weights } => {
            format!("{{ values = {values:?}, weights = {} }}", listed(weights))
        }
    }
}

fn listed(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
    format!("[{}]", texts.join(", "))
}

/// How far the work is.
struct Steps<'a> {
    done: AtomicU64,
    expected: AtomicU64,
    progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl<'a> Steps<'a> {
    fn new(progress: &'a (dyn Fn(u64, u64) + Sync)) -> Self {
        Self {
            done: AtomicU64::new(0),
            expected: AtomicU64::new(0),
            progress,
        }
    }

    fn expect(&self, steps: u64) {
        self.expected.store(steps, Ordering::Relaxed);
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.progress)(done, self.expected.load(Ordering::Relaxed).max(done));
    }
}

/// Where objects are, how many and how large.
impl Fitting<'_> {
    /// Fits scale, spread, friction and number of objects, in this order, and returns the weights of
    /// the numbers.
    fn fit_places(&mut self, real: &MeasuredSet) -> Result<Vec<f64>> {
        let boxes = real.boxes();
        let counts: Vec<usize> = boxes.iter().map(Vec::len).collect();
        let times = label_histogram(&counts);
        let mut own = self.candidate(None, &times)?;
        if self.fit_scale(&boxes, &own) {
            own = self.candidate(None, &times)?;
        }
        for lever in &LEVERS {
            own = self.fit_lever(lever, &boxes, own, &times)?;
        }
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

    /// Falls of more and more objects, until even few labels are more than the most that are
    /// looked for, or labels do not become more.
    fn falls(&self, recipe: &Recipe, most_labels: usize) -> Result<Vec<Fall>> {
        let plan = FallPlan {
            pipeline: &self.pipeline,
            seed: self.options.seed,
            each: self.options.falls,
            step: &|| self.steps.step(),
        };
        let (mut falls, mut last) = (Vec::new(), 0.0);
        for objects in OBJECT_COUNTS {
            if !self.has_room(recipe, objects) {
                break;
            }
            let more = plan.falls(recipe, objects)?;
            let Some([mean, sigma]) = label_moments(&more) else {
                continue;
            };
            falls.extend(more);
            let is_saturated = objects >= MIN_SATURATED && mean < SATURATED * last;
            if is_saturated || mean - sigma > most_labels as f64 {
                break;
            }
            last = mean;
        }
        match falls.is_empty() {
            true => Err(no_rest()),
            false => Ok(falls),
        }
    }

    fn has_room(&self, recipe: &Recipe, objects: usize) -> bool {
        let recipe = Recipe {
            objects: Count::fixed(objects as u32),
            ..recipe.clone()
        };
        self.pipeline.check_room_with(&recipe).is_ok()
    }

    /// Fits the size of objects; whether it is another now.
    fn fit_scale(&mut self, boxes: &[Vec<[f64; 4]>], own: &Candidate) -> bool {
        let sizes = |boxes: &Vec<[f64; 4]>| boxes.iter().map(|b| (log_size(b), 1.0)).collect();
        let real: Vec<Vec<Weighted>> = boxes.iter().map(sizes).collect();
        let difference = Difference::new(&real, &own.log_sizes(), self.options.seed);
        let fitted = self.fit_knob(&SCALE, difference.as_ref());
        let is_fitted = fitted.fitted.is_some();
        self.keys.push(fitted);
        is_fitted
    }

    /// Fits where objects come to lie by a lever, and returns the candidate that it is nearest to.
    fn fit_lever(
        &mut self,
        lever: &Lever,
        boxes: &[Vec<[f64; 4]>],
        own: Candidate,
        times: &[f64],
    ) -> Result<Candidate> {
        let before = (lever.before)(&self.config.scene);
        let mut key = unfitted(lever.key, before, "start.positions is given".into());
        if !lever.applies_to(&self.config.scene) {
            self.keys.push(key);
            return Ok(own);
        }
        let mut candidates = vec![own];
        for value in lever.values {
            candidates.push(self.candidate(Some((lever, *value)), times)?);
        }
        let places = places_of(boxes.iter().map(Vec::as_slice));
        let fitted = starts::choose(&candidates, &places, self.options.seed);
        key.why = describe_lever(lever, &candidates, &fitted);
        key.fitted = fitted.range.map(lever.text);
        self.keys.push(key);
        let Some(range) = fitted.range else {
            return Ok(candidates.swap_remove(0));
        };
        (lever.set)(&mut self.config.scene, range);
        let best = candidates.swap_remove(fitted.best);
        Ok(best.of_recipe())
    }

    fn fit_objects(&mut self, counts: &[usize], own: &Candidate) {
        let times = label_histogram(counts);
        let before = &self.config.scene.objects;
        let others = counts::weights_of(before, own.odds.most_objects());
        let gain = counts::gain_on_pictures_left_out(&own.odds, &times, &others);
        let mut why = self.describe_objects(counts, own, gain);
        let labels = own.odds.mean_labels(&own.weights);
        let is_explained = self.is_mean_of(counts, labels);
        if !is_explained {
            why += &unexplained(labels);
        }
        let mut key = unfitted("scene.objects", count_text(before), why);
        if gain > 0.0 && is_explained {
            let fitted = counts::count_of(&own.weights);
            key.fitted = Some(count_text(&fitted));
            self.config.scene.objects = fitted;
        }
        self.keys.push(key);
    }

    /// Whether pictures with so many labels on average could be the real ones.
    fn is_mean_of(&self, counts: &[usize], labels: f64) -> bool {
        let mean = |times: &[u32]| {
            let sum: f64 = counts
                .iter()
                .zip(times)
                .map(|(n, t)| *n as f64 * f64::from(*t))
                .sum();
            sum / counts.len() as f64
        };
        let redrawn = rounds(counts.len(), self.options.seed).map(|times| mean(&times));
        let interval = crate::eval::interval(mean(&vec![1; counts.len()]), redrawn.collect());
        (interval.low..=interval.high).contains(&labels)
    }

    fn describe_objects(&self, counts: &[usize], own: &Candidate, gain: f64) -> String {
        let mean = |weights: &[f64]| counts::mean_of(weights);
        let redrawn = rounds(counts.len(), self.options.seed).map(|times| {
            mean(&counts::object_weights(
                &own.odds,
                &histogram_of(counts, &times),
            ))
        });
        let interval = crate::eval::interval(mean(&own.weights), redrawn.collect());
        let [low, middle, high] = counts::deciles(&own.weights);
        format!(
            "on average {:.1} objects ({:.1} to {:.1}), a tenth of the pictures with at most {low}, half with at most {middle}, nine \
             tenths with at most {high}; a picture left out is likelier than with the recipe by a factor of {:.2}",
            interval.value,
            interval.low,
            interval.high,
            gain.exp()
        )
    }

    /// Sets a range by how a measure differs, and says so.
    fn fit_knob(&mut self, knob: &Knob, difference: Option<&Difference>) -> FittedKey {
        let scene = &mut self.config.scene;
        let before = (knob.get)(scene);
        let Some(difference) = difference else {
            return unfitted(
                knob.key,
                range_text(before),
                "nothing could be measured".into(),
            );
        };
        let mut key = unfitted(knob.key, range_text(before), describe(knob, difference));
        if let Some(fitted) = knob.fitted(scene, difference) {
            let mut changed = scene.clone();
            (knob.set)(&mut changed, fitted);
            if let Err(error) = changed.check().and(self.pipeline.check_room_with(&changed)) {
                key.why = format!("{} was found, but: {error}", range_text(fitted));
                return key;
            }
            *scene = changed;
            key.fitted = Some(range_text(fitted));
        }
        key
    }
}

fn unexplained(labels: f64) -> String {
    format!(
        "; but even these have {labels:.1} labels a picture, unlike the real ones: objects fall otherwise there (see          scene.walls, scene.friction, scene.collider and the assets' thickness), and their number cannot be told"
    )
}

/// How many pictures have each number of labels, when pictures are drawn so often.
fn histogram_of(counts: &[usize], times: &[u32]) -> Vec<f64> {
    let mut histogram = vec![0.0; counts.iter().copied().max().unwrap_or(0) + 1];
    for (labels, times) in counts.iter().zip(times) {
        histogram[*labels] += f64::from(*times);
    }
    histogram
}

fn label_moments(falls: &[Fall]) -> Option<[f64; 2]> {
    let labels: Vec<Weighted> = falls
        .iter()
        .map(|fall| (fall.boxes.len() as f64, 1.0))
        .collect();
    let moments = statistics::Moments::new(&labels)?;
    Some([moments.mean, moments.variance.sqrt()])
}

fn no_rest() -> Error {
    let what = "no objects came to rest in any fall".into();
    Error::Unsettled { what }
}

fn unfitted(key: &str, before: String, why: String) -> FittedKey {
    FittedKey {
        key: key.into(),
        before,
        fitted: None,
        why,
    }
}

fn describe_lever(lever: &Lever, candidates: &[Candidate], fitted: &starts::FittedLever) -> String {
    let named = |value: Option<f64>| match value {
        Some(value) => (lever.text)(Range::fixed(value)),
        None => "as it was".into(),
    };
    let pairs = candidates.iter().zip(&fitted.distances);
    let distances: Vec<String> = pairs
        .map(|(candidate, distance)| format!("{} {distance:.2}", named(candidate.value)))
        .collect();
    let best = match fitted.best {
        0 => String::new(),
        best => format!(
            "; {} is nearer than as it was in {:.0} % of bootstraps",
            named(candidates[best].value),
            100.0 * fitted.agreement
        ),
    };
    format!(
        "distance of labels, their numbers and places, in standard deviations: {}{best}",
        distances.join(", ")
    )
}

fn describe(knob: &Knob, difference: &Difference) -> String {
    let mean = difference.mean_interval();
    let [value, low, high] = [mean.value, mean.low, mean.high].map(knobs::three_digits);
    let unit = knob.unit;
    let limit = match value < 0.0 && knob.least == 0.0 {
        true => "; no key takes away what the photos of the place have",
        false => "",
    };
    format!("real pictures differ by {value} ({low} to {high}) {unit} on average{limit}")
}

/// The camera and the light.
impl Fitting<'_> {
    /// Fits the ranges of the whole picture, then once more by pictures made with them.
    fn fit_camera(&mut self, real: &MeasuredSet, before: &MeasuredSet) -> Result<()> {
        let mut fitted: Vec<(&Knob, FittedKey)> = Vec::new();
        for knob in &KNOBS {
            let difference = self.difference(knob, real, before);
            fitted.push((knob, self.fit_knob(knob, difference.as_ref())));
        }
        if fitted.iter().any(|(_, key)| key.fitted.is_some()) {
            self.refine_camera(real, &mut fitted)?;
        }
        self.keys.extend(fitted.into_iter().map(|(_, key)| key));
        Ok(())
    }

    fn refine_camera(
        &mut self,
        real: &MeasuredSet,
        fitted: &mut [(&Knob, FittedKey)],
    ) -> Result<()> {
        let trial = self.rendered()?;
        for (knob, key) in fitted.iter_mut().filter(|(_, key)| key.fitted.is_some()) {
            let difference = self.difference(knob, real, &trial);
            if let Some(range) = difference.and_then(|d| knob.moved(&self.config.scene, &d)) {
                (knob.set)(&mut self.config.scene, range);
                key.fitted = Some(range_text(range));
            }
        }
        Ok(())
    }

    fn difference(&self, knob: &Knob, real: &MeasuredSet, own: &MeasuredSet) -> Option<Difference> {
        let real = real.grouped(knob.of_picture, str::to_owned);
        let own = own.grouped(knob.of_picture, |name| self.plate_of(name));
        Difference::new(&real, &own, self.options.seed)
    }

    /// The photo behind a picture of the recipe, by the number that is its name.
    fn plate_of(&self, picture: &str) -> String {
        let number = Path::new(picture)
            .file_stem()
            .and_then(|stem| stem.to_str()?.parse().ok());
        let scene = number.and_then(|k| self.pipeline.draw(self.options.seed, k).ok());
        scene.map_or_else(String::new, |scene| scene.plate)
    }
}
