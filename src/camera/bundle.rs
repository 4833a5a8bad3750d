//! Photos of one camera as one least squares problem.
//!
//! # Method
//! Damped least squares on an arrow-shaped system: the six unknowns of each pose are coupled only
//! to the shared ones, so each photo is eliminated on its own (Schur complement) and what remains
//! is small. The priors of the lens count once.

use super::error::SolveError;
use super::label::{Framing, Label};
use super::model::{KAPPA, LN_FOCAL, PRINCIPAL, STRETCH, Square, State, UNKNOWNS, Unknowns};
use super::options::SolveOptions;
use super::prior::{ParameterPriors, Prior};
use super::problem::Problem;
use super::refine::{COST_TOLERANCE, DAMPING_DECREASE, DAMPING_INCREASE, INITIAL_DAMPING};
use super::refine::{MAX_DAMPING, Minimum, NormalEquations, Residuals};
use super::solution::Solution;
use super::solve::FocalConflict;
use super::uncertainty::{FocalShare, Uncertainty, focal_share};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector6};

/// Number of unknowns of a pose.
const POSE_UNKNOWNS: usize = 6;
/// The unknowns of the lens, in the order of the shared system's first columns.
const LENS_UNKNOWNS: [usize; 4] = [LN_FOCAL, PRINCIPAL, PRINCIPAL + 1, KAPPA];
const MAX_ITERATIONS: usize = 60;

const _: () = assert!(POSE_UNKNOWNS + LENS_UNKNOWNS.len() + 1 == UNKNOWNS);

/// The photos of one camera as one problem.
pub(crate) struct Bundle {
    /// All with the priors of one lens.
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
    /// After how many iterations.
    iterations: usize,
}

/// The normal equations of the shared unknowns.
struct SharedSystem {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

/// The shared system after every pose has been eliminated, and the blocks that were.
struct ReducedSystem {
    shared: SharedSystem,
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
    /// For the labels that are used; pictures of unknown framing are treated as having this one.
    pub(crate) fn new(
        labels: &[Label],
        used: &[usize],
        unknown: Framing,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        let labels: Vec<&Label> = used.iter().map(|&i| &labels[i]).collect();
        let problems = labels
            .iter()
            .map(|label| Problem::new(label, framing_or(label, unknown), options))
            .collect::<Result<Vec<_>, _>>()?;
        let surface = surfaces_shown(labels.into_iter().zip(&problems));
        Self::from_problems(problems, surface)
    }

    fn from_problems(mut problems: Vec<Problem>, surface: Vec<usize>) -> Result<Self, SolveError> {
        share_lens(&mut problems);
        Ok(Self {
            residuals: problems.iter().map(without_shared_priors).collect(),
            shared: shared_priors(&problems, &surface).ok_or(SolveError::NoCorners)?,
            surface,
            problems,
        })
    }

    /// Prior of the logarithm of the focal length.
    fn focal_prior(&self) -> Prior {
        self.shared[0]
    }

    /// Where what the photos give for the focal length contradicts its prior.
    pub(super) fn focal_conflict(&self, equations: &BundleEquations) -> Option<FocalConflict> {
        let (covariance, _) = self.shared_covariance(equations)?;
        let focal = self.focal_share(&equations.states[0], &covariance);
        FocalConflict::new(&self.problems[0], &focal)
    }

    fn focal_share(&self, state: &State, covariance: &DMatrix<f64>) -> FocalShare {
        let variance = covariance[(0, 0)];
        let information = if variance > 0.0 { 1.0 / variance } else { 0.0 };
        focal_share(state.ln_focal, information, self.focal_prior())
    }

    /// The lower of the minima from the photos' own focal lengths and from the prior.
    pub(crate) fn best(&self, alone: &[Result<Solution, SolveError>]) -> Option<BundleEquations> {
        self.ln_focal_starts(alone)
            .filter_map(|ln_focal| self.refine(self.posed(ln_focal)?))
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Logarithms of the focal length from which to refine.
    fn ln_focal_starts(&self, alone: &[Result<Solution, SolveError>]) -> impl Iterator<Item = f64> {
        let prior = self.focal_prior();
        let measured = mean_ln_focal(alone, self.problems[0].units.unit_px);
        [Some(prior.mean), measured.filter(|_| !prior.is_fixed())]
            .into_iter()
            .flatten()
    }

    /// Every photo's best pose for a focal length, the lens otherwise as its priors have it.
    fn posed(&self, ln_focal: f64) -> Option<Vec<State>> {
        self.problems
            .iter()
            .map(|problem| {
                let mut posed = problem.clone();
                posed.residuals.priors.fix_lens(ln_focal);
                Some(posed.search()?.best.state)
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
        let normals = self.normal_equations(&states)?;
        let chi2: Vec<f64> = normals.iter().map(|n| n.cost).collect();
        Some(BundleEquations {
            cost: chi2.iter().sum::<f64>() + self.prior_cost(&states),
            states,
            chi2,
            normals,
            iterations: 0,
        })
    }

    /// Those of each photo's own residuals.
    fn normal_equations(&self, states: &[State]) -> Option<Vec<NormalEquations>> {
        self.residuals
            .iter()
            .zip(states)
            .map(|(residuals, state)| residuals.normal_equations(state))
            .collect()
    }

    /// Degrees of freedom of each photo's chi squared, were the lens and the sides known.
    pub(crate) fn degrees_of_freedom(&self) -> Vec<usize> {
        self.residuals
            .iter()
            .map(|own| own.measurement_count().saturating_sub(POSE_UNKNOWNS))
            .collect()
    }

    /// How many of its shared unknowns each photo can tell, at most.
    pub(crate) fn shared_degrees_of_freedom(&self) -> Vec<usize> {
        let own = self.degrees_of_freedom().into_iter();
        own.map(|dof| dof.min(UNKNOWNS - POSE_UNKNOWNS)).collect()
    }

    fn prior_cost(&self, states: &[State]) -> f64 {
        let values = self.shared_values(states);
        let shared = self.shared.iter().zip(values.iter());
        shared.map(|(prior, &value)| prior.cost(value)).sum()
    }

    fn refine(&self, states: Vec<State>) -> Option<BundleEquations> {
        let mut equations = self.linearized(states)?;
        let (mut damping, mut iterations) = (INITIAL_DAMPING, 0);
        while iterations < MAX_ITERATIONS && damping <= MAX_DAMPING {
            iterations += 1;
            let Some(next) = self.lower_neighbour(&equations, damping) else {
                damping *= DAMPING_INCREASE;
                continue;
            };
            let fall = (equations.cost - next.cost) / equations.cost;
            equations = next;
            damping *= DAMPING_DECREASE;
            if fall < COST_TOLERANCE {
                break;
            }
        }
        Some(BundleEquations {
            iterations,
            ..equations
        })
    }

    /// The equations after a damped step, where that lowers the cost.
    fn lower_neighbour(
        &self,
        equations: &BundleEquations,
        damping: f64,
    ) -> Option<BundleEquations> {
        let states = self.stepped(equations, damping)?;
        self.linearized(states)
            .filter(|next| next.cost < equations.cost)
    }

    /// All states after a damped step.
    fn stepped(&self, equations: &BundleEquations, damping: f64) -> Option<Vec<State>> {
        let ReducedSystem { shared, photos } = self.reduced(equations, damping)?;
        let shared = shared.limited_step()?;
        photos
            .iter()
            .enumerate()
            .map(|(index, photo)| {
                let pose = photo.pose_step(&shared, damping)?;
                let step = self.photo_step(index, &pose, &shared);
                Some(equations.states[index].stepped(&step))
            })
            .collect()
    }

    /// The step of all unknowns of a photo, from those of its pose and of what is shared.
    fn photo_step(&self, photo: usize, pose: &Vector6<f64>, shared: &DVector<f64>) -> Unknowns {
        let mut step = Unknowns::zeros();
        step.fixed_rows_mut::<POSE_UNKNOWNS>(0).copy_from(pose);
        for (unknown, column) in self.columns(photo) {
            step[unknown] = shared[column];
        }
        step
    }

    /// The shared system after every pose has been eliminated.
    fn reduced(&self, equations: &BundleEquations, damping: f64) -> Option<ReducedSystem> {
        let photos: Vec<PhotoBlock> = (0..equations.normals.len())
            .map(|photo| self.photo_block(equations, photo))
            .collect();
        let mut shared = self.prior_system(&equations.states);
        for photo in &photos {
            shared.matrix += &photo.own;
            shared.right += &photo.own_right;
        }
        for i in 0..self.shared.len() {
            shared.matrix[(i, i)] *= 1.0 + damping;
        }
        for photo in &photos {
            shared.eliminate_pose(photo, damping)?;
        }
        self.hold_unconstrained(&mut shared);
        Some(ReducedSystem { shared, photos })
    }

    /// The part of the shared system that comes from the priors.
    fn prior_system(&self, states: &[State]) -> SharedSystem {
        let unknowns = self.shared.len();
        let mut system = SharedSystem {
            matrix: DMatrix::zeros(unknowns, unknowns),
            right: DVector::zeros(unknowns),
        };
        let values = self.shared_values(states);
        for (i, prior) in self.shared.iter().enumerate() {
            system.matrix[(i, i)] += prior.information();
            system.right[i] -= (values[i] - prior.mean) * prior.information();
        }
        system
    }

    /// Keeps what is fixed, or what nothing constrains, where it is.
    fn hold_unconstrained(&self, system: &mut SharedSystem) {
        for (i, prior) in self.shared.iter().enumerate() {
            if prior.is_fixed() || system.matrix[(i, i)] <= 0.0 {
                clear_row_and_column(&mut system.matrix, i);
                system.matrix[(i, i)] = 1.0;
                system.right[i] = 0.0;
            }
        }
    }

    /// A photo's part of the normal equations, by pose and by what is shared.
    fn photo_block(&self, equations: &BundleEquations, index: usize) -> PhotoBlock {
        let normal = &equations.normals[index];
        let mut block = PhotoBlock::uncoupled(normal, self.shared.len());
        for (unknown, column) in self.columns(index) {
            block.couple(normal, unknown, column);
            for (other, other_column) in self.columns(index) {
                block.own[(column, other_column)] += normal.information[(unknown, other)];
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
        (0..self.problems.len())
            .map(|photo| {
                let minimum = self.minimum(equations, photo);
                let uncertainty = self.uncertainty(photo, &minimum, shared.as_ref());
                self.problems[photo].solution_with(&minimum, &uncertainty, options)
            })
            .collect()
    }

    /// One photo's share, as if it had been solved alone.
    fn minimum(&self, equations: &BundleEquations, photo: usize) -> Minimum {
        let state = equations.states[photo];
        let alone = self.problems[photo].residuals.normal_equations(&state);
        Minimum {
            state,
            cost: equations.chi2[photo],
            information: alone.map_or(Square::zeros(), |normal| normal.information),
            iterations: equations.iterations,
        }
    }

    /// How well a photo's unknowns are known, by the shared covariance where there is one.
    fn uncertainty(
        &self,
        photo: usize,
        minimum: &Minimum,
        shared: Option<&SharedCovariance>,
    ) -> Uncertainty {
        let mut uncertainty = Uncertainty::new(minimum, self.focal_prior());
        if let Some((covariance, photos)) = shared {
            if let Some(own) = self.photo_covariance(covariance, &photos[photo], photo) {
                uncertainty.covariance = own;
            }
            uncertainty.focal = self.focal_share(&minimum.state, covariance);
        }
        uncertainty
    }

    fn shared_covariance(&self, equations: &BundleEquations) -> Option<SharedCovariance> {
        let ReducedSystem { shared, photos } = self.reduced(equations, 0.0)?;
        let mut covariance = shared.matrix.cholesky()?.inverse();
        for i in (0..self.shared.len()).filter(|&i| self.shared[i].is_fixed()) {
            clear_row_and_column(&mut covariance, i);
        }
        Some((covariance, photos))
    }

    /// A photo's covariance, from that of the shared unknowns and its own block.
    fn photo_covariance(
        &self,
        shared: &DMatrix<f64>,
        photo: &PhotoBlock,
        index: usize,
    ) -> Option<Square> {
        let (pose, cross) = photo.pose_covariance(shared)?;
        let mut covariance = Square::zeros();
        covariance
            .fixed_view_mut::<POSE_UNKNOWNS, POSE_UNKNOWNS>(0, 0)
            .copy_from(&pose);
        let columns = self.columns(index);
        for (unknown, column) in columns {
            set_pose_covariance(&mut covariance, unknown, &cross.column(column).into());
            for (other, other_column) in columns {
                covariance[(unknown, other)] = shared[(column, other_column)];
            }
        }
        Some(covariance)
    }
}

/// Covariance of the shared unknowns, and the photos' blocks it comes from.
type SharedCovariance = (DMatrix<f64>, Vec<PhotoBlock>);

/// Sets the covariance of the pose with one of the shared unknowns.
fn set_pose_covariance(covariance: &mut Square, unknown: usize, cross: &Vector6<f64>) {
    for row in 0..POSE_UNKNOWNS {
        covariance[(row, unknown)] = cross[row];
        covariance[(unknown, row)] = cross[row];
    }
}

impl SharedSystem {
    /// Takes out what the photo's pose can explain as well: the Schur complement.
    fn eliminate_pose(&mut self, photo: &PhotoBlock, damping: f64) -> Option<()> {
        let inverse = photo.inverse_pose(damping)?;
        self.matrix -= photo.coupling.transpose() * inverse * &photo.coupling;
        self.right -= photo.coupling.transpose() * (inverse * photo.pose_right);
        Some(())
    }

    /// The step of the shared unknowns, shortened where it would leap.
    fn limited_step(self) -> Option<DVector<f64>> {
        let step = self.matrix.cholesky()?.solve(&self.right);
        let limit = step.amax().max(1.0);
        Some(step / limit)
    }
}

fn clear_row_and_column(matrix: &mut DMatrix<f64>, i: usize) {
    matrix.row_mut(i).fill(0.0);
    matrix.column_mut(i).fill(0.0);
}

impl PhotoBlock {
    /// A pose, not yet coupled to the shared unknowns.
    fn uncoupled(normal: &NormalEquations, shared: usize) -> Self {
        let pose = normal
            .information
            .fixed_view::<POSE_UNKNOWNS, POSE_UNKNOWNS>(0, 0);
        Self {
            pose: pose.into(),
            pose_right: -Vector6::from(normal.slope.fixed_rows::<POSE_UNKNOWNS>(0)),
            coupling: Matrix6xX::zeros(shared),
            own: DMatrix::zeros(shared, shared),
            own_right: DVector::zeros(shared),
        }
    }

    /// Sets what connects the pose with one of the shared unknowns, and that unknown's slope.
    fn couple(&mut self, normal: &NormalEquations, unknown: usize, column: usize) {
        let coupling = normal
            .information
            .fixed_view::<POSE_UNKNOWNS, 1>(0, unknown);
        self.coupling.set_column(column, &coupling);
        self.own_right[column] -= normal.slope[unknown];
    }

    /// Inverse of the pose's block, damped in proportion to its diagonal.
    fn inverse_pose(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut pose = self.pose;
        for i in 0..POSE_UNKNOWNS {
            pose[(i, i)] *= 1.0 + damping;
        }
        Some(pose.cholesky()?.inverse())
    }

    /// Covariance of the pose, and of the pose with the shared unknowns, from that of these.
    fn pose_covariance(&self, shared: &DMatrix<f64>) -> Option<(Matrix6<f64>, Matrix6xX<f64>)> {
        let inverse = self.inverse_pose(0.0)?;
        let response = -(inverse * &self.coupling);
        let cross = &response * shared;
        let pose = inverse + &cross * response.transpose();
        Some((pose, cross))
    }

    /// The step of the pose that goes with one of the shared unknowns, shortened where it would
    /// leap.
    fn pose_step(&self, shared: &DVector<f64>, damping: f64) -> Option<Vector6<f64>> {
        let pose = self.inverse_pose(damping)? * (self.pose_right - &self.coupling * shared);
        Some(pose / pose.amax().max(1.0))
    }
}

/// Which of their surfaces each photo shows; those of one name and size are one, unnamed ones stand
/// alone.
fn surfaces_shown<'a>(photos: impl Iterator<Item = (&'a Label, &'a Problem)>) -> Vec<usize> {
    let mut surfaces: Vec<NamedSurface> = Vec::new();
    photos
        .map(|(label, problem)| {
            let surface = (label.surface.id.as_str(), problem.size);
            position_of(&mut surfaces, surface)
        })
        .collect()
}

/// The name and the size of a surface.
type NamedSurface<'a> = (&'a str, [f64; 2]);

/// Where a surface is in a list, to which it is added if it is unnamed or new.
fn position_of<'a>(surfaces: &mut Vec<NamedSurface<'a>>, surface: NamedSurface<'a>) -> usize {
    let known = surfaces
        .iter()
        .position(|s| *s == surface && !surface.0.is_empty());
    known.unwrap_or_else(|| {
        surfaces.push(surface);
        surfaces.len() - 1
    })
}

/// The framing of a picture, or this one where it is unknown.
fn framing_or(label: &Label, unknown: Framing) -> Framing {
    match label.framing() {
        Framing::Unknown => unknown,
        known => known,
    }
}

/// Gives all photos the priors of the lens of the one that knows most of its focal length, and the
/// principal point as well as any of them knows it.
fn share_lens(problems: &mut [Problem]) {
    let principal_sigma = least(problems.iter(), |priors| priors.principal_sigma);
    let sigma = |problem: &&Problem| problem.residuals.priors.ln_focal.sigma;
    let known = problems.iter().min_by(|a, b| sigma(a).total_cmp(&sigma(b)));
    let Some((lens, source)) = known.map(|p| (p.residuals.priors, p.prior_source)) else {
        return;
    };
    for problem in problems {
        problem.prior_source = source;
        problem.residuals.priors = ParameterPriors {
            ln_focal: lens.ln_focal,
            principal_sigma,
            kappa: lens.kappa,
            ..problem.residuals.priors
        };
    }
}

/// The least of a standard deviation in the photos' priors.
fn least<'a>(
    problems: impl Iterator<Item = &'a Problem>,
    sigma: impl Fn(&ParameterPriors) -> f64,
) -> f64 {
    let sigmas = problems.map(|problem| sigma(&problem.residuals.priors));
    sigmas.fold(f64::INFINITY, f64::min)
}

/// Priors of the lens, and of each surface's stretch.
fn shared_priors(problems: &[Problem], surface: &[usize]) -> Option<Vec<Prior>> {
    let mut shared = lens_priors(&problems.first()?.residuals.priors).to_vec();
    let surfaces = surface.iter().max().map_or(0, |last| last + 1);
    shared.extend((0..surfaces).map(|s| {
        let photos = problems.iter().zip(surface).filter(|&(_, &x)| x == s);
        let shown_by = photos.map(|(problem, _)| problem);
        Prior::at_zero(least(shown_by, |priors| priors.stretch_sigma))
    }));
    Some(shared)
}

/// In the order of [`LENS_UNKNOWNS`].
fn lens_priors(priors: &ParameterPriors) -> [Prior; 4] {
    let principal = Prior::at_zero(priors.principal_sigma);
    [priors.ln_focal, principal, principal, priors.kappa]
}

/// What a photo shows, with flat priors of what is shared.
fn without_shared_priors(problem: &Problem) -> Residuals {
    let residuals = &problem.residuals;
    Residuals {
        priors: ParameterPriors::only_height(residuals.priors.ln_height),
        ..residuals.clone()
    }
}

/// Weighted mean of what the photos alone give for the logarithm of the focal length, in units;
/// none where none gives it.
fn mean_ln_focal(alone: &[Result<Solution, SolveError>], unit_px: f64) -> Option<f64> {
    let (weight, sum) = alone
        .iter()
        .flatten()
        .filter_map(weighted_focal_px)
        .fold((0.0, 0.0), |(weights, sum), (weight, px)| {
            (weights + weight, sum + weight * libm::log(px / unit_px))
        });
    (weight > 0.0).then(|| sum / weight)
}

/// What a photo alone gives for its focal length, behind its weight.
fn weighted_focal_px(solution: &Solution) -> Option<(f64, f64)> {
    let sigma = solution.sigma.ln_focal;
    let weight = solution.focal.share / (sigma * sigma);
    weight
        .is_finite()
        .then_some((weight, solution.focal.from_data_px?))
}
