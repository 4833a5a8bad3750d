//! All the cameras that could have taken a picture, the most probable first.

use super::problem::Problem;
use super::refine::Minimum;
use super::rectangle::Stance;
use super::model::State;

/// Normals closer than this belong to one pose.
const ONE_POSE_DEG: f64 = 1.0;

/// The best camera, and the best one that stands elsewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub(crate) best: Minimum,
    pub(crate) other: Option<Minimum>,
}

impl Problem {
    /// Refines from every start and keeps what stands above the surface; none where nothing does.
    pub(crate) fn search(&self) -> Option<Found> {
        let mut minima: Vec<Minimum> = Vec::with_capacity(8);
        for focal in self.focal_starts().into_iter().flatten() {
            let direct = self.start(focal);
            let mirrored = State { stance: direct.stance.mirrored(focal), ..direct };
            let found = [direct, mirrored].map(|start| self.evidence.refine(start));
            minima.extend(found.into_iter().flatten().filter(is_above));
        }
        let best = *minima.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        let elsewhere = minima.iter().filter(|m| stands_apart(&m.state.stance, &best.state.stance));
        Some(Found { best, other: elsewhere.min_by(|a, b| a.cost.total_cmp(&b.cost)).copied() })
    }

    /// What is believed, what the corners say, and a short and a long lens; only the fact where there is one.
    fn focal_starts(&self) -> [Option<f64>; 4] {
        let belief = self.evidence.beliefs.ln_focal;
        let believed = libm::exp(belief.mean);
        if belief.is_fact() {
            return [Some(believed), None, None, None];
        }
        [Some(believed), self.closed_form_focal(), Some(believed / 2.0), Some(believed * 3.0)]
    }
}

fn is_above(minimum: &Minimum) -> bool {
    minimum.cost.is_finite() && minimum.state.camera_center().z > 0.0
}

fn stands_apart(a: &Stance, b: &Stance) -> bool {
    let (a, b) = (a.rotation.column(2), b.rotation.column(2));
    libm::atan2(a.cross(&b).norm(), a.dot(&b)) > ONE_POSE_DEG.to_radians()
}
