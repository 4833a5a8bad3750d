//! `petcomp dataset merge`: joins the shards of several machines into one dataset.

use super::{print_counts, print_trainer_inputs};
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::output::folder_parser;
use petcomp::dataset;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct MergeArgs {
    /// Folders of all shards, in any order
    #[arg(required = true, value_name = "SHARD")]
    shards: Vec<PathBuf>,
    /// Folder for the whole dataset
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
}

pub(crate) fn run(args: &MergeArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let progress = global.start_progress("pictures");
    let counts = dataset::merge(
        &args.shards,
        &args.output,
        &|p| progress.update(p.done, p.count),
        interruption(),
    )?;
    drop(progress);
    print_counts(&counts);
    print_trainer_inputs(&counts, &args.output);
    Ok(())
}
