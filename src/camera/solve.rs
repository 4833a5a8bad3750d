//! From a label to a camera.

use super::corners::{self, Checked};
use super::focal::{self, FocalSource};
use super::label::Label;
use super::rectangle::View;
use super::warning::Warning;
use crate::camera::Camera;
use crate::geom::{Point2, Point3, Pose, UnitQuaternion, Vector2};
use nalgebra::Rotation3;

/// Above this tilt the surface is seen almost edge-on.
const GRAZING_DEG: f64 = 80.0;
/// A flat focal length is not followed beyond this many longer sides.
const LONGEST_FOCAL: f64 = 100.0;
/// Sides of a more extreme ratio are a typing error.
const EXTREME_RATIO: f64 = 1e3;
/// Noise of a corner that a person clicked, pixels.
const CORNER_SIGMA_PX: f64 = 1.0;

/// Why no camera could be found.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A number is NaN or infinite.
    #[error("{0} is not finite")]
    NonFinite(&'static str),
    /// The picture has no pixels.
    #[error("image: {} x {} pixels, expected at least 1 x 1", .0[0], .0[1])]
    BadImage([u32; 2]),
    /// The rectangle's sides cannot be right.
    #[error("surface: sides of {} m and {} m, expected positive lengths with a ratio of at most 1000", .0[0], .0[1])]
    BadDimensions([f64; 2]),
    /// Neither side of the rectangle is known.
    #[error("surface: width_m and height_m are both missing, expected at least one")]
    NoScale,
    /// There are no corners.
    #[error("surface: corners_px is missing")]
    NoCorners,
    /// A value that must be positive is not.
    #[error("{at}: {value}, expected a positive number")]
    NotPositive {
        /// Which value.
        at: &'static str,
        /// What it was.
        value: f64,
    },
    /// Two corners are one.
    #[error(
        "surface.corners_px: corners {first} and {second} are {distance_px:.1} px apart, expected at least {limit_px:.1}"
    )]
    Coincident {
        /// One of them, from 0.
        first: usize,
        /// The other.
        second: usize,
        /// How far apart they are.
        distance_px: f64,
        /// How far apart they have to be.
        limit_px: f64,
    },
    /// One corner lies inside the triangle of the others.
    #[error("surface.corners_px: not convex (one corner lies inside the triangle of the others)")]
    NotConvex,
    /// Three corners are on one line, within noise.
    #[error(
        "surface.corners_px: corner {corner} is {distance_px:.1} px from the line of two others, expected at least {limit_px:.1}"
    )]
    Collinear {
        /// The corner, in clockwise order from the first.
        corner: usize,
        /// Its distance from the line.
        distance_px: f64,
        /// The distance it has to have.
        limit_px: f64,
    },
    /// The corners are in another order than asked for ([`CornerOrder::Strict`]).
    #[error("surface.corners_px: {0}, and the order was asked to be strict")]
    Order(Warning),
    /// No pose has the camera above the surface with the whole rectangle in front of it.
    #[error("surface.corners_px: no camera above the surface sees these corners")]
    NoPose,
}

/// What to do with corners in another order than clockwise from the top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CornerOrder {
    /// Put them in order, with a warning.
    #[default]
    Repair,
    /// Refuse them.
    Strict,
}

/// How to solve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolveOptions {
    /// What to do with corners out of order. Default: repair them.
    pub order: CornerOrder,
}

/// A camera, and how far to trust it.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The camera; the labelled rectangle is the plane `z = 0`, centred.
    pub camera: Camera,
    /// Width and height of the rectangle, metres.
    pub size: [f64; 2],
    /// The corners as used: clockwise from the labelled first, pixels from the picture's corner.
    pub corners_px: [Point2<f64>; 4],
    /// Where the focal length comes from.
    pub focal_source: FocalSource,
    /// Root mean square distance of the rectangle's projected corners from the labelled ones, pixels.
    pub rms_px: f64,
    /// What a person should look at.
    pub warnings: Vec<Warning>,
}

/// Solves the camera that sees a rectangle of known size at four labelled corners.
///
/// The rectangle becomes the world plane `z = 0`, centred, `+x` along its width.
///
/// # Method
/// Closed form, see `rectangle.rs`. A focal length that the label states (also by its 35 mm equivalent) is kept; without
/// one the corners give it, and where they cannot, a usual lens is assumed and [`Solution::focal_source`] says so.
/// # Errors
/// [`SolveError`], for labels that no camera can have seen. A view from straight above is not an error.
/// # Examples
/// ```
/// # use petcomp::camera::{self, Label};
/// // A rectangle of 0.6 m x 0.4 m from 0.8 m away, tilted by 30 degrees.
/// let corners = [[120.0, 124.5], [520.0, 124.5], [577.1, 388.5], [62.9, 388.5]];
/// let label = Label::new([640, 480], corners, [0.6, 0.4]);
/// let solution = camera::solve(&label, &Default::default())?;
/// assert!((solution.camera.tilt().to_degrees() - 30.0).abs() < 1.0);
/// # Ok::<(), camera::SolveError>(())
/// ```
pub fn solve(label: &Label, options: &SolveOptions) -> Result<Solution, SolveError> {
    let image = label.image_size();
    if image.contains(&0) {
        return Err(SolveError::BadImage(image));
    }
    let Checked { corners, mut warnings, .. } = labelled_corners(label, options)?;
    let (principal, unit_px) = picture_frame(label)?;
    let view = View::new(&corners.map(|c| (c - principal) / unit_px));
    let usual = focal::usual_px(image) / unit_px;
    let stated = stated_focal(label)?.map(|px| px / unit_px);
    let (sides, ratio) = dimensions(label)?;
    let (focal, focal_source) = focal_length(&view, ratio, stated, usual);
    let size = sides.completed(ratio.unwrap_or_else(|| view.ratio(focal)));

    let stance = view.stance(focal, size);
    if stance.height(focal).is_nan() || stance.height(focal) <= 0.0 {
        return Err(SolveError::NoPose);
    }
    let rotation = Rotation3::from_matrix_unchecked(stance.rotation);
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    let camera = Camera {
        image,
        focal_px: Vector2::repeat(focal * unit_px),
        principal_px: principal,
        camera_from_world: Pose::from_parts(stance.translation(focal).into(), rotation),
    };
    let tilt_deg = camera.tilt().to_degrees();
    if tilt_deg > GRAZING_DEG {
        warnings.push(Warning::Grazing { tilt_deg });
    }
    let rms_px = rms_px(&camera, size, &corners).ok_or(SolveError::NoPose)?;
    Ok(Solution { camera, size, corners_px: corners, focal_source, rms_px, warnings })
}

fn labelled_corners(label: &Label, options: &SolveOptions) -> Result<Checked, SolveError> {
    let corners = label.surface.corners_px.ok_or(SolveError::NoCorners)?;
    if corners.as_flattened().iter().any(|v| !v.is_finite()) {
        return Err(SolveError::NonFinite("surface.corners_px"));
    }
    let sigma = positive("surface.corner_sigma_px", label.surface.corner_sigma_px)?.unwrap_or(CORNER_SIGMA_PX);
    corners::check(corners.map(|c| label.pixel(c)), sigma, label.image_size(), options.order)
}

/// The principal point, and half the diagonal: the solver's unit of length in the picture.
fn picture_frame(label: &Label) -> Result<(Point2<f64>, f64), SolveError> {
    let size = Vector2::from(label.image_size().map(f64::from));
    let principal = match label.camera.principal_point_px {
        Some(px) if px.iter().any(|v| !v.is_finite()) => {
            return Err(SolveError::NonFinite("camera.principal_point_px"));
        }
        Some(px) => label.pixel(px),
        None => (size / 2.0).into(),
    };
    Ok((principal, size.norm() / 2.0))
}

/// The sides a person measured, metres.
enum Sides {
    Both([f64; 2]),
    Width(f64),
    Height(f64),
}

impl Sides {
    /// Both sides, for a rectangle whose width is `ratio` times its height.
    fn completed(&self, ratio: f64) -> [f64; 2] {
        match *self {
            Self::Both(size) => size,
            Self::Width(w) => [w, w / ratio],
            Self::Height(h) => [h * ratio, h],
        }
    }
}

/// The measured sides, and width over height where both are known.
fn dimensions(label: &Label) -> Result<(Sides, Option<f64>), SolveError> {
    let (w, h) = (label.surface.width_m, label.surface.height_m);
    let possible = |v: f64| v.is_finite() && v > 0.0;
    let size = [w.unwrap_or(1.0), h.unwrap_or(1.0)];
    if !size.into_iter().all(possible) {
        return Err(SolveError::BadDimensions(size));
    }
    match (w, h) {
        (Some(w), Some(h)) if (w / h).max(h / w) <= EXTREME_RATIO => Ok((Sides::Both([w, h]), Some(w / h))),
        (Some(_), Some(_)) => Err(SolveError::BadDimensions(size)),
        (Some(w), None) => Ok((Sides::Width(w), None)),
        (None, Some(h)) => Ok((Sides::Height(h), None)),
        (None, None) => Err(SolveError::NoScale),
    }
}

/// A stated focal length stays; else the picture's own, else a usual one.
fn focal_length(view: &View, ratio: Option<f64>, stated: Option<f64>, usual: f64) -> (f64, FocalSource) {
    if let Some(focal) = stated {
        return (focal, FocalSource::Fixed);
    }
    let squared = ratio.map_or_else(|| view.focal_squared_any_ratio(), |r| view.focal_squared(r));
    if squared > 0.0 && squared.sqrt() <= LONGEST_FOCAL * usual {
        (squared.sqrt(), FocalSource::Measured)
    } else {
        (usual, FocalSource::Prior)
    }
}

fn stated_focal(label: &Label) -> Result<Option<f64>, SolveError> {
    positive("camera.focal_px", label.camera.focal_px)?;
    positive("camera.focal_35mm", label.camera.focal_35mm)?;
    Ok(focal::stated_px(label))
}

fn positive(at: &'static str, value: Option<f64>) -> Result<Option<f64>, SolveError> {
    match value {
        Some(v) if !v.is_finite() => Err(SolveError::NonFinite(at)),
        Some(v) if v <= 0.0 => Err(SolveError::NotPositive { at, value: v }),
        other => Ok(other),
    }
}

/// The corners of a rectangle of this size, in label order.
pub(crate) fn corner_points(size: [f64; 2]) -> [Point3<f64>; 4] {
    let [x, y] = size.map(|s| s / 2.0);
    [[-x, y], [x, y], [x, -y], [-x, -y]].map(|[x, y]| Point3::new(x, y, 0.0))
}

fn rms_px(camera: &Camera, size: [f64; 2], corners: &[Point2<f64>; 4]) -> Option<f64> {
    let mut sum = 0.0;
    for (point, px) in corner_points(size).into_iter().zip(corners) {
        sum += (camera.project(point)?.0 - px).norm_squared();
    }
    Some((sum / 4.0).sqrt())
}
