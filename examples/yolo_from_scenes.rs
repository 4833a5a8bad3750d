//! Scene files become labelled pictures in YOLO's layout, as they are: no recipe, nothing drawn by
//! chance.
//!
//! `petcomp scene draw` writes such files: their table `[files]` names the folders of assets and
//! photos.
//!
//! `cargo run --release --example yolo_from_scenes FOLDER SCENE..`

use petcomp::dataset::{DatasetConfig, Pictures, Pipeline, Plan, Sample, Yolo, generate};
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
    let classes = open(first)?.0.library().classes.clone();
    let plan = Plan {
        writers: vec![Arc::new(Pictures::default()), Arc::new(Yolo::default())],
        ..Plan::new(&folder, paths.len() as u64, classes)
    };
    let sample = |k| sample(&paths[k as usize]);
    let counts = generate(&plan, sample, &|_| (), &AtomicBool::new(false))?;
    println!(
        "{folder}: {} images, {} labels",
        counts.images, counts.labelled
    );
    Ok(())
}

/// A scene, and the assets and the photo that it names.
fn open(path: &str) -> Result<(Pipeline, Scene)> {
    let scene: Scene = io::read_document(path)?;
    let config = DatasetConfig::for_scene(&scene, path, &[])?;
    Ok((Pipeline::open_for(config, &scene)?, scene))
}

fn sample(path: &str) -> Result<Sample> {
    let (pipeline, scene) = open(path)?;
    pipeline.take(scene).map_err(|e| e.in_file(path))
}
