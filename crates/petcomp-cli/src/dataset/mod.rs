//! `petcomp dataset`: recipe -> images with labels, ready to train on.

mod generate;
mod inspect;
mod recipe;
mod select;
mod training;

pub(crate) use generate::{Consent, for_trainers, make, tell};

use crate::common::Common;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Write a recipe file that explains every default
    Init(recipe::Init),
    /// Print every draw that image K is made with
    Explain(recipe::Explain),
    /// Make a dataset; the same command goes on where an interrupted one stopped
    Generate(generate::Args),
    /// Make the paper's datasets: all variation, one source of it switched off in each, all off; scenes are in pairs
    Ablate(generate::Ablate),
    /// Join the shards that several machines made
    Merge(generate::Merge),
    /// Share images out again for training and validation, and report what leaks
    Split(select::Split),
    /// The first part of the images for training and of those for validation
    Subset(select::Subset),
    /// Look for what trainers refuse, and for what makes results too good: duplicates, leaks between the parts
    Check(inspect::Check),
    /// Write one HTML page: pictures with their labels, what was drawn, what can be seen, how long it took
    Report(inspect::Report),
    /// Draw a sheet of the first pictures with their boxes
    Sheet(inspect::Sheet),
    /// Plan batches of one source each, with the weight of their loss (equation 2 of the paper)
    Batches(training::Batches),
    /// Anchors that fit a dataset's boxes, by k-means
    Anchors(training::Anchors),
    /// Write what the paper's experiments need in YOLOv5 and Ultralytics
    TrainKit(training::Kit),
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Init(args) => recipe::init(args, common),
        Command::Explain(args) => recipe::explain(args),
        Command::Generate(args) => generate::run(args, common),
        Command::Ablate(args) => generate::ablate(args, common),
        Command::Merge(args) => generate::merge(args, common),
        Command::Split(args) => select::split(args, common),
        Command::Subset(args) => select::subset(args, common),
        Command::Check(args) => inspect::check(args, common),
        Command::Report(args) => inspect::report(args, common),
        Command::Sheet(args) => inspect::sheet(args, common),
        Command::Batches(args) => training::batches(args, common),
        Command::Anchors(args) => training::anchors(args),
        Command::TrainKit(args) => training::kit(args, common),
    }
}
