//! Objects of a finished dataset that nothing supports, according to the scenes in its sidecar
//! files.

use crate::dataset::finding::Finding;
use crate::dataset::folder;
use crate::diagnostic::Code;
use crate::error::Result;
use crate::io;
use crate::scene::{Object, Placement, Scene, SettleOptions};
use crate::settle;
use rayon::prelude::*;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The scene of a sidecar file before and after its objects settled.
#[derive(Deserialize)]
struct SettledScene {
    drawn: Scene,
    scene: Scene,
}

/// A finding for each sidecar file with objects that float, and for each that cannot be read.
pub(super) fn find(dataset: &Path) -> Vec<Finding> {
    let options = settle_options(dataset);
    scene_files(dataset)
        .into_par_iter()
        .filter_map(|path| find_in(dataset, path, &options))
        .collect()
}

fn scene_files(dataset: &Path) -> Vec<PathBuf> {
    let folders = ["scenes/train", "scenes/val"].map(Path::new).into_iter();
    let mut files: Vec<PathBuf> = folders.flat_map(|part| list_files(dataset, part)).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "json"));
    files
}

/// Files of a folder below the dataset's, in order of name; empty if it cannot be listed.
fn list_files(folder: &Path, below: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder.join(below)) else {
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries
        .flatten()
        .filter(|entry| entry.path().is_file())
        .map(|entry| below.join(entry.file_name()))
        .collect();
    files.sort();
    files
}

fn find_in(dataset: &Path, path: PathBuf, options: &SettleOptions) -> Option<Finding> {
    match unsupported_in(&dataset.join(&path), options) {
        Err(e) => Some(Finding::unreadable(dataset, path, &e)),
        Ok(objects) if objects.is_empty() => None,
        Ok(objects) => {
            let objects = objects.join(", ");
            let message = format!("nothing supports {objects}: generate this picture again");
            Some(Finding::in_file(path, Code::UnsupportedObject, message))
        }
    }
}

/// The options with which the dataset's objects fell; the defaults if they are not known.
fn settle_options(dataset: &Path) -> SettleOptions {
    let identity = folder::identity(dataset).ok().flatten();
    let settle = identity.and_then(|identity| identity.pointer("/recipe/scene/settle").cloned());
    settle
        .and_then(|settle| serde_json::from_value(settle).ok())
        .unwrap_or_default()
}

/// The objects of a sidecar file that nothing supports.
fn unsupported_in(path: &Path, options: &SettleOptions) -> Result<Vec<String>> {
    let SettledScene { drawn, scene } = io::read_json(path)?;
    let ids = settle::hanging(&drawn, &scene, options)?.into_iter();
    Ok(ids.map(|id| describe(id, &scene.objects[id - 1])).collect())
}

fn describe(id: usize, object: &Object) -> String {
    let height = match &object.placement {
        Placement::At(pose) => pose.translation.z,
        Placement::Drop { height, .. } => *height,
        Placement::Gone => 0.0,
    };
    format!("object {id} (\"{}\"), {height:.2} m up", object.asset)
}
