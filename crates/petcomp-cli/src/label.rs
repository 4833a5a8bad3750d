//! `petcomp label`: scene -> outlines, boxes, visibility.

use crate::common::{Common, SceneArgs};
use petcomp::dataset::Pipeline;
use petcomp::{io, label};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
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
    let scene = args.scene.read()?;
    // Labels alone need no photo.
    let scene = if args.overlay.is_some() {
        scene
    } else {
        scene.unlit()
    };
    let pipeline = Pipeline::open_for(args.scene.config_for(&scene)?, &scene)?;
    let labels = match &args.overlay {
        None => pipeline
            .label(scene)
            .map_err(|e| e.in_file(&args.scene.path))?,
        Some(path) => {
            let sample = pipeline
                .take(scene)
                .map_err(|e| e.in_file(&args.scene.path))?;
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
