//! `petcomp train`: a small detector, learnt from real and synthetic images.

use crate::common::{Common, interruption};
use crate::print;
use petcomp::report::eval::{self, EvalReportOptions, Run};
use petcomp::train::Balance;
use petcomp::train::detector::{self, FitOptions, Fitted, Mode, TrainingSet};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// YOLO dataset of photographs; its validation part chooses the best epoch
    #[arg(long, value_name = "FOLDER", required_unless_present = "synthetic")]
    real: Option<PathBuf>,
    /// YOLO dataset that petcomp made
    #[arg(long, value_name = "FOLDER")]
    synthetic: Option<PathBuf>,
    /// One set, or batches of one source each with a weighted loss (equation 2 of the paper)
    #[arg(long, value_enum, default_value = "concatenated")]
    mode: How,
    /// Share of the real images in the combined loss, 0 to 1
    #[arg(long, default_value_t = Balance::default().alpha)]
    alpha: f64,
    /// Twice the paper's weights: alpha = R / (R + S) is then plain concatenation
    #[arg(long)]
    normalize: bool,
    #[arg(long, value_name = "N", default_value_t = FitOptions::default().epochs)]
    epochs: usize,
    /// Images in a batch
    #[arg(long, value_name = "N", default_value_t = FitOptions::default().batch)]
    batch: usize,
    /// Longer side of the images, pixels; a multiple of 32
    #[arg(long, value_name = "PX", default_value_t = FitOptions::default().side)]
    img: usize,
    /// Channels, as a multiple of YOLOv5's full size; 0.5 is YOLOv5s
    #[arg(long, value_name = "W", default_value_t = FitOptions::default().width)]
    width: f64,
    /// Blocks, as a multiple of the full size; 0.33 is YOLOv5s
    #[arg(long, value_name = "D", default_value_t = FitOptions::default().depth)]
    depth: f64,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Go on after the last whole epoch in the folder
    #[arg(long)]
    resume: bool,
    /// Train on the GPU that the system's drivers offer
    #[cfg(feature = "train-gpu")]
    #[arg(long)]
    gpu: bool,
    /// Folder for best.ckpt, last.ckpt, history.csv, curves.svg, predictions and metrics.json
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum How {
    Concatenated,
    Combined,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let set = TrainingSet::read(args.real.as_deref(), args.synthetic.as_deref(), args.img)?;
    let fitted = fit(args, common, &set)?;
    let found = args.output.join("predictions");
    detector::found_folder(&found, &fitted.sheets, &set.validation)?;
    let options = EvalReportOptions { classes: set.classes, seed: args.seed, ..Default::default() };
    let name = args.output.file_name().map_or_else(|| "train".into(), |n| n.to_string_lossy().into_owned());
    let metrics = eval::write(&args.output, &[Run { name, sheets: fitted.sheets }], &options)?;
    print::text(eval::scores_table(&metrics, &options).markdown());
    if let Some(best) = fitted.history.best() {
        common.say(format_args!(
            "best epoch {} of {}: {}",
            best + 1,
            args.epochs,
            args.output.join("best.ckpt").display()
        ));
    }
    Ok(())
}

fn fit(args: &Args, common: &Common, set: &TrainingSet) -> petcomp::Result<Fitted> {
    let mode = match args.mode {
        How::Concatenated => Mode::Concatenated,
        How::Combined => Mode::Combined(Balance { alpha: args.alpha, normalize: args.normalize }),
    };
    let options = FitOptions {
        epochs: args.epochs,
        batch: args.batch,
        side: args.img,
        width: args.width,
        depth: args.depth,
        seed: args.seed,
        mode,
        ..Default::default()
    };
    let (progress, stop) = (common.progress("batches"), interruption());
    let at = |done, total| {
        progress.at(done, total);
        !stop.load(Ordering::Relaxed)
    };
    #[cfg(feature = "train-gpu")]
    if args.gpu {
        return detector::fit::<detector::Gpu>(set, &options, &args.output, args.resume, &Default::default(), at);
    }
    detector::fit::<detector::Cpu>(set, &options, &args.output, args.resume, &Default::default(), at)
}
