//! `petcomp dataset split` and `subset`: lists of images, without copies.

use crate::common::Common;
use crate::print;
use petcomp::Error;
use petcomp::dataset::{Group, Leakage, Listing, NEAR_DUPLICATE_RMS, Partition};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Split {
    /// Folder with a data.yaml
    folder: PathBuf,
    /// Share of the images for training
    #[arg(long, value_name = "SHARE", default_value_t = 0.8)]
    ratio: f64,
    /// How: `consecutive` (the last ones for validation), `grouped` or `random`
    #[arg(long, value_name = "HOW", default_value = "consecutive")]
    by: How,
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
enum How {
    Consecutive,
    Grouped,
    Random,
}

#[derive(clap::Args)]
pub(crate) struct Subset {
    /// Folder with a data.yaml: a dataset or a split of one
    folder: PathBuf,
    /// Share of each part that is kept, from the beginning
    #[arg(long, value_name = "SHARE")]
    head: f64,
    /// Folder to write train.txt, val.txt and data.yaml into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

pub(crate) fn split(args: &Split, common: &Common) -> anyhow::Result<()> {
    let how = match args.by {
        How::Consecutive => Partition::Consecutive { guard: args.guard },
        How::Grouped => Partition::Grouped(args.group),
        How::Random => Partition::Random,
    };
    let shared = Listing::read(&args.folder)?.partitioned(how, args.ratio, args.seed)?;
    if shared.train.is_empty() || shared.val.is_empty() {
        let what = format!(
            "{} images for training and {} for validation",
            shared.train.len(),
            shared.val.len()
        );
        return Err(Error::value("split", format!("{what}: too few groups for this ratio")).into());
    }
    write(&shared, &args.output, common)?;
    tell(&shared.leakage(NEAR_DUPLICATE_RMS)?);
    Ok(())
}

pub(crate) fn subset(args: &Subset, common: &Common) -> anyhow::Result<()> {
    write(
        &Listing::read(&args.folder)?.head(args.head)?,
        &args.output,
        common,
    )
}

fn write(listing: &Listing, folder: &std::path::Path, common: &Common) -> anyhow::Result<()> {
    listing.write(folder)?;
    let (train, val) = (listing.train.len(), listing.val.len());
    common.say(format_args!(
        "{}: {train} images for training, {val} for validation",
        folder.display()
    ));
    Ok(())
}

fn tell(leakage: &Leakage) {
    for (group, [all, shared]) in &leakage.groups {
        print::line(format_args!(
            "leak: {shared} of {all} {group}s of the validation images are also trained on"
        ));
    }
    print::line(format_args!(
        "leak: {} validation images look like one that is trained on",
        leakage.near_duplicates.len()
    ));
    for near in leakage.near_duplicates.iter().take(10) {
        let (val, train) = (near.val.display(), near.train.display());
        print::line(format_args!(
            "  {val} and {train} differ by {:.2} codes",
            near.codes
        ));
    }
}
