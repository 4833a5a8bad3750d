//! What is believed before the picture is looked at: a mean and a standard deviation per unknown.

use super::model::{KAPPA, LN_FOCAL, PRINCIPAL, STRETCH, Square, State, Unknowns};

/// A normal distribution; without width it is a fact, with infinite width it says nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Belief {
    pub(crate) mean: f64,
    pub(crate) sigma: f64,
}

impl Belief {
    pub(crate) fn is_fact(&self) -> bool {
        self.sigma == 0.0
    }

    pub(crate) fn says_nothing(&self) -> bool {
        self.sigma.is_infinite()
    }

    /// One over the variance: what it adds to the information on its unknown.
    pub(crate) fn information(&self) -> f64 {
        if self.is_fact() {
            0.0
        } else {
            1.0 / (self.sigma * self.sigma)
        }
    }
}

/// Beliefs on the unknowns that have any; the principal point is believed to be at the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beliefs {
    pub(crate) ln_focal: Belief,
    pub(crate) stretch_sigma: f64,
    pub(crate) principal_sigma: f64,
    pub(crate) kappa: Belief,
    /// Logarithm of the camera's height over the surface.
    pub(crate) ln_height: Option<Belief>,
}

impl Beliefs {
    /// Each unknown with a belief: its index and what is believed.
    fn each(&self) -> [(usize, Belief); 5] {
        let at_zero = |sigma| Belief { mean: 0.0, sigma };
        [
            (LN_FOCAL, self.ln_focal),
            (STRETCH, at_zero(self.stretch_sigma)),
            (PRINCIPAL, at_zero(self.principal_sigma)),
            (PRINCIPAL + 1, at_zero(self.principal_sigma)),
            (KAPPA, self.kappa),
        ]
    }

    /// Takes the unknowns that may not move out of the normal equations.
    pub(crate) fn forget_facts(&self, information: &mut Square, slope: &mut Unknowns) {
        for (i, belief) in self.each() {
            if belief.is_fact() {
                information.row_mut(i).fill(0.0);
                information.column_mut(i).fill(0.0);
                slope[i] = 0.0;
            }
        }
    }

    /// Number of unknowns of which nothing is believed, beyond the six of the pose.
    pub(crate) fn unknown(&self) -> usize {
        self.each().iter().filter(|(_, b)| b.says_nothing()).count()
    }

    /// Adds to the normal equations: information, and half the slope of the cost. Returns the cost, the sum of the squared
    /// distances from what is believed.
    pub(crate) fn add_to(
        &self,
        state: &State,
        information: &mut Square,
        slope: &mut Unknowns,
    ) -> f64 {
        let mut cost = 0.0;
        for (i, belief) in self.each() {
            let off = state.value(i) - belief.mean;
            information[(i, i)] += belief.information();
            slope[i] += off * belief.information();
            cost += off * off * belief.information();
        }
        cost
    }

    /// The sum of the squared distances from what is believed.
    pub(crate) fn cost(&self, state: &State) -> f64 {
        let off = |(i, b): &(usize, Belief)| {
            (state.value(*i) - b.mean) * (state.value(*i) - b.mean) * b.information()
        };
        self.each().iter().map(off).sum()
    }
}
