//! Priors: what is known about the unknowns before the picture is measured, a mean and a standard
//! deviation each.

use super::model::{KAPPA, LN_FOCAL, PRINCIPAL, STRETCH, Square, State, Unknowns, clear_unknown};

/// A normal distribution; a zero standard deviation fixes its unknown, an infinite one makes the
/// prior flat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    pub(crate) mean: f64,
    pub(crate) sigma: f64,
}

impl Prior {
    /// Nothing is known.
    pub(crate) const FLAT: Self = Self::at_zero(f64::INFINITY);

    /// Around zero.
    pub(crate) const fn at_zero(sigma: f64) -> Self {
        Self { mean: 0.0, sigma }
    }

    /// Exactly known.
    pub(crate) const fn fixed(mean: f64) -> Self {
        Self { mean, sigma: 0.0 }
    }

    pub(crate) fn is_fixed(&self) -> bool {
        self.sigma == 0.0
    }

    pub(crate) fn is_flat(&self) -> bool {
        self.sigma.is_infinite()
    }

    /// One over the variance: what it adds to the information on its unknown. None for a fixed one,
    /// which is no unknown.
    pub(crate) fn information(&self) -> f64 {
        if self.is_fixed() {
            0.0
        } else {
            1.0 / (self.sigma * self.sigma)
        }
    }

    /// Squared distance of a value from the mean, in standard deviations.
    pub(crate) fn cost(&self, value: f64) -> f64 {
        (value - self.mean) * (value - self.mean) * self.information()
    }
}

/// Priors of the unknowns that have one; that of the principal point is centred on the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParameterPriors {
    pub(crate) ln_focal: Prior,
    pub(crate) stretch_sigma: f64,
    pub(crate) principal_sigma: f64,
    pub(crate) kappa: Prior,
    /// Logarithm of the camera's height above the surface.
    pub(crate) ln_height: Prior,
}

impl ParameterPriors {
    /// Nothing is known but perhaps the height.
    pub(crate) fn only_height(ln_height: Prior) -> Self {
        Self {
            ln_focal: Prior::FLAT,
            stretch_sigma: f64::INFINITY,
            principal_sigma: f64::INFINITY,
            kappa: Prior::FLAT,
            ln_height,
        }
    }

    /// Takes the lens and the sides as exactly known.
    pub(crate) fn fix_lens(&mut self, ln_focal: f64) {
        self.ln_focal = Prior::fixed(ln_focal);
        self.principal_sigma = 0.0;
        self.stretch_sigma = 0.0;
        self.kappa.sigma = 0.0;
    }
    /// Index and prior of each unknown that has one.
    fn by_unknown(&self) -> [(usize, Prior); 5] {
        [
            (LN_FOCAL, self.ln_focal),
            (STRETCH, Prior::at_zero(self.stretch_sigma)),
            (PRINCIPAL, Prior::at_zero(self.principal_sigma)),
            (PRINCIPAL + 1, Prior::at_zero(self.principal_sigma)),
            (KAPPA, self.kappa),
        ]
    }

    /// Takes the fixed unknowns out of the normal equations.
    pub(crate) fn remove_fixed(&self, information: &mut Square, slope: &mut Unknowns) {
        for (i, prior) in self.by_unknown() {
            if prior.is_fixed() {
                clear_unknown(information, i);
                slope[i] = 0.0;
            }
        }
    }

    /// Number of unknowns with a flat prior, beyond the six of the pose.
    pub(crate) fn flat_count(&self) -> usize {
        self.by_unknown()
            .iter()
            .filter(|(_, p)| p.is_flat())
            .count()
    }

    /// Adds to the normal equations: information, and half the slope of the cost. Returns the cost.
    pub(crate) fn add_to(
        &self,
        state: &State,
        information: &mut Square,
        slope: &mut Unknowns,
    ) -> f64 {
        let mut cost = 0.0;
        for (i, prior) in self.by_unknown() {
            let value = state.value(i);
            information[(i, i)] += prior.information();
            slope[i] += (value - prior.mean) * prior.information();
            cost += prior.cost(value);
        }
        cost
    }

    /// The sum of the squared distances from the means.
    pub(crate) fn cost(&self, state: &State) -> f64 {
        self.by_unknown()
            .iter()
            .map(|(i, prior)| prior.cost(state.value(*i)))
            .sum()
    }
}
