//! `petcomp dataset fit`: fits a recipe to the real place.

use crate::global::GlobalArgs;
use crate::interruption::interruption;
use crate::print;
use petcomp::dataset::YoloSet;
use petcomp::dataset::fit::{Fit, FitOptions, FitPlan, FittedKey, fit};
use petcomp::io;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct FitArgs {
    /// Labelled images of the place, 5 to 50: a YOLO dataset, or a folder of images with YOLO
    /// labels. If omitted, the recipe's photos of the place are used
    #[arg(value_name = "REAL")]
    real: Option<PathBuf>,
    /// Recipe file (TOML) to fit; it is not changed
    #[arg(long, value_name = "RECIPE")]
    recipe: PathBuf,
    /// Recipe file to write
    #[arg(short, long, value_name = "FITTED")]
    output: PathBuf,
    /// Page to write with every distribution before and after; by default FITTED's name with .html
    #[arg(long, value_name = "HTML")]
    page: Option<PathBuf>,
    /// Seed; the same seed gives the same files
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(crate) fn run(args: &FitArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_targets()?;
    let display = global.start_progress("falls and pictures");
    let plan = args.plan();
    let fitted = fit(&plan, &|done, of| display.update(done, of), interruption())?;
    drop(display);
    io::write_text(&args.output, &fitted.text)?;
    io::write_text(args.page_path(), &fitted.page.document())?;
    print_keys(&fitted);
    global.print_status(args.output.display());
    global.print_look_at(&args.page_path());
    Ok(())
}

impl FitArgs {
    fn plan(&self) -> FitPlan {
        FitPlan {
            recipe: self.recipe.clone(),
            real: self.real.clone(),
            output: self.output.clone(),
            options: FitOptions {
                seed: self.seed,
                ..FitOptions::default()
            },
        }
    }

    /// Fails if an input would be overwritten, or a folder to write into is missing: the work in
    /// between takes long.
    fn check_targets(&self) -> petcomp::Result<()> {
        let targets = [self.output.clone(), self.page_path()];
        let mut read = vec![self.recipe.clone()];
        for target in &targets {
            io::check_folder_of(target)?;
            if let Some(real) = &self.real {
                read.extend(YoloSet::files_like(real, target)?);
            }
        }
        io::check_distinct(read, targets)
    }

    fn page_path(&self) -> PathBuf {
        let beside = || self.output.with_extension("html");
        self.page.clone().unwrap_or_else(beside)
    }
}

/// Prints what was fitted, and what stays unchanged.
fn print_keys(fitted: &Fit) {
    for FittedKey {
        key, fitted, why, ..
    } in &fitted.keys
    {
        match fitted {
            Some(value) => print::line(format_args!("{key} = {value}")),
            None => print::line(format_args!("{key} stays: {why}")),
        }
    }
}
