//! The most probable camera near a first guess.
//!
//! # Method
//! Levenberg and Marquardt's damped least squares on the normal equations, scaled to a unit
//! diagonal; priors are further residuals.

use super::model::{LN_FOCAL, LN_SCALE, Observation, STRETCH, Square, State, UNKNOWNS, Unknowns};
use super::prior::ParameterPriors;

/// Damping at the start, its factor on success and on failure, and where the search is given up.
pub(super) const INITIAL_DAMPING: f64 = 1e-3;
pub(super) const DAMPING_DECREASE: f64 = 0.1;
pub(super) const DAMPING_INCREASE: f64 = 10.0;
pub(super) const MAX_DAMPING: f64 = 1e10;
/// More steps than this are never needed (10 to 30 are).
const MAX_ITERATIONS: usize = 100;
/// A relative fall of the cost, or a scaled step, below which the minimum is reached.
pub(super) const COST_TOLERANCE: f64 = 1e-12;
const STEP_TOLERANCE: f64 = 1e-10;
/// Part of the height above the bar that a step has to fall by.
const LEAST_PROGRESS: f64 = 0.01;
/// No step turns the camera, or changes a logarithm, by more than this.
const MAX_STEP: f64 = 1.0;
const LIMITED_UNKNOWNS: [usize; 6] = [0, 1, 2, LN_SCALE, LN_FOCAL, STRETCH];

/// Everything the cost is made of.
#[derive(Clone, Debug)]
pub(crate) struct Residuals {
    pub(crate) observations: Vec<Observation>,
    pub(crate) priors: ParameterPriors,
    /// Smallest and largest logarithm of the focal length to be followed.
    pub(crate) ln_focal_range: [f64; 2],
}

/// The bottom of a valley of the cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Minimum {
    pub(crate) state: State,
    /// Squared distances from all observations and priors, in sigmas: chi squared.
    pub(crate) cost: f64,
    /// Information on the unknowns there.
    pub(crate) information: Square,
    pub(crate) iterations: usize,
}

/// The cost around a state to second order.
pub(crate) struct NormalEquations {
    pub(crate) information: Square,
    /// Half the slope of the cost.
    pub(crate) slope: Unknowns,
    pub(crate) cost: f64,
}

impl Residuals {
    /// Measured numbers, priors apart.
    pub(crate) fn measurement_count(&self) -> usize {
        2 * self.observations.len() + usize::from(!self.priors.ln_height.is_flat())
    }

    /// The cost of a state; none where a point would be behind the camera.
    fn cost(&self, state: &State) -> Option<f64> {
        let mut cost = self.priors.cost(state);
        for observation in &self.observations {
            cost += observation.cost(state)?;
        }
        let height = &self.priors.ln_height;
        if !height.is_flat() {
            cost += height.cost(state.ln_height()?.0);
        }
        Some(cost)
    }

    /// The normal equations at a state; none where a point would be behind the camera.
    pub(crate) fn normal_equations(&self, state: &State) -> Option<NormalEquations> {
        let mut normal = NormalEquations::zeros();
        for observation in &self.observations {
            normal.add_observation(state, observation)?;
        }
        let height = &self.priors.ln_height;
        if !height.is_flat() {
            let (value, slope) = state.ln_height()?;
            normal.add(value - height.mean, &slope, height.information());
        }
        self.priors
            .remove_fixed(&mut normal.information, &mut normal.slope);
        normal.cost += self
            .priors
            .add_to(state, &mut normal.information, &mut normal.slope);
        Some(normal)
    }

    /// A step, kept inside the range of focal lengths.
    fn stepped(&self, state: &State, step: &Unknowns) -> State {
        let next = state.stepped(step);
        let [shortest, longest] = self.ln_focal_range;
        if (shortest..=longest).contains(&next.ln_focal) {
            return next;
        }
        next.with_ln_focal(next.ln_focal.clamp(shortest, longest))
    }

    /// Down to the nearest minimum; none where the start is impossible.
    ///
    /// Only minima below `bar` are of interest: a start that is far above it and hardly falls any
    /// more is left where it is. (The mirrored start of a large rectangle creeps along a valley
    /// floor for as long as it may.)
    pub(crate) fn refine(&self, start: State, bar: f64) -> Option<Minimum> {
        self.refine_for(start, bar, MAX_ITERATIONS)
    }

    /// The same, stopping after `max_iterations` iterations.
    pub(crate) fn refine_for(
        &self,
        start: State,
        bar: f64,
        max_iterations: usize,
    ) -> Option<Minimum> {
        let mut descent = Descent::new(self, start, bar)?;
        while descent.iterations < max_iterations && descent.damping < MAX_DAMPING {
            descent.iterations += 1;
            if descent.iterate()? {
                break;
            }
        }
        Some(descent.minimum())
    }
}

impl Observation {
    #[inline]
    fn cost(&self, state: &State) -> Option<f64> {
        let seen = state.project(&self.point, self.rigid)?;
        Some(((seen - self.seen) * self.weight).norm_squared())
    }
}

/// A descent into a valley of the cost, after some iterations.
struct Descent<'a> {
    residuals: &'a Residuals,
    bar: f64,
    state: State,
    normal: NormalEquations,
    damping: f64,
    iterations: usize,
}

impl<'a> Descent<'a> {
    fn new(residuals: &'a Residuals, start: State, bar: f64) -> Option<Self> {
        Some(Self {
            residuals,
            bar,
            state: start,
            normal: residuals.normal_equations(&start)?,
            damping: INITIAL_DAMPING,
            iterations: 0,
        })
    }

    /// What has been reached.
    fn minimum(&self) -> Minimum {
        Minimum {
            state: self.state,
            cost: self.normal.cost,
            information: self.normal.information,
            iterations: self.iterations,
        }
    }

    /// Tries a damped step, and tells whether it was the last; none where it is taken and has no
    /// normal equations.
    fn iterate(&mut self) -> Option<bool> {
        let Some((step, length)) = self.normal.damped_step(self.damping) else {
            self.damping *= DAMPING_INCREASE;
            return Some(false);
        };
        let next = self.residuals.stepped(&self.state, &step);
        let mut has_converged = length < STEP_TOLERANCE;
        // Behind the camera no cost is low enough.
        let cost = self.residuals.cost(&next).unwrap_or(f64::INFINITY);
        if cost < self.normal.cost {
            has_converged |= self.hardly_falls_to(cost);
            self.state = next;
            self.normal = self.residuals.normal_equations(&next)?;
            self.damping *= DAMPING_DECREASE;
        } else {
            self.damping *= DAMPING_INCREASE;
        }
        Some(has_converged)
    }

    /// A step to a lower cost that is not worth another.
    fn hardly_falls_to(&self, cost: f64) -> bool {
        let fall = self.normal.cost - cost;
        fall < COST_TOLERANCE * self.normal.cost || fall < LEAST_PROGRESS * (cost - self.bar)
    }
}

impl NormalEquations {
    #[inline]
    fn zeros() -> Self {
        Self {
            information: Square::zeros(),
            slope: Unknowns::zeros(),
            cost: 0.0,
        }
    }

    /// Adds both coordinates of an observation; none where its point would be behind the camera.
    fn add_observation(&mut self, state: &State, observation: &Observation) -> Option<()> {
        let (seen, slope) = state.slope(&observation.point, observation.rigid)?;
        let off = seen - observation.seen;
        let weight = observation.weight * observation.weight;
        for axis in 0..2 {
            self.add(off[axis], &slope.column(axis).into(), weight);
        }
        Some(())
    }

    /// Adds a residual with its slope and its weight, one over its variance.
    fn add(&mut self, off: f64, slope: &Unknowns, weight: f64) {
        self.information.ger(weight, slope, slope, 1.0);
        self.slope.axpy(off * weight, slope, 1.0);
        self.cost += off * off * weight;
    }

    /// The damped step, shortened where it would leap, and its length in the scale of the unknowns.
    ///
    /// Damping in proportion to the diagonal is the same as damping evenly after scaling to a unit
    /// diagonal.
    fn damped_step(&self, damping: f64) -> Option<(Unknowns, f64)> {
        let step = solve_positive(self.damped_information(damping), -self.slope)?;
        let squares = step.component_mul(&step);
        let length = squares.dot(&self.information.diagonal()).sqrt();
        Some((step * (MAX_STEP / leap(&step)), length))
    }

    /// An unknown without information stays where it is.
    #[inline]
    fn damped_information(&self, damping: f64) -> Square {
        let mut damped = self.information;
        for i in 0..UNKNOWNS {
            let own = damped[(i, i)];
            damped[(i, i)] = if own > 0.0 {
                own * (1.0 + damping)
            } else {
                1.0
            };
        }
        damped
    }
}

/// The largest change of an unknown of limited step, no less than the limit.
fn leap(step: &Unknowns) -> f64 {
    LIMITED_UNKNOWNS
        .into_iter()
        .map(|i| step[i].abs())
        .fold(MAX_STEP, f64::max)
}

/// Solves `a x = b` for a positive definite `a`, of which the lower half is read; none where it is
/// not.
///
/// Cholesky's method, left-looking by columns: a quarter of the time of the general one, and the
/// search spends most of its time here; so it stays in one piece.
fn solve_positive(a: Square, b: Unknowns) -> Option<Unknowns> {
    let (mut l, mut x) = (a.data.0, b.data.0[0]);
    for j in 0..UNKNOWNS {
        let (done, rest) = l.split_at_mut(j);
        let column = &mut rest[0];
        for before in &*done {
            let factor = before[j];
            for i in j..UNKNOWNS {
                column[i] -= before[i] * factor;
            }
        }
        if column[j].is_nan() || column[j] <= 0.0 {
            return None;
        }
        let root = 1.0 / column[j].sqrt();
        for value in &mut column[j..] {
            *value *= root;
        }
        x[j] /= column[j];
        for i in j + 1..UNKNOWNS {
            x[i] -= column[i] * x[j];
        }
    }
    for j in (0..UNKNOWNS).rev() {
        for i in j + 1..UNKNOWNS {
            x[j] -= l[j][i] * x[i];
        }
        x[j] /= l[j][j];
    }
    Some(x.into())
}

/// What each unknown has to be divided by for its own information to be 1; 1 where there is none.
pub(crate) fn unit_diagonal(information: &Square) -> Unknowns {
    information
        .diagonal()
        .map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_positive_system_is_solved_and_another_refused() {
        let root = Square::from_fn(|i, j| {
            libm::sin((3 * i + 7 * j) as f64) + if i == j { 4.0 } else { 0.0 }
        });
        let (a, x) = (
            root * root.transpose(),
            Unknowns::from_fn(|i, _| i as f64 - 3.0),
        );
        assert!((solve_positive(a, a * x).unwrap() - x).norm() < 1e-12);
        assert_eq!(solve_positive(-a, x), None);
        assert_eq!(solve_positive(a * f64::NAN, x), None);
    }
}
