//! How to solve, and the priors of what a label leaves open.

use super::label::Framing;

/// How to solve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolveOptions {
    /// What to do with corners out of order. Default: repair them.
    pub order: CornerOrder,
    /// Priors of what the label leaves open. Default: those of a real camera and a tape measure.
    pub priors: Priors,
    /// Take the width as 1 where neither side is known. Default: false, an error.
    pub unit_scale: bool,
    /// Height of the objects that will stand on the surface, metres. Default: a tenth of the
    /// shorter side.
    pub reference_height: Option<f64>,
    /// Warn where the error of a point at that height exceeds this, pixels. Default: 0.0015
    /// picture diagonals.
    pub max_height_sigma_px: Option<f64>,
    /// Maximum number of refinement iterations, from the closed form only; 0 is the closed form
    /// itself. Default: no limit, from every start until nothing changes.
    ///
    /// With a limit, other poses are not searched for, EXIF data and the order of the sides are
    /// trusted, and the standard deviations are those at the last iteration.
    pub max_iterations: Option<usize>,
}

/// What to do with corners in another order than clockwise from the top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CornerOrder {
    /// Put them in order, with a warning.
    #[default]
    Repair,
    /// Refuse them.
    Strict,
    /// Put them in order, and swap width and height where that fits the picture clearly better.
    Auto,
}

/// Standard deviations of what a label leaves open; 0 fixes the default value, infinity makes the
/// prior flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Priors {
    /// Relative, of an unknown focal length; its median is the picture's longer side.
    /// Default: 0.35 (two out of three lenses are between 25 and 51 mm equivalent).
    pub focal_sigma: f64,
    /// Of the principal point of a whole picture, in picture diagonals. Default: 0.005.
    pub principal_sigma: f64,
    /// Of the principal point of a picture that is cropped, or may be, in picture diagonals.
    /// Default: 0.12 (cutting a third away on one side moves it by 0.2 diagonals; see
    /// `petcomp-report camera`).
    pub cropped_sigma: f64,
    /// Relative, of the ratio of the sides. Default: 0.005.
    pub ratio_sigma: f64,
    /// Of the radial distortion. Default: 0, a pinhole camera.
    pub kappa_sigma: f64,
    /// Of the radial distortion that four or more photos of one camera share, where that is
    /// smaller. Default: 0.01, as lenses have it at the corner of the picture.
    pub joint_kappa_sigma: f64,
}

impl Default for Priors {
    fn default() -> Self {
        Self {
            focal_sigma: 0.35,
            principal_sigma: 0.005,
            cropped_sigma: 0.12,
            ratio_sigma: 0.005,
            kappa_sigma: 0.0,
            joint_kappa_sigma: 0.01,
        }
    }
}

impl Priors {
    /// For rendered pictures: a perfect camera over a perfect rectangle.
    ///
    /// Not for photos: from near above it turns half a percent of tape error into focal errors of
    /// hundreds of percent.
    pub fn ideal() -> Self {
        Self {
            principal_sigma: 0.0,
            cropped_sigma: 0.0,
            ratio_sigma: 0.0,
            kappa_sigma: 0.0,
            joint_kappa_sigma: 0.0,
            ..Self::default()
        }
    }

    /// Of the principal point, in picture diagonals.
    pub(crate) fn principal_sigma_for(&self, framing: Framing) -> f64 {
        if framing == Framing::Whole {
            self.principal_sigma
        } else {
            self.cropped_sigma
        }
    }

    /// A cropped picture has another prior than a whole one.
    pub(crate) fn cropping_matters(&self) -> bool {
        self.cropped_sigma > self.principal_sigma
    }

    /// The same, with a flat prior of the focal length.
    pub fn with_free_focal(self) -> Self {
        Self {
            focal_sigma: f64::INFINITY,
            ..self
        }
    }
}
