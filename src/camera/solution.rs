//! A solved camera, and how reliable it is.

use super::chi;
use super::error::{ContradictedValue, MISFIT_CAUSES, SolveError};
use super::exchange::pose_from;
use super::focal::FocalSource;
use super::label::Framing;
use super::model::{Observation, Square, State};
use super::options::SolveOptions;
use super::pinhole::{Camera, diagonal_px, k1_from_kappa};
use super::problem::Problem;
use super::rectangle::corner_points;
use super::refine::Minimum;
use super::uncertainty::{FocalShare, Uncertainty};
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::geom::{Point2, Vector2};
use nalgebra::{Matrix2, Matrix3};

/// From this share of the information on, the focal length counts as measured; below the other, as
/// the prior's.
const MEASURED_SHARE: f64 = 0.9;
const PRIOR_SHARE: f64 = 0.1;
/// Above this tilt the surface is seen almost edge-on.
const GRAZING_DEG: f64 = 80.0;
/// Height of the objects where none is given, in shorter sides.
const REFERENCE_HEIGHT_SHARE: f64 = 0.1;
/// Error of objects worth a warning where none is given, in picture diagonals: more than an EXIF
/// value leaves, less than knowing nothing from above does.
const HEIGHT_SIGMA_DIAGONALS: f64 = 0.0015;
/// Fits less probable than the first are worth a warning; those less probable than the second are
/// refused.
const POOR_FIT_P: f64 = 0.01;
pub(crate) const REFUSED_FIT_P: f64 = 1e-4;

/// A camera, and how reliable it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The camera; the labelled rectangle is the plane `z = 0`, centred.
    pub camera: Camera,
    /// Radial distortion: a point at offset `x` from the principal point is seen at
    /// `x (1 + kappa |x|^2 / S^2)`, with half the picture's diagonal for S. The camera itself is without
    /// distortion.
    pub kappa: f64,
    /// Width and height of the rectangle as fitted, metres: they agree with the picture.
    pub size: [f64; 2],
    /// The corners as used: clockwise from the labelled first, pixels from the picture's corner.
    pub corners_px: [Point2<f64>; 4],
    /// Which part of the camera's full picture this one is assumed to be.
    pub framing: Framing,
    /// Where the focal length comes from.
    pub focal_source: FocalSource,
    /// What the prior and the picture say about the focal length.
    pub focal: FocalFinding,
    /// Root mean square distance of the rectangle's projected corners from the labelled ones, or
    /// of the labelled points where no corners are, pixels.
    pub rms_px: f64,
    /// How well the label fits.
    pub fit: Fit,
    /// Standard deviations.
    pub sigma: Sigma,
    /// Warnings to review.
    pub warnings: Vec<Diagnostic>,
    /// Another possible camera; the warnings explain why.
    pub alternative: Option<Box<Solution>>,
}

/// What the prior and the picture say about the focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalFinding {
    /// Share of the information that comes from the picture, 0 to 1.
    pub share: f64,
    /// The prior, pixels, and its relative standard deviation (infinite where it is flat).
    pub prior_px: f64,
    /// See [`prior_px`](Self::prior_px).
    pub prior_sigma: f64,
    /// What the picture alone gives, pixels; none where it gives nothing.
    pub from_data_px: Option<f64>,
}

/// How well a label fits its camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squared distances from everything labelled and from the priors, in standard
    /// deviations.
    pub chi2: f64,
    /// Degrees of freedom of that sum.
    pub dof: usize,
    /// Probability of a larger sum by chance; none without degrees of freedom.
    pub p_value: Option<f64>,
    /// Chi squared with width and height swapped, where that fits clearly better.
    pub exchanged_chi2: Option<f64>,
    /// The value without which alone the label fits, where there is one.
    pub contradicted: Option<ContradictedValue>,
    /// Distance of each corner from where it was labelled, pixels; none where only points were.
    pub per_corner_px: Option<[f64; 4]>,
    /// Iterations of the refinement.
    pub iterations: usize,
    /// Condition number of the information from the picture alone.
    pub condition: f64,
    /// Depth of the farthest corner over that of the nearest.
    pub depth_ratio: f64,
    /// Pixels per metre at the rectangle's centre.
    pub px_per_metre: f64,
}

/// Standard deviations of a solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigma {
    /// Of the logarithm of the focal length: relative. Infinite where nothing is known.
    pub ln_focal: f64,
    /// Of the tilt, radians.
    pub tilt: f64,
    /// Covariance of the camera's centre, square metres.
    pub center: Matrix3<f64>,
    /// Covariance of where each corner of the rectangle is seen, square pixels.
    pub corners_px: [Matrix2<f64>; 4],
    /// Height of the objects that the next field is for, metres.
    pub reference_height: f64,
    /// Of where a point at that height is seen, pixels.
    pub height_px: f64,
    /// Of a coordinate of the principal point, pixels.
    pub principal_px: f64,
    /// Covariance of the unknowns, in the solver's units; the order is that of
    /// [`camera::UNKNOWNS`](super::UNKNOWNS).
    pub covariance: Square,
}

impl Problem {
    /// What a minimum means, in metres and pixels.
    pub(crate) fn solution(&self, minimum: &Minimum, options: &SolveOptions) -> Solution {
        let uncertainty = Uncertainty::new(minimum, self.residuals.priors.ln_focal);
        self.solution_with(minimum, &uncertainty, options)
    }

    /// The same, where more is known of the uncertainty.
    pub(crate) fn solution_with(
        &self,
        minimum: &Minimum,
        uncertainty: &Uncertainty,
        options: &SolveOptions,
    ) -> Solution {
        let camera = self.camera(minimum);
        let size = self.fitted_size(&minimum.state);
        let default_height = REFERENCE_HEIGHT_SHARE * size[0].min(size[1]);
        let height = options.reference_height.unwrap_or(default_height);
        let per_corner_px = self
            .has_labelled_corners
            .then(|| self.corner_distances_px(&minimum.state));
        let distances_px =
            per_corner_px.map_or_else(|| self.point_distances_px(&minimum.state), Vec::from);
        let mut solution = Solution {
            camera,
            kappa: minimum.state.kappa,
            size,
            corners_px: self.corners_px,
            framing: self.framing,
            focal_source: self.focal_source(minimum, &uncertainty.focal),
            focal: self.focal_finding(&uncertainty.focal),
            rms_px: root_mean_square(&distances_px),
            fit: self.fit(minimum, &camera, per_corner_px, uncertainty.condition),
            sigma: self.sigma(minimum, uncertainty, height),
            warnings: self.warnings.clone(),
            alternative: None,
        };
        solution.add_warnings(options);
        solution
    }

    fn focal_finding(&self, focal: &FocalShare) -> FocalFinding {
        let prior = self.residuals.priors.ln_focal;
        let from_data_px = focal
            .from_data
            .map(|measured| self.units.focal_px(measured.mean));
        FocalFinding {
            share: focal.share,
            prior_px: self.units.focal_px(prior.mean),
            prior_sigma: prior.sigma,
            from_data_px: from_data_px.filter(|px| px.is_finite()),
        }
    }

    fn camera(&self, minimum: &Minimum) -> Camera {
        let (state, units) = (&minimum.state, &self.units);
        Camera {
            image: self.image,
            focal_px: Vector2::repeat(state.focal * units.unit_px),
            principal_px: units.pixel(state.principal),
            camera_from_world: pose_from(state.pose.rotation, state.translation() * units.unit),
        }
    }

    /// Distance of each corner from where the camera sees it, distortion included, pixels; NaN
    /// behind the camera.
    fn corner_distances_px(&self, state: &State) -> [f64; 4] {
        let points = corner_points(self.size).map(|corner| corner.coords / self.units.unit);
        [0, 1, 2, 3].map(|i| {
            let seen = state.project(&points[i], false);
            seen.map_or(f64::NAN, |u| {
                (self.units.pixel(u) - self.corners_px[i]).norm()
            })
        })
    }

    /// The same of each labelled point.
    fn point_distances_px(&self, state: &State) -> Vec<f64> {
        let distance_px = |point: &Observation| {
            let seen = state.project(&point.point, point.rigid);
            seen.map_or(f64::NAN, |u| (u - point.seen).norm() * self.units.unit_px)
        };
        let points = self.residuals.observations.iter();
        points.map(distance_px).collect()
    }

    fn fit(
        &self,
        minimum: &Minimum,
        camera: &Camera,
        per_corner_px: Option<[f64; 4]>,
        condition: f64,
    ) -> Fit {
        let dof = self.degrees_of_freedom();
        Fit {
            chi2: minimum.cost,
            dof,
            p_value: chi::exceeds(minimum.cost, dof),
            exchanged_chi2: None,
            contradicted: None,
            per_corner_px,
            iterations: minimum.iterations,
            condition,
            depth_ratio: depth_ratio(camera, self.fitted_size(&minimum.state)),
            px_per_metre: minimum.state.pose.scale * self.units.unit_px / self.units.unit,
        }
    }

    fn degrees_of_freedom(&self) -> usize {
        let residuals = &self.residuals;
        let unknowns = 6 + residuals.priors.flat_count();
        residuals.measurement_count().saturating_sub(unknowns)
    }

    fn sigma(&self, minimum: &Minimum, uncertainty: &Uncertainty, reference_height: f64) -> Sigma {
        let state = &minimum.state;
        Sigma {
            ln_focal: uncertainty.focal.sigma,
            tilt: uncertainty.tilt_sigma(state),
            center: self.center_covariance(minimum, uncertainty),
            corners_px: uncertainty.corner_covariances_px(self, state),
            reference_height,
            height_px: uncertainty.height_sigma_px(self, state, reference_height),
            principal_px: uncertainty.principal_sigma_px(self),
            covariance: uncertainty.covariance,
        }
    }

    /// Covariance of the camera's place, squared metres: in units of the sides, and of those.
    fn center_covariance(&self, minimum: &Minimum, uncertainty: &Uncertainty) -> Matrix3<f64> {
        let in_units = uncertainty.center_covariance(&minimum.state);
        let by_scale = self.camera(minimum).center().coords * self.scale_sigma;
        in_units * (self.units.unit * self.units.unit) + by_scale * by_scale.transpose()
    }

    fn focal_source(&self, minimum: &Minimum, focal: &FocalShare) -> FocalSource {
        let prior = self.residuals.priors.ln_focal;
        let range = self.residuals.ln_focal_range;
        if prior.is_fixed() {
            FocalSource::Fixed
        } else if prior.is_flat() && range.contains(&minimum.state.ln_focal) {
            FocalSource::Unbounded
        } else if focal.share >= MEASURED_SHARE {
            FocalSource::Measured
        } else if focal.share >= PRIOR_SHARE {
            FocalSource::Mixed
        } else {
            FocalSource::Prior
        }
    }
}

impl Fit {
    /// What [`Solution::rms_px`] is of: `corners` or, where none were labelled, `points`.
    pub fn labelled(&self) -> &'static str {
        match self.per_corner_px {
            Some(_) => "corners",
            None => "points",
        }
    }
}

impl Solution {
    /// OpenCV's k1, the first coefficient of its lens's radial distortion.
    pub fn k1(&self) -> f64 {
        k1_from_kappa(&self.camera, self.kappa)
    }

    /// The solution, unless it does not fit its label.
    ///
    /// # Errors
    /// [`SolveError::NoFit`], which says what would fix it.
    pub fn fitting(self) -> Result<Self, SolveError> {
        self.misfit().map_or(Ok(self), Err)
    }

    /// Why the solution does not fit its label, where it does not: so improbable by chance, or so
    /// much better with the sides swapped, that it cannot be used.
    pub fn misfit(&self) -> Option<SolveError> {
        let exchanged = self
            .fit
            .exchanged_chi2
            .filter(|_| self.has_fitting_alternative());
        (self.is_improbable() || exchanged.is_some()).then(|| SolveError::NoFit {
            labelled: self.fit.labelled(),
            rms_px: self.rms_px,
            p_value: self.fit.p_value.unwrap_or(0.0),
            exchanged: exchanged.map(|exchanged| [self.fit.chi2, exchanged]),
            contradicted: self.fit.contradicted,
        })
    }

    fn is_improbable(&self) -> bool {
        self.warnings
            .iter()
            .any(|w| w.code == Code::PoorFit && w.severity == Severity::Error)
    }

    fn has_fitting_alternative(&self) -> bool {
        self.alternative
            .as_ref()
            .is_some_and(|other| other.misfit().is_none())
    }

    /// Everything that a camera file holds is finite, but for standard deviations of what nothing
    /// is known of.
    pub(crate) fn is_finite(&self) -> bool {
        let (fit, camera) = (&self.fit, &self.camera);
        let values = [fit.chi2, fit.depth_ratio, fit.px_per_metre, self.rms_px];
        let [prior_px, share] = [self.focal.prior_px, self.focal.share];
        let lens = [camera.focal_px.x, self.kappa, prior_px, share];
        let center = camera.center();
        let places = camera.principal_px.iter().chain(&center.coords);
        let mut all = values.iter().chain(&lens).chain(&self.size).chain(places);
        all.all(|value| value.is_finite())
    }

    /// From which error on objects at the reference height are worth a warning, pixels.
    pub(crate) fn height_limit_px(&self, options: &SolveOptions) -> f64 {
        options
            .max_height_sigma_px
            .unwrap_or(HEIGHT_SIGMA_DIAGONALS * diagonal_px(self.camera.image))
    }

    /// The warning about objects on the surface that may be projected to the wrong place.
    pub(crate) fn height_warning(&self, options: &SolveOptions) -> Option<Diagnostic> {
        let (height, sigma_px) = (self.sigma.reference_height, self.sigma.height_px);
        let what = format!(
            "a point {height:.3} m above the surface is known only to {sigma_px:.1} px: give the focal length or the \
             camera height, add photos taken at an angle, or label points above the surface"
        );
        (sigma_px > self.height_limit_px(options))
            .then(|| Diagnostic::warning(Code::HeightUncertain, what))
    }

    /// Adds the warnings about the solution by itself.
    fn add_warnings(&mut self, options: &SolveOptions) {
        let found = [
            self.grazing_warning(),
            self.unbounded_warning(),
            self.fit_warning(),
            self.height_warning(options),
        ];
        self.warnings.extend(found.into_iter().flatten());
    }

    fn grazing_warning(&self) -> Option<Diagnostic> {
        let tilt_deg = self.camera.tilt_deg();
        let what = format!(
            "grazing view: the camera looks along the surface ({tilt_deg:.1} degrees from straight down)"
        );
        (tilt_deg > GRAZING_DEG).then(|| Diagnostic::warning(Code::GrazingView, what))
    }

    fn unbounded_warning(&self) -> Option<Diagnostic> {
        (self.focal_source == FocalSource::Unbounded).then(|| {
            let what = format!(
                "the corners show no perspective and the focal length is not known: {:.0} px is a bound, not a value",
                self.camera.focal_px.x
            );
            Diagnostic::warning(Code::FocalUnbounded, what)
        })
    }

    /// An error where the fit is so improbable that the camera is refused.
    fn fit_warning(&self) -> Option<Diagnostic> {
        let p_value = self.fit.p_value.filter(|&p| p < POOR_FIT_P)?;
        let what = format!(
            "no camera fits ({:.1} px off, p = {p_value:.1e}): {MISFIT_CAUSES}",
            self.rms_px
        );
        let severity = if p_value < REFUSED_FIT_P {
            Severity::Error
        } else {
            Severity::Warning
        };
        Some(Diagnostic::new(Code::PoorFit, severity, what))
    }
}

fn root_mean_square(distances: &[f64]) -> f64 {
    (distances.iter().map(|d| d * d).sum::<f64>() / distances.len() as f64).sqrt()
}

/// Depth of the farthest corner of a rectangle over that of the nearest.
fn depth_ratio(camera: &Camera, size: [f64; 2]) -> f64 {
    let depths = corner_points(size).map(|corner| (camera.camera_from_world * corner).z);
    let nearest = depths.into_iter().fold(f64::MAX, f64::min);
    let farthest = depths.into_iter().fold(0.0, f64::max);
    farthest / nearest
}
