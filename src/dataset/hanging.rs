//! Objects of a finished dataset that nothing holds up, by the scenes in its sidecar files.

use crate::dataset::check::{Finding, fault, list, short};
use crate::dataset::folder;
use crate::error::Result;
use crate::io;
use crate::scene::{Placement, Scene, SettleOptions};
use crate::settle;
use rayon::prelude::*;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// What a sidecar file says of a fall.
#[derive(Deserialize)]
struct Fall {
    drawn: Scene,
    scene: Scene,
}

/// A fault for each sidecar file with objects that hang in the air, and for each that cannot be read.
pub(super) fn hanging(dataset: &Path) -> Vec<Finding> {
    let options = options(dataset);
    let files: Vec<PathBuf> = ["scenes/train", "scenes/val"]
        .iter()
        .flat_map(|part| list(dataset, part))
        .collect();
    let scenes = files
        .into_par_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "json"));
    let wrong = |path: PathBuf| {
        let what =
            told(&dataset.join(&path), &options).unwrap_or_else(|e| Some(short(dataset, &e)))?;
        Some(fault(path, None, what))
    };
    scenes.filter_map(wrong).collect()
}

/// How the dataset's objects fell; as usual where that is not known.
fn options(dataset: &Path) -> SettleOptions {
    let identity = folder::identity(dataset).ok().flatten();
    let settle = identity.and_then(|identity| identity.pointer("/recipe/scene/settle").cloned());
    settle
        .and_then(|settle| serde_json::from_value(settle).ok())
        .unwrap_or_default()
}

fn told(path: &Path, options: &SettleOptions) -> Result<Option<String>> {
    let Fall { drawn, scene } = io::read_json(path)?;
    let hanging = settle::hanging(&drawn, &scene, options)?;
    let object = |id: &usize| {
        let object = &scene.objects[id - 1];
        let height = match object.placement {
            Placement::At(pose) => pose.translation.z,
            Placement::Drop { height, .. } => height,
        };
        format!("object {id} (\"{}\"), {height:.2} m up", object.asset)
    };
    let told = hanging.iter().map(object).collect::<Vec<_>>().join(", ");
    Ok((!told.is_empty()).then(|| format!("nothing holds {told}: make this picture again")))
}
