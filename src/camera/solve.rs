//! From a label to a camera, with a warning for everything unusual.

use super::chi::CHI2_99;
use super::corners::COINCIDENT_PX;
use super::error::{ContradictedValue, SolveError};
use super::focal::PriorSource;
use super::hedge::is_off_center;
use super::label::{Framing, Label, LabelCamera, LabelPoint};
use super::options::{CornerOrder, SolveOptions};
use super::pinhole::diagonal_px;
use super::problem::Problem;
use super::refine::Minimum;
use super::search::{SearchResult, degrees_apart};
use super::solution::Solution;
use super::uncertainty::{FocalShare, Uncertainty};
use crate::diagnostic::{Code, Diagnostic};
use crate::geom::Vector2;

/// Picture and prior contradict each other beyond this many standard deviations.
const CONFLICT_SIGMAS: f64 = 3.0;
/// EXIF values of focal lengths are wrong by 0.6 to 1.6 times. Exchanged sides of r:1 look as if one
/// were wrong by r^2 or more: those of 1.35:1 always by more than this, those of 1.2:1 in views that
/// are tilted by less than 45 degrees.
const GROSS_FOCAL_RATIO: f64 = 1.8;

/// Solves the camera that sees a rectangle of known size at four labelled corners.
///
/// The rectangle becomes the world plane `z = 0`, centred, `+x` along its width.
///
/// # Method
/// The most probable camera given the corners and the priors of focal length, tape measure and
/// lens, from several closed-form starts; the covariance at the optimum gives how well each
/// quantity is known. Where the picture does not constrain the focal length, the answer rests on
/// its prior, and [`Solution::focal_source`] says so. A picture that may have been cropped is
/// treated as whole as long as its corners allow that, with the error that it has if it is not
/// ([`Label::framing`]).
///
/// A camera that does not fit its label is returned, too: [`Solution::fitting`] refuses it.
/// # Errors
/// [`SolveError`], for labels that no camera can have seen. A view from straight above is not an
/// error.
/// # Examples
/// ```
/// # use petcomp::camera::{self, Label};
/// // A rectangle of 0.6 m x 0.4 m from 0.8 m away, tilted by 30 degrees.
/// let corners = [[120.0, 124.5], [520.0, 124.5], [577.1, 388.5], [62.9, 388.5]];
/// let label = Label::new([640, 480], corners, [0.6, 0.4]);
/// let solution = camera::solve(&label, &Default::default())?;
/// assert!((solution.camera.tilt().to_degrees() - 30.0).abs() < 1.0);
/// # Ok::<(), camera::SolveError>(())
/// ```
pub fn solve(label: &Label, options: &SolveOptions) -> Result<Solution, SolveError> {
    solve_compared(label, options).map_err(|why| about_points(why, label))
}

/// The error of a label whose corners were predicted from points is about the points.
fn about_points(why: SolveError, label: &Label) -> SolveError {
    let is_of_corners = why.is_of_corners();
    if label.surface.corners_px.is_some() || !is_of_corners && why != SolveError::NoCorners {
        return why;
    }
    let are_markers = label.points.iter().all(LabelPoint::is_marker_corner);
    match coincident(&label.points) {
        Some(pair) if !are_markers => pair,
        _ if is_of_corners => SolveError::PointsUnseen {
            at: if are_markers { "markers.map" } else { "points" },
        },
        _ => why,
    }
}

/// The first two of four or more points that have the same place.
fn coincident(points: &[LabelPoint]) -> Option<SolveError> {
    let seconds = if points.len() < 4 { 0 } else { points.len() };
    let mut pairs = (0..seconds).flat_map(|second| (0..second).map(move |first| (first, second)));
    pairs.find_map(|(first, second)| {
        let place = common_place(&points[first], &points[second])?;
        Some(SolveError::PointsCoincident {
            first,
            second,
            place,
        })
    })
}

/// The field in which two points agree where they must not.
fn common_place(a: &LabelPoint, b: &LabelPoint) -> Option<&'static str> {
    let distance_px = (Vector2::from(a.px) - Vector2::from(b.px)).norm();
    if a.xyz_m == b.xyz_m {
        Some("xyz_m")
    } else if distance_px < COINCIDENT_PX {
        Some("px")
    } else {
        None
    }
}

fn solve_compared(label: &Label, options: &SolveOptions) -> Result<Solution, SolveError> {
    if options.max_iterations.is_some() {
        return solve_as_labelled(label, options).map(|solved| solved.solution);
    }
    let solution = solve_without_wrong_exif(label, options)?;
    let compared = compare_exchanged_sides(label, options, solution);
    Ok(compare_without_stated(label, options, compared))
}

/// A solution and what it comes from.
struct SolvedProblem {
    solution: Solution,
    problem: Problem,
    minimum: Minimum,
}

/// The solution of a label as it stands.
fn solve_as_labelled(label: &Label, options: &SolveOptions) -> Result<SolvedProblem, SolveError> {
    let may_hedge = options.max_iterations.is_none() && options.priors.cropping_matters();
    match label.framing() {
        Framing::Unknown if may_hedge => solve_perhaps_cropped(label, options),
        Framing::Unknown => solve_framed(label, Framing::Whole, options),
        known => solve_framed(label, known, options),
    }
}

/// The solution of a picture that may have been cropped.
fn solve_perhaps_cropped(
    label: &Label,
    options: &SolveOptions,
) -> Result<SolvedProblem, SolveError> {
    let whole = solve_framed(label, Framing::Whole, options);
    let loose = solve_framed(label, Framing::Unknown, options);
    match (whole, loose) {
        (Ok(whole), Ok(loose)) => Ok(whole_or_cropped(whole, loose, label, options)),
        (Ok(whole), Err(_)) => Ok(whole),
        (Err(_), loose) => loose.map(|loose| loose.off_center(None)),
    }
}

impl SolvedProblem {
    /// Where what the picture gives for the focal length contradicts its prior.
    fn focal_conflict(&self) -> Option<FocalConflict> {
        let prior = self.problem.residuals.priors.ln_focal;
        let focal = Uncertainty::new(&self.minimum, prior).focal;
        FocalConflict::new(&self.problem, &focal)
    }

    /// The camera of a picture that turns out not to be whole, and beside it that of a whole one.
    fn off_center(self, whole: Option<Solution>) -> Self {
        Self {
            solution: self.solution.off_center(whole),
            ..self
        }
    }
}

/// The camera of a whole picture with the uncertainty of both, or the other one where the corners
/// demand it.
fn whole_or_cropped(
    whole: SolvedProblem,
    loose: SolvedProblem,
    label: &Label,
    options: &SolveOptions,
) -> SolvedProblem {
    if is_off_center(whole.minimum.cost, loose.minimum.cost) {
        return loose.off_center(Some(whole.solution));
    }
    let apart = whole.minimum.state.step_to(&loose.minimum.state);
    SolvedProblem {
        solution: whole
            .solution
            .hedged(&loose.solution, &apart, label, options),
        ..whole
    }
}

/// The solution of a picture of some framing; another pose that fits as well is its alternative.
fn solve_framed(
    label: &Label,
    framing: Framing,
    options: &SolveOptions,
) -> Result<SolvedProblem, SolveError> {
    let problem = Problem::new(label, framing, options)?;
    let SearchResult { best, other } = search(&problem, options)?;
    let mut solution = problem.solution(&best, options);
    if !solution.is_finite() {
        return Err(SolveError::NoPose);
    }
    if let Some(other) = other.filter(|other| other.cost < best.cost + CHI2_99) {
        solution.warnings.push(ambiguity_warning(&best, &other));
        solution.alternative = Some(Box::new(problem.solution(&other, options)));
    }
    Ok(SolvedProblem {
        solution,
        problem,
        minimum: best,
    })
}

fn ambiguity_warning(best: &Minimum, other: &Minimum) -> Diagnostic {
    let apart_deg = degrees_apart(&best.state.pose, &other.state.pose);
    let what = format!(
        "the pose is ambiguous: another one, turned by {apart_deg:.1} degrees, fits almost as well"
    );
    Diagnostic::warning(Code::PoseAmbiguous, what)
}

fn search(problem: &Problem, options: &SolveOptions) -> Result<SearchResult, SolveError> {
    let found = match options.max_iterations {
        None => problem.search(),
        Some(limit) => problem.closed_form(limit),
    };
    found.ok_or(SolveError::NoPose)
}

/// Solves; where the picture contradicts its own EXIF value, solves again without that and keeps
/// the first answer as the alternative, unless it is the sides that are wrong.
fn solve_without_wrong_exif(label: &Label, options: &SolveOptions) -> Result<Solution, SolveError> {
    let solved = solve_as_labelled(label, options)?;
    let conflict = solved.focal_conflict();
    let mut solution = solved.solution;
    let Some(conflict) = conflict else {
        return Ok(solution);
    };
    if !conflict.is_with_exif() {
        let warning = conflict.warning(&solution);
        solution.warnings.push(warning);
        return Ok(solution);
    }
    let second = solve_as_labelled(&without_exif_focal(label), options)?.solution;
    let warning = conflict.warning(&second);
    if conflict.is_gross(&second)
        && second.misfit().is_none()
        && fits_exchanged_with_exif(label, options, solution.fit.chi2)
    {
        solution.warnings.push(warning);
        return Ok(solution);
    }
    Ok(second.preferred_to(solution, warning))
}

/// With width and height exchanged the picture agrees with its EXIF value, and fits clearly better
/// than this chi squared: seen straight on, exchanged sides look like a longer lens.
fn fits_exchanged_with_exif(label: &Label, options: &SolveOptions, chi2: f64) -> bool {
    exchanged(label)
        .and_then(|exchanged| solve_as_labelled(&exchanged, options).ok())
        .filter(|other| other.focal_conflict().is_none())
        .map(|other| other.solution)
        .is_some_and(|other| other.misfit().is_none() && other.fit.chi2 + CHI2_99 < chi2)
}

/// The label without what EXIF data say of the focal length, where that is what it goes by.
pub(super) fn without_exif_focal(label: &Label) -> Label {
    let mut without = label.clone();
    without.camera.forget_equivalent();
    without
}

impl Solution {
    /// With another solution as its alternative, and a warning that says why.
    fn preferred_to(mut self, other: Self, warning: Diagnostic) -> Self {
        self.warnings.push(warning);
        self.alternative = Some(Box::new(other));
        self
    }
}

/// What the picture gives for the focal length contradicts its prior.
#[derive(Clone, Copy, Debug)]
pub(super) struct FocalConflict {
    source: PriorSource,
    /// The focal length that was expected, in half diagonals of the picture.
    prior_half_diagonals: f64,
    /// How far apart the two are, in standard deviations of the difference.
    sigmas: f64,
    /// The label states the camera's height, from which the focal length follows, too.
    has_height: bool,
}

impl FocalConflict {
    /// None where picture and prior agree.
    pub(super) fn new(problem: &Problem, focal: &FocalShare) -> Option<Self> {
        let prior = problem.residuals.priors.ln_focal;
        let conflict = Self {
            source: problem.prior_source,
            prior_half_diagonals: libm::exp(prior.mean),
            sigmas: focal.prior_conflict(prior)?.abs(),
            has_height: !problem.residuals.priors.ln_height.is_flat(),
        };
        (conflict.sigmas > CONFLICT_SIGMAS).then_some(conflict)
    }

    /// The prior is that of EXIF data, without which the label can be solved.
    pub(super) fn is_with_exif(&self) -> bool {
        self.source == PriorSource::Exif
    }

    /// A solution without the prior is farther from it than a wrong EXIF value alone explains.
    fn is_gross(&self, without: &Solution) -> bool {
        let ratio = without.camera.focal_px.x / self.prior_px(without);
        libm::log(ratio).abs() > libm::log(GROSS_FOCAL_RATIO)
    }

    /// The focal length that was expected, in pixels of a solution's picture.
    fn prior_px(&self, solution: &Solution) -> f64 {
        self.prior_half_diagonals * diagonal_px(solution.camera.image) / 2.0
    }

    /// With the solution without the EXIF value, or else with the one that is taken.
    pub(super) fn warning(&self, solution: &Solution) -> Diagnostic {
        let (prior_px, sigmas) = (self.prior_px(solution), self.sigmas);
        let focal_px = solution.camera.focal_px.x;
        let [source, causes] = source_and_causes(self.source);
        // What the corners give alone is known only where a solution goes by them alone: beside a
        // wrong prior, the information that they have there puts it anywhere.
        let found = if self.is_with_exif() {
            format!("the corners give {focal_px:.0} px, {source} {prior_px:.0} px")
        } else {
            format!(
                "taken as {focal_px:.0} px, between the {prior_px:.0} px of {source} and what the \
                 corners give"
            )
        };
        let height = if self.has_height {
            ", or a wrong camera.height_m"
        } else {
            ""
        };
        let what = format!("focal length: {found} ({sigmas:.1} sigmas apart): {causes}{height}");
        Diagnostic::warning(Code::FocalPriorConflict, what)
    }
}

/// What an expected focal length comes from, and why the corners may contradict it.
fn source_and_causes(prior: PriorSource) -> [&'static str; 2] {
    match prior {
        PriorSource::Label => [
            "the label",
            "wrong camera.focal_px, a cropped or zoomed picture",
        ],
        PriorSource::Exif => [
            "the 35 mm equivalent",
            "wrong EXIF data or camera.focal_35mm, a cropped or zoomed picture",
        ],
        PriorSource::Nominal => [
            "a common lens",
            "another lens (give camera.focal_px in the label), or wrong dimensions",
        ],
    }
}

/// Where width and height exchanged fit clearly better, adds a warning and the better solution, as
/// the alternative or, with [`CornerOrder::Auto`], as the first.
fn compare_exchanged_sides(
    label: &Label,
    options: &SolveOptions,
    mut labelled: Solution,
) -> Solution {
    let Some(exchanged) = with_exchanged_sides(label, options, labelled.fit.chi2) else {
        return labelled;
    };
    let warning = exchange_warning(labelled.fit.chi2, exchanged.fit.chi2);
    if options.order == CornerOrder::Auto {
        return exchanged.preferred_to(labelled, warning);
    }
    labelled.fit.exchanged_chi2 = Some(exchanged.fit.chi2);
    labelled.preferred_to(exchanged, warning)
}

fn exchange_warning(labelled_chi2: f64, exchanged_chi2: f64) -> Diagnostic {
    let what = format!(
        "width and height look swapped (chi squared {labelled_chi2:.1} as labelled, {exchanged_chi2:.1} swapped)"
    );
    Diagnostic::warning(Code::SidesSwapped, what)
}

/// The solution with width and height exchanged, where it fits clearly better than this chi
/// squared.
fn with_exchanged_sides(label: &Label, options: &SolveOptions, chi2: f64) -> Option<Solution> {
    let exchanged = exchanged(label).filter(|_| chi2 > CHI2_99)?;
    let other = solve_without_wrong_exif(&exchanged, options).ok()?;
    (other.fit.chi2 + CHI2_99 < chi2).then_some(other)
}

/// The label with width and height exchanged; none where they are the same, or not both stated.
fn exchanged(label: &Label) -> Option<Label> {
    let surface = &label.surface;
    let size = [surface.height_m?, surface.width_m?];
    let mut exchanged = label.clone();
    exchanged.surface.set_size(size);
    (size[0] != size[1]).then_some(exchanged)
}

/// Where a label does not fit but does without one of the values that it states, names the one
/// without which it fits best.
fn compare_without_stated(
    label: &Label,
    options: &SolveOptions,
    mut labelled: Solution,
) -> Solution {
    if labelled.misfit().is_some() {
        let fits = STATED_VALUES
            .iter()
            .filter_map(|value| value.fit_without(label, options));
        let best = fits
            .filter(|(chi2, _)| chi2 + CHI2_99 < labelled.fit.chi2)
            .min_by(|(a, _), (b, _)| a.total_cmp(b));
        labelled.fit.contradicted = best.map(|(_, value)| value);
    }
    labelled
}

/// A value of the camera that a label may state.
struct StatedValue {
    /// Drops it from a label.
    forget: fn(&mut LabelCamera),
    /// As stated, and as a solution without it has it; none where it is not stated.
    compare: fn(&LabelCamera, &Solution) -> Option<ContradictedValue>,
}

const STATED_VALUES: [StatedValue; 4] = [
    StatedValue {
        forget: |camera| (camera.height_m, camera.height_sigma_m) = (None, None),
        compare: |camera, found| {
            Some(ContradictedValue {
                at: "camera.height_m",
                stated: camera.height_m?,
                found: found.camera.height_m(),
            })
        },
    },
    StatedValue {
        forget: |camera| {
            (camera.focal_px, camera.focal_sigma, camera.focal_fixed) = (None, None, false);
        },
        compare: |camera, found| {
            Some(ContradictedValue {
                at: "camera.focal_px",
                stated: camera.focal_px?,
                found: found.camera.focal_px.x,
            })
        },
    },
    StatedValue {
        forget: |camera| camera.principal_point_px = None,
        compare: |camera, found| {
            let (stated, found) = (camera.principal_point_px?, found.camera.principal_px);
            let [across, down] = [0, 1].map(|axis: usize| ContradictedValue {
                at: [
                    "camera.principal_point_px[0]",
                    "camera.principal_point_px[1]",
                ][axis],
                stated: stated[axis],
                found: found[axis],
            });
            let error = |value: &ContradictedValue| (value.stated - value.found).abs();
            Some(if error(&down) > error(&across) {
                down
            } else {
                across
            })
        },
    },
    StatedValue {
        forget: |camera| camera.k1 = None,
        compare: |camera, found| {
            Some(ContradictedValue {
                at: "camera.k1",
                stated: camera.k1?,
                found: found.k1(),
            })
        },
    },
];

impl StatedValue {
    /// Chi squared of a label that states the value and fits without it.
    fn fit_without(
        &self,
        label: &Label,
        options: &SolveOptions,
    ) -> Option<(f64, ContradictedValue)> {
        let mut without = label.clone();
        (self.forget)(&mut without.camera);
        if without.camera == label.camera {
            return None;
        }
        let solution = solve_without_wrong_exif(&without, options).ok()?;
        let value = (self.compare)(&label.camera, &solution)?;
        solution
            .misfit()
            .is_none()
            .then_some((solution.fit.chi2, value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::rectangle::corner_points;
    use crate::camera::simulate::Scenario;

    fn misfit(label: &Label) -> Option<SolveError> {
        solve(label, &SolveOptions::default()).unwrap().misfit()
    }

    /// Points at the corners of a rectangle, with x to the left.
    fn mirrored_points(note: &str) -> Label {
        let scenario = Scenario::default();
        let mut label = scenario.tilted(35.0).view(1, 0).label;
        let corners_px = label.surface.corners_px.take().unwrap();
        let places = corner_points(scenario.size).into_iter().zip(corners_px);
        let points = places.map(|(place, px)| LabelPoint {
            xyz_m: [-place.x, place.y, place.z],
            px,
            sigma_px: None,
            note: Some(note.into()),
        });
        label.points = points.collect();
        label
    }

    #[test]
    fn mirrored_points_are_told_where_they_are_stated() {
        for (note, at) in [("rim", "points"), ("marker 3", "markers.map")] {
            let refusal = solve(&mirrored_points(note), &SolveOptions::default()).unwrap_err();
            assert_eq!(refusal, SolveError::PointsUnseen { at });
            assert!(refusal.to_string().ends_with("are they mirrored?"));
        }
    }

    #[test]
    fn of_points_with_the_same_place_the_second_is_named() {
        let mut label = mirrored_points("rim");
        let flip = |point: &mut LabelPoint| point.xyz_m[0] = -point.xyz_m[0];
        label.points.iter_mut().for_each(flip);
        solve(&label, &SolveOptions::default()).unwrap();
        let refusal = |change: fn(&mut [LabelPoint])| {
            let mut label = label.clone();
            change(&mut label.points);
            let refusal = solve(&label, &SolveOptions::default()).unwrap_err();
            refusal.to_string()
        };
        let told = refusal(|points| points[2].px = points[0].px);
        assert_eq!(told, "points[2].px: that of points[0], expected another");
        let told = refusal(|points| points[3].xyz_m = points[1].xyz_m);
        assert_eq!(told, "points[3].xyz_m: that of points[1], expected another");
    }

    #[test]
    fn exchanged_sides_seen_straight_on_are_not_blamed_on_the_exif_value() {
        let scenario = Scenario {
            focal_px: 3000.0,
            size: [0.297, 0.21],
            fill: 0.6,
            azimuth: Some(0.0),
            ..Scenario::default()
        };
        let mut label = scenario.tilted(35.0).view(1, 0).label;
        let equivalent = 3000.0 / 5000.0 * 36f64.hypot(24.0);
        label.camera.focal_35mm = Some(equivalent);
        let refusal = misfit(&exchanged(&label).unwrap()).unwrap().to_string();
        assert!(refusal.contains("swap width_m and height_m"), "{refusal}");
        for factor in [1.0, 1.5, 1.0 / 1.5] {
            label.camera.focal_35mm = Some(factor * equivalent);
            assert_eq!(misfit(&label), None, "{factor}");
        }
    }

    #[test]
    fn a_wrong_exif_value_is_not_blamed_on_sides_that_are_nearly_the_same() {
        let corners = [
            [1322.70582, 854.41696],
            [3722.70582, 854.41696],
            [3222.03940, 2370.23246],
            [1519.54643, 2370.23246],
        ];
        let mut label = Label::new([4000, 3000], corners, [0.42, 0.4]);
        (label.image.cropped, label.camera.focal_35mm) = (Some(false), Some(35.4));
        let solution = solve(&label, &SolveOptions::default()).unwrap();
        assert_eq!(solution.misfit(), None);
        let focal_px = solution.camera.focal_px.x;
        assert!((focal_px / 3200.0 - 1.0).abs() < 0.05, "{focal_px}");
        let mut warnings = solution.warnings.iter();
        assert!(warnings.any(|w| w.code == Code::FocalPriorConflict));
    }

    #[test]
    fn a_height_without_which_the_label_fits_is_named() {
        let view = Scenario::default().tilted(30.0).view(1, 1);
        let (mut label, height) = (view.label, view.camera.center().z);
        (label.camera.focal_px, label.camera.focal_fixed) = (Some(3200.0), true);
        label.surface.dimension_sigma_m = Some(1e-5);
        label.camera.height_m = Some(1.3 * height);
        label.camera.height_sigma_m = Some(0.01 * height);
        let refusal = misfit(&label).unwrap().to_string();
        let stated = 1.3 * height;
        let expected = format!("camera.height_m: {stated} m, expected the {height:.3} m");
        assert!(refusal.contains(&expected), "{refusal}");
    }

    #[test]
    fn the_value_of_the_camera_without_which_the_label_fits_is_named() {
        let view = Scenario::default().tilted(35.0).view(1, 1);
        let focal_px = view.camera.focal_px.x;
        let middle = view.camera.principal_px.y;
        let told = |change: &dyn Fn(&mut LabelCamera)| {
            let mut label = view.label.clone();
            label.image.cropped = Some(false);
            change(&mut label.camera);
            misfit(&label).unwrap().to_string()
        };
        for (stated, fixed) in [(2.0 * focal_px, false), (0.5 * focal_px, true)] {
            let told = told(&|camera| {
                (camera.focal_px, camera.focal_fixed) = (Some(stated), fixed);
            });
            let named = format!("camera.focal_px: {stated} px, expected the ");
            assert!(told.contains(&named), "{told}");
        }
        let told_of_place = told(&|camera| camera.principal_point_px = Some([0.5, middle]));
        let named = "camera.principal_point_px[0]: 0.5 px, expected the ";
        assert!(told_of_place.contains(named), "{told_of_place}");
        let told_of_lens = told(&|camera| camera.k1 = Some(1e6));
        let named = "camera.k1: 1000000, expected the ";
        assert!(told_of_lens.contains(named), "{told_of_lens}");
    }

    /// A whole picture through a lens of about 1480 px.
    fn label_of_1480_px() -> Label {
        let corners = [
            [235.8, 239.2],
            [1019.7, 215.7],
            [1008.9, 701.2],
            [275.6, 738.8],
        ];
        let mut label = Label::new([1280, 960], corners, [0.56, 0.37]);
        label.image.cropped = Some(false);
        label
    }

    /// The focal length that is taken, and what is said of that which was expected.
    fn focal_conflict(label: &Label) -> (f64, String) {
        let solution = solve(label, &SolveOptions::default()).unwrap();
        let mut warnings = solution.warnings.iter();
        let conflict = warnings.find(|w| w.code == Code::FocalPriorConflict);
        let message = conflict.unwrap().message.clone();
        (solution.camera.focal_px.x, message)
    }

    #[test]
    fn a_conflict_names_the_focal_length_that_is_taken() {
        let mut label = label_of_1480_px();
        label.camera.focal_35mm = Some(20.0);
        let (focal_px, said) = focal_conflict(&label);
        let told = format!("the corners give {focal_px:.0} px, the 35 mm equivalent 740 px");
        assert!(said.contains(&told), "{said}");
    }

    #[test]
    fn beside_a_stated_focal_length_it_is_not_said_what_the_corners_give() {
        let mut label = label_of_1480_px();
        (label.camera.focal_px, label.camera.focal_sigma) = (Some(739.6), Some(0.05));
        let (focal_px, said) = focal_conflict(&label);
        let told = format!(
            "taken as {focal_px:.0} px, between the 740 px of the label and what the corners give ("
        );
        assert!(said.contains(&told), "{said}");
    }
}
