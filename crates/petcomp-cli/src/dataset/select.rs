//! `petcomp dataset split` and `subset`: lists of images, without copies.

use crate::global::GlobalArgs;
use crate::print;
use petcomp::Error;
use petcomp::dataset::{Group, Leakage, NEAR_DUPLICATE_RMS, NearDuplicate, Partition, YoloSet};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum SelectCommand {
    /// Share images out again for training and validation, and report what leaks
    Split(SplitArgs),
    /// The first part of the images for training and of those for validation
    Subset(SubsetArgs),
}

#[derive(clap::Args)]
pub(crate) struct SplitArgs {
    /// Folder with a data.yaml; one that is not split yet names the same images for both parts
    folder: PathBuf,
    /// Share of the images for training
    #[arg(long, value_name = "SHARE", default_value_t = 0.8)]
    ratio: f64,
    /// How: `consecutive` (the last ones for validation), `grouped` or `random`
    #[arg(long, value_name = "HOW", default_value = "consecutive")]
    by: SplitMethod,
    /// What stays together in a grouped split: `background` or `selection`
    #[arg(long, value_name = "GROUP", default_value = "background")]
    group: Group,
    /// Images between the two parts of a consecutive split that belong to neither
    #[arg(long, value_name = "N", default_value_t = 0)]
    guard: usize,
    /// Seed of a grouped or random split
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write train.txt, val.txt and data.yaml into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SplitMethod {
    Consecutive,
    Grouped,
    Random,
}

#[derive(clap::Args)]
pub(crate) struct SubsetArgs {
    /// Folder with a data.yaml: a dataset or a split of one
    folder: PathBuf,
    /// Share of each part that is kept, from the beginning
    #[arg(long, value_name = "SHARE")]
    head: f64,
    /// Folder to write train.txt, val.txt and data.yaml into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

/// Most near duplicates that are listed.
const MAX_LISTED_PAIRS: usize = 10;

pub(super) fn run(command: &SelectCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        SelectCommand::Split(args) => write_split(args, global),
        SelectCommand::Subset(args) => write_subset(args, global),
    }
}

fn write_split(args: &SplitArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let set = YoloSet::read(&args.folder)?;
    let split = set.partitioned(args.partition(), args.ratio, args.seed)?;
    check_both_parts(&split)?;
    let leakage = split.leakage(NEAR_DUPLICATE_RMS)?;
    write_lists(&split, &args.output, global)?;
    report_leakage(&leakage);
    Ok(())
}

impl SplitArgs {
    fn partition(&self) -> Partition {
        match self.by {
            SplitMethod::Consecutive => Partition::Consecutive { guard: self.guard },
            SplitMethod::Grouped => Partition::Grouped(self.group),
            SplitMethod::Random => Partition::Random,
        }
    }
}

fn check_both_parts(split: &YoloSet) -> petcomp::Result<()> {
    let (train, val) = (split.train.len(), split.val.len());
    if train > 0 && val > 0 {
        return Ok(());
    }
    let what = format!(
        "{train} images for training and {val} for validation: too few groups for this ratio"
    );
    Err(Error::value("split", what))
}

fn write_subset(args: &SubsetArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let subset = YoloSet::read(&args.folder)?.head(args.head)?;
    write_lists(&subset, &args.output, global)
}

fn write_lists(set: &YoloSet, folder: &Path, global: &GlobalArgs) -> anyhow::Result<()> {
    set.write(folder)?;
    let (train, val) = (set.train.len(), set.val.len());
    let what = format!("{train} images for training, {val} for validation");
    global.print_written(folder, what);
    Ok(())
}

fn report_leakage(leakage: &Leakage) {
    for (group, [all, shared]) in &leakage.groups {
        print::line(format_args!(
            "leak: {shared} of {all} {group}s of the validation images are also trained on"
        ));
    }
    let pairs = &leakage.near_duplicates;
    print::line(format_args!(
        "leak: {} validation images look like one that is trained on",
        pairs.len()
    ));
    pairs.iter().take(MAX_LISTED_PAIRS).for_each(list_pair);
}

fn list_pair(pair: &NearDuplicate) {
    let (val, train, codes) = (pair.val.display(), pair.train.display(), pair.codes);
    print::line(format_args!(
        "  {val} and {train} differ by {codes:.2} codes"
    ));
}
