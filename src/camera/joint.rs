//! Several photos of one camera: one lens, and a pose for each.
//!
//! # Method
//! Damped least squares on an arrow-shaped system: the six unknowns of each pose meet only the shared ones, so each photo
//! is eliminated on its own (Schur complement) and what remains is small. What is believed of the lens counts once.

use super::belief::{Belief, Beliefs};
use super::error::SolveError;
use super::hedge::is_off_center;
use super::label::{Framing, Label};
use super::model::{KAPPA, LN_FOCAL, PRINCIPAL, STRETCH, State, UNKNOWNS, Unknowns};
use super::options::SolveOptions;
use super::problem::Problem;
use super::refine::{Evidence, Minimum, Normal};
use super::solution::Solution;
use super::uncertainty::{Uncertainty, focal_share};
use super::warning::Warning;
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector6};

/// A photo whose chi squared is beyond this contradicts the others: 0.01 % of two degrees of freedom.
const OUTLIER: f64 = 18.4;
/// Of so many photos, one may be left out.
const PHOTOS_PER_OUTLIER: usize = 4;
/// Number of unknowns of a pose, and of the lens.
const POSE: usize = 6;
const LENS: [usize; 4] = [LN_FOCAL, PRINCIPAL, PRINCIPAL + 1, KAPPA];
const MOST_STEPS: usize = 60;

/// Photos of one camera, solved together.
#[derive(Clone, Debug)]
pub struct Joint {
    /// One per label: with the shared lens, alone where the photo contradicts the others, or why it could not be used.
    pub photos: Vec<Result<Solution, SolveError>>,
    /// What a person should look at.
    pub warnings: Vec<Warning>,
}

/// Solves photos of one camera together: they share focal length, principal point and distortion, and photos of one surface
/// share its sides.
///
/// The labels have to agree in the shape of their pictures; one may be a reduced copy. See [`one_camera`]. A photo that no
/// camera fits when it is alone takes no part, and keeps its own solution.
///
/// # Errors
/// [`SolveError::DifferentPictures`] where the shapes differ; the first photo's error where no photo can be used.
pub fn solve_joint(labels: &[Label], options: &SolveOptions) -> Result<Joint, SolveError> {
    if let Some(other) = labels.iter().position(|l| !same_frame(l, &labels[0])) {
        return Err(SolveError::DifferentPictures { photo: other });
    }
    let mut photos: Vec<_> = labels
        .iter()
        .map(|label| super::solve(label, options))
        .collect();
    if let Some(Err(error)) = photos.first().filter(|_| photos.iter().all(Result::is_err)) {
        return Err(error.clone());
    }
    let misfits = photos.iter().enumerate().filter_map(|(photo, solution)| {
        let solution = solution.as_ref().ok().filter(|s| s.misfit().is_some())?;
        Some(Warning::OutlierPhoto {
            photo,
            chi2: solution.fit.chi2,
        })
    });
    let mut warnings: Vec<Warning> = misfits.collect();
    let together = Together {
        labels,
        alone: &photos,
        options,
    };
    if let Some(agreed) = together.whole_or_cropped()? {
        for (solution, photo) in agreed.solutions.into_iter().zip(agreed.used) {
            photos[photo] = Ok(solution);
        }
        warnings.extend(agreed.warnings);
    }
    Ok(Joint { photos, warnings })
}

/// Photos of one camera, and what each says alone.
struct Together<'a> {
    labels: &'a [Label],
    alone: &'a [Result<Solution, SolveError>],
    options: &'a SolveOptions,
}

/// What photos say together.
struct Agreed {
    used: Vec<usize>,
    states: Vec<State>,
    solutions: Vec<Solution>,
    cost: f64,
    warnings: Vec<Warning>,
}

impl Together<'_> {
    /// The camera of whole pictures, or where nobody says that they are whole and the corners deny it, of cropped ones.
    fn whole_or_cropped(&self) -> Result<Option<Agreed>, SolveError> {
        let whole = self.agreed(Framing::Whole)?;
        let unknown = self
            .labels
            .iter()
            .any(|label| label.framing() == Framing::Unknown);
        if !unknown || !self.options.priors.cropping_matters() {
            return Ok(whole);
        }
        let (Some(whole), Some(mut loose)) = (whole, self.agreed(Framing::Unknown)?) else {
            return Ok(None);
        };
        if loose.used.len() > whole.used.len() || is_off_center(whole.cost, loose.cost) {
            loose.solutions = loose
                .solutions
                .into_iter()
                .map(|s| s.off_center(None))
                .collect();
            return Ok(Some(loose));
        }
        Ok(Some(whole.hedged(&loose, self.options)))
    }

    /// What the photos that fit say together, but for those that contradict the others; pictures of unknown framing are
    /// taken for pictures of this one.
    fn agreed(&self, unknown: Framing) -> Result<Option<Agreed>, SolveError> {
        let fits = |i: &usize| self.alone[*i].as_ref().is_ok_and(|s| s.misfit().is_none());
        let mut used: Vec<usize> = (0..self.labels.len()).filter(fits).collect();
        let mut warnings = Vec::new();
        let spare = self.labels.len() / PHOTOS_PER_OUTLIER;
        while !used.is_empty() {
            let bundle = Bundle::new(self.labels, &used, unknown, self.options)?;
            let arrow = bundle.best(self.alone).ok_or(SolveError::NoPose)?;
            let worst = (0..used.len()).max_by(|&a, &b| arrow.chi2[a].total_cmp(&arrow.chi2[b]));
            match worst.filter(|&w| arrow.chi2[w] > OUTLIER && warnings.len() < spare) {
                Some(w) => warnings.push(Warning::OutlierPhoto {
                    photo: used.remove(w),
                    chi2: arrow.chi2[w],
                }),
                None => {
                    let solutions = bundle.solutions(&arrow, self.options);
                    return Ok(Some(Agreed {
                        used,
                        states: arrow.states,
                        solutions,
                        cost: arrow.cost,
                        warnings,
                    }));
                }
            }
        }
        Ok(None)
    }
}

impl Agreed {
    /// Whole pictures with the error that they have if they are cropped.
    fn hedged(mut self, loose: &Self, options: &SolveOptions) -> Self {
        let unsure = |(i, solution): (usize, Solution)| {
            let Some(other) = loose.used.iter().position(|photo| *photo == self.used[i]) else {
                return solution;
            };
            let apart = self.states[i].step_to(&loose.states[other]);
            solution.hedged(&loose.solutions[other], &apart, options)
        };
        self.solutions = std::mem::take(&mut self.solutions)
            .into_iter()
            .enumerate()
            .map(unsure)
            .collect();
        self
    }
}

/// Groups of labels that name the same camera and agree in the shape of their pictures, each in order; unnamed cameras
/// stand alone.
pub fn one_camera(labels: &[Label]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, label) in labels.iter().enumerate() {
        let named = label.camera.id.is_some();
        let fits = |group: &&mut Vec<usize>| {
            let first = &labels[group[0]];
            named && first.camera.id == label.camera.id && same_frame(first, label)
        };
        match groups.iter_mut().find(fits) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// Two pictures show the same frame of a camera, in whatever number of pixels: in units of the diagonal, everything that a
/// camera's photos share is then the same.
fn same_frame(a: &Label, b: &Label) -> bool {
    let is_part = |label: &Label| label.image.crop.is_some() || label.image.cropped == Some(true);
    if is_part(a) || is_part(b) {
        return a.image_size() == b.image_size() && a.image.crop == b.image.crop;
    }
    let ([aw, ah], [bw, bh]) = (a.image_size().map(f64::from), b.image_size().map(f64::from));
    // Reduced sizes are rounded to whole pixels.
    (aw * bh - ah * bw).abs() <= aw.max(ah).max(bw).max(bh)
}

/// The photos of one camera as one problem.
struct Bundle {
    problems: Vec<Problem>,
    /// What each photo shows, without beliefs on what is shared.
    evidence: Vec<Evidence>,
    /// Which of the surfaces each photo shows.
    surface: Vec<usize>,
    /// What is believed of the lens and then of each surface's stretch.
    shared: Vec<Belief>,
}

/// All photos at a common optimum.
struct Arrow {
    states: Vec<State>,
    cost: f64,
    /// Of each photo's own sights.
    chi2: Vec<f64>,
    normals: Vec<Normal>,
}

impl Bundle {
    fn new(
        labels: &[Label],
        used: &[usize],
        unknown: Framing,
        options: &SolveOptions,
    ) -> Result<Self, SolveError> {
        let problem = |&i: &usize| {
            let framing = Some(labels[i].framing()).filter(|&known| known != Framing::Unknown);
            Problem::new(&labels[i], framing.unwrap_or(unknown), options)
        };
        let problems = used.iter().map(problem).collect::<Result<Vec<_>, _>>()?;
        let mut surfaces: Vec<(&str, [f64; 2])> = Vec::new();
        let mut surface = Vec::new();
        for (&i, problem) in used.iter().zip(&problems) {
            let name = (labels[i].surface.id.as_str(), problem.size);
            let known = surfaces
                .iter()
                .position(|s| *s == name && !name.0.is_empty());
            surface.push(known.unwrap_or_else(|| {
                surfaces.push(name);
                surfaces.len() - 1
            }));
        }
        let surest = |a: &&Problem, b: &&Problem| {
            let sigma = |p: &Problem| p.evidence.beliefs.ln_focal.sigma;
            sigma(a).total_cmp(&sigma(b))
        };
        let first = problems
            .iter()
            .min_by(surest)
            .ok_or(SolveError::NoCorners)?
            .evidence
            .beliefs;
        let at_zero = |sigma| Belief { mean: 0.0, sigma };
        let principal = at_zero(first.principal_sigma);
        let mut shared = vec![first.ln_focal, principal, principal, first.kappa];
        for s in 0..surfaces.len() {
            let shown = surface.iter().position(|&x| x == s).unwrap_or(0);
            shared.push(at_zero(problems[shown].evidence.beliefs.stretch_sigma));
        }
        let evidence = problems.iter().map(|p| unbiased(&p.evidence)).collect();
        Ok(Self {
            problems,
            evidence,
            surface,
            shared,
        })
    }

    /// The lower of the minima from the photos' own focal lengths and from what is believed.
    fn best(&self, alone: &[Result<Solution, SolveError>]) -> Option<Arrow> {
        let unit_px = self.problems[0].frame.unit_px;
        let believed = self.shared[0].mean;
        let mut sums = (0.0, 0.0);
        for solution in alone.iter().flatten() {
            if let (Some(px), sigma) = (solution.focal.from_data_px, solution.sigma.ln_focal) {
                let weight = solution.focal.share / (sigma * sigma);
                if weight.is_finite() {
                    sums = (sums.0 + weight, sums.1 + weight * libm::log(px / unit_px));
                }
            }
        }
        let measured = (sums.0 > 0.0 && !self.shared[0].is_fact()).then(|| sums.1 / sums.0);
        let starts = [Some(believed), measured].into_iter().flatten();
        let found = starts.filter_map(|ln_focal| self.refine(self.posed(ln_focal)?));
        found.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    /// Every photo's best pose for a focal length, the lens otherwise as believed.
    fn posed(&self, ln_focal: f64) -> Option<Vec<State>> {
        let pose = |problem: &Problem| {
            let mut problem = problem.clone();
            let beliefs = &mut problem.evidence.beliefs;
            beliefs.ln_focal = Belief {
                mean: ln_focal,
                sigma: 0.0,
            };
            (
                beliefs.principal_sigma,
                beliefs.stretch_sigma,
                beliefs.kappa.sigma,
            ) = (0.0, 0.0, 0.0);
            Some(problem.search()?.best.state)
        };
        self.problems.iter().map(pose).collect()
    }

    /// The column of the shared system for each unknown of a photo from [`LN_FOCAL`] on.
    fn columns(&self, photo: usize) -> [(usize, usize); 5] {
        let [f, x, y, k] = LENS;
        [
            (f, 0),
            (x, 1),
            (y, 2),
            (k, 3),
            (STRETCH, LENS.len() + self.surface[photo]),
        ]
    }

    fn values(&self, states: &[State]) -> DVector<f64> {
        let mut values = DVector::zeros(self.shared.len());
        for (photo, state) in states.iter().enumerate() {
            for (unknown, column) in self.columns(photo) {
                values[column] = state.value(unknown);
            }
        }
        values
    }

    /// The cost around the states to second order; none where a point would be behind its camera.
    fn arrow(&self, states: Vec<State>) -> Option<Arrow> {
        let normals = self
            .evidence
            .iter()
            .zip(&states)
            .map(|(e, s)| e.normal(s))
            .collect::<Option<Vec<_>>>()?;
        let chi2: Vec<f64> = normals.iter().map(|n| n.cost).collect();
        let values = self.values(&states);
        let off = |(b, v): (&Belief, &f64)| (v - b.mean) * (v - b.mean) * b.information();
        let beliefs: f64 = self.shared.iter().zip(values.iter()).map(off).sum();
        Some(Arrow {
            cost: chi2.iter().sum::<f64>() + beliefs,
            states,
            chi2,
            normals,
        })
    }

    fn refine(&self, states: Vec<State>) -> Option<Arrow> {
        let mut arrow = self.arrow(states)?;
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let next = self
                .step(&arrow, damping)
                .and_then(|states| self.arrow(states));
            match next.filter(|next| next.cost < arrow.cost) {
                Some(next) => {
                    let fall = (arrow.cost - next.cost) / arrow.cost;
                    arrow = next;
                    damping *= 0.1;
                    if fall < 1e-12 {
                        break;
                    }
                }
                None => damping *= 10.0,
            }
            if damping > 1e10 {
                break;
            }
        }
        Some(arrow)
    }

    /// The shared system after every pose has been eliminated, and its right side.
    fn reduced(
        &self,
        arrow: &Arrow,
        damping: f64,
    ) -> Option<(DMatrix<f64>, DVector<f64>, Vec<Photo>)> {
        let count = self.shared.len();
        let (mut system, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let values = self.values(&arrow.states);
        for (i, belief) in self.shared.iter().enumerate() {
            system[(i, i)] += belief.information();
            right[i] -= (values[i] - belief.mean) * belief.information();
        }
        let photos: Vec<Photo> = (0..arrow.normals.len())
            .map(|p| self.photo(arrow, p))
            .collect();
        for photo in &photos {
            system += &photo.own;
            right += &photo.own_right;
        }
        for i in 0..count {
            system[(i, i)] *= 1.0 + damping;
        }
        for photo in &photos {
            let inverse = photo.damped(damping)?;
            system -= photo.coupling.transpose() * inverse * &photo.coupling;
            right -= photo.coupling.transpose() * (inverse * photo.pose_right);
        }
        for (i, belief) in self.shared.iter().enumerate() {
            if belief.is_fact() || system[(i, i)] <= 0.0 {
                system.row_mut(i).fill(0.0);
                system.column_mut(i).fill(0.0);
                (system[(i, i)], right[i]) = (1.0, 0.0);
            }
        }
        Some((system, right, photos))
    }

    /// A photo's part of the normal equations, by pose and by what is shared.
    fn photo(&self, arrow: &Arrow, index: usize) -> Photo {
        let (normal, count) = (&arrow.normals[index], self.shared.len());
        let mut photo = Photo {
            pose: normal.information.fixed_view::<POSE, POSE>(0, 0).into(),
            pose_right: -Vector6::from(normal.slope.fixed_rows::<POSE>(0)),
            coupling: Matrix6xX::zeros(count),
            own: DMatrix::zeros(count, count),
            own_right: DVector::zeros(count),
        };
        for (unknown, column) in self.columns(index) {
            photo.coupling.set_column(
                column,
                &normal.information.fixed_view::<POSE, 1>(0, unknown),
            );
            photo.own_right[column] -= normal.slope[unknown];
            for (other, other_column) in self.columns(index) {
                photo.own[(column, other_column)] += normal.information[(unknown, other)];
            }
        }
        photo
    }

    /// All states after a damped step.
    fn step(&self, arrow: &Arrow, damping: f64) -> Option<Vec<State>> {
        let (system, right, photos) = self.reduced(arrow, damping)?;
        let shared = system.cholesky()?.solve(&right);
        let limit = shared.amax().max(1.0);
        let shared = shared / limit;
        let stepped = |(index, photo): (usize, &Photo)| {
            let pose = photo.damped(damping)? * (photo.pose_right - &photo.coupling * &shared);
            let mut step = Unknowns::zeros();
            step.fixed_rows_mut::<POSE>(0)
                .copy_from(&(pose / pose.amax().max(1.0)));
            for (unknown, column) in self.columns(index) {
                step[unknown] = shared[column];
            }
            Some(arrow.states[index].stepped(&step))
        };
        photos.iter().enumerate().map(stepped).collect()
    }

    /// Every photo's solution, with the covariance that the others give it.
    fn solutions(&self, arrow: &Arrow, options: &SolveOptions) -> Vec<Solution> {
        let reduced = self.reduced(arrow, 0.0);
        let inverse = reduced.and_then(|(system, _, photos)| {
            Some((self.without_facts(system.cholesky()?.inverse()), photos))
        });
        let solution = |(index, problem): (usize, &Problem)| {
            let state = arrow.states[index];
            let normal = &arrow.normals[index];
            let minimum = Minimum {
                state,
                cost: arrow.chi2[index],
                information: normal.information,
                steps: MOST_STEPS,
            };
            let mut uncertainty = Uncertainty::new(&minimum, self.shared[0]);
            if let Some((shared, photos)) = &inverse {
                self.fill_covariance(&mut uncertainty, shared, &photos[index], index);
                let information = if shared[(0, 0)] > 0.0 {
                    1.0 / shared[(0, 0)]
                } else {
                    0.0
                };
                uncertainty.focal = focal_share(state.ln_focal, information, self.shared[0]);
            }
            let mut believing = problem.clone();
            believing.evidence.beliefs.ln_focal = self.shared[0];
            believing.solution_with(&minimum, &uncertainty, options)
        };
        self.problems.iter().enumerate().map(solution).collect()
    }

    /// What is a fact has no variance.
    fn without_facts(&self, mut covariance: DMatrix<f64>) -> DMatrix<f64> {
        for i in (0..self.shared.len()).filter(|&i| self.shared[i].is_fact()) {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        covariance
    }

    fn fill_covariance(
        &self,
        uncertainty: &mut Uncertainty,
        shared: &DMatrix<f64>,
        photo: &Photo,
        index: usize,
    ) {
        let Some(inverse) = photo.damped(0.0) else {
            return;
        };
        let response = -(inverse * &photo.coupling);
        let cross = &response * shared;
        let pose = inverse + &cross * response.transpose();
        let covariance = &mut uncertainty.covariance;
        covariance.fill(0.0);
        covariance
            .fixed_view_mut::<POSE, POSE>(0, 0)
            .copy_from(&pose);
        let columns = self.columns(index);
        for (unknown, column) in columns {
            for row in 0..POSE {
                covariance[(row, unknown)] = cross[(row, column)];
                covariance[(unknown, row)] = cross[(row, column)];
            }
            for (other, other_column) in columns {
                covariance[(unknown, other)] = shared[(column, other_column)];
            }
        }
    }
}

/// One photo's part of the arrow.
struct Photo {
    pose: Matrix6<f64>,
    pose_right: Vector6<f64>,
    /// Pose by shared unknowns.
    coupling: Matrix6xX<f64>,
    own: DMatrix<f64>,
    own_right: DVector<f64>,
}

impl Photo {
    /// Inverse of the pose's block, damped in proportion to its diagonal.
    fn damped(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut pose = self.pose;
        for i in 0..POSE {
            pose[(i, i)] *= 1.0 + damping;
        }
        Some(pose.cholesky()?.inverse())
    }
}

/// What a photo shows, without beliefs on what is shared.
fn unbiased(evidence: &Evidence) -> Evidence {
    let nothing = Belief {
        mean: 0.0,
        sigma: f64::INFINITY,
    };
    let beliefs = Beliefs {
        ln_focal: nothing,
        stretch_sigma: f64::INFINITY,
        principal_sigma: f64::INFINITY,
        kappa: nothing,
        ln_height: evidence.beliefs.ln_height,
    };
    Evidence {
        beliefs,
        ..evidence.clone()
    }
}

const _: () = assert!(POSE + LENS.len() + 1 == UNKNOWNS);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;

    fn labels(k: u64, count: usize, tilts: [f64; 2]) -> (Vec<Label>, f64) {
        let views = Scenario::realistic().views(31, k, count, tilts);
        let focal = views[0].camera.focal_px.x;
        let name = |v: crate::camera::simulate::View| {
            let mut label = v.label;
            (label.surface.id, label.camera.id) = ("tray".into(), Some("phone".into()));
            label
        };
        (views.into_iter().map(name).collect(), focal)
    }

    #[test]
    fn photos_share_their_lens_and_their_surface() {
        let (labels, focal) = labels(1, 6, [10.0, 30.0]);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let solved: Vec<_> = joint.photos.iter().map(|p| p.as_ref().unwrap()).collect();
        assert!(joint.warnings.is_empty(), "{:?}", joint.warnings);
        for s in &solved {
            assert_eq!(s.camera.focal_px, solved[0].camera.focal_px);
            assert_eq!(s.size, solved[0].size);
            assert!(
                (s.camera.focal_px.x / focal).ln().abs() < 4.0 * s.sigma.ln_focal,
                "{:?}",
                s.camera.focal_px
            );
        }
    }

    #[test]
    fn one_photo_alone_is_solved_as_alone() {
        let (labels, _) = labels(2, 1, [20.0, 20.0]);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let (a, b) = (
            joint.photos[0].as_ref().unwrap(),
            super::super::solve(&labels[0], &SolveOptions::default()).unwrap(),
        );
        assert!((a.camera.focal_px.x / b.camera.focal_px.x - 1.0).abs() < 1e-6);
        assert!((a.sigma.ln_focal / b.sigma.ln_focal - 1.0).abs() < 1e-4);
        assert!((a.sigma.height_px / b.sigma.height_px - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_photo_that_contradicts_is_left_out_and_an_impossible_one_keeps_its_error() {
        let (mut labels, _) = labels(3, 8, [15.0, 35.0]);
        labels[2].surface.corners_px.as_mut().unwrap()[1][0] += 120.0;
        labels[5].surface.corners_px = Some([[0.0; 2]; 4]);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        assert!(
            matches!(joint.warnings[..], [Warning::OutlierPhoto { photo: 2, .. }]),
            "{:?}",
            joint.warnings
        );
        assert!(matches!(
            joint.photos[5],
            Err(SolveError::Coincident { .. })
        ));
    }

    #[test]
    fn cameras_are_told_apart_by_name_and_shape_of_the_picture() {
        let (mut labels, _) = labels(4, 4, [20.0, 30.0]);
        (labels[1].image.width, labels[3].camera.id) = (3000, None);
        assert_eq!(one_camera(&labels), [vec![0, 2], vec![1], vec![3]]);
        assert!(matches!(
            solve_joint(&labels, &SolveOptions::default()),
            Err(SolveError::DifferentPictures { photo: 1 })
        ));
    }

    #[test]
    fn a_reduced_photo_shares_the_lens() {
        let (labels, _) = labels(5, 6, [10.0, 30.0]);
        let together = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let mut reduced = labels.clone();
        for label in &mut reduced[3..] {
            (label.image.width, label.image.height) =
                (label.image.width / 4, label.image.height / 4);
            let surface = &mut label.surface;
            surface.corners_px = surface.corners_px.map(|c| c.map(|p| p.map(|v| v / 4.0)));
            surface.corner_sigma_px = surface.corner_sigma_px.map(|s| s / 4.0);
        }
        assert_eq!(one_camera(&reduced), [vec![0, 1, 2, 3, 4, 5]]);
        let scaled = solve_joint(&reduced, &SolveOptions::default()).unwrap();
        for (i, (a, b)) in together.photos.iter().zip(&scaled.photos).enumerate() {
            let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
            let scale = if i < 3 { 1.0 } else { 4.0 };
            assert!(
                (scale * b.camera.focal_px.x / a.camera.focal_px.x - 1.0).abs() < 1e-6,
                "{i}"
            );
            assert!((b.camera.center() - a.camera.center()).norm() < 1e-6, "{i}");
        }
    }
}
