//! `petcomp dataset`: recipe -> images with labels, ready to train on.

use crate::common::{Common, RecipeArgs, interruption};
use petcomp::dataset::{self, Checked, Report, Studio, contact_sheet_of};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Make a dataset; the same command goes on where an interrupted one stopped
    Generate(Generate),
    /// Look for what trainers refuse: rows that are not five numbers, values outside 0..1, duplicates, missing files
    Check {
        /// Folder of the dataset
        folder: PathBuf,
    },
    /// Draw a sheet of the first pictures with their boxes
    Sheet {
        /// Folder of the dataset
        folder: PathBuf,
        /// Picture to write
        #[arg(short, long, value_name = "PNG")]
        output: PathBuf,
        /// Number of pictures
        #[arg(short = 'n', long, value_name = "N", default_value_t = 24)]
        most: usize,
    },
}

#[derive(clap::Args)]
pub(crate) struct Generate {
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Number of pictures
    #[arg(short = 'n', long, value_name = "N")]
    count: u64,
    /// Seed; the same one gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Generate(args) => {
            let report = generate(args.recipe.studio()?, args.count, args.seed, &args.output, common)?;
            tell(&report, common);
            common.say(format_args!("{}", args.output.join("data.yaml").display()));
        }
        Command::Check { folder } => {
            let Checked { faults, images, rows } = dataset::check(folder)?;
            faults.iter().for_each(|fault| println!("{fault}"));
            anyhow::ensure!(faults.is_empty(), "{}: {} faults", folder.display(), faults.len());
            let rows: usize = rows.iter().sum();
            common.say(format_args!("{}: {images} images, {rows} labels, no fault", folder.display()));
        }
        Command::Sheet { folder, output, most } => {
            io::write(output, &contact_sheet_of(folder, *most, &Default::default())?)?;
            common.say(output.display());
        }
    }
    Ok(())
}

/// Makes the dataset, showing progress, and stops between two pictures when interrupted.
pub(crate) fn generate(
    studio: Studio,
    count: u64,
    seed: u64,
    folder: &Path,
    common: &Common,
) -> anyhow::Result<Report> {
    let plan = studio.plan(count, seed, folder)?;
    let progress = common.progress("pictures");
    let report =
        dataset::generate(&plan, |k| studio.sample(seed, k), &|p| progress.at(p.done, p.count), interruption())?;
    Ok(report)
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
