//! `petcomp dataset generate`, `ablate` and `merge`: datasets are made.

use crate::common::{Common, RecipeArgs, interruption};
use petcomp::dataset::{self, Numbers, Plan, Report, Setup, ShardChoice, Studio, contact_sheet_of};
use petcomp::{Quality, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of pictures of the whole dataset
    #[arg(short = 'n', long, value_name = "N", required_unless_present_any = ["only", "preview"])]
    count: Option<u64>,
    /// Seed; the same one gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// draft, normal or reference: how finely everything is computed; by default what the recipe says. Falls differ between
    /// qualities, and so do the places where things come to lie
    #[arg(long)]
    quality: Option<Quality>,
    /// Go on with a dataset that was begun before: refuse a new folder, and check every file against its checksum
    #[arg(long)]
    resume: bool,
    /// Make only image K, whether it is there or not
    #[arg(long, value_name = "K", conflicts_with_all = ["shard", "preview"])]
    only: Option<u64>,
    /// Make every N-th image, from the I-th (1 to N), in a folder of its own below the output; `auto` or `auto/N` asks the
    /// Slurm array or the indexed Kubernetes job that this runs in
    #[arg(long, value_name = "I/N", conflicts_with = "preview")]
    shard: Option<ShardChoice>,
    /// Make the first N images at half their width and height, and a sheet of them: a look in seconds
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "16", conflicts_with = "count")]
    preview: Option<u64>,
}

#[derive(clap::Args)]
pub(crate) struct Ablate {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of pictures of each dataset; 0 writes the recipes only
    #[arg(short = 'n', long, value_name = "N")]
    count: u64,
    /// Seed of all of them: the same scenes but for what is switched off
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write a folder for each into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct Merge {
    /// Folders of all shards, in any order
    #[arg(required = true, value_name = "SHARD")]
    shards: Vec<PathBuf>,
    /// Folder to write the whole dataset into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let mut setup = args.recipe.setup()?;
    if let Some(quality) = args.quality {
        setup = quality.setup(setup);
    }
    if args.preview.is_some() {
        setup = setup.preview();
    }
    let count = args.preview.or(args.count).unwrap_or_else(|| args.only.map_or(0, |k| k + 1));
    let numbers = numbers(args)?;
    let folder = match numbers {
        Numbers::Shard(shard) => args.output.join(shard.folder()),
        _ => args.output.clone(),
    };
    if args.resume {
        let (good, bad) = dataset::mend(&folder)?;
        common.say(format_args!("{}: {good} images are as they were written, {bad} are made again", folder.display()));
    }
    let studio = Studio::open(setup)?.stopped_by(interruption());
    let plan = Plan { numbers, ..studio.plan(count, args.seed, &folder)? };
    tell(&make(&studio, &plan, common)?, common);
    if args.preview.is_some() {
        let sheet = folder.join("sheet.png");
        io::write(&sheet, &contact_sheet_of(&folder, count as usize, &Default::default())?)?;
        common.say(format_args!("look at      {}", sheet.display()));
    }
    common.say(folder.join("data.yaml").display());
    Ok(())
}

fn numbers(args: &Args) -> petcomp::Result<Numbers> {
    match (args.only, args.shard) {
        (Some(k), _) => Ok(Numbers::One(k)),
        (None, Some(choice)) => choice.within(|name| std::env::var(name).ok()).map(Numbers::Shard),
        (None, None) => Ok(Numbers::All),
    }
}

pub(crate) fn ablate(args: &Ablate, common: &Common) -> anyhow::Result<()> {
    for (ablation, setup) in args.recipe.setup()?.ablations() {
        let folder = args.output.join(ablation.name);
        io::create_folder(&folder)?;
        let recipe = folder.join("recipe.toml");
        setup.write(&recipe)?;
        common.say(format_args!("{}", recipe.display()));
        if args.count > 0 {
            let studio = Studio::open(Setup::read(&recipe, &[])?)?.stopped_by(interruption());
            let plan = studio.plan(args.count, args.seed, folder.join("dataset"))?;
            tell(&make(&studio, &plan, common)?, common);
        }
    }
    Ok(())
}

pub(crate) fn merge(args: &Merge, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("pictures");
    let report = dataset::merge(&args.shards, &args.output, &|p| progress.at(p.done, p.count), interruption())?;
    drop(progress);
    tell(&report, common);
    common.say(args.output.join("data.yaml").display());
    Ok(())
}

/// Makes the dataset, showing progress, and stops between two pictures when interrupted.
pub(crate) fn make(studio: &Studio, plan: &Plan, common: &Common) -> anyhow::Result<Report> {
    let progress = common.progress("pictures");
    let sample = |k| studio.sample(plan.seed, k);
    Ok(dataset::generate(plan, sample, &|p| progress.at(p.done, p.count), interruption())?)
}

/// Prints what is in the folder.
pub(crate) fn tell(report: &Report, common: &Common) {
    let Report { images, val, made, objects, labelled, retries, .. } = report;
    common.say(format_args!(
        "images       {images} ({val} for validation), {made} made now, {retries} scenes drawn again"
    ));
    common.say(format_args!("objects      {objects}, {labelled} labelled (on top), {} obstructed", objects - labelled));
    for class in &report.classes {
        common.say(format_args!("  {:10} {} labelled of {}", class.name, class.labelled, class.objects));
    }
}
