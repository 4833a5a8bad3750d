//! Renders scene files as a labelled dataset in YOLO's layout, without a recipe or random draws.
//!
//! `petcomp scene draw` writes such files. Their table `[files]` names the folders of assets and
//! photos; `[settings.labels]` sets how labels are made and written. All scenes must have the
//! classes and label settings of the first.
//!
//! `cargo run --release --example yolo_from_scenes FOLDER SCENE..`

use petcomp::dataset::{DatasetConfig, Pipeline, Plan, Sample, Writer, generate};
use petcomp::{Error, Result, Scene, io};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| "scenes_dataset".into());
    let paths: Vec<String> = arguments.collect();
    let Some(first) = paths.first() else {
        return Err(Error::value("SCENE", "none, expected at least one file"));
    };
    let first = open(first)?.0;
    let plan = plan(&first, &folder, paths.len() as u64)?;
    let sample = |k: u64| sample(&paths[k as usize], &first);
    let counts = generate(&plan, sample, &|_| (), &AtomicBool::new(false))?;
    println!(
        "{folder}: {} images, {} labels",
        counts.images, counts.labelled
    );
    Ok(())
}

/// A dataset with the label settings of the first scene.
fn plan(first: &Pipeline, folder: &str, count: u64) -> Result<Plan> {
    let DatasetConfig {
        labels, pictures, ..
    } = first.config();
    let mut writers: Vec<Arc<dyn Writer>> = vec![Arc::new(pictures.clone())];
    writers.extend(labels.writers(pictures));
    let classes = labels.obstructed.classes(&first.library().classes)?;
    Ok(Plan {
        writers,
        obstructed: labels.obstructed,
        ..Plan::new(folder, count, classes)
    })
}

/// Opens a scene with the assets and the photo that it names.
fn open(path: &str) -> Result<(Pipeline, Scene)> {
    let scene: Scene = io::read_document(path)?;
    let config = DatasetConfig::for_scene(&scene, path, &[])?;
    Ok((Pipeline::open_for(config, &scene)?, scene))
}

fn sample(path: &str, first: &Pipeline) -> Result<Sample> {
    let (pipeline, scene) = open(path)?;
    check_alike(&pipeline, first)
        .and_then(|()| pipeline.take(scene))
        .map_err(|e| e.in_file(path))
}

/// Fails if a scene has other classes or label settings than the first one.
fn check_alike(pipeline: &Pipeline, first: &Pipeline) -> Result<()> {
    let [own, expected] = [pipeline, first].map(|opened| &opened.library().classes);
    if own != expected {
        let what = format!("{own:?}, expected those of the first scene, {expected:?}");
        return Err(Error::value("classes", what));
    }
    if pipeline.config().labels != first.config().labels {
        let what = "differ from those of the first scene, expected the same";
        return Err(Error::value("settings.labels", what));
    }
    Ok(())
}
