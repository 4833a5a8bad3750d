//! Solution files (`NAME.camera.json`): a solved camera with everything known about it.

#![allow(
    missing_docs,
    reason = "the fields of Solution, in the words of the file format"
)]

use super::exchange::{BlenderCamera, OpencvCamera, matrix_rows};
use super::focal::FocalSource;
use super::label::{Framing, Label, LabelImage, version_one};
use super::label_check::MAX_MAGNITUDE;
use super::pinhole::{Camera, k1_from_kappa};
use super::solution::Solution;
use super::uncertainty::UNKNOWN_NAMES;
use crate::diagnostic::Diagnostic;
use crate::error::{Error, Result};
use crate::geom::{Point2, Vector2};
use nalgebra::Matrix3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// A solved camera as a document; numbers read back to the same bits. Infinite values are `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// What kind of file this is.
    pub format: CameraFormat,
    /// Version of the format: 1.
    #[serde(deserialize_with = "version_one")]
    pub version: u32,
    /// The label's picture.
    pub image: LabelImage,
    /// The label's surface.
    pub surface_id: String,
    /// What the camera was solved from: shows whether the label has changed since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solved_from: Option<SolvedFrom>,
    /// The camera does not fit its label and was written because of `--force`. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub forced: bool,
    /// The camera, its uncertainty and its warnings.
    #[serde(flatten)]
    pub found: FoundCamera,
}

/// What a camera was solved from, by content.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolvedFrom {
    /// CRC-32 of the label together with what its photo's EXIF data say.
    pub label_crc32: u32,
    /// Width and height of the rectangle as measured, metres, for labels that do not hold them.
    pub size_m: [Option<f64>; 2],
    /// The same checksum of each label that was solved together with this one, by file name as seen
    /// from the folder of this one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub together: BTreeMap<String, u32>,
}

/// The one word of [`CameraFile::format`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum CameraFormat {
    /// `plane-camera`.
    #[default]
    #[serde(rename = "plane-camera")]
    PlaneCamera,
}

/// A camera, how reliable it is, and another possible one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundCamera {
    /// Intrinsics in our pixels.
    pub model: Model,
    /// The camera in OpenCV's terms.
    pub opencv: OpencvCamera,
    /// The camera's centre, metres.
    pub center_m: [f64; 3],
    /// Angle between optical axis and surface normal, degrees.
    pub tilt_deg: f64,
    /// The camera in Blender's terms.
    pub blender: BlenderCamera,
    /// The rectangle as fitted.
    pub surface: FittedSurface,
    /// Surface metres to pixels, row by row.
    pub homography: [[f64; 3]; 3],
    /// Standard deviations.
    pub sigma: SigmaRecord,
    /// How well the label fits.
    pub fit: FitRecord,
    /// Which part of the camera's full picture this one was assumed to be.
    #[serde(default)]
    pub framing: Framing,
    /// Where the focal length comes from.
    pub focal_source: FocalSource,
    /// Part of the information on the focal length that comes from the picture.
    pub data_share: f64,
    /// What the picture alone gives for the focal length, pixels.
    pub focal_from_data: Option<f64>,
    /// The prior of the focal length.
    pub focal_prior: FocalPrior,
    /// Warnings to review.
    #[serde(deserialize_with = "warnings_with_codes")]
    pub warnings: Vec<Diagnostic>,
    /// Another possible camera.
    pub alternative: Option<Box<FoundCamera>>,
}

/// Intrinsics in our pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    pub f_px: f64,
    pub principal_point_px: [f64; 2],
    pub kappa: f64,
}

/// Sides of the rectangle as fitted, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedSurface {
    pub width_m: f64,
    pub height_m: f64,
}

/// The prior of the focal length: pixels, and relative standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FocalPrior {
    pub px: f64,
    pub sigma: Option<f64>,
}

/// Standard deviations; `null` where nothing is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SigmaRecord {
    pub ln_f: Option<f64>,
    pub tilt_deg: Option<f64>,
    pub center_m: [Option<f64>; 3],
    pub height_px: Option<f64>,
    pub height_ref_m: f64,
    #[serde(default)]
    pub principal_point_px: Option<f64>,
    /// Order of the rows and columns of the covariance.
    pub unknowns: Vec<String>,
    pub covariance: Vec<Vec<Option<f64>>>,
}

/// How well the label fits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitRecord {
    pub chi2: f64,
    pub dof: usize,
    pub p_value: Option<f64>,
    pub rms_px: f64,
    pub per_corner_px: Option<[f64; 4]>,
    pub iterations: usize,
    pub condition: f64,
    pub depth_ratio: f64,
    pub px_per_m: f64,
}

impl CameraFile {
    /// The file to write next to a label.
    pub fn new(label: &Label, solution: &Solution) -> Self {
        Self {
            format: CameraFormat::PlaneCamera,
            version: 1,
            image: label.image.clone(),
            surface_id: label.surface.id.clone(),
            solved_from: Some(SolvedFrom::new(label)),
            forced: solution.misfit().is_some(),
            found: FoundCamera::new(solution),
        }
    }

    /// The camera of the file.
    pub fn camera(&self) -> Camera {
        let model = &self.found.model;
        Camera {
            focal_px: Vector2::repeat(model.f_px),
            principal_px: Point2::from(model.principal_point_px),
            ..Camera::from_opencv(&self.found.opencv, self.image.size())
        }
    }

    /// OpenCV's k1, the first coefficient of its lens's radial distortion.
    pub fn k1(&self) -> f64 {
        k1_from_kappa(&self.camera(), self.found.model.kappa)
    }

    /// Width and height of the rectangle as fitted, metres.
    pub fn size(&self) -> [f64; 2] {
        [self.found.surface.width_m, self.found.surface.height_m]
    }

    /// Checks that the file holds a camera that can have taken a picture of this size.
    ///
    /// # Errors
    /// [`Error::Value`] naming the first value that cannot be right.
    pub fn check(&self, image: [u32; 2]) -> Result<()> {
        self.check_image(image)?;
        self.found.model.check()?;
        for side in self.size() {
            check_positive("surface", side)?;
        }
        check_pose(&self.found.opencv)?;
        if self.camera().height_m() > 0.0 {
            Ok(())
        } else {
            Err(Error::value("opencv.t", "the camera is below the surface"))
        }
    }

    fn check_image(&self, image: [u32; 2]) -> Result<()> {
        let ([w, h], [width, height]) = (self.image.size(), image);
        if self.image.size() == image && !image.contains(&0) {
            return Ok(());
        }
        let what = format!("{w} x {h} pixels, expected {width} x {height}");
        Err(Error::value("image", what))
    }
}

impl Model {
    fn new(solution: &Solution) -> Self {
        Self {
            f_px: solution.camera.focal_px.x,
            principal_point_px: solution.camera.principal_px.into(),
            kappa: solution.kappa,
        }
    }

    fn check(&self) -> Result<()> {
        check_positive("model.f_px", self.f_px)?;
        self.principal_point_px
            .iter()
            .try_for_each(|v| check_magnitude("model.principal_point_px", *v))
    }
}

fn check_pose(opencv: &OpencvCamera) -> Result<()> {
    for value in opencv.t {
        check_magnitude("opencv.t", value)?;
    }
    if is_rotation(&Matrix3::from_fn(|i, j| opencv.r[i][j])) {
        Ok(())
    } else {
        Err(Error::value("opencv.R", "not a rotation"))
    }
}

fn is_rotation(matrix: &Matrix3<f64>) -> bool {
    let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    off < ROTATION_TOLERANCE && matrix.determinant() > 0.0
}

/// Matrices farther from a rotation than this are not accepted as one.
const ROTATION_TOLERANCE: f64 = 1e-6;

fn check_magnitude(at: &str, value: f64) -> Result<()> {
    if value.abs() <= MAX_MAGNITUDE {
        return Ok(());
    }
    let what = format!("{value:e}, expected at most {MAX_MAGNITUDE:e}");
    Err(Error::value(at, what))
}

fn check_positive(at: &str, value: f64) -> Result<()> {
    if (1.0 / MAX_MAGNITUDE..=MAX_MAGNITUDE).contains(&value) {
        return Ok(());
    }
    Err(Error::value(
        at,
        format!("{value:e}, expected a positive number"),
    ))
}

/// Reads warnings, without those of older files, which had a `kind` and its numbers instead of a
/// code and a message.
fn warnings_with_codes<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> std::result::Result<Vec<Diagnostic>, D::Error> {
    Vec::<Value>::deserialize(deserializer)?
        .into_iter()
        .filter(|warning| warning.get("kind").is_none())
        .map(|warning| serde_json::from_value(warning).map_err(D::Error::custom))
        .collect()
}

impl SolvedFrom {
    /// For a label that is solved alone.
    pub fn new(label: &Label) -> Self {
        let size_m = [label.surface.width_m, label.surface.height_m];
        Self {
            label_crc32: checksum(label),
            size_m,
            together: BTreeMap::new(),
        }
    }
}

/// CRC-32 of a label as we would write it, without what no camera depends on.
pub(crate) fn checksum(label: &Label) -> u32 {
    let mut label = label.clone();
    (label.surface.albedo, label.surface.source) = (None, None);
    label.points.iter_mut().for_each(|point| point.note = None);
    checksum_without_wall(&label)
}

/// A checksum is this label's; those of older files change with its albedo and its notes.
pub(crate) fn has_checksum(label: &Label, crc: u32) -> bool {
    [checksum(label), checksum_without_wall(label)].contains(&crc)
}

fn checksum_without_wall(label: &Label) -> u32 {
    let mut label = label.clone();
    label.surface.wall = None;
    // A label is made of texts and numbers: all of them have a form in JSON.
    crc32fast::hash(&serde_json::to_vec(&label).unwrap_or_default())
}

impl FoundCamera {
    fn new(solution: &Solution) -> Self {
        let (camera, focal) = (&solution.camera, &solution.focal);
        let [width_m, height_m] = solution.size;
        let alternative = solution.alternative.as_deref().map(Self::new);
        // Long, but only a list: one line for each field of the file.
        Self {
            model: Model::new(solution),
            opencv: camera.to_opencv(),
            center_m: camera.center().into(),
            tilt_deg: camera.tilt_deg(),
            blender: camera.to_blender(),
            surface: FittedSurface { width_m, height_m },
            homography: matrix_rows(&camera.pixel_from_surface().0),
            sigma: SigmaRecord::new(solution),
            fit: FitRecord::new(solution),
            framing: solution.framing,
            focal_source: solution.focal_source,
            data_share: focal.share,
            focal_from_data: focal.from_data_px,
            focal_prior: FocalPrior {
                px: focal.prior_px,
                sigma: finite(focal.prior_sigma),
            },
            warnings: solution.warnings.clone(),
            alternative: alternative.map(Box::new),
        }
    }
}

impl SigmaRecord {
    fn new(solution: &Solution) -> Self {
        let sigma = &solution.sigma;
        let rows = sigma.covariance.row_iter();
        Self {
            ln_f: finite(sigma.ln_focal),
            tilt_deg: finite(sigma.tilt.to_degrees()),
            center_m: deviations(&sigma.center).map(finite),
            height_px: finite(sigma.height_px),
            height_ref_m: sigma.reference_height,
            principal_point_px: finite(sigma.principal_px),
            unknowns: UNKNOWN_NAMES.map(String::from).into(),
            covariance: rows
                .map(|row| row.iter().copied().map(finite).collect())
                .collect(),
        }
    }
}

/// The standard deviations of a covariance.
fn deviations(covariance: &Matrix3<f64>) -> [f64; 3] {
    [0, 1, 2].map(|i| covariance[(i, i)].max(0.0).sqrt())
}

impl FitRecord {
    fn new(solution: &Solution) -> Self {
        let fit = &solution.fit;
        Self {
            chi2: fit.chi2,
            dof: fit.dof,
            p_value: fit.p_value,
            rms_px: solution.rms_px,
            per_corner_px: fit.per_corner_px,
            iterations: fit.iterations,
            condition: fit.condition,
            depth_ratio: fit.depth_ratio,
            px_per_m: fit.px_per_metre,
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{Priors, SolveOptions, solve};

    #[test]
    fn a_file_reads_back_to_the_same_bits() {
        for (k, tilt) in [0.0, 3.0, 20.0, 60.0].into_iter().enumerate() {
            let view = Scenario::realistic().tilted(tilt).view(21, k as u64);
            for priors in [Priors::default(), Priors::ideal().with_free_focal()] {
                let solution = solve(
                    &view.label,
                    &SolveOptions {
                        priors,
                        ..Default::default()
                    },
                )
                .unwrap();
                let file = CameraFile::new(&view.label, &solution);
                let text = serde_json::to_string_pretty(&file).unwrap();
                let back: CameraFile = serde_json::from_str(&text).unwrap();
                assert_eq!(serde_json::to_string_pretty(&back).unwrap(), text);
                assert_eq!(back, file);
                let p = crate::geom::Point3::new(0.1, 0.1, 0.05);
                let (a, b) = (
                    back.camera().project(p).unwrap().0,
                    solution.camera.project(p).unwrap().0,
                );
                assert!((a - b).norm() < 1e-9);
            }
        }
    }
    fn warned() -> (Label, Solution) {
        let label = Scenario::realistic().tilted(85.0).view(21, 1).label;
        let solution = solve(&label, &SolveOptions::default()).unwrap();
        assert!(!solution.warnings.is_empty());
        (label, solution)
    }

    #[test]
    fn warnings_have_a_code_a_severity_and_a_message() {
        let (label, solution) = warned();
        let file = serde_json::to_value(CameraFile::new(&label, &solution)).unwrap();
        let written = file["warnings"].as_array().unwrap();
        assert_eq!(written.len(), solution.warnings.len());
        let (first, expected) = (&written[0], &solution.warnings[0]);
        assert_eq!(first["code"], expected.code.name());
        assert_eq!(first["severity"], "warning");
        assert_eq!(first["message"], expected.message);
    }

    #[test]
    fn a_file_with_warnings_of_the_older_form_is_read_without_them() {
        let (label, solution) = warned();
        let file = CameraFile::new(&label, &solution);
        let mut value = serde_json::to_value(&file).unwrap();
        let older = serde_json::json!({ "kind": "grazing", "tilt_deg": 85.0 });
        let warnings = value["warnings"].as_array_mut().unwrap();
        warnings.push(older.clone());
        let mixed: CameraFile = serde_json::from_value(value.clone()).unwrap();
        assert_eq!(mixed, file);
        value["warnings"] = serde_json::json!([older]);
        let read: CameraFile = serde_json::from_value(value).unwrap();
        assert!(read.found.warnings.is_empty());
        assert_eq!(read.found.model, file.found.model);
    }

    #[test]
    fn an_unknown_code_is_an_error() {
        let (label, solution) = warned();
        let mut value = serde_json::to_value(CameraFile::new(&label, &solution)).unwrap();
        value["warnings"][0]["code"] = "camera.unheard_of".into();
        let error = serde_json::from_value::<CameraFile>(value).unwrap_err();
        assert!(error.to_string().contains("camera.unheard_of"), "{error}");
    }
}
