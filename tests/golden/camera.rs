//! Cameras placed by Blender come back from the corners it projects.

use crate::case::Case;
use nalgebra::{Matrix3, Vector3};
use petcomp::Camera;
use petcomp::camera::{self, BlenderCamera, FocalSource, Label, Priors, SensorFit, SolveOptions};
use petcomp::geom::{Point2, Point3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Reference {
    cases: Vec<View>,
}

/// One camera and what it sees, as the script writes it.
#[derive(Deserialize)]
struct View {
    image: [u32; 2],
    size: [f64; 2],
    corners_px: [[f64; 2]; 4],
    corners_px_blender: [[f64; 2]; 4],
    checks: Vec<Check>,
    focal_px: f64,
    principal_px: [f64; 2],
    #[serde(rename = "R")]
    rotation: [[f64; 3]; 3],
    #[serde(rename = "t")]
    translation: [f64; 3],
    blender: Blender,
}

/// The values that Blender was given, and the pose it made of them in 32 bits.
#[derive(Deserialize)]
struct Blender {
    sensor_fit: SensorFit,
    sensor: [f64; 2],
    lens: f64,
    shift: [f64; 2],
    matrix_world: [[f64; 4]; 3],
}

/// A point above the surface and where it is seen.
#[derive(Deserialize)]
struct Check {
    point: [f64; 3],
    px: [f64; 2],
}

#[derive(Deserialize)]
struct Tolerance {
    known_position: f64,
    known_angle_deg: f64,
    known_check_px: f64,
    known_blender_check_px: f64,
    blender_camera_check_px: f64,
    flat_focal: Option<f64>,
    flat_check_px: Option<f64>,
    flat_blender_check_px: Option<f64>,
}

pub(crate) fn run(case: &Case) -> Result<(), String> {
    let text =
        std::fs::read_to_string(case.dir.join("reference.json")).map_err(|e| e.to_string())?;
    let reference: Reference = serde_json::from_str(&text).map_err(|e| e.to_string())?;
    let tolerance: Tolerance = case.table["tolerance"]
        .clone()
        .try_into()
        .map_err(|e: toml::de::Error| e.to_string())?;
    for (i, view) in reference.cases.iter().enumerate() {
        view.check(&tolerance)
            .map_err(|e| format!("view {i}: {e}"))?;
    }
    Ok(())
}

impl View {
    fn check(&self, limit: &Tolerance) -> Result<(), String> {
        within(
            "check points by Blender's own values",
            self.worst_check_px(&self.blender()),
            limit.blender_camera_check_px,
        )?;
        let known = self.solve(self.corners_px, Some(self.focal_px))?;
        within(
            "position with a known focal length",
            self.position_error(&known),
            limit.known_position,
        )?;
        within(
            "angle with a known focal length",
            self.angle_deg(&known),
            limit.known_angle_deg,
        )?;
        within(
            "check points with a known focal length",
            self.worst_check_px(&known),
            limit.known_check_px,
        )?;
        let known = self.solve(self.corners_px_blender, Some(self.focal_px))?;
        within(
            "check points from Blender's corners",
            self.worst_check_px(&known),
            limit.known_blender_check_px,
        )?;

        let (Some(focal), Some(check), Some(blender)) = (
            limit.flat_focal,
            limit.flat_check_px,
            limit.flat_blender_check_px,
        ) else {
            return Ok(());
        };
        let flat = self.solve(self.corners_px, None)?;
        within(
            "focal length",
            (flat.focal_px.x / self.focal_px - 1.0).abs(),
            focal,
        )?;
        within(
            "check points with a free focal length",
            self.worst_check_px(&flat),
            check,
        )?;
        let flat = self.solve(self.corners_px_blender, None)?;
        within(
            "check points from Blender's corners alone",
            self.worst_check_px(&flat),
            blender,
        )
    }

    fn solve(&self, corners_px: [[f64; 2]; 4], focal_px: Option<f64>) -> Result<Camera, String> {
        let mut label = Label::new(self.image, corners_px, self.size);
        label.surface.corner_sigma_px = Some(0.01);
        label.camera.principal_point_px = Some(self.principal_px);
        label.camera.focal_px = focal_px;
        label.camera.focal_fixed = focal_px.is_some();
        let options = SolveOptions {
            priors: Priors::ideal().with_free_focal(),
            ..Default::default()
        };
        let solution = camera::solve(&label, &options).map_err(|e| e.to_string())?;
        let expected = if focal_px.is_some() {
            FocalSource::Fixed
        } else {
            FocalSource::Measured
        };
        match solution.focal_source == expected {
            true => Ok(solution.camera),
            false => Err(format!(
                "focal length is {:?}, expected {expected:?}",
                solution.focal_source
            )),
        }
    }

    /// The camera that the values given to Blender stand for.
    fn blender(&self) -> Camera {
        let blender = &self.blender;
        let [a, b, c] = blender.matrix_world;
        let values = BlenderCamera {
            sensor_fit: blender.sensor_fit,
            sensor_width: blender.sensor[0],
            sensor_height: blender.sensor[1],
            lens: blender.lens,
            shift_x: blender.shift[0],
            shift_y: blender.shift[1],
            pixel_aspect: 1.0,
            matrix_world: [a, b, c, [0.0, 0.0, 0.0, 1.0]],
        };
        Camera::from_blender(&values, self.image)
    }

    fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.rotation[i][j])
    }

    /// Of the translation and of the camera's centre, relative to their lengths.
    fn position_error(&self, camera: &Camera) -> f64 {
        let truth = Vector3::from(self.translation);
        let center = -self.rotation().transpose() * truth;
        let t = (camera.camera_from_world.translation.vector - truth).norm() / truth.norm();
        t.max((camera.center().coords - center).norm() / center.norm())
    }

    /// Between the rotations; the difference of two matrices is 2 sqrt(2) sin(angle / 2) long.
    fn angle_deg(&self, camera: &Camera) -> f64 {
        let found = camera.camera_from_world.rotation.to_rotation_matrix();
        let chord = (found.matrix() - self.rotation()).norm() / 8f64.sqrt();
        2.0 * chord.asin().to_degrees()
    }

    fn worst_check_px(&self, camera: &Camera) -> f64 {
        let error = |c: &Check| {
            camera
                .project(Point3::from(c.point))
                .map(|(px, _)| (px - Point2::from(c.px)).norm())
        };
        // A NaN is as far off as can be.
        let errors = self
            .checks
            .iter()
            .map(|c| error(c).unwrap_or(f64::INFINITY));
        errors
            .map(|px| if px.is_nan() { f64::INFINITY } else { px })
            .fold(0.0, f64::max)
    }
}

fn within(what: &str, error: f64, limit: f64) -> Result<(), String> {
    if error <= limit {
        Ok(())
    } else {
        Err(format!("{what}: off by {error:.3e}, allowed {limit:.0e}"))
    }
}
