//! From a label to a camera, with every doubt that the label gives reason for.

use super::error::SolveError;
use super::focal::Witness;
use super::hedge::is_off_center;
use super::label::{Framing, Label};
use super::options::{CornerOrder, Effort, SolveOptions};
use super::problem::Problem;
use super::refine::Minimum;
use super::search::{Found, TELLING, degrees_apart};
use super::solution::Solution;
use super::uncertainty::Uncertainty;
use super::warning::Warning;

/// Picture and belief contradict each other beyond this many standard deviations.
const CONFLICT_SIGMAS: f64 = 3.0;
/// How often a stated distortion is understood anew, and the relative change of the focal length that ends it.
const MOST_REPEATS: usize = 20;
const SETTLED: f64 = 1e-9;

/// Solves the camera that sees a rectangle of known size at four labelled corners.
///
/// The rectangle becomes the world plane `z = 0`, centred, `+x` along its width.
///
/// # Method
/// The most probable camera given the corners and what is known of focal length, tape measure and lens, from several
/// closed-form starts; the covariance at the optimum tells how well each quantity is known. Where the picture cannot tell
/// the focal length, the answer rests on what was believed, and [`Solution::focal_source`] says so. A picture of which
/// nobody says that it is whole is taken for whole as long as its corners allow that, with the error that it has if it is
/// not ([`Label::framing`]).
///
/// A camera that does not fit its label is returned, too: [`Solution::fitting`] refuses it.
/// # Errors
/// [`SolveError`], for labels that no camera can have seen. A view from straight above is not an error.
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
    if options.effort != Effort::Whole {
        return as_labelled(label, options).map(|solved| solved.solution);
    }
    let solution = without_wrong_exif(label, options)?;
    Ok(with_sides_exchanged(label, options, solution))
}

/// A solution and what it comes from.
struct Solved {
    solution: Solution,
    problem: Problem,
    minimum: Minimum,
}

/// The solution of a label as it stands.
fn as_labelled(label: &Label, options: &SolveOptions) -> Result<Solved, SolveError> {
    match label.framing() {
        Framing::Unknown
            if options.effort == Effort::Whole && options.priors.cropping_matters() =>
        {
            perhaps_cropped(label, options)
        }
        Framing::Unknown => framed(label, Framing::Whole, options),
        known => framed(label, known, options),
    }
}

/// The solution of a picture of which nobody says that it is whole.
fn perhaps_cropped(label: &Label, options: &SolveOptions) -> Result<Solved, SolveError> {
    let whole = framed(label, Framing::Whole, options);
    let loose = framed(label, Framing::Unknown, options);
    let (whole, loose) = match (whole, loose) {
        (Ok(whole), Ok(loose)) => (whole, loose),
        (Ok(whole), Err(_)) => return Ok(whole),
        (Err(_), loose) => {
            return loose.map(|l| Solved {
                solution: l.solution.off_center(None),
                ..l
            });
        }
    };
    if is_off_center(whole.minimum.cost, loose.minimum.cost) {
        let solution = loose.solution.off_center(Some(whole.solution));
        return Ok(Solved { solution, ..loose });
    }
    let apart = whole.minimum.state.step_to(&loose.minimum.state);
    Ok(Solved {
        solution: whole.solution.hedged(&loose.solution, &apart, options),
        ..whole
    })
}

/// The solution of a picture of some framing; another pose that fits as well is its alternative.
fn framed(label: &Label, framing: Framing, options: &SolveOptions) -> Result<Solved, SolveError> {
    let (problem, found) = with_stated_distortion(label, framing, options)?;
    let mut solution = problem.solution(&found.best, options);
    if !solution.is_finite() {
        return Err(SolveError::NoPose);
    }
    if let Some(other) = found
        .other
        .filter(|other| other.cost < found.best.cost + TELLING)
    {
        let apart_deg = degrees_apart(&found.best.state.stance, &other.state.stance);
        solution.warnings.push(Warning::PoseAmbiguous { apart_deg });
        solution.alternative = Some(Box::new(problem.solution(&other, options)));
    }
    Ok(Solved {
        solution,
        problem,
        minimum: found.best,
    })
}

/// The search, repeated for a label that states k1 until that is understood at the focal length found.
fn with_stated_distortion(
    label: &Label,
    framing: Framing,
    options: &SolveOptions,
) -> Result<(Problem, Found), SolveError> {
    let mut problem = Problem::new(label, framing, options)?;
    let mut found = search(&problem, options)?;
    let known =
        label.camera.k1.is_none_or(|k1| k1 == 0.0) || problem.evidence.beliefs.ln_focal.is_fact();
    let mut understood = problem.evidence.beliefs.ln_focal.mean;
    for _ in 0..if known { 0 } else { MOST_REPEATS } {
        let ln_focal = found.best.state.ln_focal;
        if (ln_focal - understood).abs() < SETTLED {
            break;
        }
        understood = ln_focal;
        problem = Problem::with_focal(label, framing, Some(libm::exp(ln_focal)), options)?;
        found = search(&problem, options)?;
    }
    Ok((problem, found))
}

fn search(problem: &Problem, options: &SolveOptions) -> Result<Found, SolveError> {
    let found = match options.effort {
        Effort::Whole => problem.search(),
        Effort::Steps(most) => problem.first_guess(most),
    };
    found.ok_or(SolveError::NoPose)
}

/// Solves; where the picture contradicts its own EXIF value, solves again without that and keeps the first answer beside.
fn without_wrong_exif(label: &Label, options: &SolveOptions) -> Result<Solution, SolveError> {
    let Solved {
        mut solution,
        problem,
        minimum,
    } = as_labelled(label, options)?;
    let Some(conflict) = focal_conflict(&problem, &minimum) else {
        return Ok(solution);
    };
    if problem.witness != Witness::Exif {
        solution.warnings.push(conflict);
        return Ok(solution);
    }
    let mut doubted = label.clone();
    (doubted.camera.focal_35mm, doubted.camera.focal_sigma) = (None, None);
    let mut second = as_labelled(&doubted, options)?.solution;
    second.warnings.push(conflict);
    second.alternative = Some(Box::new(solution));
    Ok(second)
}

fn focal_conflict(problem: &Problem, minimum: &Minimum) -> Option<Warning> {
    let believed = problem.evidence.beliefs.ln_focal;
    let focal = Uncertainty::new(minimum, believed).focal;
    let sigmas = focal.conflict(believed)?.abs();
    let to_px = |ln_focal: f64| libm::exp(ln_focal) * problem.frame.unit_px;
    let (believed_px, measured_px) = (to_px(believed.mean), to_px(focal.from_data?.mean));
    (sigmas > CONFLICT_SIGMAS).then_some(Warning::FocalPriorConflict {
        believed_px,
        measured_px,
        sigmas,
    })
}

/// Where width and height exchanged fit clearly better, says so, and has the better one beside, or before when asked.
fn with_sides_exchanged(label: &Label, options: &SolveOptions, solution: Solution) -> Solution {
    let surface = &label.surface;
    let differ = surface.width_m.is_some()
        && surface.height_m.is_some()
        && surface.width_m != surface.height_m;
    let labelled = solution.fit.chi2;
    if !differ || labelled <= TELLING {
        return solution;
    }
    let mut exchanged = label.clone();
    (exchanged.surface.width_m, exchanged.surface.height_m) = (surface.height_m, surface.width_m);
    let Ok(other) = without_wrong_exif(&exchanged, options) else {
        return solution;
    };
    if other.fit.chi2 + TELLING >= labelled {
        return solution;
    }
    let swapped = Warning::SidesSwapped {
        labelled,
        exchanged: other.fit.chi2,
    };
    let (mut first, second) = if options.order == CornerOrder::Auto {
        (other, solution)
    } else {
        (solution, other)
    };
    first.warnings.push(swapped);
    first.alternative = Some(Box::new(second));
    first
}
