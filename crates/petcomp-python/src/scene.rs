//! Scenes and recipes as documents.

use crate::document::{parse, text};
use crate::errors::to_python;
use crate::work;
use petcomp::scene::{CameraSource, Surface};
use petcomp::{Camera, Result, Scene, io};
use pyo3::prelude::*;
use std::path::PathBuf;

/// Checks a scene and fills in the defaults that scene files write.
#[pyfunction]
pub(crate) fn check_scene(json: &str) -> PyResult<String> {
    scene_of(json)
        .and_then(|scene| text(&scene))
        .map_err(to_python)
}

/// Reads a scene file, TOML or JSON.
#[pyfunction]
pub(crate) fn read_scene(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    work::run(py, move || {
        let scene: Scene = io::read_document(&path)?;
        scene.check().map_err(|e| e.in_file(&path))?;
        text(&scene)
    })
}

/// Writes a scene file, TOML or JSON depending on its name.
#[pyfunction]
pub(crate) fn write_scene(py: Python<'_>, path: PathBuf, json: &str) -> PyResult<()> {
    let scene = scene_of(json).map_err(to_python)?;
    work::run(py, move || io::write_document(path, &scene))
}

pub(crate) fn scene_of(json: &str) -> Result<Scene> {
    let scene: Scene = parse("scene", json)?;
    scene.check()?;
    Ok(scene)
}

/// An empty scene that this camera sees.
pub(crate) fn empty_scene(camera: &Camera) -> Scene {
    let surface = Surface::new([1.0, 1.0]);
    Scene::new(camera.image, CameraSource::Known(*camera), surface)
}

/// A camera that a scene may have.
pub(crate) fn check_camera(camera: &Camera) -> Result<()> {
    empty_scene(camera).check()
}
