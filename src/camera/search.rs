//! All the cameras that could have taken a picture, the most probable first.

use super::chi::CHI2_99;
use super::model::State;
use super::problem::Problem;
use super::rectangle::ScaledPose;
use super::refine::Minimum;

/// Normals closer than this belong to one pose.
const ONE_POSE_DEG: f64 = 1.0;

/// The best camera, and the best one in another pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchResult {
    pub(crate) best: Minimum,
    pub(crate) other: Option<Minimum>,
}

impl Problem {
    /// Refines from every start and keeps what stands above the surface; none where nothing does.
    pub(crate) fn search(&self) -> Option<SearchResult> {
        let minima = self.minima();
        let best = lowest(minima.iter())?;
        let elsewhere = minima
            .iter()
            .filter(|m| degrees_apart(&m.state.pose, &best.state.pose) > ONE_POSE_DEG);
        Some(SearchResult {
            best,
            other: lowest(elsewhere),
        })
    }

    /// What the starts lead to, above the surface.
    fn minima(&self) -> Vec<Minimum> {
        let mut minima: Vec<Minimum> = Vec::with_capacity(10);
        let mut lowest = f64::INFINITY;
        for start in self.starts() {
            let minimum = self.residuals.refine(start, lowest + CHI2_99);
            let minimum = minimum.filter(is_above_surface);
            lowest = minimum.map_or(lowest, |m| lowest.min(m.cost));
            minima.extend(minimum);
        }
        minima
    }

    /// The closed form, where it stands above the surface, after at most `max_iterations`
    /// iterations; other poses are not searched for.
    pub(crate) fn closed_form(&self, max_iterations: usize) -> Option<SearchResult> {
        let measured = self.closed_form_focal().filter(|_| !self.has_fixed_focal());
        let start = self.start(measured.unwrap_or_else(|| self.prior_focal()));
        self.residuals
            .refine_for(start, f64::INFINITY, max_iterations)
            .filter(is_above_surface)
            .map(|best| SearchResult { best, other: None })
    }

    /// For each focal length the closed form and its mirror image; then the two poses without
    /// perspective.
    fn starts(&self) -> impl Iterator<Item = State> {
        let focals = self.focal_starts().into_iter().flatten();
        let near = focals.flat_map(|focal| {
            let direct = self.start(focal);
            let pose = direct.pose.mirrored(focal);
            [direct, State { pose, ..direct }]
        });
        let nominal = self.start(self.prior_focal());
        let distant = self.projected.distant_poses(self.unit_size());
        near.chain(distant.map(|pose| State { pose, ..nominal }))
    }

    /// The mean of the prior, what the corners give, and a short and a long lens; only the mean
    /// where it is fixed.
    fn focal_starts(&self) -> [Option<f64>; 4] {
        let prior = self.prior_focal();
        if self.has_fixed_focal() {
            return [Some(prior), None, None, None];
        }
        [
            Some(prior),
            self.closed_form_focal(),
            Some(prior / 2.0),
            Some(prior * 3.0),
        ]
    }

    fn has_fixed_focal(&self) -> bool {
        self.residuals.priors.ln_focal.is_fixed()
    }

    fn prior_focal(&self) -> f64 {
        libm::exp(self.residuals.priors.ln_focal.mean)
    }
}

fn lowest<'a>(minima: impl Iterator<Item = &'a Minimum>) -> Option<Minimum> {
    minima.min_by(|a, b| a.cost.total_cmp(&b.cost)).copied()
}

fn is_above_surface(minimum: &Minimum) -> bool {
    minimum.cost.is_finite() && minimum.state.camera_center().z > 0.0
}

/// Angle between the surface normals of two poses, degrees.
pub(crate) fn degrees_apart(a: &ScaledPose, b: &ScaledPose) -> f64 {
    let (a, b) = (a.rotation.column(2), b.rotation.column(2));
    libm::atan2(a.cross(&b).norm(), a.dot(&b)).to_degrees()
}
