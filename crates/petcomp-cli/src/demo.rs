//! `petcomp demo`: a sample dataset from the photographs in the repository.

use crate::common::Common;
use crate::print;
use crate::{asset, dataset};
use petcomp::dataset::{DatasetConfig, Pipeline, contact_sheet_of};
use petcomp::{Error, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder with bottles/photos.toml and labelled backgrounds/
    #[arg(long, value_name = "FOLDER", default_value = "tests/samples")]
    samples: PathBuf,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "demo")]
    output: PathBuf,
    /// Number of pictures
    #[arg(short = 'n', long, value_name = "N", default_value_t = 24)]
    count: u64,
    /// Seed; the same one gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    consent: dataset::Consent,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let list = args.samples.join("bottles/photos.toml");
    if !list.exists() {
        let what = "no such file; run in petcomp's repository, or say with --samples where its tests/samples folder is";
        return Err(Error::file(list, what).into());
    }
    io::create_folder(&args.output)?;
    let recipe = write_recipe(args)?;
    let library = asset::build(&list, &args.output.join("assets"), common)?;
    let folder = args.output.join("dataset");
    let pipeline = Pipeline::with_library(DatasetConfig::read(&recipe, &[])?, library)?;
    let report = dataset::make(
        &pipeline,
        &pipeline.plan(args.count, args.seed, &folder)?,
        &args.consent,
        common,
    )?;
    let sheet = args.output.join("contact_sheet.png");
    io::write(
        &sheet,
        &contact_sheet_of(&folder, args.count as usize, &Default::default())?,
    )?;
    dataset::tell(&report);
    print::line(format_args!("look at      {}", sheet.display()));
    for path in dataset::for_trainers(&report, &folder) {
        print::line(format_args!("train with   {}", path.display()));
    }
    print::line(format_args!("change       {}", recipe.display()));
    Ok(())
}

/// A recipe file that says nothing but where its folders are.
fn write_recipe(args: &Args) -> anyhow::Result<PathBuf> {
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| Error::file(path, e));
    let backgrounds = io::relative(
        &absolute(&args.samples.join("backgrounds"))?,
        &absolute(&args.output)?,
    );
    // A JSON string is a TOML string.
    let backgrounds = serde_json::Value::from(backgrounds.to_string_lossy());
    let text = format!("assets = \"assets\"\nbackgrounds = {backgrounds}\n");
    let path = args.output.join("recipe.toml");
    io::write_text(&path, &text)?;
    Ok(path)
}
