//! The training itself.

use super::augment::{Augment, Example, example};
use super::checkpoint::{Progress, load_training, save, save_training};
use super::dice::Dice;
use super::history::{Epoch, History};
use super::loss::{loss, numbers};
use super::network::{ANCHORS_PER_LEVEL, Description, LEVELS, Network};
use super::optimizer::Optimizer;
use super::plan::{Mode, Step, plan};
use super::predict::predict;
use super::sample::Sample;
use super::schedule::Schedule;
use crate::error::{Error, Result};
use crate::eval::{Sheet, yolov5};
use crate::io;
use crate::train::{BatchOptions, anchors};
use burn::module::AutodiffModule;
use burn::tensor::backend::AutodiffBackend;
use burn::tensor::{Tensor, TensorData};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Images whose gradient an update is worth, whatever the batch: YOLOv5's nominal batch.
const NOMINAL_BATCH: f64 = 64.0;
/// Bits of a stream's number that count the images of an epoch.
const IMAGE_BITS: u32 = 32;

/// How to train.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitOptions {
    /// Epochs. Default: 300.
    pub epochs: usize,
    /// Images in a batch. Default: 32.
    pub batch: usize,
    /// Side of the network's square, pixels, a multiple of 32. Default: 640.
    pub side: usize,
    /// See [`Description::width`]. Default: 0.5.
    pub width: f64,
    /// See [`Description::depth`]. Default: 0.33.
    pub depth: f64,
    /// Of weights, order, augmentation and anchors. Default: 0.
    pub seed: u64,
    /// How real and synthetic images go together. Default: concatenated.
    pub mode: Mode,
    /// Learning rate and momentum.
    pub schedule: Schedule,
    /// How pictures are changed.
    pub augment: Augment,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            epochs: 300,
            batch: BatchOptions::default().size,
            side: 640,
            width: 0.5,
            depth: 0.33,
            seed: 0,
            mode: Mode::Concatenated,
            schedule: Schedule::default(),
            augment: Augment::default(),
        }
    }
}

/// What there is to learn from. All is kept in memory: three bytes a pixel.
#[derive(Clone, Debug, Default)]
pub struct TrainingSet {
    /// Names of the classes.
    pub classes: Vec<String>,
    /// Photographs.
    pub real: Vec<Sample>,
    /// Made by petcomp.
    pub synthetic: Vec<Sample>,
    /// What the best epoch is chosen by.
    pub validation: Vec<Sample>,
}

/// A finished training.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Every epoch.
    pub history: History,
    /// What the best epoch's network found in the validation set.
    pub sheets: Vec<Sheet>,
}

/// Trains a network and leaves in `folder`: `best.ckpt` (the network with the best mAP@0.5:0.95 on the validation set),
/// `last.ckpt` (to go on from), `history.csv` and `curves.svg`.
///
/// With `resume` it goes on after the last whole epoch in the folder, to the same result as without the break; where
/// there is none it begins. `at` is told batches done and in all, and says whether to go on.
///
/// # Errors
/// [`Error::Value`] for options that cannot be right; [`Error::File`] for a folder that cannot be written or whose
/// training had other options; [`Error::Interrupted`] when told to stop, with the last whole epoch kept.
pub fn fit<B: AutodiffBackend>(
    set: &TrainingSet,
    options: &FitOptions,
    folder: &Path,
    resume: bool,
    device: &B::Device,
    mut at: impl FnMut(u64, u64) -> bool,
) -> Result<Fitted> {
    io::create_folder(folder)?;
    let mut run = if resume && last(folder).is_file() {
        Run::<B>::resumed(set, options, folder, device)?
    } else {
        Run::<B>::new(set, options, device)?
    };
    let images: Vec<&Sample> = set.real.iter().chain(&set.synthetic).collect();
    for epoch in run.progress.history.epochs.len()..options.epochs {
        run.learn(epoch, &images, &mut at)?;
        run.judge(&set.validation, folder)?;
    }
    let (best, description) = super::load::<B::InnerBackend>(&folder.join("best.ckpt"), device)?;
    let sheets = predict(&best, &description, &set.validation, options.batch, device);
    Ok(Fitted { history: run.progress.history, sheets })
}

fn last(folder: &Path) -> std::path::PathBuf {
    folder.join("last.ckpt")
}

/// A training under way.
struct Run<'a, B: AutodiffBackend> {
    sizes: [usize; 2],
    progress: Progress,
    /// Out only during an update.
    network: Network<B>,
    optimizer: Optimizer<B>,
    device: &'a B::Device,
    /// The epoch in hand.
    current: Epoch,
}

impl<'a, B: AutodiffBackend> Run<'a, B> {
    fn new(set: &TrainingSet, options: &FitOptions, device: &'a B::Device) -> Result<Self> {
        let description = describe(set, options);
        description.check()?;
        let network = Network::new(&description, options.seed, device);
        let optimizer = Optimizer::new(options.schedule, &network);
        let progress = Progress { options: options.clone(), description, history: History::default() };
        let sizes = [set.real.len(), set.synthetic.len()];
        Ok(Self { sizes, progress, network, optimizer, device, current: Epoch::default() })
    }

    fn resumed(set: &TrainingSet, options: &FitOptions, folder: &Path, device: &'a B::Device) -> Result<Self> {
        let path = last(folder);
        let (progress, network, optimizer) = load_training(&path, device)?;
        if progress.options != *options || progress.description != describe(set, options) {
            return Err(Error::file(path, "a training with other options or images, expected the same to go on"));
        }
        let sizes = [set.real.len(), set.synthetic.len()];
        Ok(Self { sizes, progress, network, optimizer, device, current: Epoch::default() })
    }

    /// Shows every training image once.
    fn learn(&mut self, epoch: usize, images: &[&Sample], at: &mut impl FnMut(u64, u64) -> bool) -> Result<()> {
        let options = self.progress.options.clone();
        let order = BatchOptions { size: options.batch, seed: options.seed };
        let steps = plan(options.mode, self.sizes, epoch, &order)?;
        self.current = Epoch::default();
        let mut shown = 0;
        for (i, step) in steps.iter().enumerate() {
            let count = steps.len();
            if !at((epoch * count + i) as u64, (options.epochs * count) as u64) {
                let what = format!("{epoch} of {} epochs are kept; --resume goes on", options.epochs);
                return Err(Error::Interrupted { what });
            }
            let speed = options.schedule.at(epoch, i as f64 / count as f64, options.epochs);
            let stream = ((epoch as u64) << IMAGE_BITS) + shown as u64;
            let losses = self.update(step, &examples(step, images, &options, stream), speed)?;
            for (sum, part) in self.current.losses.iter_mut().zip(losses) {
                *sum += part * step.images.len() as f64 / images.len() as f64;
            }
            self.current.rate = speed[0];
            shown += step.images.len();
        }
        Ok(())
    }

    /// One batch; gives the parts of its weighted loss.
    fn update(&mut self, step: &Step, examples: &[Example], speed: [f64; 2]) -> Result<[f64; 3]> {
        let Progress { options, description, .. } = &self.progress;
        let objects: Vec<_> = examples.iter().map(|e| e.objects.clone()).collect();
        let output = self.network.forward(tensor::<B>(examples, description.side, self.device));
        let told = loss(output, &objects, description);
        if !numbers(told.total.clone())[0].is_finite() {
            return Err(Error::value("loss", "not a number; a smaller learning rate may help"));
        }
        // A last batch with fewer images weighs less, so that every image weighs the same.
        let worth = NOMINAL_BATCH * examples.len() as f64 / options.batch.max(1) as f64;
        let gradients = (told.total * (step.weight * worth)).backward();
        self.network = self.optimizer.step(speed, self.network.clone(), gradients);
        Ok(told.parts.map(|part| part * step.weight))
    }

    /// Scores the network, notes the epoch, writes what it is worth.
    fn judge(&mut self, validation: &[Sample], folder: &Path) -> Result<()> {
        let network = self.network.valid();
        let Progress { options, description, history } = &mut self.progress;
        let scores = yolov5(&predict(&network, description, validation, options.batch, self.device), &[]);
        history.epochs.push(Epoch { map50: scores.map_at(0), map: scores.map(), ..self.current });
        let best = history.best() == Some(history.epochs.len() - 1);
        if best {
            save(&folder.join("best.ckpt"), &network, description)?;
        }
        history.write(folder)?;
        save_training(&last(folder), &self.progress, &self.network, &self.optimizer)
    }
}

/// The network for these options, its anchors fitted to the training images.
fn describe(set: &TrainingSet, options: &FitOptions) -> Description {
    let objects = set.real.iter().chain(&set.synthetic).flat_map(|sample| &sample.objects);
    let sizes: Vec<[f64; 2]> = objects.map(|o| [o.bbox.width(), o.bbox.height()]).collect();
    let found = anchors(&sizes, LEVELS * ANCHORS_PER_LEVEL, options.seed).sizes;
    // Fewer boxes than anchors: the largest stands for the rest. None at all: any size is as good.
    let size = |i: usize| found.get(i).or(found.last()).copied().unwrap_or([options.side as f64 / 8.0; 2]);
    let anchors = std::array::from_fn(|l| std::array::from_fn(|a| size(l * ANCHORS_PER_LEVEL + a)));
    let FitOptions { side, width, depth, .. } = *options;
    Description { classes: set.classes.clone(), width, depth, side, anchors }
}

/// The images of a batch as the network sees them; each has a stream of draws of its own.
fn examples(step: &Step, images: &[&Sample], options: &FitOptions, stream: u64) -> Vec<Example> {
    let pool = &images[step.pool.clone()];
    let one = |(k, &i): (usize, &usize)| {
        let mut dice = Dice::new(options.seed, stream + k as u64);
        example(images[i], pool, options.side, &options.augment, &mut dice)
    };
    step.images.par_iter().enumerate().map(one).collect()
}

fn tensor<B: AutodiffBackend>(examples: &[Example], side: usize, device: &B::Device) -> Tensor<B, 4> {
    let planes: Vec<f32> = examples.iter().flat_map(|e| e.planes.iter().copied()).collect();
    Tensor::from_data(TensorData::new(planes, [examples.len(), 3, side, side]), device)
}
