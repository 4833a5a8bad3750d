//! `petcomp-report scale`: memory and rate, and what a million pictures take; of scenes made in
//! code, or of a recipe.

use crate::ReportFlags;
use clap::builder::RangedU64ValueParser;
use petcomp_report::scale::{self, RecipeRun};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// About how many seconds of work each point is measured for, 0 to 3600; more is finer
    #[arg(long, value_name = "N", default_value_t = scale::DEFAULT_SECONDS, value_parser = seconds)]
    seconds: f64,
    /// Most threads, 1 to 1024; by default one per core
    #[arg(
        long,
        value_name = "N",
        default_value_t = scale::core_count(),
        value_parser = RangedU64ValueParser::<usize>::new().range(1..=1024)
    )]
    most_threads: usize,
    /// Measure a dataset of this recipe instead, made by the program `petcomp`: scale_recipe.csv,
    /// scale_recipe.md and a chart
    #[arg(long, value_name = "RECIPE")]
    recipe: Option<PathBuf>,
    /// Pictures of that recipe to make
    #[arg(
        short = 'n',
        long,
        value_name = "N",
        default_value_t = 2000,
        value_parser = clap::value_parser!(u64).range(100..=1_000_000)
    )]
    pictures: u64,
    /// Pictures of the beginning that the rest is forecast from
    #[arg(
        long,
        value_name = "N",
        default_value_t = 500,
        value_parser = clap::value_parser!(u64).range(50..=1_000_000)
    )]
    first: u64,
    /// The program to measure [default: petcomp beside this one]
    #[arg(long, value_name = "PROGRAM")]
    petcomp: Option<PathBuf>,
    /// Instead, measure this point in this process and print it (JSON)
    #[arg(long, value_name = "JSON", hide = true)]
    case: Option<String>,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok();
    number
        .filter(|seconds| (0.0..=3600.0).contains(seconds))
        .ok_or_else(|| format!("{text}, expected 0 to 3600"))
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    if let Some(case) = &args.case {
        return print_measurement(case, args.seconds);
    }
    if let Some(recipe) = &args.recipe {
        return measure_recipe(args, recipe, common);
    }
    let tables = common.with_progress("measuring", |progress| {
        scale::write(&args.output, args.seconds, args.most_threads, progress)
    })?;
    for (title, table) in tables {
        println!("{title}\n{}", table.markdown());
    }
    let folder = args.output.display();
    common.print_line(format_args!("{folder}: scale.csv, scale.md and two charts"));
    Ok(())
}

fn measure_recipe(args: &Args, recipe: &Path, common: &ReportFlags) -> anyhow::Result<()> {
    let run = RecipeRun {
        program: args.petcomp.clone().unwrap_or_else(beside_this_program),
        recipe: recipe.to_owned(),
        pictures: args.pictures,
        first: args.first,
        threads: common.threads,
    };
    let table = common.with_progress("pictures", |progress| {
        scale::write_recipe(&args.output, &run, progress)
    })?;
    println!("{}", table.markdown());
    let folder = args.output.display();
    common.print_line(format_args!(
        "{folder}: scale_recipe.csv, scale_recipe.md, scale_recipe.svg"
    ));
    Ok(())
}

fn beside_this_program() -> PathBuf {
    std::env::current_exe()
        .unwrap_or_default()
        .with_file_name("petcomp")
}

/// Measures one point (JSON) in this process.
fn print_measurement(case: &str, seconds: f64) -> anyhow::Result<()> {
    let measured = scale::run(&serde_json::from_str(case)?, seconds)?;
    println!("{}", serde_json::to_string(&measured)?);
    Ok(())
}
