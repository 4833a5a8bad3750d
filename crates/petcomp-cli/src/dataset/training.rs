//! What trainings need of a dataset: batches, anchors, the kit for PyTorch.

use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::print;
use crate::values::count;
use clap::value_parser;
use petcomp::dataset::YoloSet;
use petcomp::eval::{YoloTruth, read_yolo_truth_of};
use petcomp::io;
use petcomp::train::kit::KitOptions;
use petcomp::train::{self, Anchors, Balance, Batch, BatchOptions, Source, Weights};
use std::path::PathBuf;

#[derive(clap::Subcommand)]
pub(crate) enum TrainingCommand {
    /// Plan batches of one source each, with the weight of their loss (equation 2 of the paper)
    Batches(BatchesArgs),
    /// Anchors that fit a dataset's boxes, by k-means
    Anchors(AnchorsArgs),
    /// Write what the paper's experiments need in YOLOv5 and Ultralytics
    TrainKit(KitArgs),
}

#[derive(clap::Args)]
pub(crate) struct MixedSetArgs {
    /// YOLO dataset of photographs
    #[arg(long, value_name = "FOLDER")]
    real: PathBuf,
    /// YOLO dataset that petcomp made
    #[arg(long, value_name = "FOLDER")]
    synthetic: PathBuf,
    /// Share of the real images in the loss, 0 to 1
    #[arg(long, default_value_t = Balance::default().alpha)]
    alpha: f64,
    /// Twice the paper's weights: alpha = R / (R + S) is then plain concatenation
    #[arg(long)]
    normalize: bool,
    /// Images in a batch, 1 to 65536
    #[arg(long, value_name = "N", default_value_t = BatchOptions::default().size, value_parser = count(1..=65_536))]
    batch: usize,
}

impl MixedSetArgs {
    fn balance(&self) -> Balance {
        Balance {
            alpha: self.alpha,
            normalize: self.normalize,
        }
    }
}

#[derive(clap::Args)]
pub(crate) struct BatchesArgs {
    #[command(flatten)]
    sets: MixedSetArgs,
    /// Epochs to plan, 1 to 10000
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..=10_000))]
    epochs: u64,
    /// Seed of the order
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// File to write (JSON lines): epoch, source, weight of the loss (equation 2), images
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct KitArgs {
    #[command(flatten)]
    sets: MixedSetArgs,
    /// Epochs of a training, 1 to 100000
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = value_parser!(u64).range(1..=100_000))]
    epochs: u64,
    /// Trainings per variant, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct AnchorsArgs {
    /// Folder of the dataset
    folder: PathBuf,
    /// Number of anchors, 1 to 1000
    #[arg(short = 'n', long, value_name = "N", default_value_t = 9, value_parser = count(1..=1000))]
    count: usize,
    /// Longer side of the images in training, pixels, 1 to 65536
    #[arg(long, value_name = "PX", default_value_t = 640, value_parser = value_parser!(u32).range(1..=65_536))]
    side: u32,
    /// Seed of the clustering
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(super) fn run(command: &TrainingCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        TrainingCommand::Batches(args) => plan_batches(args, global),
        TrainingCommand::Anchors(args) => fit_anchors(args),
        TrainingCommand::TrainKit(args) => write_kit(args, global),
    }
}

fn plan_batches(args: &BatchesArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let sets = MixedSets::open(&args.sets)?;
    args.check_sets_stay()?;
    let options = BatchOptions {
        size: args.sets.batch,
        seed: args.seed,
    };
    let lines = sets.lines(args.epochs, &options)?;
    io::write_text(&args.output, &lines.concat())?;
    let (batches, weights) = (lines.len(), sets.describe_weights());
    global.print_written(&args.output, format_args!("{batches} batches; {weights}"));
    Ok(())
}

impl BatchesArgs {
    /// Fails where a file of the sets would be written over.
    fn check_sets_stay(&self) -> petcomp::Result<()> {
        let folders = [&self.sets.real, &self.sets.synthetic].into_iter();
        let files = folders.map(|folder| YoloSet::files_like(folder, &self.output));
        let files = files.collect::<petcomp::Result<Vec<_>>>()?.concat();
        io::check_distinct(files, [&self.output])
    }
}

/// Two datasets that are trained on together.
struct MixedSets {
    real: YoloSet,
    synthetic: YoloSet,
    weights: Weights,
}

impl MixedSets {
    fn open(args: &MixedSetArgs) -> petcomp::Result<Self> {
        let real = train::kit::open_for_training(&args.real)?;
        let synthetic = train::kit::open_for_training(&args.synthetic)?;
        train::kit::check_sets([&real, &synthetic], [&args.real, &args.synthetic])?;
        let counts = [&real, &synthetic].map(|set| set.train.len() as u64);
        Ok(Self {
            weights: args.balance().weights(counts[0], counts[1])?,
            real,
            synthetic,
        })
    }

    fn describe_weights(&self) -> String {
        let Weights { real, synthetic } = self.weights;
        format!("weights real {real:.4}, synthetic {synthetic:.4}")
    }

    fn lines(&self, epochs: u64, options: &BatchOptions) -> petcomp::Result<Vec<String>> {
        let (real, synthetic) = (self.real.train.len(), self.synthetic.train.len());
        let mut lines = Vec::new();
        for epoch in 0..epochs {
            for batch in train::batches(real, synthetic, epoch, options) {
                lines.push(self.batch_line(epoch, &batch)?);
            }
        }
        Ok(lines)
    }

    /// A line of JSON: epoch, source, weight of the loss, images.
    fn batch_line(&self, epoch: u64, batch: &Batch) -> petcomp::Result<String> {
        let (list, weight) = self.images_and_weight(batch.source);
        let images = batch.images.iter().map(|&i| io::path_text(&list[i]));
        let images: Vec<&str> = images.collect::<petcomp::Result<_>>()?;
        let line = serde_json::json!({
            "epoch": epoch, "source": batch.source, "weight": weight, "images": images
        });
        Ok(format!("{line}\n"))
    }

    fn images_and_weight(&self, source: Source) -> (&[PathBuf], f64) {
        match source {
            Source::Real => (&self.real.train, self.weights.real),
            Source::Synthetic => (&self.synthetic.train, self.weights.synthetic),
        }
    }
}

fn write_kit(args: &KitArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    train::kit::write(&args.output, &args.kit_options())?;
    global.print_written(&args.output, "run commands.sh there");
    Ok(())
}

impl KitArgs {
    fn kit_options(&self) -> KitOptions {
        let sets = &self.sets;
        KitOptions {
            balance: sets.balance(),
            seeds: self.seeds,
            epochs: self.epochs,
            batch: sets.batch as u64,
            ..KitOptions::new(&sets.real, &sets.synthetic)
        }
    }
}

fn fit_anchors(args: &AnchorsArgs) -> anyhow::Result<()> {
    let set = train::kit::open_for_training(&args.folder)?;
    let truth = read_yolo_truth_of(&set.train)?;
    let sides = box_sides(&truth, f64::from(args.side));
    print_anchors(&train::anchors(&sides, args.count, args.seed));
    Ok(())
}

fn print_anchors(found: &Anchors) {
    for [w, h] in &found.sizes {
        print::line(format_args!("{w:.1},{h:.1}"));
    }
    print::line(format_args!(
        "mean IoU {:.3}, best possible recall {:.4}",
        found.mean_iou, found.best_possible_recall
    ));
}

/// Width and height of each box, in images whose longer side has `longer_side` pixels.
fn box_sides(truth: &YoloTruth, longer_side: f64) -> Vec<[f64; 2]> {
    let images = truth.sheets.iter().zip(&truth.sizes);
    let scaled = images.flat_map(|(sheet, size)| {
        let scale = longer_side / f64::from(size[0].max(size[1]));
        let boxes = sheet.truth.iter().map(|truth| truth.bbox);
        boxes.map(move |bbox| [bbox.width() * scale, bbox.height() * scale])
    });
    scaled.collect()
}
