//! `petcomp dataset generate`, `ablate` and `merge`: datasets are made.

use crate::common::{Common, RecipeArgs, interruption};
use crate::print;
use petcomp::dataset::{
    self, DatasetConfig, DatasetCounts, LongRun, Obstructed, Pipeline, Plan, Progress, SampleRange,
    ShardChoice, contact_sheet_of,
};
use petcomp::{Error, Quality, io};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of pictures of the whole dataset, at most a thousand million; a folder that holds more is refused
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
    /// Go on with a dataset that was begun before: refuse a new folder, and check every file against its checksum, inputs
    /// too
    #[arg(long)]
    resume: bool,
    /// Make only image K, whether it is there or not
    #[arg(long, value_name = "K", conflicts_with_all = ["shard", "preview"])]
    only: Option<u64>,
    /// Make every N-th image, from the I-th (1 to N), in a folder of its own below the output; `auto` or `auto/N` asks the
    /// Slurm array or the indexed Kubernetes job that this runs in
    #[arg(long, value_name = "I/N", conflicts_with = "preview")]
    shard: Option<ShardChoice>,
    /// Make the first N images (of those that -n asks for) at half their width and height, and a sheet of them: a look in
    /// seconds
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "16")]
    preview: Option<u64>,
    #[command(flatten)]
    consent: Consent,
}

/// Whether a job may take very long.
#[derive(clap::Args)]
pub(crate) struct Consent {
    /// Go on with a job that would take more than an hour; without, it stops with an estimate after its first pictures
    #[arg(long)]
    yes: bool,
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
    #[command(flatten)]
    consent: Consent,
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
    let mut config = args.recipe.config()?;
    if let Some(quality) = args.quality {
        config = quality.config(config);
    }
    if args.preview.is_some() {
        config = config.preview();
    }
    let count = args
        .count
        .or(args.preview)
        .unwrap_or_else(|| args.only.map_or(0, |k| k.saturating_add(1)));
    let count = args.preview.map_or(count, |first| first.min(count));
    let range = sample_range(args)?;
    let folder = match range {
        SampleRange::Shard(shard) => args.output.join(shard.folder()),
        _ => args.output.clone(),
    };
    if args.resume {
        let (good, bad) = dataset::repair(&folder)?;
        print::line(format_args!(
            "{}: {good} images are as they were written, {bad} are made again",
            folder.display()
        ));
    }
    let pipeline = Pipeline::open(config)?.stopped_by(interruption());
    let plan = Plan {
        range,
        ..pipeline.plan(count, args.seed, &folder)?
    };
    let report = make(&pipeline, &plan, &args.consent, common)?;
    tell(&report);
    if args.preview.is_some() {
        let sheet = folder.join("sheet.png");
        io::write(
            &sheet,
            &contact_sheet_of(&folder, count as usize, &Default::default())?,
        )?;
        print::line(format_args!("look at      {}", sheet.display()));
    }
    for_trainers(&report, &folder)
        .iter()
        .for_each(|path| print::line(path.display()));
    Ok(())
}

fn sample_range(args: &Args) -> petcomp::Result<SampleRange> {
    match (args.only, args.shard) {
        (Some(k), _) => Ok(SampleRange::One(k)),
        (None, Some(choice)) => choice
            .within(|name| std::env::var(name).ok())
            .map(SampleRange::Shard),
        (None, None) => Ok(SampleRange::All),
    }
}

pub(crate) fn ablate(args: &Ablate, common: &Common) -> anyhow::Result<()> {
    for (ablation, config) in args.recipe.config()?.ablations() {
        let folder = args.output.join(ablation.name);
        io::create_folder(&folder)?;
        let recipe = folder.join("recipe.toml");
        config.write(&recipe)?;
        print::line(recipe.display());
        if args.count > 0 {
            let pipeline =
                Pipeline::open(DatasetConfig::read(&recipe, &[])?)?.stopped_by(interruption());
            let plan = pipeline.plan(args.count, args.seed, folder.join("dataset"))?;
            tell(&make(&pipeline, &plan, &args.consent, common)?);
        }
    }
    Ok(())
}

pub(crate) fn merge(args: &Merge, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("pictures");
    let report = dataset::merge(
        &args.shards,
        &args.output,
        &|p| progress.at(p.done, p.count),
        interruption(),
    )?;
    drop(progress);
    tell(&report);
    for_trainers(&report, &args.output)
        .iter()
        .for_each(|path| print::line(path.display()));
    Ok(())
}

/// Makes the dataset, showing progress, and stops between two pictures when interrupted, or when the first ones tell that
/// it takes longer than an hour and nobody has agreed to that.
pub(crate) fn make(
    pipeline: &Pipeline,
    plan: &Plan,
    consent: &Consent,
    common: &Common,
) -> anyhow::Result<DatasetCounts> {
    let progress = common.progress("pictures");
    let sample = |k| pipeline.sample(plan.seed, k);
    let (last, done) = (Mutex::new(None), AtomicBool::new(false));
    let show = |p: Progress| {
        progress.at(p.done, p.count);
        *last.lock().unwrap_or_else(PoisonError::into_inner) = Some(p);
    };
    std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            if consent.yes {
                None
            } else {
                watch(&last, &done)
            }
        });
        let made = dataset::generate(plan, sample, &show, interruption());
        done.store(true, Ordering::Relaxed);
        watch.thread().unpark();
        match (made, watch.join()) {
            (Err(Error::Interrupted { what }), Ok(Some(long))) => {
                anyhow::bail!("this would take {long}; say --yes to go on ({what})")
            }
            (made, _) => Ok(made?),
        }
    })
}

/// How often it is looked how long the rest will take.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Stops the run when it is going to take longer than an hour, and tells how long.
fn watch(last: &Mutex<Option<Progress>>, done: &AtomicBool) -> Option<LongRun> {
    let (began, threads) = (Instant::now(), rayon::current_num_threads());
    while !done.load(Ordering::Relaxed) {
        let progress = *last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(long) =
            progress.and_then(|progress| LongRun::of(&progress, began.elapsed(), threads))
        {
            interruption().store(true, Ordering::Relaxed);
            return Some(long);
        }
        std::thread::park_timeout(LOOK_EVERY);
    }
    None
}

/// Prints what is in the folder: a result, so also where quiet is asked for.
pub(crate) fn tell(report: &DatasetCounts) {
    let DatasetCounts {
        images,
        val,
        made,
        objects,
        labelled,
        obstructed,
        retries,
        ..
    } = report;
    print::line(format_args!(
        "images       {images} ({val} for validation), {made} made now, {retries} scenes resampled"
    ));
    print::line(format_args!(
        "objects      {objects}, {labelled} labelled, {obstructed} obstructed ({})",
        labels_of(report.policy)
    ));
    for class in &report.classes {
        print::line(format_args!(
            "  {:10} {} labelled of {}",
            class.name, class.labelled, class.objects
        ));
    }
}

/// What became of the labels of objects that something lies over.
fn labels_of(policy: Obstructed) -> &'static str {
    match policy {
        Obstructed::Drop => "without a label",
        Obstructed::Keep => "labelled like the others",
        Obstructed::Ignore => "to be ignored, in YOLO without a label",
        Obstructed::Class => "labelled as a class of their own",
    }
}

/// What a dataset's trainers are given: the files that name all others, or the folder where there are none.
pub(crate) fn for_trainers(report: &DatasetCounts, folder: &Path) -> Vec<PathBuf> {
    match report.for_trainers.as_slice() {
        [] => vec![folder.into()],
        files => files.iter().map(|file| folder.join(file)).collect(),
    }
}
