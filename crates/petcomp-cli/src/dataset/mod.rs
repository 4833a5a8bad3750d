//! `petcomp dataset`: recipe -> images with labels, ready to train on.

mod ablate;
mod counts;
mod generate;
mod inspect;
mod merge;
mod recipe;
mod select;
mod supervised;
mod training;

pub(crate) use counts::{print_counts, trainer_inputs};
pub(crate) use supervised::{LongRunConsent, generate_supervised};

use crate::global::GlobalArgs;

#[derive(clap::Subcommand)]
pub(crate) enum DatasetCommand {
    /// Write a recipe file that explains every default
    Init(recipe::InitRecipeArgs),
    /// Print every draw that image K is made with
    Explain(recipe::ExplainArgs),
    /// Make a dataset; the same command goes on where an interrupted one stopped
    Generate(generate::GenerateArgs),
    /// Make the paper's datasets: all variation, one source of it switched off in each, all off; scenes are in pairs
    Ablate(ablate::AblateArgs),
    /// Join the shards that several machines made
    Merge(merge::MergeArgs),
    /// Share images out again for training and validation, and report what leaks
    Split(select::SplitArgs),
    /// The first part of the images for training and of those for validation
    Subset(select::SubsetArgs),
    /// Look for what trainers refuse, and for what makes results too good: duplicates, leaks between the parts
    Check(inspect::CheckArgs),
    /// Write one HTML page: pictures with their labels, what was drawn, what can be seen, how long it took
    Report(inspect::ReportArgs),
    /// Draw a sheet of the first pictures with their boxes
    Sheet(inspect::SheetArgs),
    /// Plan batches of one source each, with the weight of their loss (equation 2 of the paper)
    Batches(training::BatchesArgs),
    /// Anchors that fit a dataset's boxes, by k-means
    Anchors(training::AnchorsArgs),
    /// Write what the paper's experiments need in YOLOv5 and Ultralytics
    TrainKit(training::KitArgs),
}

pub(crate) fn run(command: &DatasetCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        DatasetCommand::Init(args) => recipe::init_recipe(args, global),
        DatasetCommand::Explain(args) => recipe::explain_draws(args),
        DatasetCommand::Generate(args) => generate::run(args, global),
        DatasetCommand::Ablate(args) => ablate::run(args, global),
        DatasetCommand::Merge(args) => merge::run(args, global),
        DatasetCommand::Split(args) => select::write_split(args, global),
        DatasetCommand::Subset(args) => select::write_subset(args, global),
        DatasetCommand::Check(args) => inspect::check_dataset(args, global),
        DatasetCommand::Report(args) => inspect::write_report(args, global),
        DatasetCommand::Sheet(args) => inspect::write_sheet(args, global),
        DatasetCommand::Batches(args) => training::plan_batches(args, global),
        DatasetCommand::Anchors(args) => training::fit_anchors(args),
        DatasetCommand::TrainKit(args) => training::write_kit(args, global),
    }
}
