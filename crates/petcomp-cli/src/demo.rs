//! `petcomp demo`: a sample dataset from the photographs in the repository.

use crate::global::GlobalArgs;
use crate::output::folder_parser;
use crate::print;
use crate::{asset, dataset};
use petcomp::dataset::{DatasetConfig, DatasetCounts, Pipeline};
use petcomp::{Error, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct DemoArgs {
    /// Folder with bottles/photos.toml and labelled backgrounds/
    #[arg(long, value_name = "FOLDER", default_value = "tests/samples")]
    samples: PathBuf,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "demo", value_parser = folder_parser())]
    output: PathBuf,
    /// Number of images
    #[arg(short = 'n', long, value_name = "N", default_value_t = 24)]
    count: u64,
    /// Seed; the same seed gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    consent: dataset::LongRunConsent,
}

pub(crate) fn run(args: &DemoArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let list = args.photo_list()?;
    io::create_folder(&args.output)?;
    let recipe = args.recipe()?;
    let config = DatasetConfig::read(&recipe, &[])?;
    let built = asset::build_library(&list, &args.output.join("assets"), true, global)?;
    let pipeline = Pipeline::with_library(config, built.library)?;
    let plan = pipeline.plan(args.count, args.seed, args.dataset_folder())?;
    let counts = dataset::generate_supervised(&pipeline, &plan, &args.consent, global)?;
    let sheet = args.write_sheet()?;
    dataset::print_counts(&counts);
    args.print_files(&sheet, &counts, &recipe);
    Ok(())
}

impl DemoArgs {
    fn photo_list(&self) -> petcomp::Result<PathBuf> {
        let list = self.samples.join("bottles/photos.toml");
        if list.exists() {
            return Ok(list);
        }
        let what = "no such file; run this in petcomp's repository, or give its tests/samples folder with --samples";
        Err(Error::file(list, what))
    }

    fn dataset_folder(&self) -> PathBuf {
        self.output.join("dataset")
    }

    /// A recipe file that names its folders and nothing else, or the existing one, which the user
    /// may have changed.
    fn recipe(&self) -> petcomp::Result<PathBuf> {
        let path = self.output.join("recipe.toml");
        if path.exists() {
            return Ok(path);
        }
        let backgrounds = self.samples.join("backgrounds");
        let backgrounds = io::relative_on_disk(&backgrounds, &self.output)?;
        // A JSON string is a TOML string.
        let backgrounds = serde_json::Value::from(backgrounds.to_string_lossy());
        let text = format!("assets = \"assets\"\nbackgrounds = {backgrounds}\n");
        io::write_text(&path, &text)?;
        Ok(path)
    }

    fn write_sheet(&self) -> petcomp::Result<PathBuf> {
        let path = self.output.join("contact_sheet.png");
        let count = self.count as usize;
        dataset::write_contact_sheet(&self.dataset_folder(), count, &path)?;
        Ok(path)
    }

    fn print_files(&self, sheet: &Path, counts: &DatasetCounts, recipe: &Path) {
        print::line(format_args!("look at      {}", sheet.display()));
        for path in dataset::trainer_inputs(counts, &self.dataset_folder()) {
            print::line(format_args!("train with   {}", path.display()));
        }
        print::line(format_args!("change       {}", recipe.display()));
    }
}
