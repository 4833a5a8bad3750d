//! `petcomp dataset generate`: a recipe becomes images with labels.

use super::{
    LongRunConsent, generate_supervised, print_counts, print_trainer_inputs, write_contact_sheet,
};
use crate::documents::RecipeArgs;
use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::output::Output;
use crate::print;
use clap::builder::{OsStringValueParser, TypedValueParser};
use petcomp::dataset::{self, DatasetConfig, Pipeline, Plan};
use petcomp::dataset::{SampleRange, ShardChoice, SplitOrder};
use petcomp::{Error, Quality};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct GenerateArgs {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of images in the whole dataset, at most 1,000,000,000; a folder that already holds
    /// more is rejected
    #[arg(short = 'n', long, value_name = "N", required_unless_present_any = ["only", "preview"])]
    count: Option<u64>,
    /// Seed; the same seed gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write into, or an object store for a dataset of archives: s3://BUCKET/PREFIX, gs://..
    /// or az://.. (credentials from the environment)
    #[arg(short, long, value_name = "FOLDER|URL", value_parser = OsStringValueParser::new().try_map(Output::parse))]
    output: Output,
    /// Folder for unfinished files if the output is an object store [default: one in the system's
    /// temporary folder]
    #[arg(long, value_name = "FOLDER")]
    scratch: Option<PathBuf>,
    /// draft, normal or reference: how finely everything is computed; by default as set in the
    /// recipe. Falls differ between qualities, so objects come to rest in different places
    #[arg(long)]
    quality: Option<Quality>,
    /// Resume an existing dataset: reject a new folder, and verify every file, inputs too, by its
    /// checksum (archives have none: verify that they are complete, and the samples not yet packed)
    #[arg(long)]
    resume: bool,
    /// Generate only image K, even if it exists
    #[arg(long, value_name = "K", conflicts_with_all = ["shard", "preview"])]
    only: Option<u64>,
    /// Generate every N-th image, from the I-th (1 to N), in a subfolder of the output (for a
    /// dataset of archives: every N-th archive, in the output itself); `auto` or `auto/N` queries
    /// the Slurm array (with N: its tasks are 1 to N, and any of them may be rerun), the AWS Batch
    /// array job or the indexed Kubernetes job that this runs in
    #[arg(long, value_name = "I/N", conflicts_with = "preview")]
    shard: Option<ShardChoice>,
    /// Generate the first N images (at most -n) at half their width and height, and a contact
    /// sheet: a preview in seconds
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "16")]
    preview: Option<u64>,
    #[command(flatten)]
    consent: LongRunConsent,
}

pub(crate) fn run(args: &GenerateArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    // For pictures of the recipe's own size.
    let whole = args.recipe.read_config_at(args.quality)?;
    let range = args.sample_range()?;
    let (whole_px, config) = (whole.scene.image, args.reduced(whole));
    args.check_count(config.split.order)?;
    let archives = config.labels.archives();
    let folder = range.folder(&args.output.folder(args.scratch.as_deref())?, archives);
    if args.resume {
        args.repair(&folder, range, archives.is_some())?;
    }
    let pipeline = Pipeline::open_reduced(config, whole_px)?.stopped_by(interruption());
    let plan = args.plan(&pipeline, range, &folder)?;
    let counts = generate_supervised(&pipeline, &plan, &args.consent, global)?;
    print_counts(&counts);
    if args.preview.is_some() {
        write_preview_sheet(&folder, args.image_count())?;
    }
    match &args.output {
        Output::Folder(_) => print_trainer_inputs(&counts, &folder),
        Output::Store(url) => print::line(format_args!("{url}/webdataset")),
    }
    Ok(())
}

impl GenerateArgs {
    /// Marks damaged samples and archives to be generated again.
    fn repair(&self, folder: &Path, range: SampleRange, archives: bool) -> petcomp::Result<()> {
        match &self.output {
            Output::Folder(_) if archives => repair_archives(folder, range),
            Output::Folder(_) => repair_folder(folder),
            Output::Store(_) => Err(Error::value(
                "resume",
                "an object store, expected a folder: archives with a receipt are complete there",
            )),
        }
    }

    /// The recipe for the requested pictures.
    fn reduced(&self, whole: DatasetConfig) -> DatasetConfig {
        match self.preview {
            Some(_) => whole.preview(),
            None => whole,
        }
    }

    fn plan(
        &self,
        pipeline: &Pipeline,
        range: SampleRange,
        folder: &Path,
    ) -> petcomp::Result<Plan> {
        Ok(Plan {
            range,
            store: self.output.open()?,
            ..pipeline.plan(self.image_count(), self.seed, folder)?
        })
    }

    /// Fails if the part of a single image depends on a number of images that is not given.
    fn check_count(&self, order: SplitOrder) -> petcomp::Result<()> {
        let is_unknown = self.count.is_none() && self.only.is_some();
        if is_unknown && order == SplitOrder::Consecutive {
            let what = "missing, expected the number of images in the whole dataset: with split.order = \
                        \"consecutive\" the part of image --only depends on it";
            return Err(Error::value("--count", what));
        }
        Ok(())
    }

    /// Number of images of the whole dataset, or of the preview.
    fn image_count(&self) -> u64 {
        let after_only = self.only.map(|only| only.saturating_add(1));
        match (self.count, self.preview) {
            (Some(count), Some(first)) => count.min(first),
            (count, first) => count.or(first).or(after_only).unwrap_or(0),
        }
    }

    fn sample_range(&self) -> petcomp::Result<SampleRange> {
        match self.shard {
            Some(choice) => choice
                .within(|name| std::env::var(name).ok())
                .map(SampleRange::Shard),
            None => Ok(self.only.map_or(SampleRange::All, SampleRange::One)),
        }
    }
}

fn repair_folder(folder: &Path) -> petcomp::Result<()> {
    let (good, bad) = dataset::repair(folder)?;
    print::line(format_args!(
        "{}: {good} images are intact, {bad} are generated again",
        folder.display()
    ));
    Ok(())
}

fn repair_archives(folder: &Path, range: SampleRange) -> petcomp::Result<()> {
    let (good, bad) = dataset::repair_archives(folder, range)?;
    print::line(format_args!(
        "{}: {good} archives are intact, {bad} are generated again",
        folder.display()
    ));
    Ok(())
}

fn write_preview_sheet(folder: &Path, count: u64) -> petcomp::Result<()> {
    let path = folder.join("sheet.png");
    write_contact_sheet(folder, count as usize, &path)?;
    print::line(format_args!("look at      {}", path.display()));
    Ok(())
}
