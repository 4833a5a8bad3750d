//! `petcomp matte segment`: every step of the search as a picture.

use crate::common::{Common, options_file, report_diagnostics};
use petcomp::matte::{PlateOptions, ScreenPlate, SegmentOptions, Segmentation, segment};
use petcomp::{Image, LinearRgb, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Photo of one object on a uniform screen or board
    photo: PathBuf,
    /// Folder for the pictures
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Options to use instead of the defaults, as TOML
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let options: SegmentOptions = options_file(args.options.as_deref())?;
    let photo: Image<LinearRgb> = io::read(&args.photo)?;
    let found = segment(&photo, &options).map_err(|e| e.in_file(&args.photo))?;
    io::create_folder(&args.output)?;
    report_diagnostics(&args.photo, &found.diagnostics);
    for (i, (name, picture)) in pictures(&photo, &found).into_iter().enumerate() {
        let path = args.output.join(format!("{i}_{name}.png"));
        io::write(&path, &picture)?;
        common.say(path.display());
    }
    Ok(())
}

/// The steps of the search, its outcome, and the mattes for a keyer; named, in order.
fn pictures(photo: &Image<LinearRgb>, found: &Segmentation) -> Vec<(&'static str, Image<f32>)> {
    let mut all: Vec<_> = found
        .steps
        .iter()
        .map(|step| (step.name, step.shown()))
        .collect();
    all.push(("hull", found.mask.map(|c| c.0)));
    all.push(("outline", found.tight.map(|c| c.0)));
    // An object that leaves no screen has no plate, and what is opaque of it is unknown.
    if let Ok(plate) = ScreenPlate::fit_outside(photo, &found.mask, &PlateOptions::default()) {
        let [garbage, core] = found.mattes(photo, &plate.image);
        all.push(("garbage", garbage.map(|c| c.0)));
        all.push(("core", core.map(|c| c.0)));
    }
    all
}
