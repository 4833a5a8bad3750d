//! The pinhole camera.

use crate::document::{parse, text};
use crate::errors::{internal, to_python, wrong_value};
use crate::work;
use nalgebra::Matrix3;
use numpy::ndarray::Array2;
use numpy::{PyArray2, PyReadonlyArray2};
use petcomp::camera::{self, CameraFile, Label, Solution};
use petcomp::geom::{Point2, Point3};
use petcomp::{Error, Result, io};
use pyo3::prelude::*;
use std::path::PathBuf;

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
        check_finite("height", &[height])?;
        check_finite("focal_px", &[focal_px])?;
        if height <= 0.0 {
            let what = format_args!("{height}, expected above 0 (metres)");
            return Err(wrong_value("height", what));
        }
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
                format_args!("{target:?}, expected a point other than eye"),
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

    /// Pixel and depth of each point (n x 3); NaN at or behind the camera.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let camera = self.0;
        each_row(py, &points, move |point: [f64; 3]| {
            let seen = camera.project(Point3::from(point));
            seen.map_or([f64::NAN; 3], |(px, depth)| [px.x, px.y, depth])
        })
    }

    /// Direction of the ray through each pixel (n x 2), with depth 1 along the optical axis.
    fn rays<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let camera = self.0;
        each_row(py, &pixels, move |px: [f64; 2]| {
            camera.ray(Point2::from(px)).direction.into()
        })
    }
}

/// What becomes of each row of a contiguous array of `N` columns: n x 3.
fn each_row<'py, const N: usize>(
    py: Python<'py>,
    rows: &PyReadonlyArray2<'py, f64>,
    change: impl Fn([f64; N]) -> [f64; 3] + Send + 'static,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows = rows.as_slice()?.as_chunks::<N>().0.to_vec();
    let job = move || Ok(rows.into_iter().map(change).collect());
    let changed: Vec<[f64; 3]> = work::run(py, job)?;
    let array = Array2::from_shape_vec((changed.len(), 3), changed.into_flattened());
    let array = array.map_err(|e| internal(&e.to_string()))?;
    Ok(PyArray2::from_owned_array(py, array))
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

/// Solves the camera of a label; also returns the record of the solution as JSON.
#[pyfunction]
pub(crate) fn solve_camera(py: Python<'_>, label: &str, force: bool) -> PyResult<(Camera, String)> {
    let label: Label = parse("label", label).map_err(to_python)?;
    let (camera, record) = work::run(py, move || solved(&label, force))?;
    Ok((Camera(camera), record))
}

/// A label and what the file of its photo says of the camera, as JSON.
#[pyfunction]
pub(crate) fn read_label(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    work::run(py, move || text(&camera::read_label(path)?))
}

/// The camera of a camera file.
#[pyfunction]
pub(crate) fn read_camera(py: Python<'_>, path: PathBuf) -> PyResult<Camera> {
    let camera = work::run(py, move || {
        let file: CameraFile = io::read_json(&path)?;
        let camera = file.camera();
        crate::scene::check_camera(&camera).map_err(|e| e.in_file(&path))?;
        Ok(camera)
    })?;
    Ok(Camera(camera))
}

fn solved(label: &Label, force: bool) -> Result<(petcomp::Camera, String)> {
    if !force {
        camera::check_size(label)?;
    }
    let solution = camera::solve(label, &Default::default()).map_err(Error::from)?;
    let solution = if force { solution } else { accepted(solution)? };
    Ok((solution.camera, text(&record(label, &solution))?))
}

/// A solution that fits its label, whose camera can see objects on the surface through a lens that
/// can have taken the photo.
fn accepted(solution: Solution) -> Result<Solution> {
    camera::check_distance(&solution)?;
    let solution = solution.fitting()?;
    camera::check_lens(&solution.camera, solution.k1())?;
    Ok(solution)
}

fn record(label: &Label, solution: &Solution) -> serde_json::Value {
    serde_json::json!({
        "size": solution.size,
        "rms_px": solution.rms_px,
        "p_value": solution.fit.p_value,
        "focal_sigma": solution.sigma.ln_focal,
        "tilt_sigma": solution.sigma.tilt,
        "warnings": solution.warnings,
        "file": CameraFile::new(label, solution),
    })
}
