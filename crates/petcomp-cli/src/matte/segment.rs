//! `petcomp matte segment`: every step of the search as a picture.

use crate::diagnostics::report_diagnostics;
use crate::documents::read_options;
use crate::global::GlobalArgs;
use crate::output::folder_parser;
use petcomp::matte::{PlateOptions, ScreenPlate, SegmentOptions, Segmentation, segment};
use petcomp::{Coverage, Image, LinearRgb, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct SegmentArgs {
    /// Photo of one object on a uniform screen or board
    photo: PathBuf,
    /// Folder for the images
    #[arg(short, long, value_name = "FOLDER", value_parser = folder_parser())]
    output: PathBuf,
    /// TOML file with options that override the defaults
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
}

pub(crate) fn run(args: &SegmentArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let options = read_options(args.options.as_deref(), SegmentOptions::check)?;
    let photo: Image<LinearRgb> = io::read(&args.photo)?;
    let found = segment(&photo, &options).map_err(|e| e.in_file(&args.photo))?;
    let mut pictures = search_pictures(&found);
    pictures.extend(keyer_mattes(&photo, &found));
    let numbered = numbered(pictures, &args.output);
    let inputs = args.options.iter().chain([&args.photo]);
    io::check_distinct(inputs, numbered.iter().map(|(path, _)| path))?;
    io::create_folder(&args.output)?;
    log_search(&args.photo, &found);
    report_diagnostics(args.photo.display(), &found.diagnostics);
    for (path, picture) in &numbered {
        io::write(path, picture)?;
        global.print_status(path.display());
    }
    Ok(())
}

/// Logs how the object was found.
pub(super) fn log_search(photo: &Path, found: &Segmentation) {
    log::info!(
        "{}: segmented at level {} of the Laplacian pyramid; a pixel of the search is {:.2} of the photo",
        photo.display(),
        found.levels,
        found.reduction
    );
}

/// The file of each picture.
fn numbered(pictures: Vec<NamedPicture>, folder: &Path) -> Vec<(PathBuf, Image<f32>)> {
    let pictures = pictures.into_iter().enumerate();
    let placed = pictures.map(|(i, (name, picture))| {
        let path = folder.join(format!("{i}_{name}.png"));
        (path, picture)
    });
    placed.collect()
}

type NamedPicture = (&'static str, Image<f32>);

/// The steps of the search and its result, in order.
fn search_pictures(found: &Segmentation) -> Vec<NamedPicture> {
    let steps = found.steps.iter().map(|step| (step.name, step.shown()));
    let outcome = [("hull", &found.mask), ("outline", &found.tight)];
    steps
        .chain(outcome.map(|(name, mask)| (name, shares(mask))))
        .collect()
}

/// The mattes for a keyer. If the object leaves no screen free, there is no plate, and its opaque
/// parts are unknown.
fn keyer_mattes(photo: &Image<LinearRgb>, found: &Segmentation) -> Vec<NamedPicture> {
    let plate = ScreenPlate::fit_outside(photo, &found.mask, &PlateOptions::default());
    let Ok(plate) = plate else {
        return Vec::new();
    };
    let [garbage, core] = found.mattes(photo, &plate.image);
    vec![("garbage", shares(&garbage)), ("core", shares(&core))]
}

fn shares(coverage: &Image<Coverage>) -> Image<f32> {
    coverage.map(|c| c.0)
}
