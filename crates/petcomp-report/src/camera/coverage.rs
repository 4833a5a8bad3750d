//! Coverage of the stated errors: how often the truth is within them, with the principal point in
//! the middle of the picture and off it.

use super::show::three;
use super::{focal_percent, height_error_px};
use crate::columns::{Column, four, table_of};
use crate::statistics::quantile;
use petcomp::camera::simulate::{Scenario, View};
use petcomp::camera::{Framing, Solution, SolveOptions, solve};

/// Distances of the principal point from the picture's middle, in longer sides: a whole picture,
/// and cropped ones.
const OFF_CENTER: [f64; 4] = [0.0, 0.05, 0.1, 0.23];
/// Noise of the corners, pixels.
const NOISES_PX: [f64; 2] = [0.5, 1.0];
/// Angles from straight above, degrees, cycled through.
const TILTS_DEG: [f64; 6] = [5.0, 10.0, 20.0, 30.0, 45.0, 60.0];
/// Multiples of the standard deviation within which errors are counted.
const SIGMAS: [f64; 3] = [1.0, 2.0, 3.0];
const VIEW_SEED: u64 = 7;
const FRAMINGS: [Framing; 3] = [Framing::Whole, Framing::Unknown, Framing::Cropped];

/// Errors of one kind of view, and their stated values.
#[derive(Debug)]
pub(super) struct StatedErrors {
    /// Distance of the principal point from the picture's middle, in longer sides.
    off_center: f64,
    /// Noise of the corners, pixels.
    noise_px: f64,
    /// What the label states about the picture.
    framing: Framing,
    views: usize,
    /// Number of views that no camera fits; they are left out of all other numbers.
    refused: usize,
    /// Median error of the focal length and median of its stated standard deviation, percent.
    focal_percent: [f64; 2],
    /// The same for the reprojection of points above the surface, pixels.
    height_px: [f64; 2],
    /// Shares of the focal lengths within one, two and three standard deviations of the truth.
    within: [f64; 3],
    /// The largest error of a focal length, in standard deviations.
    worst: f64,
}

/// Measures whole pictures with every framing, and cropped ones with those that apply to them.
pub(super) fn measure(views: u64) -> Vec<StatedErrors> {
    let kinds = NOISES_PX
        .into_iter()
        .flat_map(|noise_px| OFF_CENTER.map(|off_center| (off_center, noise_px)));
    kinds
        .flat_map(|(off_center, noise_px)| {
            true_framings(off_center)
                .map(move |framing| coverage(off_center, noise_px, framing, views))
        })
        .collect()
}

fn true_framings(off_center: f64) -> impl Iterator<Item = Framing> {
    FRAMINGS
        .into_iter()
        .filter(move |framing| off_center == 0.0 || *framing != Framing::Whole)
}

fn coverage(off_center: f64, noise_px: f64, framing: Framing, views: u64) -> StatedErrors {
    let scenario = Scenario {
        off_center,
        corner_sigma_px: noise_px,
        ..Scenario::default()
    };
    let solved: Vec<SolvedView> = (0..views)
        .filter_map(|k| SolvedView::new(&scenario, framing, k))
        .collect();
    StatedErrors {
        off_center,
        noise_px,
        framing,
        views: views as usize,
        refused: views as usize - solved.len(),
        focal_percent: medians(&solved, |view| view.focal_percent),
        height_px: medians(&solved, |view| view.height_px),
        within: SIGMAS.map(|limit| share_within(&solved, limit)),
        worst: largest_error(&solved),
    }
}

/// Medians of an error and of its stated standard deviation.
fn medians(solved: &[SolvedView], of: fn(&SolvedView) -> [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| quantile(solved.iter().map(|view| of(view)[i]), 0.5))
}

/// In standard deviations.
fn largest_error(solved: &[SolvedView]) -> f64 {
    solved.iter().map(|view| view.sigmas).fold(0.0, f64::max)
}

fn share_within(solved: &[SolvedView], limit: f64) -> f64 {
    let within = solved.iter().filter(|view| view.sigmas < limit).count();
    within as f64 / solved.len().max(1) as f64
}

/// The errors of one view, each with its stated standard deviation.
struct SolvedView {
    focal_percent: [f64; 2],
    height_px: [f64; 2],
    /// Error of the focal length, in standard deviations.
    sigmas: f64,
}

impl SolvedView {
    /// View `k`; none if no camera fits it.
    fn new(scenario: &Scenario, framing: Framing, k: u64) -> Option<Self> {
        let tilt = TILTS_DEG[k as usize % TILTS_DEG.len()];
        let mut view = scenario.tilted(tilt).view(VIEW_SEED, k);
        view.label.image.cropped = is_cropped(framing);
        let solution = solve(&view.label, &SolveOptions::default()).ok()?;
        Some(Self::compare(&view, &solution.fitting().ok()?))
    }

    fn compare(view: &View, solution: &Solution) -> Self {
        let sigma = &solution.sigma;
        let ln_error = libm::log(solution.camera.focal_px.x / view.camera.focal_px.x).abs();
        Self {
            focal_percent: [focal_percent(view, solution), 100.0 * sigma.ln_focal],
            height_px: [height_error_px(view, solution), sigma.height_px],
            sigmas: ln_error / sigma.ln_focal,
        }
    }
}

fn is_cropped(framing: Framing) -> Option<bool> {
    match framing {
        Framing::Whole => Some(false),
        Framing::Unknown => None,
        Framing::Cropped => Some(true),
    }
}

const CSV_COLUMNS: [Column<StatedErrors>; 13] = [
    ("off_center", |r| r.off_center.to_string()),
    ("noise_px", |r| r.noise_px.to_string()),
    ("framing", |r| format!("{:?}", r.framing).to_lowercase()),
    ("views", |r| r.views.to_string()),
    ("refused", |r| r.refused.to_string()),
    ("focal_median_percent", |r| four(r.focal_percent[0])),
    ("focal_sigma_percent", |r| four(r.focal_percent[1])),
    ("height_median_px", |r| four(r.height_px[0])),
    ("height_sigma_px", |r| four(r.height_px[1])),
    ("within_1", |r| four(r.within[0])),
    ("within_2", |r| four(r.within[1])),
    ("within_3", |r| four(r.within[2])),
    ("worst_sigmas", |r| format!("{:.3}", r.worst)),
];

pub(super) fn csv(rows: &[StatedErrors]) -> String {
    table_of(&CSV_COLUMNS, rows).csv()
}

const MARKDOWN_COLUMNS: [Column<StatedErrors>; 12] = [
    ("off centre", |r| format!("{} %", 100.0 * r.off_center)),
    ("corner noise, px", |r| r.noise_px.to_string()),
    ("label", |r| label_words(r.framing).to_owned()),
    ("refused", |r| format!("{} of {}", r.refused, r.views)),
    ("error, %", |r| three(r.focal_percent[0])),
    ("stated, %", |r| three(r.focal_percent[1])),
    ("at 50 mm, px", |r| three(r.height_px[0])),
    ("stated, px", |r| three(r.height_px[1])),
    ("within 1", |r| format!("{:.2}", r.within[0])),
    ("within 2", |r| format!("{:.2}", r.within[1])),
    ("within 3", |r| format!("{:.2}", r.within[2])),
    ("worst", |r| format!("{:.1}", r.worst)),
];

/// What a label states about a picture, in its own words.
fn label_words(framing: Framing) -> &'static str {
    match framing {
        Framing::Whole => "\"cropped\": false",
        Framing::Unknown => "nothing",
        Framing::Cropped => "\"cropped\": true",
    }
}

const EXPLANATION: &str = "\n## Coverage of the stated error\n\n\
    Principal points in the centre of the picture, as in whole ones, and off it by a share of its longer side, as in \
    cropped ones; tilts of 5 to 60 degrees; unknown focal length. Focal length: median error, median stated standard \
    deviation, shares within one, two and three standard deviations, and the worst error. At 50 mm above the surface: \
    reprojection error.\n\n";

pub(super) fn markdown(rows: &[StatedErrors]) -> String {
    EXPLANATION.to_owned() + &table_of(&MARKDOWN_COLUMNS, rows).markdown()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stated_errors_are_true_for_whole_and_for_cropped_pictures() {
        for row in measure(120) {
            println!("{row:?}");
            assert_eq!(row.refused, 0, "{row:?}");
            // A normal error is within one standard deviation in 68 % of all cases; 23 % off the
            // middle, every view deviates by twice the standard deviation expected of cropped ones.
            let extreme = row.off_center > 0.2;
            let least = if extreme {
                [0.5, 0.75, 0.95]
            } else {
                [0.64, 0.9, 0.97]
            };
            assert!(
                row.within
                    .iter()
                    .zip(least)
                    .all(|(part, least)| *part >= least),
                "{row:?}"
            );
            assert!(row.worst < 3.5, "{row:?}");
        }
    }

    #[test]
    fn whole_pictures_pay_only_where_they_are_not_labelled_whole() {
        for noise_px in NOISES_PX {
            let [whole, unknown, cropped] =
                FRAMINGS.map(|framing| coverage(0.0, noise_px, framing, 120));
            assert!(
                (unknown.focal_percent[0] / whole.focal_percent[0] - 1.0).abs() < 1e-9,
                "{whole:?} {unknown:?}"
            );
            assert!(
                whole.focal_percent[1] < 0.3 * unknown.focal_percent[1],
                "{whole:?} {unknown:?}"
            );
            assert!(
                cropped.focal_percent[0] > 2.0 * whole.focal_percent[0],
                "{whole:?} {cropped:?}"
            );
        }
    }
}
