//! Several photos of one camera: one lens, and a pose for each.

use super::bundle::Bundle;
use super::chi::{self, CHI2_99};
use super::error::SolveError;
use super::hedge::is_off_center;
use super::label::{Framing, Label};
use super::model::State;
use super::options::SolveOptions;
use super::solution::{REFUSED_FIT_P, Solution};
use super::solve::{FocalConflict, solve, without_exif_focal};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::Vector2;
use std::cmp::Ordering;

/// So many photos tell the distortion that they share from everything else; fewer do not.
const LEAST_PHOTOS_FOR_KAPPA: usize = 4;
/// One photo in this many may be left out.
const PHOTOS_PER_OUTLIER: usize = 4;
/// Focal lengths that photos of one lens state differ by no more, relative: the next one of a zoom
/// is farther away.
const ONE_FOCAL_TOLERANCE: f64 = 0.02;
/// The same of k1, and of the principal point in picture diagonals.
const ONE_LENS_TOLERANCE: f64 = 0.005;

/// Photos of one camera, solved together.
#[derive(Clone, Debug)]
pub struct Joint {
    /// One per label: with the shared lens, alone where the photo contradicts the others, or why
    /// it could not be used.
    pub photos: Vec<Result<Solution, SolveError>>,
    /// The photos that were left out; where it is unclear which ones contradict the others, each
    /// is solved alone, with a warning.
    pub outliers: Vec<OutlierPhoto>,
}

/// A photo that contradicts the others and was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierPhoto {
    /// Which photo, from 0.
    pub photo: usize,
    /// Its chi squared with the shared camera, or alone where no camera fits it.
    pub chi2: f64,
}

impl OutlierPhoto {
    /// A warning about it, to be read after the photo's name.
    pub fn diagnostic(&self) -> Diagnostic {
        let chi2 = self.chi2;
        let what = format!("contradicts the other photos (chi squared {chi2:.1}) and was left out");
        Diagnostic::warning(Code::OutlierPhoto, what)
    }
}

/// Solves photos of one camera together: they share focal length, principal point and distortion,
/// and photos of one surface share its sides. Distortion is an unknown where four or more photos
/// can be used ([`Priors::joint_kappa_sigma`](super::Priors::joint_kappa_sigma)).
///
/// The labels have to agree in the shape of their pictures; one may be a reduced copy. See
/// [`group_by_camera`]. The principal point or the k1 that one of them states holds for all. A
/// photo that no camera fits when it is alone takes no part, and keeps its own solution.
///
/// # Errors
/// [`SolveError::DifferentPictures`] where the shapes differ, or what is stated of the lens, or
/// where one of several was cropped at an unknown place; the first photo's error where no photo can
/// be used.
pub fn solve_joint(labels: &[Label], options: &SolveOptions) -> Result<Joint, SolveError> {
    refuse_different_cameras(labels)?;
    let labels = with_shared_lens(labels);
    let photos = solve_each(&labels, options);
    refuse_none(&photos)?;
    let shared_options = with_shared_kappa(options);
    let distorted = solve_distorted(&labels, &shared_options);
    let (measured, options) = match &distorted {
        Some(distorted) => (distorted, &shared_options),
        None => (&photos, options),
    };
    let solver = JointSolver {
        labels: &labels,
        alone: measured,
        options,
    };
    let estimate = solver.without_wrong_exif()?;
    let agreed = estimate
        .as_ref()
        .is_some_and(|estimate| !estimate.is_contradictory(measured));
    // Photos that stay alone keep the options as they are: one photo cannot tell distortion.
    let mut joint = Joint {
        outliers: misfit_outliers(if agreed { measured } else { &photos }),
        photos,
    };
    match estimate {
        Some(estimate) if agreed => joint.apply(estimate),
        Some(contradictory) => joint.warn(&contradictory),
        None => {}
    }
    Ok(joint)
}

/// The options for photos that share a distortion.
fn with_shared_kappa(options: &SolveOptions) -> SolveOptions {
    let mut shared = options.clone();
    let kappa_sigma = &mut shared.priors.kappa_sigma;
    *kappa_sigma = kappa_sigma.max(options.priors.joint_kappa_sigma);
    shared
}

/// What each photo gives with these options; none where too few of them fit a camera to tell the
/// distortion that they share.
fn solve_distorted(
    labels: &[Label],
    options: &SolveOptions,
) -> Option<Vec<Result<Solution, SolveError>>> {
    if labels.len() < LEAST_PHOTOS_FOR_KAPPA {
        return None;
    }
    let photos = solve_each(labels, options);
    let fitting = photos.iter().filter(|photo| fits(photo)).count();
    (fitting >= LEAST_PHOTOS_FOR_KAPPA).then_some(photos)
}

/// What each photo gives.
fn solve_each(labels: &[Label], options: &SolveOptions) -> Vec<Result<Solution, SolveError>> {
    labels.iter().map(|label| solve(label, options)).collect()
}

/// A camera fits the photo when it is alone.
fn fits(photo: &Result<Solution, SolveError>) -> bool {
    photo
        .as_ref()
        .is_ok_and(|solution| solution.misfit().is_none())
}

/// Fails with the first photo's error where none gives anything.
fn refuse_none(photos: &[Result<Solution, SolveError>]) -> Result<(), SolveError> {
    match photos.first() {
        Some(Err(error)) if photos.iter().all(Result::is_err) => Err(error.clone()),
        _ => Ok(()),
    }
}

impl Joint {
    /// Keeps what each photo gives alone, with a warning about all that were solved together.
    fn warn(&mut self, contradictory: &JointEstimate) {
        let left_out = contradictory.outliers.iter().map(|outlier| outlier.photo);
        for photo in contradictory.used.iter().copied().chain(left_out) {
            if let Ok(solution) = &mut self.photos[photo] {
                solution.warnings.push(contradiction_warning());
            }
        }
    }

    /// Replaces the solutions of the photos that agree.
    fn apply(&mut self, estimate: JointEstimate) {
        for (solution, photo) in estimate.solutions.into_iter().zip(estimate.used) {
            self.photos[photo] = Ok(solution);
        }
        self.outliers.extend(estimate.outliers);
    }
}

fn contradiction_warning() -> Diagnostic {
    let what = "the photos contradict each other, so each was solved alone: corner_sigma_px is too small, or the zoom differs, which needs another camera.id";
    Diagnostic::warning(Code::OutlierPhoto, what)
}

/// The photos that no camera fits when they are alone.
fn misfit_outliers(photos: &[Result<Solution, SolveError>]) -> Vec<OutlierPhoto> {
    let misfits = photos.iter().enumerate().filter_map(|(photo, solution)| {
        let solution = solution.as_ref().ok()?;
        let chi2 = solution.fit.chi2;
        solution.misfit().map(|_| OutlierPhoto { photo, chi2 })
    });
    misfits.collect()
}

/// Photos of one camera, and what each gives alone, with the same options.
struct JointSolver<'a> {
    labels: &'a [Label],
    alone: &'a [Result<Solution, SolveError>],
    options: &'a SolveOptions,
}

/// What photos give together.
struct JointEstimate {
    used: Vec<usize>,
    states: Vec<State>,
    /// Of each photo's own observations.
    fits: Vec<PhotoFit>,
    solutions: Vec<Solution>,
    cost: f64,
    /// How many of the shared unknowns each photo can tell.
    shared_dof: Vec<usize>,
    outliers: Vec<OutlierPhoto>,
    /// Where what they give for the focal length contradicts its prior.
    conflict: Option<FocalConflict>,
}

impl JointSolver<'_> {
    /// The estimate; where the photos contradict their own EXIF value, that without it.
    fn without_wrong_exif(&self) -> Result<Option<JointEstimate>, SolveError> {
        let Some(estimate) = self.whole_or_cropped()? else {
            return Ok(None);
        };
        let Some(conflict) = estimate.conflict else {
            return Ok(Some(estimate));
        };
        let estimate = match conflict.is_with_exif() {
            true => self.without_exif()?,
            false => Some(estimate),
        };
        Ok(estimate.map(|estimate| estimate.warned(&conflict)))
    }

    fn without_exif(&self) -> Result<Option<JointEstimate>, SolveError> {
        let labels: Vec<Label> = self.labels.iter().map(without_exif_focal).collect();
        let solver = JointSolver {
            labels: &labels,
            alone: self.alone,
            options: self.options,
        };
        solver.whole_or_cropped()
    }

    /// The camera of whole pictures or, where they may have been cropped and the corners demand it,
    /// of cropped ones.
    fn whole_or_cropped(&self) -> Result<Option<JointEstimate>, SolveError> {
        let whole = self.estimate(Framing::Whole)?;
        if !self.may_be_cropped() {
            return Ok(whole);
        }
        let (Some(whole), Some(loose)) = (whole, self.estimate(Framing::Unknown)?) else {
            return Ok(None);
        };
        if loose.used.len() > whole.used.len() || is_off_center(whole.cost, loose.cost) {
            return Ok(Some(loose.off_center()));
        }
        Ok(Some(whole.hedged(&loose, self.labels, self.options)))
    }

    fn may_be_cropped(&self) -> bool {
        let mut labels = self.labels.iter();
        labels.any(|label| label.framing() == Framing::Unknown)
            && self.options.priors.cropping_matters()
    }

    /// What the photos that fit give together, but for those that contradict the others; pictures
    /// of unknown framing are treated as pictures of this one.
    fn estimate(&self, unknown: Framing) -> Result<Option<JointEstimate>, SolveError> {
        let fits = |&photo: &usize| fits(&self.alone[photo]);
        let mut used: Vec<usize> = (0..self.labels.len()).filter(fits).collect();
        let mut outliers = Vec::new();
        let most_outliers = self.labels.len() / PHOTOS_PER_OUTLIER;
        while !used.is_empty() {
            let estimate = self.estimate_from(&used, unknown)?;
            let worst = worst_photo(&estimate.fits).filter(|_| outliers.len() < most_outliers);
            let Some(worst) = worst else {
                return Ok(Some(JointEstimate {
                    outliers,
                    ..estimate
                }));
            };
            let photo = used.remove(worst);
            let chi2 = estimate.fits[worst].chi2;
            outliers.push(OutlierPhoto { photo, chi2 });
        }
        Ok(None)
    }

    /// What these photos give together.
    fn estimate_from(&self, used: &[usize], unknown: Framing) -> Result<JointEstimate, SolveError> {
        let bundle = Bundle::new(self.labels, used, unknown, self.options)?;
        let best = bundle.best(self.alone).ok_or(SolveError::NoPose)?;
        Ok(JointEstimate {
            used: used.to_vec(),
            solutions: bundle.solutions(&best, self.options),
            conflict: bundle.focal_conflict(&best),
            states: best.states,
            fits: PhotoFit::of_all(&best.chi2, &bundle.degrees_of_freedom()),
            cost: best.cost,
            shared_dof: bundle.shared_degrees_of_freedom(),
            outliers: Vec::new(),
        })
    }
}

/// How well a photo fits the camera that it shares.
#[derive(Clone, Copy, Debug)]
struct PhotoFit {
    chi2: f64,
    /// Degrees of freedom of that.
    dof: usize,
    /// Probability of a larger chi squared by chance.
    probability: f64,
}

impl PhotoFit {
    fn new(chi2: f64, dof: usize) -> Self {
        Self {
            chi2,
            dof,
            probability: chi::exceeds(chi2, dof).unwrap_or(1.0),
        }
    }

    fn of_all(chi2: &[f64], dof: &[usize]) -> Vec<Self> {
        let pairs = chi2.iter().zip(dof);
        pairs.map(|(&chi2, &dof)| Self::new(chi2, dof)).collect()
    }

    /// By probability, or where both have too little of it to be told apart, by chi squared per
    /// degree of freedom.
    fn compare(&self, other: &Self) -> Ordering {
        let per_dof = |fit: &Self| fit.chi2 / fit.dof as f64;
        let by_probability = self.probability.total_cmp(&other.probability);
        by_probability.then_with(|| per_dof(other).total_cmp(&per_dof(self)))
    }
}

/// The photo that fits worst, where it contradicts the others: a photo that fits no better when it
/// is alone is refused.
fn worst_photo(fits: &[PhotoFit]) -> Option<usize> {
    let worst = (0..fits.len()).min_by(|&a, &b| fits[a].compare(&fits[b]))?;
    (fits[worst].probability < REFUSED_FIT_P).then_some(worst)
}

impl JointEstimate {
    /// The photos do not share a camera, and which of them has another one cannot be told: one that
    /// contradicts the others is left, or a camera of its own for each explains them clearly better.
    fn is_contradictory(&self, alone: &[Result<Solution, SolveError>]) -> bool {
        let alone = self.used.iter().filter_map(|&i| alone[i].as_ref().ok());
        let apart: f64 = alone.map(|solution| solution.fit.chi2).sum();
        // The first photo's camera is there in any case. For two photos of four corners this is
        // REFUSED_FIT_P; more photos leave room for corners that are less exact than stated.
        let gained: usize = self.shared_dof.iter().skip(1).sum();
        let is_shared = self.used.len() > 1;
        is_shared
            && (worst_photo(&self.fits).is_some() || self.cost > apart + CHI2_99 * gained as f64)
    }

    /// With a warning about every photo, in its own pixels.
    fn warned(mut self, conflict: &FocalConflict) -> Self {
        for solution in &mut self.solutions {
            let warning = conflict.warning(solution);
            solution.warnings.push(warning);
        }
        self
    }

    /// Pictures that turn out not to be whole.
    fn off_center(mut self) -> Self {
        let solutions = self.solutions.into_iter();
        self.solutions = solutions.map(|s| s.off_center(None)).collect();
        self
    }

    /// Whole pictures with the error that they have if they are cropped.
    fn hedged(mut self, loose: &Self, labels: &[Label], options: &SolveOptions) -> Self {
        let solutions = std::mem::take(&mut self.solutions).into_iter().enumerate();
        self.solutions = solutions
            .map(|(i, solution)| {
                let photo = self.used[i];
                let Some(other) = loose.used.iter().position(|&used| used == photo) else {
                    return solution;
                };
                let apart = self.states[i].step_to(&loose.states[other]);
                solution.hedged(&loose.solutions[other], &apart, &labels[photo], options)
            })
            .collect();
        self
    }
}

/// Groups of labels that name the same camera and agree in the shape of their pictures and in what
/// they state of the lens, each in order; unnamed cameras stand alone, and so do pictures that were
/// cropped at an unknown place ([`Framing::Cropped`] without a principal point).
pub fn group_by_camera(labels: &[Label]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, label) in labels.iter().enumerate() {
        let joins = |group: &[usize]| group.iter().all(|&i| same_camera(&labels[i], label));
        match groups.iter_mut().find(|group| joins(group)) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

fn same_camera(a: &Label, b: &Label) -> bool {
    b.camera.id.is_some()
        && a.camera.id == b.camera.id
        && can_share_lens(a, b)
        && agree(stated_focal(a), stated_focal(b), ONE_FOCAL_TOLERANCE)
}

fn refuse_different_cameras(labels: &[Label]) -> Result<(), SolveError> {
    let is_other = |&photo: &usize| {
        let mut before = labels[..photo].iter();
        before.any(|label| !can_share_lens(label, &labels[photo]))
    };
    match (0..labels.len()).find(is_other) {
        Some(photo) => Err(SolveError::DifferentPictures { photo }),
        None => Ok(()),
    }
}

fn can_share_lens(a: &Label, b: &Label) -> bool {
    same_frame(a, b) && agree(stated_lens(a), stated_lens(b), ONE_LENS_TOLERANCE)
}

/// What both state is the same to a tolerance.
fn agree<const N: usize>(a: [Option<f64>; N], b: [Option<f64>; N], most: f64) -> bool {
    let mut pairs = a.into_iter().zip(b);
    pairs.all(|(a, b)| a.zip(b).is_none_or(|(a, b)| (a - b).abs() <= most))
}

/// Logarithms of the 35 mm equivalent, and of the focal length in picture diagonals.
fn stated_focal(label: &Label) -> [Option<f64>; 2] {
    let camera = &label.camera;
    let in_diagonals = camera.focal_px.map(|px| px / diagonal_px(label));
    [camera.focal_35mm, in_diagonals].map(|focal| focal.map(libm::log))
}

/// k1, and the principal point in picture diagonals.
fn stated_lens(label: &Label) -> [Option<f64>; 3] {
    let principal = label.camera.principal_point_px;
    let principal = principal.map(|px| label.pixel(px) / diagonal_px(label));
    [
        label.camera.k1,
        principal.map(|p| p.x),
        principal.map(|p| p.y),
    ]
}

fn diagonal_px(label: &Label) -> f64 {
    Vector2::from(label.image_size().map(f64::from)).norm()
}

/// The labels with the k1 and the principal point that one of them states.
fn with_shared_lens(labels: &[Label]) -> Vec<Label> {
    let mut shared = labels.to_vec();
    let k1 = labels.iter().find_map(|label| label.camera.k1);
    let states_point = |label: &&Label| label.camera.principal_point_px.is_some();
    let centered = labels.iter().find(states_point);
    for label in &mut shared {
        label.camera.k1 = k1;
        if let Some(other) = centered {
            share_principal_point(label, other);
        }
    }
    shared
}

/// Takes over the principal point of the same picture at another size.
fn share_principal_point(label: &mut Label, other: &Label) {
    let scale = diagonal_px(label) / diagonal_px(other);
    let principal = other.camera.principal_point_px;
    label.camera.principal_point_px =
        principal.map(|px| label.labelled_px(other.pixel(px) * scale));
    let sigma_px = other.camera.principal_point_sigma_px;
    label.camera.principal_point_sigma_px = sigma_px.map(|sigma| sigma * scale);
}

/// Two pictures show the same frame of a camera, at any resolution: in units of the diagonal,
/// everything that a camera's photos share is then the same.
fn same_frame(a: &Label, b: &Label) -> bool {
    if is_unknown_part(a) || is_unknown_part(b) {
        return false;
    }
    if is_part(a) || is_part(b) {
        return a.image_size() == b.image_size() && a.image.crop == b.image.crop;
    }
    have_same_shape(a.image_size(), b.image_size())
}

/// Two sizes of a picture have the same shape.
pub fn have_same_shape(a: [u32; 2], b: [u32; 2]) -> bool {
    let ([aw, ah], [bw, bh]) = (a.map(f64::from), b.map(f64::from));
    // Reduced sizes are rounded to whole pixels.
    (aw * bh - ah * bw).abs() <= aw.max(ah).max(bw).max(bh)
}

/// Cropped nobody knows where: each photo by hand has its principal point elsewhere.
fn is_unknown_part(label: &Label) -> bool {
    label.framing() == Framing::Cropped && label.camera.principal_point_px.is_none()
}

fn is_part(label: &Label) -> bool {
    label.image.crop.is_some() || label.image.cropped == Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::{Scenario, View};
    use crate::camera::{LabelPoint, Priors, distorted};
    use crate::geom::Point3;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn labels(k: u64, count: usize, tilts: [f64; 2]) -> (Vec<Label>, f64) {
        let views = Scenario::realistic().views(31, k, count, tilts);
        let focal = views[0].camera.focal_px.x;
        let name = |v: View| {
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
        assert!(joint.outliers.is_empty(), "{:?}", joint.outliers);
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
    fn the_stated_error_of_a_lens_that_distorts_covers_the_truth() {
        const GROUPS: u64 = 20;
        let squared_pull = |k: u64| {
            let (labels, focal) = labels(k, 16, [25.0, 40.0]);
            let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
            let solution = joint.photos[0].as_ref().unwrap();
            // The photos' lens has 0.01 or -0.01.
            let kappa = solution.kappa.abs();
            assert!((0.004..0.016).contains(&kappa), "{k}: {kappa}");
            let off = libm::log(solution.camera.focal_px.x / focal);
            (off / solution.sigma.ln_focal).powi(2)
        };
        let mean = (0..GROUPS).map(squared_pull).sum::<f64>() / GROUPS as f64;
        assert!(mean < 2.0, "{mean}");
    }

    #[test]
    fn fewer_than_four_photos_that_can_be_used_are_a_pinhole_s() {
        let (mut labels, _) = labels(1, 4, [25.0, 40.0]);
        labels[3].surface.corners_px = Some([[0.0; 2]; 4]);
        for labels in [&labels[..3], &labels] {
            let joint = solve_joint(labels, &SolveOptions::default()).unwrap();
            let mut photos = joint.photos.iter().flatten();
            assert!(photos.all(|solution| solution.kappa == 0.0));
        }
    }

    #[test]
    fn a_wider_prior_of_the_distortion_is_kept() {
        let shared = |kappa_sigma: f64| {
            let priors = Priors {
                kappa_sigma,
                ..Priors::default()
            };
            let options = SolveOptions {
                priors,
                ..SolveOptions::default()
            };
            with_shared_kappa(&options).priors.kappa_sigma
        };
        assert_eq!([shared(0.0), shared(0.05)], [0.01, 0.05]);
    }

    /// Photos of one camera, the last of them at another zoom.
    fn labels_at_two_zooms(count: usize, zoomed: usize) -> Vec<Label> {
        let views = Scenario::default().views(31, 1, count, [25.0, 40.0]);
        let mut labels: Vec<Label> = views.into_iter().map(|view| view.label).collect();
        for label in &mut labels[count - zoomed..] {
            for [x, y] in label.surface.corners_px.as_mut().unwrap() {
                (*x, *y) = (2000.0 + 1.5 * (*x - 2000.0), 1500.0 + 1.5 * (*y - 1500.0));
            }
        }
        labels
    }

    #[test]
    fn photos_that_contradict_each_other_are_solved_as_alone() {
        let labels = labels_at_two_zooms(4, 2);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        for (label, photo) in labels.iter().zip(&joint.photos) {
            let photo = photo.as_ref().unwrap();
            let told = |w: &Diagnostic| w.message.contains("which needs another camera.id");
            assert!(photo.warnings.iter().any(told), "{:?}", photo.warnings);
            let alone = solve(label, &SolveOptions::default()).unwrap();
            assert_eq!((photo.kappa, photo.camera), (0.0, alone.camera));
        }
    }

    #[test]
    fn photos_at_two_zooms_are_solved_alone_and_say_so() {
        let labels = labels_at_two_zooms(3, 1);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let photos: Vec<_> = joint.photos.iter().map(|p| p.as_ref().unwrap()).collect();
        for photo in &photos {
            let told = |w: &Diagnostic| w.message.contains("which needs another camera.id");
            assert!(photo.warnings.iter().any(told), "{:?}", photo.warnings);
        }
        let zoom = photos[2].camera.focal_px.x / photos[0].camera.focal_px.x;
        assert!((1.3..1.7).contains(&zoom), "{zoom}");
    }

    #[test]
    fn a_stated_distortion_is_applied_at_the_focal_length_found() {
        let scenario = Scenario {
            kappa: 0.12,
            ..Scenario::realistic()
        };
        let views = scenario.views(31, 7, 4, [20.0, 40.0]);
        // Relative to half the diagonal in place of the focal length.
        let k1 = |kappa: f64, focal_px: f64| kappa * (focal_px / 2500.0).powi(2);
        let stated = k1(views[0].kappa, scenario.focal_px);
        let mut labels: Vec<Label> = views.into_iter().map(|view| view.label).collect();
        labels.iter_mut().for_each(|l| l.camera.k1 = Some(stated));
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        assert!(joint.outliers.is_empty(), "{:?}", joint.outliers);
        for solution in joint.photos.iter().flatten() {
            let focal_px = solution.camera.focal_px.x;
            let off = libm::log(focal_px / scenario.focal_px).abs();
            assert!(off < 4.0 * solution.sigma.ln_focal, "{focal_px}");
            let applied = k1(solution.kappa, focal_px);
            assert!((applied / stated - 1.0).abs() < 1e-8, "{applied} {stated}");
        }
    }

    #[test]
    fn what_one_label_states_of_the_lens_holds_for_all() {
        let (mut labels, _) = labels(1, 4, [10.0, 30.0]);
        labels[1].camera.principal_point_px = Some([2010.0, 1490.0]);
        labels[2].camera.k1 = Some(0.001);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let photos = joint.photos.iter().flatten();
        let lenses: Vec<_> = photos.map(|s| (s.camera.principal_px, s.kappa)).collect();
        assert!(lenses[0].1 > 0.0 && lenses == [lenses[0]; 4], "{lenses:?}");
        labels[3].camera.k1 = Some(-0.1);
        assert_eq!(
            solve_joint(&labels, &SolveOptions::default()).unwrap_err(),
            SolveError::DifferentPictures { photo: 3 }
        );
    }

    /// Six photos whose EXIF data state one and a half times their focal length, which is the second
    /// value.
    fn labels_with_wrong_exif() -> (Vec<Label>, f64) {
        let (mut labels, focal) = labels(1, 6, [10.0, 30.0]);
        let equivalent = 1.5 * focal / 5000.0 * 36f64.hypot(24.0);
        labels
            .iter_mut()
            .for_each(|l| l.camera.focal_35mm = Some(equivalent));
        (labels, focal)
    }

    #[test]
    fn photos_that_contradict_their_exif_value_are_solved_without_it() {
        let (labels, focal) = labels_with_wrong_exif();
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        assert!(joint.outliers.is_empty(), "{:?}", joint.outliers);
        for solution in joint.photos.iter().flatten() {
            let off = libm::log(solution.camera.focal_px.x / focal).abs();
            assert!(off < 4.0 * solution.sigma.ln_focal, "{off}");
            assert_eq!(solution.focal.prior_sigma, 0.35);
            let mut warnings = solution.warnings.iter();
            let conflict = warnings.find(|w| w.code == Code::FocalPriorConflict);
            let told = format!("the corners give {:.0} px", solution.camera.focal_px.x);
            assert!(conflict.unwrap().message.contains(&told), "{conflict:?}");
        }
    }

    /// Makes a label that of a photo of a quarter of the size.
    fn reduce(label: &mut Label) {
        (label.image.width, label.image.height) = (label.image.width / 4, label.image.height / 4);
        let surface = &mut label.surface;
        surface.corners_px = surface.corners_px.map(|c| c.map(|p| p.map(|v| v / 4.0)));
        surface.corner_sigma_px = surface.corner_sigma_px.map(|s| s / 4.0);
    }

    #[test]
    fn a_warning_about_photos_of_several_sizes_is_in_the_pixels_of_each() {
        let (mut labels, focal) = labels_with_wrong_exif();
        labels[3..].iter_mut().for_each(reduce);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let shares = [1.5, 1.5, 1.5, 0.375, 0.375, 0.375];
        for (photo, share) in joint.photos.iter().zip(shares) {
            let solution = photo.as_ref().unwrap();
            let mut warnings = solution.warnings.iter();
            let conflict = warnings.find(|w| w.code == Code::FocalPriorConflict);
            let (focal_px, exif_px) = (solution.camera.focal_px.x, share * focal);
            let told =
                format!("the corners give {focal_px:.0} px, the 35 mm equivalent {exif_px:.0} px");
            assert!(conflict.unwrap().message.contains(&told), "{conflict:?}");
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
        assert!((a.fit.condition / b.fit.condition - 1.0).abs() < 1e-3);
        assert!(a.fit.iterations < 60, "{}", a.fit.iterations);
    }

    #[test]
    fn a_photo_that_contradicts_is_left_out_and_an_impossible_one_keeps_its_error() {
        let (mut labels, _) = labels(3, 8, [15.0, 35.0]);
        labels[2].surface.corners_px.as_mut().unwrap()[1][0] += 120.0;
        labels[5].surface.corners_px = Some([[0.0; 2]; 4]);
        let joint = solve_joint(&labels, &SolveOptions::default()).unwrap();
        assert!(
            matches!(joint.outliers[..], [OutlierPhoto { photo: 2, .. }]),
            "{:?}",
            joint.outliers
        );
        assert!(matches!(
            joint.photos[5],
            Err(SolveError::Coincident { .. })
        ));
    }

    /// Labels with a grid of 24 further points on their surface, as noisy as the corners.
    fn labels_with_points(count: usize) -> Vec<Label> {
        let mut noise = ChaCha8Rng::seed_from_u64(6);
        // Evenly spread numbers of this range have a standard deviation of 1.
        let mut deviate = || 12f64.sqrt() * (f64::from(noise.next_u32()) / 2f64.powi(32) - 0.5);
        let mut pointed = |view: View| {
            let mut label = view.label;
            label.surface.id = "tray".into();
            let [w, h] = [label.surface.width_m, label.surface.height_m].map(Option::unwrap);
            for i in 0..24 {
                let [x, y] = [f64::from(i % 6) / 5.0 - 0.5, f64::from(i / 6) / 3.0 - 0.5];
                let place = Point3::new(x * view.size[0], y * view.size[1], 0.0);
                let seen = distorted(&view.camera, view.kappa, place);
                label.points.push(LabelPoint {
                    xyz_m: [x * w, y * h, 0.0],
                    px: [seen.x + deviate(), seen.y + deviate()],
                    sigma_px: None,
                    note: None,
                });
            }
            label
        };
        let scenario = Scenario {
            kappa: 0.0,
            ..Scenario::realistic()
        };
        let views = scenario.views(31, 6, count, [15.0, 35.0]);
        views.into_iter().map(&mut pointed).collect()
    }

    #[test]
    fn many_points_make_no_photo_an_outlier_and_hide_none() {
        let mut labels = labels_with_points(8);
        let outliers = |labels: &[Label]| {
            let joint = solve_joint(labels, &SolveOptions::default()).unwrap();
            let outliers = joint.outliers.into_iter();
            outliers.map(|outlier| outlier.photo).collect::<Vec<_>>()
        };
        assert_eq!(outliers(&labels), Vec::<usize>::new());
        // Zoomed in by 5 %.
        let zoomed = |px: &mut [f64; 2]| {
            *px = [
                2000.0 + 1.05 * (px[0] - 2000.0),
                1500.0 + 1.05 * (px[1] - 1500.0),
            ];
        };
        let photo = &mut labels[2];
        let corners = photo.surface.corners_px.iter_mut().flatten();
        corners.for_each(zoomed);
        photo
            .points
            .iter_mut()
            .for_each(|point| zoomed(&mut point.px));
        assert_eq!(outliers(&labels), [2]);
    }

    #[test]
    fn cameras_are_told_apart_by_name_and_shape_of_the_picture() {
        let (mut labels, _) = labels(4, 4, [20.0, 30.0]);
        (labels[1].image.width, labels[3].camera.id) = (3000, None);
        assert_eq!(group_by_camera(&labels), [vec![0, 2], vec![1], vec![3]]);
        assert!(matches!(
            solve_joint(&labels, &SolveOptions::default()),
            Err(SolveError::DifferentPictures { photo: 1 })
        ));
    }

    #[test]
    fn a_photo_that_was_cropped_nobody_knows_where_stands_alone() {
        let (labels, _) = labels(4, 2, [20.0, 30.0]);
        let groups = |cropped: [bool; 2], principal_px: Option<[f64; 2]>| {
            let mut labels = labels.clone();
            for (label, cropped) in labels.iter_mut().zip(cropped) {
                label.image.cropped = Some(cropped);
                label.camera.principal_point_px = principal_px;
            }
            group_by_camera(&labels).len()
        };
        assert_eq!(groups([true, true], None), 2);
        assert_eq!(groups([true, false], None), 2);
        assert_eq!(groups([false, true], None), 2);
        assert_eq!(groups([false, false], None), 1);
        assert_eq!(groups([true, true], Some([1700.0, 1400.0])), 1);
    }

    #[test]
    fn what_the_photos_state_counts_whatever_their_order() {
        let (mut labels, _) = labels(4, 2, [20.0, 30.0]);
        labels[0].surface.dimension_sigma_m = Some(0.001);
        labels[1].image.cropped = None;
        let sigma_of = |labels: &[Label]| {
            let joint = solve_joint(labels, &SolveOptions::default()).unwrap();
            joint.photos[0].as_ref().unwrap().sigma.ln_focal
        };
        let alone = solve(&labels[0], &SolveOptions::default()).unwrap();
        let forwards = sigma_of(&labels);
        labels.reverse();
        let backwards = sigma_of(&labels);
        assert!(
            (forwards / backwards - 1.0).abs() < 1e-4,
            "{forwards} {backwards}"
        );
        assert!(forwards < 1.02 * alone.sigma.ln_focal, "{forwards}");
    }

    #[test]
    fn photos_at_two_zooms_or_through_two_lenses_have_two_cameras() {
        let (mut labels, _) = labels(4, 5, [20.0, 30.0]);
        labels[1].camera.focal_35mm = Some(26.0);
        labels[2].camera.focal_35mm = Some(27.0);
        labels[3].camera.focal_px = Some(3000.0);
        (labels[4].camera.focal_px, labels[4].camera.k1) = (Some(3030.0), Some(0.1));
        assert_eq!(group_by_camera(&labels), [vec![0, 1, 3, 4], vec![2]]);
        labels[0].camera.k1 = Some(0.0);
        assert_eq!(group_by_camera(&labels), [vec![0, 1, 3], vec![2, 4]]);
    }

    #[test]
    fn a_reduced_photo_shares_the_lens() {
        let (mut labels, _) = labels(5, 6, [10.0, 30.0]);
        labels[0].camera.principal_point_px = Some([2010.0, 1490.0]);
        let together = solve_joint(&labels, &SolveOptions::default()).unwrap();
        let mut reduced = labels.clone();
        reduced[3..].iter_mut().for_each(reduce);
        assert_eq!(group_by_camera(&reduced), [vec![0, 1, 2, 3, 4, 5]]);
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
