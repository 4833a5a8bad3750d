//! Solves the camera from the four corners of a rectangle of known size.
#![expect(unsafe_code, reason = "called from C")]

use crate::memory::{array, put, store_text};
use crate::status::{Failure, Status, call};
use bytemuck::{Pod, Zeroable};
use petcomp::camera::{self, CameraFile, Label, LabelCamera, LabelImage, LabelSurface};
use petcomp::{Camera, Error};
use std::ffi::c_char;

/// A pinhole camera without distortion, with OpenCV's axes: x right, y down, z forward.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CameraModel {
    /// Focal lengths along x and y, pixels.
    pub focal_px: [f64; 2],
    /// Principal point, pixels; (0, 0) is the top left corner of the top left pixel.
    pub principal_px: [f64; 2],
    /// Three rows of rotation and translation (metres): camera point = matrix * (world point, 1).
    pub camera_from_world: [[f64; 4]; 3],
}

impl From<&Camera> for CameraModel {
    fn from(camera: &Camera) -> Self {
        let matrix = camera.camera_from_world.to_homogeneous();
        Self {
            focal_px: camera.focal_px.into(),
            principal_px: camera.principal_px.into(),
            camera_from_world: std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)])),
        }
    }
}

/// Solves the camera from the four corners of a rectangle of known size.
///
/// * `corners_px`: eight numbers, x and y of top left, top right, bottom right and bottom left,
///   pixels
/// * `size_m`: width and height of the rectangle, metres
/// * `image`: width and height of the image, pixels
/// * `focal_px`: focal length, or 0 if unknown
/// * `camera`: receives the camera. The rectangle becomes the world plane z = 0, centred, +x along
///   its width, +z towards the camera
/// * `report`: if not null, receives the text of petcomp's NAME.camera.json: the camera, standard
///   deviations of everything solved, warnings. If the buffer is too small, `camera` is still
///   written
/// * `report_length`: if not null, receives the size of that text in bytes, including its NUL
///
/// # Safety
/// Each pointer is null or points to memory as described; `report` has room for `report_capacity`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn petcomp_camera_solve(
    corners_px: *const f64,
    size_m: *const f64,
    image: *const u32,
    focal_px: f64,
    camera: *mut CameraModel,
    report: *mut c_char,
    report_capacity: usize,
    report_length: *mut usize,
) -> Status {
    call(|| {
        // SAFETY: promised by the caller.
        let (corners, size, image) = unsafe {
            let corners: [f64; 8] = array("corners_px", corners_px)?;
            (corners, array("size_m", size_m)?, array("image", image)?)
        };
        let (model, text) = solved(&label_of(corners, size, image, focal_px)?)?;
        // SAFETY: promised by the caller.
        unsafe {
            put("camera", model, camera)?;
            if report.is_null() && report_length.is_null() {
                return Ok(());
            }
            store_text("report", &text, report, report_capacity, report_length)
        }
    })
}

fn label_of(
    corners: [f64; 8],
    [width_m, height_m]: [f64; 2],
    [width, height]: [u32; 2],
    focal_px: f64,
) -> Result<Label, Failure> {
    if !(focal_px.is_finite() && focal_px >= 0.0) {
        let what = format_args!("{focal_px}, expected pixels, or 0 for an unknown focal length");
        return Err(Failure::argument("focal_px", what));
    }
    check_finite("corners_px", &corners)?;
    check_finite("size_m", &[width_m, height_m])?;
    if width == 0 || height == 0 {
        let what = format_args!("{width} x {height} pixels, expected at least 1 x 1");
        return Err(Failure::argument("image", what));
    }
    let known = (focal_px > 0.0).then_some(focal_px);
    Ok(Label {
        format: Default::default(),
        version: 1,
        image: LabelImage {
            width,
            height,
            ..Default::default()
        },
        pixel_origin: Default::default(),
        surface: LabelSurface {
            width_m: Some(width_m),
            height_m: Some(height_m),
            corners_px: Some(std::array::from_fn(|i| {
                [corners[2 * i], corners[2 * i + 1]]
            })),
            ..Default::default()
        },
        camera: LabelCamera {
            focal_px: known,
            focal_fixed: known.is_some(),
            ..Default::default()
        },
        points: Vec::new(),
        markers: None,
    })
}

fn check_finite(name: &str, numbers: &[f64]) -> Result<(), Failure> {
    match numbers.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(Failure::argument(
            name,
            format_args!("{} at {i}, expected finite numbers", numbers[i]),
        )),
        None => Ok(()),
    }
}

fn solved(label: &Label) -> Result<(CameraModel, String), Failure> {
    camera::check_size(label)?;
    let solution = camera::solve(label, &Default::default()).map_err(Error::from)?;
    camera::check_distance(&solution)?;
    let solution = solution.fitting().map_err(Error::from)?;
    let text = serde_json::to_string(&CameraFile::new(label, &solution));
    let text = text.map_err(|e| Error::value("report", e))?;
    Ok(((&solution.camera).into(), text))
}
