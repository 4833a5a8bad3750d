//! Photos of one camera as one least squares problem.
//!
//! # Method
//! Damped least squares on an arrow-shaped system: the six unknowns of each pose are coupled only to the shared ones, so
//! each photo is eliminated on its own (Schur complement) and what remains is small. The priors of the lens count once.

use super::error::SolveError;
use super::label::{Framing, Label};
use super::model::{KAPPA, LN_FOCAL, PRINCIPAL, STRETCH, State, UNKNOWNS, Unknowns};
use super::options::SolveOptions;
use super::prior::{ParameterPriors, Prior};
use super::problem::Problem;
use super::refine::{Minimum, NormalEquations, Residuals};
use super::solution::Solution;
use super::uncertainty::{Uncertainty, focal_share};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector6};

/// Number of unknowns of a pose.
const POSE_UNKNOWNS: usize = 6;
/// The unknowns of the lens, in the order of the shared system's first columns.
const LENS_UNKNOWNS: [usize; 4] = [LN_FOCAL, PRINCIPAL, PRINCIPAL + 1, KAPPA];
const MAX_ITERATIONS: usize = 60;
/// Damping at the start, its factor on success and on failure, and where the search is given up.
const INITIAL_DAMPING: f64 = 1e-3;
const DAMPING_DECREASE: f64 = 0.1;
const DAMPING_INCREASE: f64 = 10.0;
const MAX_DAMPING: f64 = 1e10;
/// A relative fall of the cost below which the minimum is reached.
const COST_TOLERANCE: f64 = 1e-12;

const _: () = assert!(POSE_UNKNOWNS + LENS_UNKNOWNS.len() + 1 == UNKNOWNS);

/// The photos of one camera as one problem.
pub(crate) struct Bundle {
    problems: Vec<Problem>,
    /// Those of each photo, with flat priors of what is shared.
    residuals: Vec<Residuals>,
    /// Which of the surfaces each photo shows.
    surface: Vec<usize>,
    /// Priors of the lens and then of each surface's stretch.
    shared: Vec<Prior>,
}

/// The cost around the states of all photos, to second order.
pub(crate) struct BundleEquations {
    pub(crate) states: Vec<State>,
    pub(crate) cost: f64,
    /// Of each photo's own observations.
    pub(crate) chi2: Vec<f64>,
    normals: Vec<NormalEquations>,
}

/// The normal equations of the shared unknowns after every pose has been eliminated.
struct ReducedSystem {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    photos: Vec<PhotoBlock>,
}

/// One photo's part of the normal equations.
struct PhotoBlock {
    pose: Matrix6<f64>,
    pose_right: Vector6<f64>,
    /// Pose by shared unknowns.
    coupling: Matrix6xX<f64>,
    own: DMatrix<f64>,
    own_right: DVector<f64>,
}

impl Bundle {
    /// Of the labels that are used; pictures of unknown framing are treated as pictures of this one.
    pub(crate) fn new(
        labels: &[Label],
        used: &[usize],
        unknown: Framing,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        let problems = used
            .iter()
            .map(|&i| {
                let known = Some(labels[i].framing()).filter(|f| *f != Framing::Unknown);
                Problem::new(&labels[i], known.unwrap_or(unknown), options)
            })
            .collect::<Result<Vec<_>, _>>()?;
        let surface = surfaces_shown(used.iter().map(|&i| &labels[i]).zip(&problems));
        Ok(Self {
            residuals: problems.iter().map(without_shared_priors).collect(),
            shared: shared_priors(&problems, &surface).ok_or(SolveError::NoCorners)?,
            surface,
            problems,
        })
    }

    /// The lower of the minima from the photos' own focal lengths and from the prior.
    pub(crate) fn best(&self, alone: &[Result<Solution, SolveError>]) -> Option<BundleEquations> {
        let prior = self.shared[0];
        let measured = mean_ln_focal(alone, self.problems[0].units.unit_px);
        [Some(prior.mean), measured.filter(|_| !prior.is_fixed())]
            .into_iter()
            .flatten()
            .filter_map(|ln_focal| self.refine(self.posed(ln_focal)?))
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Every photo's best pose for a focal length, the lens otherwise as its priors have it.
    fn posed(&self, ln_focal: f64) -> Option<Vec<State>> {
        self.problems
            .iter()
            .map(|problem| {
                let mut problem = problem.clone();
                let priors = &mut problem.residuals.priors;
                priors.ln_focal = Prior::fixed(ln_focal);
                priors.principal_sigma = 0.0;
                priors.stretch_sigma = 0.0;
                priors.kappa.sigma = 0.0;
                Some(problem.search()?.best.state)
            })
            .collect()
    }

    /// The column of the shared system for each unknown of a photo from [`LN_FOCAL`] on.
    fn columns(&self, photo: usize) -> [(usize, usize); 5] {
        let [f, x, y, k] = LENS_UNKNOWNS;
        let stretch = LENS_UNKNOWNS.len() + self.surface[photo];
        [(f, 0), (x, 1), (y, 2), (k, 3), (STRETCH, stretch)]
    }

    fn shared_values(&self, states: &[State]) -> DVector<f64> {
        let mut values = DVector::zeros(self.shared.len());
        for (photo, state) in states.iter().enumerate() {
            for (unknown, column) in self.columns(photo) {
                values[column] = state.value(unknown);
            }
        }
        values
    }

    /// The cost around the states to second order; none where a point would be behind its camera.
    fn linearized(&self, states: Vec<State>) -> Option<BundleEquations> {
        let normals = self
            .residuals
            .iter()
            .zip(&states)
            .map(|(residuals, state)| residuals.normal_equations(state))
            .collect::<Option<Vec<_>>>()?;
        let chi2: Vec<f64> = normals.iter().map(|n| n.cost).collect();
        let values = self.shared_values(&states);
        let shared = self.shared.iter().zip(values.iter());
        let prior_cost: f64 = shared.map(|(prior, &value)| prior.cost(value)).sum();
        Some(BundleEquations {
            cost: chi2.iter().sum::<f64>() + prior_cost,
            states,
            chi2,
            normals,
        })
    }

    fn refine(&self, states: Vec<State>) -> Option<BundleEquations> {
        let mut equations = self.linearized(states)?;
        let mut damping = INITIAL_DAMPING;
        for _ in 0..MAX_ITERATIONS {
            let next = self
                .stepped(&equations, damping)
                .and_then(|states| self.linearized(states));
            match next.filter(|next| next.cost < equations.cost) {
                Some(next) => {
                    let fall = (equations.cost - next.cost) / equations.cost;
                    equations = next;
                    damping *= DAMPING_DECREASE;
                    if fall < COST_TOLERANCE {
                        break;
                    }
                }
                None => damping *= DAMPING_INCREASE,
            }
            if damping > MAX_DAMPING {
                break;
            }
        }
        Some(equations)
    }

    /// All states after a damped step.
    fn stepped(&self, equations: &BundleEquations, damping: f64) -> Option<Vec<State>> {
        let ReducedSystem {
            matrix,
            right,
            photos,
        } = self.reduced(equations, damping)?;
        let shared = matrix.cholesky()?.solve(&right);
        let limit = shared.amax().max(1.0);
        let shared = shared / limit;
        photos
            .iter()
            .enumerate()
            .map(|(index, photo)| {
                let pose = photo.pose_step(&shared, damping)?;
                let mut step = Unknowns::zeros();
                step.fixed_rows_mut::<POSE_UNKNOWNS>(0).copy_from(&pose);
                for (unknown, column) in self.columns(index) {
                    step[unknown] = shared[column];
                }
                Some(equations.states[index].stepped(&step))
            })
            .collect()
    }

    /// The shared system after every pose has been eliminated.
    fn reduced(&self, equations: &BundleEquations, damping: f64) -> Option<ReducedSystem> {
        let (mut matrix, mut right) = self.prior_system(&equations.states);
        let photos: Vec<PhotoBlock> = (0..equations.normals.len())
            .map(|photo| self.photo_block(equations, photo))
            .collect();
        for photo in &photos {
            matrix += &photo.own;
            right += &photo.own_right;
        }
        for i in 0..self.shared.len() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        for photo in &photos {
            let inverse = photo.inverse_pose(damping)?;
            matrix -= photo.coupling.transpose() * inverse * &photo.coupling;
            right -= photo.coupling.transpose() * (inverse * photo.pose_right);
        }
        self.hold_unconstrained(&mut matrix, &mut right);
        Some(ReducedSystem {
            matrix,
            right,
            photos,
        })
    }

    /// The part of the shared system that comes from the priors.
    fn prior_system(&self, states: &[State]) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.shared.len();
        let (mut matrix, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let values = self.shared_values(states);
        for (i, prior) in self.shared.iter().enumerate() {
            matrix[(i, i)] += prior.information();
            right[i] -= (values[i] - prior.mean) * prior.information();
        }
        (matrix, right)
    }

    /// Keeps what is fixed, or what nothing constrains, where it is.
    fn hold_unconstrained(&self, matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        for (i, prior) in self.shared.iter().enumerate() {
            if prior.is_fixed() || matrix[(i, i)] <= 0.0 {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
                (matrix[(i, i)], right[i]) = (1.0, 0.0);
            }
        }
    }

    /// A photo's part of the normal equations, by pose and by what is shared.
    fn photo_block(&self, equations: &BundleEquations, index: usize) -> PhotoBlock {
        let (normal, count) = (&equations.normals[index], self.shared.len());
        let information = &normal.information;
        let mut block = PhotoBlock {
            pose: information
                .fixed_view::<POSE_UNKNOWNS, POSE_UNKNOWNS>(0, 0)
                .into(),
            pose_right: -Vector6::from(normal.slope.fixed_rows::<POSE_UNKNOWNS>(0)),
            coupling: Matrix6xX::zeros(count),
            own: DMatrix::zeros(count, count),
            own_right: DVector::zeros(count),
        };
        for (unknown, column) in self.columns(index) {
            let coupling = information.fixed_view::<POSE_UNKNOWNS, 1>(0, unknown);
            block.coupling.set_column(column, &coupling);
            block.own_right[column] -= normal.slope[unknown];
            for (other, other_column) in self.columns(index) {
                block.own[(column, other_column)] += information[(unknown, other)];
            }
        }
        block
    }

    /// Every photo's solution, with the covariance that the others give it.
    pub(crate) fn solutions(
        &self,
        equations: &BundleEquations,
        options: &SolveOptions,
    ) -> Vec<Solution> {
        let shared = self.shared_covariance(equations);
        self.problems
            .iter()
            .enumerate()
            .map(|(index, problem)| {
                let minimum = equations.minimum(index);
                let mut uncertainty = Uncertainty::new(&minimum, self.shared[0]);
                if let Some((covariance, photos)) = &shared {
                    self.fill_covariance(&mut uncertainty, covariance, &photos[index], index);
                    let information = inverse_or_zero(covariance[(0, 0)]);
                    let ln_focal = minimum.state.ln_focal;
                    uncertainty.focal = focal_share(ln_focal, information, self.shared[0]);
                }
                let mut with_shared_prior = problem.clone();
                with_shared_prior.residuals.priors.ln_focal = self.shared[0];
                with_shared_prior.solution_with(&minimum, &uncertainty, options)
            })
            .collect()
    }

    /// Covariance of the shared unknowns, and the photos' blocks it comes from.
    fn shared_covariance(
        &self,
        equations: &BundleEquations,
    ) -> Option<(DMatrix<f64>, Vec<PhotoBlock>)> {
        let ReducedSystem { matrix, photos, .. } = self.reduced(equations, 0.0)?;
        let mut covariance = matrix.cholesky()?.inverse();
        for i in (0..self.shared.len()).filter(|&i| self.shared[i].is_fixed()) {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        Some((covariance, photos))
    }

    /// A photo's covariance, from that of the shared unknowns and its own block.
    fn fill_covariance(
        &self,
        uncertainty: &mut Uncertainty,
        shared: &DMatrix<f64>,
        photo: &PhotoBlock,
        index: usize,
    ) {
        let Some(inverse) = photo.inverse_pose(0.0) else {
            return;
        };
        let response = -(inverse * &photo.coupling);
        let cross = &response * shared;
        let pose = inverse + &cross * response.transpose();
        let covariance = &mut uncertainty.covariance;
        covariance.fill(0.0);
        covariance
            .fixed_view_mut::<POSE_UNKNOWNS, POSE_UNKNOWNS>(0, 0)
            .copy_from(&pose);
        let columns = self.columns(index);
        for (unknown, column) in columns {
            for row in 0..POSE_UNKNOWNS {
                covariance[(row, unknown)] = cross[(row, column)];
                covariance[(unknown, row)] = cross[(row, column)];
            }
            for (other, other_column) in columns {
                covariance[(unknown, other)] = shared[(column, other_column)];
            }
        }
    }
}

impl BundleEquations {
    /// One photo's share, as if it had been solved alone.
    fn minimum(&self, photo: usize) -> Minimum {
        Minimum {
            state: self.states[photo],
            cost: self.chi2[photo],
            information: self.normals[photo].information,
            iterations: MAX_ITERATIONS,
        }
    }
}

impl PhotoBlock {
    /// Inverse of the pose's block, damped in proportion to its diagonal.
    fn inverse_pose(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut pose = self.pose;
        for i in 0..POSE_UNKNOWNS {
            pose[(i, i)] *= 1.0 + damping;
        }
        Some(pose.cholesky()?.inverse())
    }

    /// The step of the pose that goes with one of the shared unknowns, shortened where it would leap.
    fn pose_step(&self, shared: &DVector<f64>, damping: f64) -> Option<Vector6<f64>> {
        let pose = self.inverse_pose(damping)? * (self.pose_right - &self.coupling * shared);
        Some(pose / pose.amax().max(1.0))
    }
}

/// Which of their surfaces each photo shows; those of one name and size are one, unnamed ones stand alone.
fn surfaces_shown<'a>(photos: impl Iterator<Item = (&'a Label, &'a Problem)>) -> Vec<usize> {
    let mut surfaces: Vec<(&str, [f64; 2])> = Vec::new();
    photos
        .map(|(label, problem)| {
            let surface = (label.surface.id.as_str(), problem.size);
            let known = surfaces
                .iter()
                .position(|s| *s == surface && !surface.0.is_empty());
            known.unwrap_or_else(|| {
                surfaces.push(surface);
                surfaces.len() - 1
            })
        })
        .collect()
}

/// Priors of the lens, by the photo that knows most of its focal length, and of each surface's stretch.
fn shared_priors(problems: &[Problem], surface: &[usize]) -> Option<Vec<Prior>> {
    let best_known = problems.iter().min_by(|a, b| {
        let [a, b] = [a, b].map(|problem| problem.residuals.priors.ln_focal.sigma);
        a.total_cmp(&b)
    })?;
    let lens = best_known.residuals.priors;
    let principal = Prior::at_zero(lens.principal_sigma);
    let mut shared = vec![lens.ln_focal, principal, principal, lens.kappa];
    for s in 0..surface.iter().max().map_or(0, |last| last + 1) {
        let shown = surface.iter().position(|&x| x == s).unwrap_or(0);
        let stretch_sigma = problems[shown].residuals.priors.stretch_sigma;
        shared.push(Prior::at_zero(stretch_sigma));
    }
    Some(shared)
}

/// What a photo shows, with flat priors of what is shared.
fn without_shared_priors(problem: &Problem) -> Residuals {
    let residuals = &problem.residuals;
    Residuals {
        priors: ParameterPriors {
            ln_focal: Prior::FLAT,
            stretch_sigma: f64::INFINITY,
            principal_sigma: f64::INFINITY,
            kappa: Prior::FLAT,
            ln_height: residuals.priors.ln_height,
        },
        ..residuals.clone()
    }
}

/// Weighted mean of what the photos alone give for the logarithm of the focal length, in units; none where none gives it.
fn mean_ln_focal(alone: &[Result<Solution, SolveError>], unit_px: f64) -> Option<f64> {
    let mut sums = (0.0, 0.0);
    for solution in alone.iter().flatten() {
        if let (Some(px), sigma) = (solution.focal.from_data_px, solution.sigma.ln_focal) {
            let weight = solution.focal.share / (sigma * sigma);
            if weight.is_finite() {
                sums = (sums.0 + weight, sums.1 + weight * libm::log(px / unit_px));
            }
        }
    }
    (sums.0 > 0.0).then(|| sums.1 / sums.0)
}

fn inverse_or_zero(variance: f64) -> f64 {
    if variance > 0.0 { 1.0 / variance } else { 0.0 }
}
