//! A solved camera for display: numbers with their errors, lines over the photo, advice in words.

use crate::refusal::Answer;
use petcomp::Error;
use petcomp::camera::{self, Label, Sketch, Solution, SolveOptions};
use serde::Serialize;

/// A camera and its assessment.
#[derive(Serialize)]
pub(super) struct CameraSummary {
    /// Height of the lens above the surface, metres, and its standard deviation.
    height: [f64; 2],
    /// Tilt from straight down, degrees.
    tilt_deg: [f64; 2],
    /// Focal length, pixels; its error is relative, none if nothing constrains it.
    focal_px: f64,
    focal_sigma: Option<f64>,
    /// Reprojection error of the corners, or of the points if only those are labelled: root mean
    /// square, and for each corner, pixels.
    rms_px: f64,
    per_corner_px: Option<[f64; 4]>,
    /// Width and height of the rectangle, metres.
    size: [f64; 2],
    px_per_metre: f64,
    /// Reprojection error of points at `sketch.wall_height`, pixels.
    height_px: f64,
    reference_height: f64,
    /// Why this camera cannot be used.
    misfit: Option<String>,
    /// The lines of `petcomp camera doctor`.
    advice: Vec<String>,
    sketch: Sketch,
}

impl CameraSummary {
    /// The camera of a label that was completed with its photo's EXIF data.
    pub(super) fn of(label: &Label) -> Answer<Self> {
        let options = SolveOptions::default();
        let solution = camera::solve(label, &options).map_err(Error::from)?;
        camera::check_distance(&solution)?;
        camera::check_lens(&solution.camera, solution.k1())?;
        Ok(Self {
            advice: camera::doctor(label, &solution, &options)
                .lines()
                .map(str::to_owned)
                .collect(),
            ..Self::without_advice(label, &solution)
        })
    }

    fn without_advice(label: &Label, solution: &Solution) -> Self {
        let sigma = &solution.sigma;
        let reference_height = sigma.reference_height;
        Self {
            height: height_of(solution),
            tilt_deg: [solution.camera.tilt(), sigma.tilt].map(f64::to_degrees),
            focal_px: solution.camera.focal_px.x,
            focal_sigma: Some(sigma.ln_focal).filter(|sigma| sigma.is_finite()),
            rms_px: solution.rms_px,
            per_corner_px: solution.fit.per_corner_px,
            size: solution.size,
            px_per_metre: solution.fit.px_per_metre,
            height_px: sigma.height_px,
            reference_height,
            misfit: solution.misfit().map(|error| error.to_string()),
            advice: Vec::new(),
            sketch: Sketch::new(solution, wall_height(label).unwrap_or(reference_height)),
        }
    }
}

/// Height of the lens above the surface and its standard deviation, metres.
fn height_of(solution: &Solution) -> [f64; 2] {
    let variance = solution.sigma.center[(2, 2)];
    [solution.camera.center().z, variance.max(0.0).sqrt()]
}

/// The height of the walls from the label, metres.
fn wall_height(label: &Label) -> Option<f64> {
    let height = label.surface.wall?.height_m?;
    Some(height).filter(|height| height.is_finite() && *height > 0.0)
}
