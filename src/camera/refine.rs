//! The most probable camera near a first guess.
//!
//! # Method
//! Levenberg and Marquardt's damped least squares on the normal equations, scaled to a unit diagonal; beliefs are further
//! residuals.

use super::belief::Beliefs;
use super::model::{LN_FOCAL, LN_SCALE, STRETCH, Sight, Square, State, UNKNOWNS, Unknowns};

/// Damping at the start, its factor on success and on failure, and where it is hopeless.
const DAMPING: f64 = 1e-3;
const RELAX: f64 = 0.1;
const STIFFEN: f64 = 10.0;
const HOPELESS: f64 = 1e10;
/// More steps than this are never needed (10 to 30 are).
const MOST_STEPS: usize = 100;
/// A relative fall of the cost, or a scaled step, below which the minimum is reached.
const SMALLEST_FALL: f64 = 1e-12;
const SMALLEST_STEP: f64 = 1e-10;
/// No step turns the camera, or changes a logarithm, by more than this.
const LONGEST_STEP: f64 = 1.0;

/// Everything the cost is made of.
#[derive(Clone, Debug)]
pub(crate) struct Evidence {
    pub(crate) sights: Vec<Sight>,
    pub(crate) beliefs: Beliefs,
    /// Smallest and largest logarithm of the focal length to be followed.
    pub(crate) ln_focal_range: [f64; 2],
}

/// The bottom of a valley of the cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Minimum {
    pub(crate) state: State,
    /// Squared distances from everything seen and believed, in sigmas: chi squared.
    pub(crate) cost: f64,
    /// Information on the unknowns there.
    pub(crate) information: Square,
    pub(crate) steps: usize,
}

/// The cost around a state to second order.
pub(crate) struct Normal {
    pub(crate) information: Square,
    /// Half the slope of the cost.
    pub(crate) slope: Unknowns,
    pub(crate) cost: f64,
}

impl Evidence {
    /// The cost of a state; none where a point would be behind the camera.
    fn cost(&self, state: &State) -> Option<f64> {
        let mut cost = self.beliefs.cost(state);
        for sight in &self.sights {
            let off = (state.project(&sight.point, sight.elastic)? - sight.seen) * sight.weight;
            cost += off.norm_squared();
        }
        if let Some(height) = self.beliefs.ln_height {
            let off = state.ln_height()?.0 - height.mean;
            cost += off * off * height.information();
        }
        Some(cost)
    }

    /// The normal equations at a state; none where a point would be behind the camera.
    pub(crate) fn normal(&self, state: &State) -> Option<Normal> {
        let (mut information, mut slope) = (Square::zeros(), Unknowns::zeros());
        let mut cost = self.beliefs.add_to(state, &mut information, &mut slope);
        for sight in &self.sights {
            let (seen, jacobian) = state.slope(&sight.point, sight.elastic)?;
            let (off, jacobian) = ((seen - sight.seen) * sight.weight, jacobian * sight.weight);
            information += jacobian.transpose() * jacobian;
            slope += jacobian.transpose() * off;
            cost += off.norm_squared();
        }
        if let Some(height) = self.beliefs.ln_height {
            let (value, jacobian) = state.ln_height()?;
            let off = value - height.mean;
            information += jacobian * jacobian.transpose() * height.information();
            slope += jacobian * (off * height.information());
            cost += off * off * height.information();
        }
        for i in (0..UNKNOWNS).filter(|&i| !self.beliefs.free()[i]) {
            information.row_mut(i).fill(0.0);
            information.column_mut(i).fill(0.0);
            slope[i] = 0.0;
        }
        Some(Normal { information, slope, cost })
    }

    /// A step, kept inside the range of focal lengths.
    fn stepped(&self, state: &State, step: &Unknowns) -> State {
        let mut next = state.stepped(step);
        let [shortest, longest] = self.ln_focal_range;
        next.ln_focal = next.ln_focal.clamp(shortest, longest);
        next
    }

    /// Down to the nearest minimum; none where the start is impossible.
    pub(crate) fn refine(&self, start: State) -> Option<Minimum> {
        let (mut state, mut normal) = (start, self.normal(&start)?);
        let mut damping = DAMPING;
        let mut steps = 0;
        while steps < MOST_STEPS && damping < HOPELESS {
            steps += 1;
            let Some((step, scaled)) = normal.damped_step(damping) else {
                damping *= STIFFEN;
                continue;
            };
            let next = self.stepped(&state, &step);
            match self.cost(&next) {
                Some(cost) if cost < normal.cost => {
                    let fall = normal.cost - cost;
                    let before = normal.cost;
                    (state, normal) = (next, self.normal(&next)?);
                    damping *= RELAX;
                    if fall < SMALLEST_FALL * before {
                        break;
                    }
                }
                _ => damping *= STIFFEN,
            }
            if scaled < SMALLEST_STEP {
                break;
            }
        }
        Some(Minimum { state, cost: normal.cost, information: normal.information, steps })
    }
}

impl Normal {
    /// The damped step, shortened where it would leap, and its length in the scale of the unknowns.
    fn damped_step(&self, damping: f64) -> Option<(Unknowns, f64)> {
        let scale = unit_diagonal(&self.information);
        let scaled = Square::from_fn(|i, j| {
            let entry = self.information[(i, j)] * scale[i] * scale[j];
            // An unknown without information stays where it is.
            if i == j { entry.max(1.0) + damping } else { entry }
        });
        let y = scaled.cholesky()?.solve(&-self.slope.component_mul(&scale));
        let step = y.component_mul(&scale);
        let bounded = [0, 1, 2, LN_SCALE, LN_FOCAL, STRETCH].map(|i| step[i].abs());
        let leap = bounded.into_iter().fold(LONGEST_STEP, f64::max);
        Some((step * (LONGEST_STEP / leap), y.norm()))
    }
}

/// What each unknown has to be divided by for its own information to be 1; 1 where there is none.
pub(crate) fn unit_diagonal(information: &Square) -> Unknowns {
    information.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 })
}
