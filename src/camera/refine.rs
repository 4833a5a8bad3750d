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
/// Part of the height above the bar that a step has to fall by.
const CREEPING: f64 = 0.01;
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
            let off = (state.project(&sight.point, sight.rigid)? - sight.seen) * sight.weight;
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
        let mut normal = Normal {
            information: Square::zeros(),
            slope: Unknowns::zeros(),
            cost: 0.0,
        };
        for sight in &self.sights {
            let (seen, slope) = state.slope(&sight.point, sight.rigid)?;
            let (off, weight) = (seen - sight.seen, sight.weight * sight.weight);
            for axis in 0..2 {
                normal.add(off[axis], &slope.column(axis).into(), weight);
            }
        }
        if let Some(height) = self.beliefs.ln_height {
            let (value, slope) = state.ln_height()?;
            normal.add(value - height.mean, &slope, height.information());
        }
        self.beliefs
            .forget_facts(&mut normal.information, &mut normal.slope);
        normal.cost += self
            .beliefs
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
    /// Only minima below `bar` are of interest: a start that is far above it and hardly falls any more is left where it is.
    /// (The mirrored start of a large rectangle creeps along a valley floor for as long as it is let.)
    pub(crate) fn refine(&self, start: State, bar: f64) -> Option<Minimum> {
        self.refine_for(start, bar, MOST_STEPS)
    }

    /// The same, leaving off after so many steps.
    pub(crate) fn refine_for(&self, start: State, bar: f64, most_steps: usize) -> Option<Minimum> {
        let (mut state, mut normal) = (start, self.normal(&start)?);
        let mut damping = DAMPING;
        let mut steps = 0;
        while steps < most_steps && damping < HOPELESS {
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
                    if fall < SMALLEST_FALL * before || fall < CREEPING * (cost - bar) {
                        break;
                    }
                }
                _ => damping *= STIFFEN,
            }
            if scaled < SMALLEST_STEP {
                break;
            }
        }
        Some(Minimum {
            state,
            cost: normal.cost,
            information: normal.information,
            steps,
        })
    }
}

impl Normal {
    /// Adds a residual with its slope and its weight, one over its variance.
    fn add(&mut self, off: f64, slope: &Unknowns, weight: f64) {
        self.information.ger(weight, slope, slope, 1.0);
        self.slope.axpy(off * weight, slope, 1.0);
        self.cost += off * off * weight;
    }

    /// The damped step, shortened where it would leap, and its length in the scale of the unknowns.
    ///
    /// Damping in proportion to the diagonal is the same as damping evenly after scaling to a unit diagonal.
    fn damped_step(&self, damping: f64) -> Option<(Unknowns, f64)> {
        let mut damped = self.information;
        for i in 0..UNKNOWNS {
            let own = damped[(i, i)];
            // An unknown without information stays where it is.
            damped[(i, i)] = if own > 0.0 {
                own * (1.0 + damping)
            } else {
                1.0
            };
        }
        let step = solve_positive(damped, -self.slope)?;
        let length = step
            .component_mul(&step)
            .dot(&self.information.diagonal())
            .sqrt();
        let bounded = [0, 1, 2, LN_SCALE, LN_FOCAL, STRETCH].map(|i| step[i].abs());
        let leap = bounded.into_iter().fold(LONGEST_STEP, f64::max);
        Some((step * (LONGEST_STEP / leap), length))
    }
}

/// Solves `a x = b` for a positive definite `a`, of which the lower half is read; none where it is not.
///
/// Cholesky's method, left-looking by columns: a quarter of the time of the general one, which the search spends here.
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
