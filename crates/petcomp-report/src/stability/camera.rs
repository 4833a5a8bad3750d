//! Labels that are hard to solve a camera from: nearly no perspective, grazing, tiny, huge, degenerate, wrong.

use super::{HardCase, Outcome};
use petcomp::camera::simulate::{Scenario, View};
use petcomp::camera::{FocalSource, Label, Priors, Solution, SolveError, SolveOptions, solve};
use petcomp::{Code, Result};

/// Views of a kind; the worst of them counts.
const VIEWS: u64 = 20;

pub(super) fn cases() -> Result<Vec<HardCase>> {
    let mut cases: Vec<HardCase> = [81.0, 85.0, 89.0].map(grazing).into();
    cases.extend(extremes());
    cases.extend([
        nearly_level(),
        without_perspective(),
        believed(),
        inverse_perspective(),
        order(),
    ]);
    cases.extend(impossible());
    Ok(cases)
}

/// Nothing is believed; the corners alone decide.
fn ideal() -> SolveOptions {
    SolveOptions {
        priors: Priors::ideal().with_free_focal(),
        ..Default::default()
    }
}

/// A label without noise, said to be as exact as its numbers.
fn exact(scenario: &Scenario, k: u64, sigma_px: f64) -> View {
    let mut view = scenario.view(11, k);
    view.label.surface.corner_sigma_px = Some(sigma_px);
    view
}

fn focal_error(view: &View, solution: &Solution) -> f64 {
    (solution.camera.focal_px.x / view.camera.focal_px.x - 1.0).abs()
}

/// No number of a solution is NaN, those of the camera are finite, and the camera is above the surface.
fn is_sound(solution: &Solution) -> bool {
    let (camera, sigma) = (&solution.camera, &solution.sigma);
    let center = camera.center();
    let numbers = [
        camera.focal_px.x,
        camera.principal_px.x,
        camera.principal_px.y,
        center.x,
        center.y,
        camera.tilt(),
    ];
    let fit = [
        solution.rms_px,
        solution.fit.chi2,
        solution.fit.depth_ratio,
        solution.fit.px_per_metre,
    ];
    let uncertain = [sigma.ln_focal, sigma.tilt, sigma.height_px];
    numbers
        .iter()
        .chain(&fit)
        .chain(&solution.size)
        .all(|v| v.is_finite())
        && center.z > 0.0
        && !uncertain
            .iter()
            .chain(sigma.center.iter())
            .any(|v| v.is_nan())
}

fn grazing(degrees: f64) -> HardCase {
    HardCase::new(
        format!("tilted by {degrees} degrees"),
        "exact corners of a 0.6 x 0.4 m rectangle, nothing else known",
        "focal length back to 1e-7, with a warning that the view is grazing",
        move || {
            let view = exact(&Scenario::default().tilted(degrees), 3, 0.01);
            let solution = solve(&view.label, &ideal())?;
            let told = solution
                .warnings
                .iter()
                .any(|w| w.code == Code::GrazingView);
            let error = focal_error(&view, &solution);
            let warned = if told { "warned" } else { "not warned" };
            Ok(Outcome::new(
                format!("{error:.1e}, {warned}"),
                told && error < 1e-7 && is_sound(&solution),
            ))
        },
    )
}

fn extremes() -> Vec<HardCase> {
    let usual = Scenario::default().tilted(25.0);
    let tiny = Scenario {
        image: [20_000, 15_000],
        focal_px: 16_000.0,
        fill: 10.0 / 15_000.0,
        ..usual
    };
    let kinds = [
        ("a rectangle of 10 px in 20 000", tiny, 2e-5),
        (
            "a rectangle of a centimetre",
            Scenario {
                size: [0.01, 0.007],
                ..usual
            },
            1e-9,
        ),
        (
            "a rectangle of a kilometre",
            Scenario {
                size: [1000.0, 700.0],
                ..usual
            },
            1e-9,
        ),
        (
            "a short lens, 0.4 of the width",
            Scenario {
                focal_px: 0.4 * 4000.0,
                ..usual
            },
            1e-9,
        ),
        (
            "a long lens, 12 times the width",
            Scenario {
                focal_px: 12.0 * 4000.0,
                ..usual
            },
            2e-5,
        ),
        (
            "sides of 1 to 900",
            Scenario {
                size: [0.9, 0.001],
                ..usual
            },
            2e-5,
        ),
        (
            "a picture of 64 x 48",
            Scenario {
                image: [64, 48],
                focal_px: 51.2,
                ..usual
            },
            1e-9,
        ),
    ];
    kinds
        .map(|(name, scenario, limit)| extreme(name, scenario, limit))
        .into()
}

/// Corners are doubles of up to 20 000 px: what perspective they hold, over its size, bounds what can come back.
fn extreme(name: &str, scenario: Scenario, limit: f64) -> HardCase {
    let input = format!("exact corners of {VIEWS} views at 25 degrees");
    let promise = format!("focal length back to {limit:e}, or two corners told to be one");
    HardCase::new(name, input, promise, move || {
        let (mut worst, mut refused) = (0.0_f64, 0);
        for k in 0..VIEWS {
            let view = exact(&scenario, k, 1e-4);
            match solve(&view.label, &ideal()) {
                Ok(solution) if is_sound(&solution) => {
                    worst = worst.max(focal_error(&view, &solution))
                }
                Ok(_) => worst = f64::INFINITY,
                Err(SolveError::Coincident { .. }) => refused += 1,
                Err(error) => return Err(error.into()),
            }
        }
        Ok(Outcome::new(
            format!("{worst:.1e} at worst, {refused} refused"),
            worst < limit,
        ))
    })
}

fn nearly_level() -> HardCase {
    HardCase::new(
        "tilted by 0.01 degrees",
        format!("exact corners of {VIEWS} views"),
        "corners met to 1e-6 px, sound numbers",
        || {
            let mut worst = 0.0_f64;
            for k in 0..VIEWS {
                let view = exact(&Scenario::default().tilted(0.01), k, 0.01);
                let (free, usual) = (
                    solve(&view.label, &ideal())?,
                    solve(&view.label, &SolveOptions::default())?,
                );
                let sound = is_sound(&free) && is_sound(&usual);
                worst = worst.max(if sound { free.rms_px } else { f64::INFINITY });
            }
            Ok(Outcome::at_most(worst, 1e-6, "px"))
        },
    )
}

/// A rectangle tilted by 30 degrees as seen from infinitely far.
fn from_infinity() -> Label {
    let (x, y) = (900.0, 600.0 * libm::cos(30_f64.to_radians()));
    let corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| [2000.0 + x, 1500.0 + y]);
    Label::new([4000, 3000], corners, [0.6, 0.4])
}

fn without_perspective() -> HardCase {
    HardCase::new(
        "no perspective, nothing known",
        "a rectangle tilted by 30 degrees as seen from infinitely far",
        "focal length at its bound of 100 widths and said to be one; tilt 30 degrees to 0.1",
        || {
            let free = solve(&from_infinity(), &ideal())?;
            let tilt = free.camera.tilt().to_degrees();
            let bound = (free.camera.focal_px.x / 400_000.0 - 1.0).abs() < 1e-9;
            let said = free.focal_source == FocalSource::Unbounded
                && free.warnings.iter().any(|w| w.code == Code::FocalUnbounded);
            let passed = bound && said && (tilt - 30.0).abs() < 0.1 && is_sound(&free);
            Ok(Outcome::new(
                format!(
                    "{:.0} px, {tilt:.3} degrees, {:?}",
                    free.camera.focal_px.x, free.focal_source
                ),
                passed,
            ))
        },
    )
}

fn believed() -> HardCase {
    HardCase::new(
        "no perspective, a usual lens believed",
        "the same corners",
        "an answer that is not said to be without bound, sound numbers",
        || {
            let found = solve(&from_infinity(), &SolveOptions::default())?;
            let passed = found.focal_source != FocalSource::Unbounded && is_sound(&found);
            Ok(Outcome::new(
                format!(
                    "{:.0} px, {:?}",
                    found.camera.focal_px.x, found.focal_source
                ),
                passed,
            ))
        },
    )
}

fn inverse_perspective() -> HardCase {
    HardCase::new(
        "perspective the wrong way round",
        "corners that no camera can have seen of a rectangle: its square of the focal length is negative",
        "a camera with sound numbers that says how far off it is, or an error",
        || {
            let mut label = from_infinity();
            label.surface.corners_px = Some([
                [1000.0, 1000.0],
                [2400.0, 1000.0],
                [2400.0, 2003.0],
                [1000.0, 2000.0],
            ]);
            (label.surface.width_m, label.surface.height_m) = (Some(0.5), Some(0.4));
            let ends = [
                solve(&label, &ideal())?,
                solve(&label, &SolveOptions::default())?,
            ];
            let off = ends
                .each_ref()
                .map(|s| format!("{:.2}", s.rms_px))
                .join(" and ");
            Ok(Outcome::new(
                format!("{off} px off"),
                ends.iter().all(is_sound),
            ))
        },
    )
}

/// Orders of the four corners that begin at the first: it names the width.
const ORDERS: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [0, 1, 3, 2],
    [0, 2, 1, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [0, 3, 2, 1],
];

fn order() -> HardCase {
    HardCase::new(
        "corners in any order",
        "the same four corners, criss-cross and the other way round",
        "one camera: centres 1e-9 m apart",
        || {
            let view = Scenario::realistic().tilted(25.0).view(1, 4);
            let Some(corners) = view.label.surface.corners_px else {
                return Ok(Outcome::new("no corners", false));
            };
            let first = solve(&view.label, &SolveOptions::default())?
                .camera
                .center();
            let mut apart = 0.0_f64;
            for order in ORDERS {
                let mut label = view.label.clone();
                label.surface.corners_px = Some(order.map(|i| corners[i]));
                apart = apart
                    .max((solve(&label, &SolveOptions::default())?.camera.center() - first).norm());
            }
            Ok(Outcome::at_most(apart, 1e-9, "m"))
        },
    )
}

fn impossible() -> Vec<HardCase> {
    let at = |name: &str, corners: [[f64; 2]; 4], cause: &'static str| {
        refused(name, cause, move |label| {
            label.surface.corners_px = Some(corners)
        })
    };
    vec![
        at(
            "collinear corners",
            [
                [100.0, 100.0],
                [900.0, 500.0],
                [1700.0, 900.0],
                [2500.0, 1300.0],
            ],
            "line",
        ),
        at(
            "three corners on a line",
            [
                [100.0, 100.0],
                [1100.0, 100.0],
                [2100.0, 100.0],
                [1100.0, 900.0],
            ],
            "line",
        ),
        at("all corners in one point", [[500.0, 500.0]; 4], "apart"),
        at(
            "two corners in one point",
            [
                [100.0, 100.0],
                [100.0, 100.0],
                [900.0, 900.0],
                [100.0, 900.0],
            ],
            "apart",
        ),
        at(
            "a corner inside the others",
            [
                [100.0, 100.0],
                [2000.0, 100.0],
                [700.0, 600.0],
                [100.0, 2000.0],
            ],
            "not convex",
        ),
        at(
            "corner of NaN",
            [[f64::NAN, 0.0], [900.0, 0.0], [900.0, 900.0], [0.0, 900.0]],
            "not finite",
        ),
        refused("no corners", "corners_px is missing", |label| {
            label.surface.corners_px = None
        }),
        refused("picture without pixels", "0 x 3000", |label| {
            label.image.width = 0
        }),
        refused("rectangle without width", "0 m", |label| {
            label.surface.width_m = Some(0.0)
        }),
        refused("rectangle of negative width", "-0.6 m", |label| {
            label.surface.width_m = Some(-0.6)
        }),
        refused("rectangle of 1250 to 1", "ratio of at most 1000", |label| {
            label.surface.width_m = Some(500.0)
        }),
        refused("focal length of 0", "camera.focal_px: 0", |label| {
            label.camera.focal_px = Some(0.0)
        }),
        refused("camera at infinite height", "not finite", |label| {
            label.camera.height_m = Some(f64::INFINITY)
        }),
    ]
}

/// A good label with one thing wrong.
fn refused(
    name: &str,
    cause: &'static str,
    spoil: impl Fn(&mut Label) + Send + Sync + 'static,
) -> HardCase {
    HardCase::new(
        name,
        "an else good label",
        format!("refused, by \"{cause}\""),
        move || {
            let mut label = Scenario::default().tilted(20.0).view(1, 9).label;
            spoil(&mut label);
            Ok(Outcome::refused(
                solve(&label, &SolveOptions::default()).map_err(Into::into),
                cause,
            ))
        },
    )
}
