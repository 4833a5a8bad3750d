//! The pinhole camera.

use crate::document::{parse, text};
use crate::errors::{to_python, wrong_value};
use crate::work;
use nalgebra::Matrix3;
use petcomp::camera::{self, CameraFile, Label, Solution};
use petcomp::geom::{Point2, Point3};
use petcomp::{Error, Result};
use pyo3::prelude::*;

/// A pinhole camera without distortion.
#[pyclass(frozen, eq, module = "petcomp._petcomp")]
#[derive(PartialEq)]
pub(crate) struct Camera(pub(crate) petcomp::Camera);

fn checked(camera: petcomp::Camera) -> PyResult<Camera> {
    crate::scene::check_camera(&camera).map_err(to_python)?;
    Ok(Camera(camera))
}

/// Numbers that are numbers, before anything is computed from them.
fn check_finite(name: &str, numbers: &[f64]) -> PyResult<()> {
    match numbers.iter().find(|number| !number.is_finite()) {
        None => Ok(()),
        Some(bad) => Err(wrong_value(
            name,
            format_args!("{bad}, expected finite numbers"),
        )),
    }
}

#[pymethods]
impl Camera {
    #[staticmethod]
    fn from_json(json: &str) -> PyResult<Self> {
        checked(parse("camera", json).map_err(to_python)?)
    }

    fn to_json(&self) -> PyResult<String> {
        text(&self.0).map_err(to_python)
    }

    #[staticmethod]
    fn looking_down(height: f64, focal_px: f64, image: [u32; 2]) -> PyResult<Self> {
        check_finite("height", &[height, focal_px])?;
        checked(petcomp::Camera::looking_down(height, focal_px, image))
    }

    #[staticmethod]
    fn look_at(eye: [f64; 3], target: [f64; 3], focal_px: f64, image: [u32; 2]) -> PyResult<Self> {
        check_finite("eye", &eye)?;
        check_finite("target", &target)?;
        check_finite("focal_px", &[focal_px])?;
        if eye == target {
            return Err(wrong_value(
                "target",
                format_args!("{target:?}, expected another place than eye"),
            ));
        }
        checked(petcomp::Camera::look_at(
            eye.into(),
            target.into(),
            focal_px,
            image,
        ))
    }

    #[getter]
    fn image(&self) -> [u32; 2] {
        self.0.image
    }

    #[getter]
    fn focal_px(&self) -> [f64; 2] {
        self.0.focal_px.into()
    }

    #[getter]
    fn principal_px(&self) -> [f64; 2] {
        self.0.principal_px.into()
    }

    #[getter]
    fn center(&self) -> [f64; 3] {
        self.0.center().into()
    }

    #[getter]
    fn tilt(&self) -> f64 {
        self.0.tilt()
    }

    fn intrinsics(&self) -> [[f64; 3]; 3] {
        rows(&self.0.intrinsics())
    }

    fn camera_from_world(&self) -> [[f64; 4]; 4] {
        let matrix = self.0.camera_from_world.to_homogeneous();
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
    }

    fn pixel_from_surface(&self) -> [[f64; 3]; 3] {
        rows(&self.0.pixel_from_surface().0)
    }

    fn resized(&self, image: [u32; 2]) -> PyResult<Self> {
        checked(self.0.resized(image))
    }

    /// Pixel and depth of each point; NaN at or behind the camera.
    fn project(&self, points: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        let projected = points
            .into_iter()
            .map(|point| self.0.project(Point3::from(point)));
        let nowhere = [f64::NAN; 3];
        projected
            .map(|seen| seen.map_or(nowhere, |(px, depth)| [px.x, px.y, depth]))
            .collect()
    }

    /// Direction of the ray through each pixel, whose depth along the optical axis is 1.
    fn rays(&self, pixels: Vec<[f64; 2]>) -> Vec<[f64; 3]> {
        let rays = pixels.into_iter().map(|px| self.0.ray(Point2::from(px)));
        rays.map(|ray| ray.direction.into()).collect()
    }
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

/// The camera of a label, and what `NAME.camera.json` would say of it.
#[pyfunction]
pub(crate) fn solve_camera(py: Python<'_>, label: &str, force: bool) -> PyResult<(Camera, String)> {
    let label: Label = parse("label", label).map_err(to_python)?;
    let (camera, record) = work::run(py, move || solved(&label, force))?;
    Ok((Camera(camera), record))
}

fn solved(label: &Label, force: bool) -> Result<(petcomp::Camera, String)> {
    let solution = camera::solve(label, &Default::default()).map_err(Error::from)?;
    let solution = if force {
        solution
    } else {
        solution.fitting().map_err(Error::from)?
    };
    Ok((solution.camera, text(&record(label, &solution))?))
}

fn record(label: &Label, solution: &Solution) -> serde_json::Value {
    serde_json::json!({
        "size": solution.size,
        "rms_px": solution.rms_px,
        "p_value": solution.fit.p_value,
        "focal_sigma": solution.sigma.ln_focal,
        "tilt_sigma": solution.sigma.tilt,
        "height_sigma_px": solution.sigma.height_px,
        "warnings": solution.warnings,
        "file": CameraFile::new(label, solution),
    })
}
