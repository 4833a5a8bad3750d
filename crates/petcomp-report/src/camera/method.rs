//! The compared methods, and the cameras that they have to find.

use petcomp::camera::simulate::{Scenario, View};
use petcomp::camera::{self, Priors, Solution, SolveOptions};

/// Photos of one camera that are solved jointly.
pub(super) const PHOTOS_TOGETHER: usize = 8;

/// The real camera, and the solver's assumptions about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lens {
    /// A perfect pinhole over a perfect rectangle, known to the solver; nothing is known about the
    /// focal length.
    Ideal,
    /// Principal point, distortion and tape measure are as uncertain as usual, with the default
    /// priors.
    Realistic,
}

/// A method for finding a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SolveMethod {
    /// The closed form and this many steps of refinement.
    Steps(usize),
    /// All starting points, to convergence, with covariance.
    Whole,
    /// Together with other photos of the same camera.
    Joint,
}

impl Lens {
    /// Both of them.
    pub(super) const ALL: [Self; 2] = [Self::Ideal, Self::Realistic];

    /// Its name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Realistic => "realistic",
        }
    }

    pub(super) fn scenario(self, corner_sigma_px: f64) -> Scenario {
        let scenario = match self {
            Self::Ideal => Scenario::default(),
            Self::Realistic => Scenario::realistic(),
        };
        Scenario {
            corner_sigma_px,
            ..scenario
        }
    }

    fn priors(self) -> Priors {
        match self {
            Self::Ideal => Priors::ideal().with_free_focal(),
            Self::Realistic => Priors::default(),
        }
    }
}

impl SolveMethod {
    /// All of them, the quickest first.
    pub(super) const ALL: [Self; 8] = [
        Self::Steps(0),
        Self::Steps(1),
        Self::Steps(2),
        Self::Steps(3),
        Self::Steps(4),
        Self::Steps(5),
        Self::Whole,
        Self::Joint,
    ];

    /// Its name in tables.
    pub(super) fn name(self) -> String {
        match self {
            Self::Steps(0) => "closed form".into(),
            Self::Steps(1) => "closed form + 1 step".into(),
            Self::Steps(n) => format!("closed form + {n} steps"),
            Self::Whole => "full refinement".into(),
            Self::Joint => format!("joint, {PHOTOS_TOGETHER} photos"),
        }
    }

    pub(super) fn options(self, lens: Lens) -> SolveOptions {
        SolveOptions {
            priors: lens.priors(),
            max_iterations: self.max_iterations(),
            ..Default::default()
        }
    }

    fn max_iterations(self) -> Option<usize> {
        match self {
            Self::Steps(limit) => Some(limit),
            Self::Whole | Self::Joint => None,
        }
    }

    /// Solves the first of some photos of one camera.
    pub(super) fn solve(self, views: &[View], options: &SolveOptions) -> Option<Solution> {
        if self == Self::Joint {
            solve_jointly(views, options)
        } else {
            camera::solve(&views[0].label, options).ok()
        }
    }

    /// Number of photos used for one result.
    pub(super) fn photos(self) -> usize {
        if self == Self::Joint {
            PHOTOS_TOGETHER
        } else {
            1
        }
    }
}

fn solve_jointly(views: &[View], options: &SolveOptions) -> Option<Solution> {
    let labels: Vec<_> = views.iter().map(|view| view.label.clone()).collect();
    let mut joint = camera::solve_joint(&labels, options).ok()?;
    joint.photos.swap_remove(0).ok()
}
