//! All the cameras that could have taken a picture, the most probable first.

use super::model::State;
use super::problem::Problem;
use super::rectangle::Stance;
use super::refine::Minimum;

/// Normals closer than this belong to one pose.
const ONE_POSE_DEG: f64 = 1.0;

/// Another explanation counts where its chi squared is no worse, or better, by this: 1 % of two degrees of freedom.
pub(crate) const TELLING: f64 = 9.2;

/// The best camera, and the best one that stands elsewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) best: Minimum,
    pub(crate) other: Option<Minimum>,
}

impl Problem {
    /// Refines from every start and keeps what stands above the surface; none where nothing does.
    pub(crate) fn search(&self) -> Option<Found> {
        let mut minima: Vec<Minimum> = Vec::with_capacity(10);
        let mut lowest = f64::INFINITY;
        let mut try_from = |start: State| {
            let minimum = self
                .evidence
                .refine(start, lowest + TELLING)
                .filter(is_above);
            lowest = minimum.map_or(lowest, |m| lowest.min(m.cost));
            minima.extend(minimum);
        };
        for focal in self.focal_starts().into_iter().flatten() {
            let direct = self.start(focal);
            try_from(direct);
            try_from(State {
                stance: direct.stance.mirrored(focal),
                ..direct
            });
        }
        let believed = self.start(libm::exp(self.evidence.beliefs.ln_focal.mean));
        for stance in self.view.distant_stances(self.unit_size()) {
            try_from(State { stance, ..believed });
        }
        let best = *minima.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        let elsewhere = minima
            .iter()
            .filter(|m| degrees_apart(&m.state.stance, &best.state.stance) > ONE_POSE_DEG);
        Some(Found {
            best,
            other: elsewhere.min_by(|a, b| a.cost.total_cmp(&b.cost)).copied(),
        })
    }

    /// The closed form, where it stands above the surface, after at most so many steps.
    pub(crate) fn first_guess(&self, most_steps: usize) -> Option<Found> {
        let fact = self.evidence.beliefs.ln_focal.is_fact();
        let said = self.closed_form_focal().filter(|_| !fact);
        let start =
            self.start(said.unwrap_or_else(|| libm::exp(self.evidence.beliefs.ln_focal.mean)));
        let best = self
            .evidence
            .refine_for(start, f64::INFINITY, most_steps)
            .filter(is_above)?;
        Some(Found { best, other: None })
    }

    /// What is believed, what the corners say, and a short and a long lens; only the fact where there is one.
    fn focal_starts(&self) -> [Option<f64>; 4] {
        let belief = self.evidence.beliefs.ln_focal;
        let believed = libm::exp(belief.mean);
        if belief.is_fact() {
            return [Some(believed), None, None, None];
        }
        [
            Some(believed),
            self.closed_form_focal(),
            Some(believed / 2.0),
            Some(believed * 3.0),
        ]
    }
}

fn is_above(minimum: &Minimum) -> bool {
    minimum.cost.is_finite() && minimum.state.camera_center().z > 0.0
}

/// Angle between the surface normals of two poses, degrees.
pub(crate) fn degrees_apart(a: &Stance, b: &Stance) -> f64 {
    let (a, b) = (a.rotation.column(2), b.rotation.column(2));
    libm::atan2(a.cross(&b).norm(), a.dot(&b)).to_degrees()
}
