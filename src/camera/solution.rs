//! A solved camera, and how far to trust it.

use super::chi;
use super::error::SolveError;
use super::focal::FocalSource;
use super::label::Framing;
use super::model::Square;
use super::options::SolveOptions;
use super::problem::{Problem, corner_points};
use super::refine::Minimum;
use super::uncertainty::{FocalShare, Uncertainty};
use super::warning::Warning;
use crate::camera::Camera;
use crate::geom::{Point2, Point3, Pose, UnitQuaternion, Vector2};
use nalgebra::{Matrix2, Matrix3, Rotation3};

/// From this share of the information on, the focal length counts as measured; below the other, as believed.
const MEASURED: f64 = 0.9;
const BELIEVED: f64 = 0.1;
/// Above this tilt the surface is seen almost edge-on.
const GRAZING_DEG: f64 = 80.0;
/// Height of the objects where none is given, in shorter sides.
const REFERENCE_HEIGHT: f64 = 0.1;
/// Error of objects worth a warning where none is given, in picture diagonals: more than a usual EXIF value leaves, less
/// than knowing nothing from above does.
const HEIGHT_SIGMA: f64 = 0.0015;
/// Fits less probable than these are warned of, and severe.
const IMPROBABLE: f64 = 0.01;
const IMPOSSIBLE: f64 = 1e-4;

/// A camera, and how far to trust it.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The camera; the labelled rectangle is the plane `z = 0`, centred.
    pub camera: Camera,
    /// Radial distortion: a point at offset `x` from the principal point is seen at `x (1 + kappa |x|^2 / S^2)`, with half
    /// the picture's diagonal for S. The camera itself is without distortion.
    pub kappa: f64,
    /// Width and height of the rectangle as fitted, metres: they agree with the picture.
    pub size: [f64; 2],
    /// The corners as used: clockwise from the labelled first, pixels from the picture's corner.
    pub corners_px: [Point2<f64>; 4],
    /// Which part of what the camera took the picture is taken for.
    pub framing: Framing,
    /// Where the focal length comes from.
    pub focal_source: FocalSource,
    /// What was known of the focal length before and what the picture says.
    pub focal: FocalFinding,
    /// Root mean square distance of the rectangle's projected corners from the labelled ones, pixels.
    pub rms_px: f64,
    /// How well the label fits.
    pub fit: Fit,
    /// Standard deviations.
    pub sigma: Sigma,
    /// What a person should look at.
    pub warnings: Vec<Warning>,
    /// Another camera that a person should know of; the warnings say why.
    pub alternative: Option<Box<Solution>>,
}

/// What was known of the focal length before and what the picture says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalFinding {
    /// Part of the information that comes from the picture, 0 to 1.
    pub share: f64,
    /// What was believed, pixels, and its relative standard deviation (infinite where nothing was).
    pub prior_px: f64,
    /// See [`prior_px`](Self::prior_px).
    pub prior_sigma: f64,
    /// What the picture alone says, pixels; none where it says nothing.
    pub from_data_px: Option<f64>,
}

/// How well a label fits its camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squared distances from everything labelled and believed, in standard deviations.
    pub chi2: f64,
    /// Degrees of freedom of that sum.
    pub dof: usize,
    /// Probability of a larger sum by chance; none without degrees of freedom.
    pub p_value: Option<f64>,
    /// Distance of each corner from where it was labelled, pixels.
    pub per_corner_px: [f64; 4],
    /// Steps of the refinement.
    pub steps: usize,
    /// Condition number of what the picture alone says.
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
    /// Covariance of the unknowns, in the solver's units; the order is that of [`camera::UNKNOWNS`](super::UNKNOWNS).
    pub covariance: Square,
}

impl Problem {
    /// What a minimum means, in metres and pixels.
    pub(crate) fn solution(&self, minimum: &Minimum, options: &SolveOptions) -> Solution {
        let uncertainty = Uncertainty::new(minimum, self.evidence.beliefs.ln_focal);
        self.solution_with(minimum, &uncertainty, options)
    }

    /// The same, where more is known of the uncertainty.
    pub(crate) fn solution_with(
        &self,
        minimum: &Minimum,
        uncertainty: &Uncertainty,
        options: &SolveOptions,
    ) -> Solution {
        let state = &minimum.state;
        let believed = self.evidence.beliefs.ln_focal;
        let camera = self.camera(minimum);
        let size = self.fitted_size(state);
        let seen = self.seen_corners(minimum);
        let per_corner_px = [0, 1, 2, 3].map(|i| (seen[i] - self.corners_px[i]).norm());
        let rms_px = (per_corner_px.iter().map(|d| d * d).sum::<f64>() / 4.0).sqrt();
        let height = options
            .reference_height
            .unwrap_or(REFERENCE_HEIGHT * size[0].min(size[1]));
        let fit = self.fit(minimum, &camera, per_corner_px, uncertainty.condition);
        let sigma = self.sigma(minimum, uncertainty, height);
        let to_px = |ln_focal: f64| libm::exp(ln_focal) * self.frame.unit_px;
        let focal = FocalFinding {
            share: uncertainty.focal.share,
            prior_px: to_px(believed.mean),
            prior_sigma: believed.sigma,
            from_data_px: uncertainty
                .focal
                .from_data
                .map(|b| to_px(b.mean))
                .filter(|f| f.is_finite()),
        };
        let focal_source = self.focal_source(minimum, &uncertainty.focal);
        let mut solution = Solution {
            camera,
            kappa: state.kappa,
            size,
            corners_px: self.corners_px,
            framing: self.framing,
            focal_source,
            focal,
            rms_px,
            fit,
            sigma,
            warnings: self.warnings.clone(),
            alternative: None,
        };
        solution.warn(options);
        solution
    }

    fn camera(&self, minimum: &Minimum) -> Camera {
        let (state, frame) = (&minimum.state, &self.frame);
        let rotation = Rotation3::from_matrix_unchecked(state.stance.rotation);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        Camera {
            image: self.image,
            focal_px: Vector2::repeat(state.focal * frame.unit_px),
            principal_px: frame.principal_px + state.principal * frame.unit_px,
            camera_from_world: Pose::from_parts(
                (state.translation() * frame.unit).into(),
                rotation,
            ),
        }
    }

    /// Where the rectangle's corners are seen, pixels, distortion included.
    fn seen_corners(&self, minimum: &Minimum) -> [Point2<f64>; 4] {
        corner_points(self.size).map(|corner| {
            let seen = minimum
                .state
                .project(&(corner.coords / self.frame.unit), false);
            seen.map_or(Point2::new(f64::NAN, f64::NAN), |u| {
                self.frame.principal_px + u * self.frame.unit_px
            })
        })
    }

    fn fit(
        &self,
        minimum: &Minimum,
        camera: &Camera,
        per_corner_px: [f64; 4],
        condition: f64,
    ) -> Fit {
        let evidence = &self.evidence;
        let seen = 2 * evidence.sights.len() + usize::from(evidence.beliefs.ln_height.is_some());
        let dof = seen.saturating_sub(6 + evidence.beliefs.unknown());
        let depths = corner_points(self.fitted_size(&minimum.state)).map(|c| depth(camera, c));
        let (near, far) = (
            depths.into_iter().fold(f64::MAX, f64::min),
            depths.into_iter().fold(0.0, f64::max),
        );
        Fit {
            chi2: minimum.cost,
            dof,
            p_value: chi::exceeds(minimum.cost, dof),
            per_corner_px,
            steps: minimum.steps,
            condition,
            depth_ratio: far / near,
            px_per_metre: minimum.state.stance.scale * self.frame.unit_px / self.frame.unit,
        }
    }

    fn sigma(&self, minimum: &Minimum, uncertainty: &Uncertainty, reference_height: f64) -> Sigma {
        let state = &minimum.state;
        Sigma {
            ln_focal: uncertainty.focal.sigma,
            tilt: uncertainty.tilt(state),
            center: uncertainty.camera_center(state) * (self.frame.unit * self.frame.unit),
            corners_px: uncertainty.corners_px(self, state),
            reference_height,
            height_px: uncertainty.height_px(self, state, reference_height),
            principal_px: uncertainty.principal_px(self),
            covariance: uncertainty.covariance,
        }
    }

    fn focal_source(&self, minimum: &Minimum, focal: &FocalShare) -> FocalSource {
        let believed = self.evidence.beliefs.ln_focal;
        if believed.is_fact() {
            FocalSource::Fixed
        } else if believed.says_nothing()
            && self
                .evidence
                .ln_focal_range
                .contains(&minimum.state.ln_focal)
        {
            FocalSource::Unbounded
        } else if focal.share >= MEASURED {
            FocalSource::Measured
        } else if focal.share >= BELIEVED {
            FocalSource::Mixed
        } else {
            FocalSource::Prior
        }
    }
}

impl Solution {
    /// The solution, unless it is one that does not fit its label.
    ///
    /// # Errors
    /// [`SolveError::NoFit`], which says what would mend it.
    pub fn fitting(self) -> Result<Self, SolveError> {
        self.misfit().map_or(Ok(self), Err)
    }

    /// Why the solution does not fit its label, where it does not: so improbable by chance, or so much better with the
    /// sides exchanged, that it is worth nothing.
    pub fn misfit(&self) -> Option<SolveError> {
        let severe = self
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::Inconsistent { severe: true, .. }));
        let exchanged = self.warnings.iter().find_map(|w| match *w {
            Warning::SidesSwapped {
                labelled,
                exchanged,
            } if self.fit.chi2 > exchanged => Some([labelled, exchanged]),
            _ => None,
        });
        let mended = self
            .alternative
            .as_ref()
            .is_some_and(|other| other.misfit().is_none());
        let exchanged = exchanged.filter(|_| mended);
        let p_value = self.fit.p_value.unwrap_or(0.0);
        (severe || exchanged.is_some()).then_some(SolveError::NoFit {
            rms_px: self.rms_px,
            p_value,
            exchanged,
        })
    }

    /// Everything that a camera file holds is finite, but for standard deviations of what nothing is known of.
    pub(crate) fn is_finite(&self) -> bool {
        let (camera, fit, focal) = (&self.camera, &self.fit, &self.focal);
        let center = camera.center();
        let places = [
            camera.focal_px.x,
            camera.principal_px.x,
            camera.principal_px.y,
            center.x,
            center.y,
            center.z,
        ];
        let fits = [
            fit.chi2,
            fit.depth_ratio,
            fit.px_per_metre,
            self.rms_px,
            self.kappa,
            focal.prior_px,
            focal.share,
        ];
        places
            .iter()
            .chain(&fits)
            .chain(&self.size)
            .all(|value| value.is_finite())
    }

    /// From which error on objects at the reference height are warned of, pixels.
    pub(crate) fn height_limit_px(&self, options: &SolveOptions) -> f64 {
        let [w, h] = self.camera.image.map(f64::from);
        options
            .max_height_sigma_px
            .unwrap_or(HEIGHT_SIGMA * libm::hypot(w, h))
    }

    /// That objects on the surface may be seen at the wrong place, where they may.
    pub(crate) fn height_warning(&self, options: &SolveOptions) -> Option<Warning> {
        let (height, sigma_px) = (self.sigma.reference_height, self.sigma.height_px);
        (sigma_px > self.height_limit_px(options))
            .then_some(Warning::HeightUncertain { height, sigma_px })
    }

    /// Adds what is odd about the solution by itself.
    fn warn(&mut self, options: &SolveOptions) {
        let tilt_deg = self.camera.tilt().to_degrees();
        if tilt_deg > GRAZING_DEG {
            self.warnings.push(Warning::Grazing { tilt_deg });
        }
        if self.focal_source == FocalSource::Unbounded {
            self.warnings.push(Warning::FocalUnbounded {
                focal_px: self.camera.focal_px.x,
            });
        }
        if let Some(p_value) = self.fit.p_value.filter(|&p| p < IMPROBABLE) {
            let severe = p_value < IMPOSSIBLE;
            self.warnings.push(Warning::Inconsistent {
                p_value,
                rms_px: self.rms_px,
                severe,
            });
        }
        self.warnings.extend(self.height_warning(options));
    }
}

fn depth(camera: &Camera, point: Point3<f64>) -> f64 {
    (camera.camera_from_world * point).z
}
