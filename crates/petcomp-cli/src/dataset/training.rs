//! What trainings need of a dataset: batches, anchors, the kit for PyTorch.

use crate::common::{Common, count};
use crate::print;
use clap::value_parser;
use petcomp::dataset::YoloSet;
use petcomp::eval::read_yolo_truth;
use petcomp::io;
use petcomp::train::kit::KitOptions;
use petcomp::train::{self, Balance, BatchOptions, Source};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Sets {
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

impl Sets {
    fn balance(&self) -> Balance {
        Balance {
            alpha: self.alpha,
            normalize: self.normalize,
        }
    }
}

#[derive(clap::Args)]
pub(crate) struct Batches {
    #[command(flatten)]
    sets: Sets,
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
pub(crate) struct Kit {
    #[command(flatten)]
    sets: Sets,
    /// Epochs of a training, 1 to 100000
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = value_parser!(u64).range(1..=100_000))]
    epochs: u64,
    /// Trainings per variant, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct Anchors {
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

pub(crate) fn batches(args: &Batches, common: &Common) -> anyhow::Result<()> {
    let (real, synthetic) = (
        YoloSet::open(&args.sets.real)?,
        YoloSet::open(&args.sets.synthetic)?,
    );
    let weights = args
        .sets
        .balance()
        .weights(real.train.len() as u64, synthetic.train.len() as u64)?;
    let options = BatchOptions {
        size: args.sets.batch,
        seed: args.seed,
    };
    let mut text = String::new();
    for epoch in 0..args.epochs {
        for batch in train::batches(real.train.len(), synthetic.train.len(), epoch, &options) {
            let (list, weight) = match batch.source {
                Source::Real => (&real.train, weights.real),
                Source::Synthetic => (&synthetic.train, weights.synthetic),
            };
            let images: Vec<&Path> = batch.images.iter().map(|&i| list[i].as_path()).collect();
            let line = serde_json::json!({ "epoch": epoch, "source": batch.source, "weight": weight, "images": images });
            text += &format!("{line}\n");
        }
    }
    io::write_text(&args.output, &text)?;
    common.say(format_args!(
        "{}: {} batches; weights real {:.4}, synthetic {:.4}",
        args.output.display(),
        text.lines().count(),
        weights.real,
        weights.synthetic
    ));
    Ok(())
}

pub(crate) fn kit(args: &Kit, common: &Common) -> anyhow::Result<()> {
    let options = KitOptions {
        balance: args.sets.balance(),
        seeds: args.seeds,
        epochs: args.epochs,
        batch: args.sets.batch as u64,
        ..KitOptions::new(&args.sets.real, &args.sets.synthetic)
    };
    train::kit::write(&args.output, &options)?;
    common.say(format_args!(
        "{}: run commands.sh there",
        args.output.display()
    ));
    Ok(())
}

pub(crate) fn anchors(args: &Anchors) -> anyhow::Result<()> {
    let set = YoloSet::open(&args.folder)?;
    let labels = set
        .train
        .first()
        .and_then(|image| YoloSet::label_of(image).parent().map(Path::to_path_buf));
    let truth = read_yolo_truth(&labels.unwrap_or_default(), None)?;
    let scaled = truth
        .sheets
        .iter()
        .zip(&truth.sizes)
        .flat_map(|(sheet, size)| {
            let scale = f64::from(args.side) / f64::from(size[0].max(size[1]));
            sheet
                .truth
                .iter()
                .map(move |t| [t.bbox.width() * scale, t.bbox.height() * scale])
        });
    let found = train::anchors(&scaled.collect::<Vec<_>>(), args.count, args.seed);
    for [w, h] in &found.sizes {
        print::line(format_args!("{w:.1},{h:.1}"));
    }
    print::line(format_args!(
        "mean IoU {:.3}, best possible recall {:.4}",
        found.mean_iou, found.best_possible_recall
    ));
    Ok(())
}
