//! A label in the solver's units: observations, priors, and where to start.

use super::corners::{self, OrderedCorners};
use super::error::SolveError;
use super::focal::{self, PriorSource};
use super::label::{Framing, Label, LabelPoint};
use super::label_check::check_label;
use super::model::{Observation, State, StretchShares, kappa_from_k1};
use super::options::{Priors, SolveOptions};
use super::pinhole::diagonal_px;
use super::prior::{ParameterPriors, Prior};
use super::rectangle::{ProjectedRectangle, corner_points};
use super::refine::Residuals;
use super::sides::{MeasuredSides, ratio_by_right_angle};
use crate::diagnostic::Diagnostic;
use crate::geom::{Point2, Point3, Vector2};
use nalgebra::Vector3;

/// Focal lengths beyond this many longer sides, or below one over it, are not followed.
const MAX_FOCAL_SIDES: f64 = 100.0;
/// Noise of a corner that a person clicked, pixels.
const CLICKED_SIGMA_PX: f64 = 1.0;
/// Relative noise of a camera height that is stated without a standard deviation.
const STATED_HEIGHT_SIGMA: f64 = 0.03;

/// The units of the solver, and what they stand for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolverUnits {
    /// Where the principal point is expected, pixels.
    pub(crate) principal_px: Point2<f64>,
    /// One unit in the picture: half its diagonal, pixels.
    pub(crate) unit_px: f64,
    /// One unit of length: the geometric mean of the rectangle's sides, metres.
    pub(crate) unit: f64,
}

/// Everything that the solver needs of a label.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(crate) image: [u32; 2],
    pub(crate) framing: Framing,
    pub(crate) units: SolverUnits,
    pub(crate) corners_px: [Point2<f64>; 4],
    /// Whether they were labelled, or else predicted from the further points.
    pub(crate) has_labelled_corners: bool,
    pub(crate) projected: ProjectedRectangle,
    /// Sides of the rectangle before they are stretched, metres.
    pub(crate) size: [f64; 2],
    pub(crate) stretch_shares: StretchShares,
    /// Relative standard deviation of all lengths, by that of the sides.
    pub(crate) scale_sigma: f64,
    k1: Option<f64>,
    pub(crate) residuals: Residuals,
    pub(crate) prior_source: PriorSource,
    pub(crate) warnings: Vec<Diagnostic>,
}

impl Problem {
    /// Checks a label of a picture of some framing and brings it into the solver's units.
    pub(crate) fn new(
        label: &Label,
        framing: Framing,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        // In one piece: each step needs what several before it have found.
        check_label(label)?;
        let sides = MeasuredSides::new(label, options)?;
        let (stretch_shares, scale_sigma) = (sides.stretch_shares(), sides.scale_sigma(label));
        let used = used_corners(label, sides, options)?;
        let units = SolverUnits::for_picture(label);
        let (priors, prior_source) = units.lens_priors(label, framing, &options.priors);
        let (k1, prior_focal) = (label.camera.k1, libm::exp(priors.ln_focal.mean));
        let kappa = k1.map_or(0.0, |k1| kappa_from_k1(k1, prior_focal));
        let projected = units.projected(&used.corners, kappa);
        let size = sides.completed(|| ratio_by_right_angle(&projected, prior_focal));
        let units = units.for_rectangle(size);
        let residuals = Residuals {
            observations: units.observations(label, size, &used.corners, stretch_shares),
            priors: ParameterPriors {
                stretch_sigma: sides.stretch_sigma(label, &options.priors),
                ln_height: height_prior(label, &units, scale_sigma),
                ..priors
            },
            ln_focal_range: units.ln_focal_range(label),
        };
        Ok(Self {
            image: label.image_size(),
            framing,
            units,
            corners_px: used.corners,
            has_labelled_corners: label.surface.corners_px.is_some(),
            projected,
            size,
            stretch_shares,
            scale_sigma,
            k1,
            residuals,
            prior_source,
            warnings: used.warnings,
        })
    }

    /// The closed-form camera for a focal length.
    pub(crate) fn start(&self, focal: f64) -> State {
        State::new(
            self.projected.pose_at(focal, self.unit_size()),
            focal,
            self.k1,
            self.stretch_shares,
        )
    }

    /// The sides before they are stretched, in the solver's unit.
    pub(crate) fn unit_size(&self) -> [f64; 2] {
        self.size.map(|s| s / self.units.unit)
    }

    /// The focal length that the corners give in closed form, where they give one that can be
    /// followed.
    pub(crate) fn closed_form_focal(&self) -> Option<f64> {
        let squared = if self.stretch_shares == StretchShares::BOTH {
            self.projected.focal_squared(self.size[0] / self.size[1])
        } else {
            self.projected.focal_squared_any_ratio()
        };
        let [shortest, longest] = self.residuals.ln_focal_range.map(libm::exp);
        (squared > shortest * shortest && squared < longest * longest).then(|| squared.sqrt())
    }

    /// The sides in a state, metres.
    pub(crate) fn fitted_size(&self, state: &State) -> [f64; 2] {
        [self.size[0] * state.sides[0], self.size[1] * state.sides[1]]
    }
}

/// The corners, clockwise, labelled or predicted from the further points, and warnings about them.
fn used_corners(
    label: &Label,
    sides: MeasuredSides,
    options: &SolveOptions,
) -> Result<OrderedCorners, SolveError> {
    let labelled = label.surface.corners_px;
    let labelled = labelled.map(|corners| corners.map(|c| label.pixel(c)));
    let quad_px = labelled
        .or_else(|| sides.predicted_corners(label))
        .ok_or_else(|| sides.missing_corners(label))?;
    let sigma_px = corner_sigma_px(label);
    let mut used = corners::check(quad_px, sigma_px, label.image_size(), options.order)?;
    if labelled.is_none() {
        used.warnings.extend(sides.span_warning(label));
    }
    Ok(used)
}

fn corner_sigma_px(label: &Label) -> f64 {
    label.surface.corner_sigma_px.unwrap_or(CLICKED_SIGMA_PX)
}

impl SolverUnits {
    /// For a picture, with lengths in metres.
    fn for_picture(label: &Label) -> Self {
        let diagonal = Vector2::from(label.image_size().map(f64::from));
        let stated = label.camera.principal_point_px;
        Self {
            principal_px: stated.map_or(label.taken_center(), |px| label.pixel(px)),
            unit_px: diagonal.norm() / 2.0,
            unit: 1.0,
        }
    }

    /// The same, with lengths for a rectangle.
    fn for_rectangle(self, size: [f64; 2]) -> Self {
        Self {
            unit: (size[0] * size[1]).sqrt(),
            ..self
        }
    }

    /// The priors of the lens, the others flat, and where that of the focal length comes from.
    fn lens_priors(
        &self,
        label: &Label,
        framing: Framing,
        priors: &Priors,
    ) -> (ParameterPriors, PriorSource) {
        let (mut ln_focal, source) = focal::length_prior(label, framing, priors);
        ln_focal.mean -= libm::log(self.unit_px);
        let lens = ParameterPriors {
            ln_focal,
            stretch_sigma: f64::INFINITY,
            principal_sigma: principal_sigma(label, framing, priors),
            // Where a coefficient is stated kappa follows the focal length, and is no unknown.
            kappa: Prior::at_zero(label.camera.k1.map_or(priors.kappa_sigma, |_| 0.0)),
            ln_height: Prior::FLAT,
        };
        (lens, source)
    }

    /// The rectangle as a camera without distortion would show it.
    fn projected(&self, corners_px: &[Point2<f64>; 4], kappa: f64) -> ProjectedRectangle {
        ProjectedRectangle::new(&corners_px.map(|c| undistorted(self.normalized(c), kappa)))
    }

    fn normalized(&self, px: Point2<f64>) -> Vector2<f64> {
        (px - self.principal_px) / self.unit_px
    }

    /// The pixel of a position on the picture.
    pub(crate) fn pixel(&self, position: Vector2<f64>) -> Point2<f64> {
        self.principal_px + position * self.unit_px
    }

    /// The focal length in pixels, from its logarithm.
    pub(crate) fn focal_px(&self, ln_focal: f64) -> f64 {
        libm::exp(ln_focal) * self.unit_px
    }

    /// Smallest and largest logarithm of the focal length to be followed.
    fn ln_focal_range(&self, label: &Label) -> [f64; 2] {
        let nominal = focal::nominal_px(label.taken_size()) / self.unit_px;
        [1.0 / MAX_FOCAL_SIDES, MAX_FOCAL_SIDES].map(|f| libm::log(f * nominal))
    }

    /// The labelled corners and the further points. Corners that were only predicted are a start
    /// and no observations.
    fn observations(
        &self,
        label: &Label,
        size: [f64; 2],
        corners_px: &[Point2<f64>; 4],
        stretch_shares: StretchShares,
    ) -> Vec<Observation> {
        let is_labelled = label.surface.corners_px.is_some();
        let corners = corner_points(size)
            .into_iter()
            .zip(corners_px)
            .filter(|_| is_labelled)
            .map(|(point, &px)| self.observation(point, px, corner_sigma_px(label)));
        let further = label
            .points
            .iter()
            .map(|point| self.point_observation(label, point, stretch_shares));
        corners.chain(further).collect()
    }

    fn point_observation(
        &self,
        label: &Label,
        point: &LabelPoint,
        stretch_shares: StretchShares,
    ) -> Observation {
        let sigma_px = point.sigma_px.unwrap_or(corner_sigma_px(label));
        Observation {
            // Where both sides were measured, so was the point, with the same tape.
            rigid: stretch_shares != StretchShares::BOTH,
            ..self.observation(point.xyz_m.into(), label.pixel(point.px), sigma_px)
        }
    }

    /// Of a point that stretches with the rectangle.
    fn observation(&self, point: Point3<f64>, px: Point2<f64>, sigma_px: f64) -> Observation {
        let point: Vector3<f64> = point.coords / self.unit;
        Observation {
            point,
            rigid: false,
            seen: self.normalized(px),
            weight: self.unit_px / sigma_px,
        }
    }
}

/// Standard deviation of a coordinate of the principal point, in the solver's units. Where a part of
/// the picture was cut away matters no more once the principal point is stated.
fn principal_sigma(label: &Label, framing: Framing, priors: &Priors) -> f64 {
    let framing = match label.camera.principal_point_px {
        Some(_) => Framing::Whole,
        None => framing,
    };
    let default_px = priors.principal_sigma_for(framing) * diagonal_px(label.taken_size());
    let sigma_px = label.camera.principal_point_sigma_px;
    let unit_px = diagonal_px(label.image_size()) / 2.0;
    sigma_px.unwrap_or(default_px) / unit_px
}

/// Prior of the logarithm of the camera's height above the surface, in the solver's units, which are
/// as far off as the sides.
fn height_prior(label: &Label, units: &SolverUnits, scale_sigma: f64) -> Prior {
    let Some(height) = label.camera.height_m else {
        return Prior::FLAT;
    };
    let sigma = label
        .camera
        .height_sigma_m
        .map_or(STATED_HEIGHT_SIGMA, |s| s / height);
    Prior {
        mean: libm::log(height / units.unit),
        sigma: libm::hypot(sigma, scale_sigma),
    }
}

/// Where a point would be seen without distortion, by fixed-point iteration.
fn undistorted(seen: Vector2<f64>, kappa: f64) -> Vector2<f64> {
    const MAX_STEPS: usize = 60;
    const TOLERANCE: f64 = 1e-12;
    if kappa == 0.0 {
        return seen;
    }
    let mut straight = seen;
    for _ in 0..MAX_STEPS {
        let next = seen / (1.0 + kappa * straight.norm_squared());
        let moved = (next - straight).norm();
        straight = next;
        if moved < TOLERANCE {
            break;
        }
    }
    straight
}
