//! `petcomp dataset`: recipe -> images with labels, ready to train on.

mod ablate;
mod counts;
mod fit;
mod generate;
mod inspect;
mod merge;
mod recipe;
mod select;
mod supervised;
mod training;

use counts::print_trainer_inputs;
pub(crate) use counts::{print_counts, trainer_inputs};
pub(crate) use inspect::write_contact_sheet;
pub(crate) use supervised::{LongRunConsent, generate_supervised};

use crate::global::GlobalArgs;

#[derive(clap::Subcommand)]
pub(crate) enum DatasetCommand {
    #[command(flatten)]
    Recipe(recipe::RecipeCommand),
    /// Fit a recipe to labelled images of the real place, or only to its photos of the place
    Fit(fit::FitArgs),
    /// Generate a dataset; rerun the same command to resume an interrupted run
    Generate(generate::GenerateArgs),
    /// Generate the paper's ablation datasets: all variation, one source switched off in each, all
    /// off; their scenes are paired
    Ablate(ablate::AblateArgs),
    /// Merge shards generated on several machines
    Merge(merge::MergeArgs),
    #[command(flatten)]
    Select(select::SelectCommand),
    #[command(flatten)]
    Inspect(inspect::InspectCommand),
    #[command(flatten)]
    Training(training::TrainingCommand),
}

pub(crate) fn run(command: &DatasetCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        DatasetCommand::Recipe(command) => recipe::run(command, global),
        DatasetCommand::Fit(args) => fit::run(args, global),
        DatasetCommand::Generate(args) => generate::run(args, global),
        DatasetCommand::Ablate(args) => ablate::run(args, global),
        DatasetCommand::Merge(args) => merge::run(args, global),
        DatasetCommand::Select(command) => select::run(command, global),
        DatasetCommand::Inspect(command) => inspect::run(command, global),
        DatasetCommand::Training(command) => training::run(command, global),
    }
}
