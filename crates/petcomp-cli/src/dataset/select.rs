//! `petcomp dataset split` and `subset`: lists of images, without copies.

use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::print;
use crate::values::check_companion;
use petcomp::dataset::{Group, Leakage, NEAR_DUPLICATE_RMS, NearDuplicate, Partition, YoloSet};
use petcomp::{Error, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum SelectCommand {
    /// Split images anew into training and validation, and report leakage
    Split(SplitArgs),
    /// Keep the first part of the training images and of the validation images
    Subset(SubsetArgs),
}

#[derive(clap::Args)]
pub(crate) struct SplitArgs {
    /// Folder with a data.yaml; if not yet split, it names the same images for both parts
    folder: PathBuf,
    /// Share of the images for training
    #[arg(long, value_name = "SHARE", default_value_t = 0.8)]
    ratio: f64,
    /// Method: `consecutive` (the last images for validation), `grouped` or `random`
    #[arg(long, value_name = "HOW", default_value = "consecutive")]
    by: SplitMethod,
    /// What a grouped split keeps together: `background` or `selection` [default: background]
    #[arg(long, value_name = "GROUP")]
    group: Option<Group>,
    /// Images left out between the two parts of a consecutive split [default: 0]
    #[arg(long, value_name = "N")]
    guard: Option<usize>,
    /// Seed of a grouped or random split
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for train.txt, val.txt and data.yaml
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SplitMethod {
    Consecutive,
    Grouped,
    Random,
}

#[derive(clap::Args)]
pub(crate) struct SubsetArgs {
    /// Folder with a data.yaml: a dataset or a split of one
    folder: PathBuf,
    /// Share of each part to keep, from the beginning, rounded down
    #[arg(long, value_name = "SHARE")]
    head: f64,
    /// Folder for train.txt, val.txt and data.yaml
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
}

/// Maximum number of near-duplicates that are listed.
const MAX_LISTED_PAIRS: usize = 10;

pub(super) fn run(command: &SelectCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        SelectCommand::Split(args) => write_split(args, global),
        SelectCommand::Subset(args) => write_subset(args, global),
    }
}

fn write_split(args: &SplitArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let how = args.partition()?;
    check_sources_stay(&args.folder, &args.output)?;
    let set = YoloSet::read(&args.folder)?;
    let split = set.partitioned(how, args.ratio, args.seed)?;
    check_both_parts(&split, &scarce(how, args.ratio))?;
    let leakage = split.leakage(NEAR_DUPLICATE_RMS)?;
    write_lists(&split, &args.output, global)?;
    report_leakage(&leakage);
    Ok(())
}

impl SplitArgs {
    fn partition(&self) -> petcomp::Result<Partition> {
        self.check_companions()?;
        Ok(match self.by {
            SplitMethod::Consecutive => Partition::Consecutive {
                guard: self.guard.unwrap_or(0),
            },
            SplitMethod::Grouped => Partition::Grouped(self.group.unwrap_or(Group::Background)),
            SplitMethod::Random => Partition::Random,
        })
    }

    /// Fails if a guard or a group is given that belongs to another split method.
    fn check_companions(&self) -> petcomp::Result<()> {
        let (guard, consecutive) = (self.guard.is_some(), self.by == SplitMethod::Consecutive);
        check_companion("--guard", guard, "--by consecutive", consecutive)?;
        let (group, grouped) = (self.group.is_some(), self.by == SplitMethod::Grouped);
        check_companion("--group", group, "--by grouped", grouped)
    }
}

/// Fails if a list or the data.yaml would replace one that it is made from.
fn check_sources_stay(folder: &Path, output: &Path) -> petcomp::Result<()> {
    let written = ["train.txt", "val.txt", "data.yaml"].map(|file| output.join(file));
    io::check_distinct(YoloSet::choosing_files(folder)?, written)
}

/// What there may be too few of, and for which options.
fn scarce(how: Partition, ratio: f64) -> String {
    match how {
        Partition::Grouped(_) => format!("groups for --ratio {ratio}"),
        Partition::Consecutive { guard } if guard > 0 => {
            format!("images for --ratio {ratio} with --guard {guard}")
        }
        Partition::Consecutive { .. } | Partition::Random => format!("images for --ratio {ratio}"),
    }
}

fn check_both_parts(set: &YoloSet, scarce: &str) -> petcomp::Result<()> {
    let (train, val) = (set.train.len(), set.val.len());
    if train > 0 && val > 0 {
        return Ok(());
    }
    let what = format!("{train} images for training and {val} for validation: too few {scarce}");
    Err(Error::value("split", what))
}

fn write_subset(args: &SubsetArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    check_sources_stay(&args.folder, &args.output)?;
    let set = YoloSet::read(&args.folder)?;
    let subset = set.head(args.head)?;
    check_no_part_is_lost(args.head, &set, &subset)?;
    write_lists(&subset, &args.output, global)
}

/// Fails if nothing is left of a part that has images.
fn check_no_part_is_lost(head: f64, set: &YoloSet, subset: &YoloSet) -> petcomp::Result<()> {
    let parts = [
        ("training", &set.train, &subset.train),
        ("validation", &set.val, &subset.val),
    ];
    let lost = parts
        .iter()
        .find(|(_, all, left)| left.is_empty() && !all.is_empty());
    match lost {
        None => Ok(()),
        Some((part, all, _)) => {
            let what = format!("{head} leaves none of the {} images for {part}", all.len());
            Err(Error::value("--head", what))
        }
    }
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
            "leak: {shared} of {all} {group}s of the validation images are also used for training"
        ));
    }
    let pairs = &leakage.near_duplicates;
    print::line(format_args!(
        "leak: {} validation images look like a training image",
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
