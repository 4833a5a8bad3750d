//! Fits a recipe to the real place: by a few labelled pictures of it, or by its plates alone.
//!
//! Obstructed objects have no label, so the number of labels is not the number of objects.
//! Therefore objects of the recipe fall and are labelled, without pixels, for several numbers of
//! objects and several ways to start; the weights of those numbers are those that explain the real
//! labels best (`counts`), and the spread is that whose labels lie as the real ones do (`starts`).
//! Ranges of camera and light are fitted by the mean and the variance of what they add to measures
//! (`knobs`), taken around the labels in the same way for pictures of the recipe and real ones.
//! What the pictures do not decide, by a bootstrap over them and over the recipe's own, is left
//! unchanged. Of a sequence on a belt one picture is used, and the recipe's own are made without a
//! belt (`sequences`).

mod camera;
mod counts;
mod falls;
mod knobs;
mod measured;
mod moved_paths;
mod places;
mod plates;
mod real;
mod report;
mod sequences;
mod starts;
mod statistics;

use crate::dataset::recipe_text::{KeyEdit, with_edits};
use crate::dataset::{DatasetConfig, Format, LabelConfig, Pictures, Pipeline, Yolo, generate};
use crate::error::{Error, Result};
use crate::io;
use crate::plot::Page;
use crate::scene::{BeltRanges, Range, Recipe};
use falls::stopped;
use measured::MeasuredSet;
use moved_paths::moved_paths;
use places::{MORE_FALLS, OBJECT_COUNTS};
use plates::MeasuredPlate;
use report::Compared;
use starts::LEVERS;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// How precisely a recipe is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FitOptions {
    /// Seed of all random draws. Default: 0.
    pub seed: u64,
    /// Number of pictures rendered from the recipe before and after. Default: 48.
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
    /// Labelled pictures of the place: a YOLO dataset, or a folder of images with labels. None fits
    /// to the plates alone.
    pub real: Option<PathBuf>,
    /// The file that the fitted recipe will be written to.
    pub output: PathBuf,
    /// How precisely.
    pub options: FitOptions,
}

/// A key that was considered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FittedKey {
    /// Its path in the recipe.
    pub key: String,
    /// Its value before, as TOML.
    pub before: String,
    /// Its value now; none if unchanged.
    pub fitted: Option<String>,
    /// The reason.
    pub why: String,
}

/// A fitted recipe.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Its text.
    pub text: String,
    /// The keys that were considered.
    pub keys: Vec<FittedKey>,
    /// Every distribution before and after, next to the real one.
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
    let recipe = DatasetConfig::read(&plan.recipe, &[])?;
    let config = plain_pictures(&recipe);
    let pipeline = Pipeline::open(config.clone())?.stopped_by(stop);
    let plates = plates::measured_plates(&pipeline)?;
    let fitting = Fitting {
        moved_paths: moved_paths(&config, &plan.recipe, &plan.output)?,
        pipeline,
        belt: recipe.scene.belt,
        config,
        options: plan.options,
        keys: Vec::new(),
        steps: Steps::new(progress),
        stop,
    };
    match &plan.real {
        None => fitting.fit_to_plates(&plates, plan),
        Some(folder) => fitting.fit_to_pictures(folder, &plates, plan),
    }
}

/// A recipe being fitted.
struct Fitting<'a> {
    /// Of the original recipe, without its belt.
    pipeline: Pipeline,
    /// The recipe's belt.
    belt: Option<BeltRanges>,
    /// The recipe as fitted so far, for [plain pictures](plain_pictures).
    config: DatasetConfig,
    options: FitOptions,
    keys: Vec<FittedKey>,
    /// Changes to file names for the fitted recipe's folder.
    moved_paths: Vec<KeyEdit>,
    steps: Steps<'a>,
    stop: &'static AtomicBool,
}

impl Fitting<'_> {
    fn fit_to_plates(mut self, plates: &[MeasuredPlate], plan: &FitPlan) -> Result<Fit> {
        self.keys = plates::match_objects(&mut self.config, plates);
        self.keys
            .extend(plates::vary_light(&mut self.config, plates));
        let page = report::of_plates(&self.keys, plates);
        self.finish(plan, page)
    }

    fn fit_to_pictures(
        mut self,
        folder: &Path,
        plates: &[MeasuredPlate],
        plan: &FitPlan,
    ) -> Result<Fit> {
        let real = self.real_pictures(folder)?;
        check_labels(folder, &real)?;
        warn_of_few(folder, real.set.pictures.len());
        self.steps.expect(self.expected_steps());
        let before = self.rendered()?;
        let negatives = self.config.scene.negatives;
        let weights = self.fit_places(&real)?;
        let matched = plates::match_objects(&mut self.config, plates);
        self.keys.extend(matched);
        // Negatives show all photos of the place, so another share of them changes the light.
        let refilled = match self.config.scene.negatives == negatives {
            true => None,
            false => Some(self.rendered()?),
        };
        self.fit_camera(&real, refilled.as_ref().unwrap_or(&before))?;
        let sets = Compared {
            after: self.rendered()?,
            real,
            before,
        };
        let page = report::of_pictures(&self.keys, &weights, &sets, plates);
        self.finish(plan, page)
    }

    /// The labelled pictures of a folder: on a belt one of each sequence.
    fn real_pictures(&self, folder: &Path) -> Result<MeasuredSet> {
        let set = real::real_pictures(folder, self.belt.as_ref())?;
        Ok(MeasuredSet::new(set, self.config.scene.image[0]))
    }

    /// Approximate number of falls and pictures.
    fn expected_steps(&self) -> u64 {
        let row = (OBJECT_COUNTS.len() / 2 + 2) * self.options.falls;
        let tried: usize = LEVERS.iter().map(|lever| lever.values.len()).sum();
        // Falls of the recipe, and of the values that two levers may be fitted to.
        let fitted = 1 + 2;
        (row * (fitted + MORE_FALLS as usize + tried)) as u64 + 3 * self.options.pictures
    }

    fn finish(self, plan: &FitPlan, page: Page) -> Result<Fit> {
        let mut edits = self.moved_paths;
        let fitted = self.keys.iter();
        edits.extend(fitted.filter_map(|key| Some(KeyEdit::set(&key.key, key.fitted.clone()?))));
        let text = io::read_text(&plan.recipe)?;
        let text = with_edits(&text, &edits).map_err(|e| e.in_file(&plan.recipe))?;
        Ok(Fit {
            text,
            keys: self.keys,
            page,
        })
    }

    /// Pictures of the recipe as fitted so far, written and read as a trainer would.
    fn rendered(&self) -> Result<MeasuredSet> {
        let folder = tempfile::tempdir().map_err(|e| Error::file(std::env::temp_dir(), e))?;
        match self.render_into(folder.path()) {
            // The original error explains how to resume in the temporary folder.
            Err(Error::Interrupted { .. }) => Err(stopped()),
            Err(error) => Err(error),
            Ok(()) => MeasuredSet::read(folder.path(), self.config.scene.image[0]),
        }
    }

    fn render_into(&self, folder: &Path) -> Result<()> {
        let pipeline = Pipeline::open(self.config.clone())?.stopped_by(self.stop);
        let FitOptions { pictures, seed, .. } = self.options;
        let plan = pipeline.plan(pictures, seed, folder)?;
        let sample = |k| pipeline.sample(seed, k).inspect(|_| self.steps.step());
        generate(&plan, sample, &|_| {}, self.stop).map(|_| ())
    }
}

/// The recipe's pictures with boxes only, each from a fall of its own.
fn plain_pictures(config: &DatasetConfig) -> DatasetConfig {
    DatasetConfig {
        scene: Recipe {
            belt: None,
            ..config.scene.clone()
        },
        labels: LabelConfig {
            formats: vec![Format::Yolo],
            yolo: Yolo {
                boxes: config.labels.extent(),
                ..Yolo::default()
            },
            ..config.labels.clone()
        },
        pictures: Pictures {
            exr: false,
            ..config.pictures.clone()
        },
        ..config.clone()
    }
}

fn check_labels(folder: &Path, real: &MeasuredSet) -> Result<()> {
    if real.set.boxes().next().is_some() {
        return Ok(());
    }
    let what = "no label, expected images with YOLO labels";
    Err(Error::file(folder, what))
}

/// Fewer real pictures than these are an accident of their moment.
const FEW_PICTURES: usize = 5;

fn warn_of_few(folder: &Path, count: usize) {
    if count < FEW_PICTURES {
        let folder = folder.display();
        log::warn!("{folder}: {count} labelled images, expected at least {FEW_PICTURES}");
    }
}

/// A range as TOML.
fn range_text(range: Range) -> String {
    match range.min == range.max {
        true => range.min.to_string(),
        false => format!("[{}, {}]", range.min, range.max),
    }
}

fn unfitted(key: &str, before: String, why: String) -> FittedKey {
    FittedKey {
        key: key.into(),
        before,
        fitted: None,
        why,
    }
}

/// Progress of the work.
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
