//! Labels from which a camera is hard to solve: nearly without perspective, grazing, tiny, huge,
//! degenerate, wrong.

use super::{HardCase, Outcome};
use petcomp::camera::simulate::{Scenario, View};
use petcomp::camera::{FocalSource, Label, Priors, Solution, SolveError, SolveOptions, solve};
use petcomp::{Code, Result};

/// Number of views of a kind; the worst of them counts.
const VIEW_COUNT: u64 = 20;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases: Vec<HardCase> = [81.0, 85.0, 89.0].map(grazing_view).into();
    cases.extend(extreme_geometry());
    cases.extend(extreme_cameras());
    cases.extend([
        HardCase::new(
            "tilted by 0.01 degrees",
            format!("exact corners of {VIEW_COUNT} views"),
            "reprojection error at most 1e-6 px, valid numbers",
            solve_nearly_level_views,
        ),
        HardCase::new(
            "no perspective, no priors",
            "a rectangle tilted by 30 degrees seen from infinitely far away",
            "focal length at its bound of 100 widths, reported as unbounded; tilt 30 degrees to 0.1",
            solve_without_perspective,
        ),
        HardCase::new(
            "no perspective, the default prior of the lens",
            "the same corners",
            "a solution that is not reported as unbounded, valid numbers",
            solve_with_priors,
        ),
        HardCase::new(
            "reversed perspective",
            "corners that are no image of a rectangle: the square of the focal length is negative",
            "a camera with valid numbers that reports its error, or an error message",
            solve_inverse_perspective,
        ),
        HardCase::new(
            "corners in any order",
            "the same four corners, crossed and in reverse order",
            "the same camera: centres at most 1e-9 m apart",
            solve_in_any_order,
        ),
    ]);
    cases.extend(degenerate_corners());
    cases.extend(invalid_labels());
    Ok(cases)
}

/// No priors; the corners alone decide.
fn without_priors() -> SolveOptions {
    SolveOptions {
        priors: Priors::ideal().with_free_focal(),
        ..Default::default()
    }
}

/// A label without noise, whose corners are declared to be as accurate as their digits.
fn exact_view(scenario: &Scenario, k: u64, sigma_px: f64) -> View {
    let mut view = scenario.view(11, k);
    view.label.surface.corner_sigma_px = Some(sigma_px);
    view
}

fn focal_error(view: &View, solution: &Solution) -> f64 {
    (solution.camera.focal_px.x / view.camera.focal_px.x - 1.0).abs()
}

/// Whether a solution is sound: no number is NaN, those of the camera and of the fit are finite,
/// and the camera is above the surface.
fn is_sound(solution: &Solution) -> bool {
    let (center, sigma) = (solution.camera.center(), &solution.sigma);
    let mut places = center.coords.iter().chain(&solution.size);
    let sigmas = [sigma.ln_focal, sigma.tilt, sigma.height_px];
    let mut sigmas = sigmas.iter().chain(sigma.center.iter());
    finite_numbers(solution).iter().all(|v| v.is_finite())
        && places.all(|v| v.is_finite())
        && center.z > 0.0
        && !sigmas.any(|v| v.is_nan())
}

fn finite_numbers(solution: &Solution) -> [f64; 8] {
    let (camera, fit) = (&solution.camera, &solution.fit);
    [
        camera.focal_px.x,
        camera.principal_px.x,
        camera.principal_px.y,
        camera.tilt(),
        solution.rms_px,
        fit.chi2,
        fit.depth_ratio,
        fit.px_per_metre,
    ]
}

fn has_warning(solution: &Solution, code: Code) -> bool {
    solution.warnings.iter().any(|w| w.code == code)
}

fn grazing_view(degrees: f64) -> HardCase {
    HardCase::new(
        format!("tilted by {degrees} degrees"),
        "exact corners of a 0.6 x 0.4 m rectangle, nothing else known",
        "focal length recovered to 1e-7, with a warning that the view is grazing",
        move || solve_grazing_view(degrees),
    )
}

fn solve_grazing_view(degrees: f64) -> Result<Outcome> {
    let view = exact_view(&Scenario::default().tilted(degrees), 3, 0.01);
    let solution = solve(&view.label, &without_priors())?;
    let error = focal_error(&view, &solution);
    let is_warned = has_warning(&solution, Code::GrazingView);
    let warned = if is_warned { "warned" } else { "not warned" };
    let passed = is_warned && error < 1e-7 && is_sound(&solution);
    Ok(Outcome::new(format!("{error:.1e}, {warned}"), passed))
}

fn oblique() -> Scenario {
    Scenario::default().tilted(25.0)
}

fn of_size(size: [f64; 2]) -> Scenario {
    Scenario { size, ..oblique() }
}

fn with_focal(focal_px: f64) -> Scenario {
    Scenario {
        focal_px,
        ..oblique()
    }
}

fn extreme_geometry() -> Vec<HardCase> {
    let few_pixels = Scenario {
        image: [20_000, 15_000],
        focal_px: 16_000.0,
        fill: 10.0 / 15_000.0,
        ..oblique()
    };
    vec![
        focal_recovery("a rectangle of 10 px in 20 000", few_pixels, 2e-5),
        focal_recovery("a rectangle of a centimetre", of_size([0.01, 0.007]), 1e-9),
        focal_recovery("a rectangle of a kilometre", of_size([1000.0, 700.0]), 1e-9),
    ]
}

fn extreme_cameras() -> Vec<HardCase> {
    let small_image = Scenario {
        image: [64, 48],
        focal_px: 51.2,
        ..oblique()
    };
    let (short, long) = (with_focal(0.4 * 4000.0), with_focal(12.0 * 4000.0));
    vec![
        focal_recovery("a short lens, 0.4 of the width", short, 1e-9),
        focal_recovery("a long lens, 12 times the width", long, 2e-5),
        focal_recovery("aspect ratio of 1 to 900", of_size([0.9, 0.001]), 2e-5),
        focal_recovery("a picture of 64 x 48", small_image, 1e-9),
    ]
}

/// Corners are doubles of up to 20 000 px: the size of the perspective effect in them, relative to
/// their size, bounds the accuracy.
fn focal_recovery(name: &str, scenario: Scenario, limit: f64) -> HardCase {
    let input = format!("exact corners of {VIEW_COUNT} views at 25 degrees");
    let expectation =
        format!("focal length recovered to {limit:e}, or two corners reported as coincident");
    HardCase::new(name, input, expectation, move || {
        recover_focal_lengths(&scenario, limit)
    })
}

fn recover_focal_lengths(scenario: &Scenario, limit: f64) -> Result<Outcome> {
    let (mut worst, mut refused) = (0.0_f64, 0);
    for k in 0..VIEW_COUNT {
        match recover_focal_length(&exact_view(scenario, k, 1e-4)) {
            Ok(error) => worst = worst.max(error),
            Err(SolveError::Coincident { .. }) => refused += 1,
            Err(error) => return Err(error.into()),
        }
    }
    let measured = format!("{worst:.1e} at worst, {refused} refused");
    Ok(Outcome::new(measured, worst < limit))
}

/// The relative error of the focal length; infinite for an unsound solution.
fn recover_focal_length(view: &View) -> std::result::Result<f64, SolveError> {
    let solution = solve(&view.label, &without_priors())?;
    Ok(if is_sound(&solution) {
        focal_error(view, &solution)
    } else {
        f64::INFINITY
    })
}

fn solve_nearly_level_views() -> Result<Outcome> {
    let scenario = Scenario::default().tilted(0.01);
    let mut worst = 0.0_f64;
    for k in 0..VIEW_COUNT {
        let view = exact_view(&scenario, k, 0.01);
        worst = worst.max(residual_of_sound_solutions(&view.label)?);
    }
    Ok(Outcome::at_most(worst, 1e-6, "px"))
}

/// The residual without priors; infinite if a solution with or without them is unsound.
fn residual_of_sound_solutions(label: &Label) -> Result<f64> {
    let free = solve(label, &without_priors())?;
    let is_sound = is_sound(&free) && is_sound(&solve(label, &SolveOptions::default())?);
    Ok(if is_sound { free.rms_px } else { f64::INFINITY })
}

/// A rectangle tilted by 30 degrees and seen from infinitely far away.
fn from_infinity() -> Label {
    let (x, y) = (900.0, 600.0 * libm::cos(30_f64.to_radians()));
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]];
    let centered = corners.map(|[x, y]| [2000.0 + x, 1500.0 + y]);
    Label::new([4000, 3000], centered, [0.6, 0.4])
}

fn solve_without_perspective() -> Result<Outcome> {
    let free = solve(&from_infinity(), &without_priors())?;
    let tilt = free.camera.tilt().to_degrees();
    let focal_px = free.camera.focal_px.x;
    let passed = is_reported_at_bound(&free) && (tilt - 30.0).abs() < 0.1 && is_sound(&free);
    let measured = format!(
        "{focal_px:.0} px, {tilt:.3} degrees, {:?}",
        free.focal_source
    );
    Ok(Outcome::new(measured, passed))
}

fn is_reported_at_bound(solution: &Solution) -> bool {
    (solution.camera.focal_px.x / 400_000.0 - 1.0).abs() < 1e-9
        && solution.focal_source == FocalSource::Unbounded
        && has_warning(solution, Code::FocalUnbounded)
}

fn solve_with_priors() -> Result<Outcome> {
    let found = solve(&from_infinity(), &SolveOptions::default())?;
    let passed = found.focal_source != FocalSource::Unbounded && is_sound(&found);
    let focal_px = found.camera.focal_px.x;
    let measured = format!("{focal_px:.0} px, {:?}", found.focal_source);
    Ok(Outcome::new(measured, passed))
}

fn solve_inverse_perspective() -> Result<Outcome> {
    let label = impossible_label();
    let free = solve(&label, &without_priors())?;
    let default = solve(&label, &SolveOptions::default())?;
    Ok(Outcome::new(
        format!("{:.2} and {:.2} px off", free.rms_px, default.rms_px),
        is_sound(&free) && is_sound(&default),
    ))
}

fn impossible_label() -> Label {
    let mut label = from_infinity();
    label.surface.corners_px = Some([
        [1000.0, 1000.0],
        [2400.0, 1000.0],
        [2400.0, 2003.0],
        [1000.0, 2000.0],
    ]);
    (label.surface.width_m, label.surface.height_m) = (Some(0.5), Some(0.4));
    label
}

/// Orders of the four corners that begin at the first: it defines the width.
const CORNER_ORDERS: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [0, 1, 3, 2],
    [0, 2, 1, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [0, 3, 2, 1],
];

fn solve_in_any_order() -> Result<Outcome> {
    let label = Scenario::realistic().tilted(25.0).view(1, 4).label;
    let first = solve(&label, &SolveOptions::default())?.camera.center();
    let mut apart = 0.0_f64;
    for order in CORNER_ORDERS {
        let solution = solve(&reordered(&label, order), &SolveOptions::default())?;
        apart = apart.max((solution.camera.center() - first).norm());
    }
    Ok(Outcome::at_most(apart, 1e-9, "m"))
}

fn reordered(label: &Label, order: [usize; 4]) -> Label {
    let mut label = label.clone();
    let corners = &mut label.surface.corners_px;
    *corners = corners.map(|corners| order.map(|i| corners[i]));
    label
}

fn degenerate_corners() -> Vec<HardCase> {
    [
        ("collinear corners", COLLINEAR, "line"),
        ("three corners on a line", THREE_ON_A_LINE, "line"),
        ("all corners in one point", [[500.0, 500.0]; 4], "apart"),
        ("two corners in one point", TWO_COINCIDENT, "apart"),
        ("a corner inside the others", CONCAVE, "not convex"),
        ("corner of NaN", WITH_NAN, "not finite"),
    ]
    .map(|(name, corners, cause)| {
        refused(name, cause, move |label| {
            label.surface.corners_px = Some(corners)
        })
    })
    .into()
}

const COLLINEAR: [[f64; 2]; 4] = [
    [100.0, 100.0],
    [900.0, 500.0],
    [1700.0, 900.0],
    [2500.0, 1300.0],
];
const THREE_ON_A_LINE: [[f64; 2]; 4] = [
    [100.0, 100.0],
    [1100.0, 100.0],
    [2100.0, 100.0],
    [1100.0, 900.0],
];
const TWO_COINCIDENT: [[f64; 2]; 4] = [
    [100.0, 100.0],
    [100.0, 100.0],
    [900.0, 900.0],
    [100.0, 900.0],
];
const CONCAVE: [[f64; 2]; 4] = [
    [100.0, 100.0],
    [2000.0, 100.0],
    [700.0, 600.0],
    [100.0, 2000.0],
];
const WITH_NAN: [[f64; 2]; 4] = [[f64::NAN, 0.0], [900.0, 0.0], [900.0, 900.0], [0.0, 900.0]];

fn invalid_labels() -> Vec<HardCase> {
    vec![
        refused("no corners", "corners_px is missing", |label| {
            label.surface.corners_px = None
        }),
        refused("picture without pixels", "0 x 3000", |label| {
            label.image.width = 0
        }),
        refused_width("rectangle without width", "0 m", 0.0),
        refused_width("rectangle of negative width", "-0.6 m", -0.6),
        refused_width("aspect ratio of 1250 to 1", "ratio of at most 1000", 500.0),
        refused("focal length of 0", "camera.focal_px: 0", |label| {
            label.camera.focal_px = Some(0.0)
        }),
        refused("camera at infinite height", "not finite", |label| {
            label.camera.height_m = Some(f64::INFINITY)
        }),
    ]
}

fn refused_width(name: &str, cause: &'static str, width_m: f64) -> HardCase {
    refused(name, cause, move |label| {
        label.surface.width_m = Some(width_m)
    })
}

/// An otherwise valid label with one mistake.
fn refused(
    name: &str,
    cause: &'static str,
    spoil: impl Fn(&mut Label) + Send + Sync + 'static,
) -> HardCase {
    HardCase::refused(name, "an otherwise valid label", cause, move || {
        let mut label = Scenario::default().tilted(20.0).view(1, 9).label;
        spoil(&mut label);
        Ok(solve(&label, &SolveOptions::default())?)
    })
}
