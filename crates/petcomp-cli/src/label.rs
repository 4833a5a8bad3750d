//! `petcomp label`: scene -> outlines, boxes, visibility.

use crate::documents::{SceneArgs, check_picture_target};
use crate::global::GlobalArgs;
use petcomp::dataset::Pipeline;
use petcomp::label::{self, Labels};
use petcomp::{Scene, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct LabelArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Labels to write (JSON)
    #[arg(short, long, value_name = "LABELS")]
    output: PathBuf,
    /// Also write the image with outlines and boxes drawn on it
    #[arg(long, value_name = "PNG")]
    overlay: Option<PathBuf>,
    /// Also write the mask borders as polygons, simplified by the recipe's `labels.simplify`
    #[arg(long, value_name = "JSON")]
    polygons: Option<PathBuf>,
}

pub(crate) fn run(args: &LabelArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_targets()?;
    io::check_distinct(args.scene.files(), args.targets())?;
    let scene = args.scene.read_scene()?;
    let pipeline = args.scene.open_pipeline(&scene, None, args.targets())?;
    let labels = args.label(&pipeline, scene);
    let labels = labels.map_err(|e| e.in_file(&args.scene.path))?;
    io::write_json(&args.output, &labels)?;
    args.write_polygons(&labels, &pipeline)?;
    global.print_written(&args.output, count_objects(&labels));
    Ok(())
}

impl LabelArgs {
    /// Rejects invalid output paths before anything is labelled.
    fn check_targets(&self) -> petcomp::Result<()> {
        let mut pictures = self.overlay.iter();
        pictures.try_for_each(|path| check_picture_target(path))?;
        let mut lists = self.polygons.iter().chain([&self.output]);
        lists.try_for_each(|path| io::check_folder_of(path))
    }

    /// The files to write.
    fn targets(&self) -> impl Iterator<Item = &PathBuf> {
        let more = self.overlay.iter().chain(&self.polygons);
        more.chain([&self.output])
    }

    fn label(&self, pipeline: &Pipeline, scene: Scene) -> petcomp::Result<Labels> {
        match &self.overlay {
            Some(path) => write_overlay(path, pipeline, scene),
            None => pipeline.label(scene),
        }
    }

    fn write_polygons(&self, labels: &Labels, pipeline: &Pipeline) -> petcomp::Result<()> {
        let Some(path) = &self.polygons else {
            return Ok(());
        };
        let simplify = pipeline.config().labels.simplify;
        io::write_json(path, &label::borders(labels, simplify))
    }
}

fn count_objects(labels: &Labels) -> String {
    let objects = &labels.objects;
    let topmost = objects.iter().filter(|o| o.is_topmost()).count();
    format!("{} objects, {topmost} on top", objects.len())
}

/// Renders the picture, and writes it with its labels drawn on it.
fn write_overlay(path: &Path, pipeline: &Pipeline, scene: Scene) -> petcomp::Result<Labels> {
    let sample = pipeline.take(scene)?;
    let classes = &pipeline.library().classes;
    io::write(
        path,
        &label::overlay(&sample.frame, &sample.labels, classes),
    )?;
    Ok(sample.labels)
}
