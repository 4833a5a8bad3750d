//! `petcomp label`: scene -> outlines, boxes, visibility.

use crate::common::{Common, RecipeArgs};
use petcomp::dataset::Pipeline;
use petcomp::{Scene, io, label};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene, TOML or JSON; what is unknown in it is found out first
    scene: PathBuf,
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Labels to write, JSON
    #[arg(short, long, value_name = "LABELS")]
    output: PathBuf,
    /// Also write the picture with outlines and boxes drawn on it
    #[arg(long, value_name = "PNG")]
    overlay: Option<PathBuf>,
    /// Also write the borders of the masks as polygons, simplified as the recipe's `labels.simplify` says
    #[arg(long, value_name = "JSON")]
    polygons: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let scene: Scene = io::read_document(&args.scene)?;
    let pipeline = Pipeline::open_for(args.recipe.config()?, &scene)?;
    let labels = match &args.overlay {
        None => pipeline.label(scene).map_err(|e| e.in_file(&args.scene))?,
        Some(path) => {
            let sample = pipeline.take(scene).map_err(|e| e.in_file(&args.scene))?;
            io::write(
                path,
                &label::overlay(&sample.frame, &sample.labels, &pipeline.library().classes),
            )?;
            sample.labels
        }
    };
    io::write_json(&args.output, &labels)?;
    if let Some(path) = &args.polygons {
        io::write_json(
            path,
            &label::borders(&labels, pipeline.config().labels.simplify),
        )?;
    }
    let objects = &labels.objects;
    let topmost = objects.iter().filter(|o| o.is_topmost()).count();
    common.say(format_args!(
        "{}: {} objects, {topmost} on top",
        args.output.display(),
        objects.len()
    ));
    Ok(())
}
