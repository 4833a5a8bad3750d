//! A solution in plain words: how well each quantity is known, and what to measure to know it
//! better.

use super::focal::FocalSource;
use super::import::place_for_more;
use super::label::{Framing, Label};
use super::options::SolveOptions;
use super::solution::Solution;
use super::solve::solve;
use crate::diagnostic::Code;
use crate::geom::Point2;

/// Relative error of a camera height measured with a tape, as the advice assumes.
const TAPE_HEIGHT_SIGMA: f64 = 0.03;
/// An improvement by this factor or more is worth mentioning.
const WORTHWHILE_FACTOR: f64 = 0.8;

/// What a person should know about a solution, in a few lines of plain words.
pub fn doctor(label: &Label, solution: &Solution, options: &SolveOptions) -> String {
    let lines = [
        pose_line(solution),
        focal_line(solution),
        framing_line(label, solution, options),
        surface_line(solution),
        height_line(solution),
    ];
    let misfit = solution.misfit();
    misfit
        .map(|error| format!("This camera cannot be used: {error}."))
        .into_iter()
        .chain(lines)
        .chain(warning_lines(solution))
        .chain(height_advice(label, solution, options))
        .map(|line| line + "\n")
        .collect()
}

/// All warnings but that of the framing, which has a line of its own.
fn warning_lines(solution: &Solution) -> impl Iterator<Item = String> {
    solution
        .warnings
        .iter()
        .filter(|w| w.code != Code::FramingUnknown)
        .map(|warning| format!("Warning: {warning}."))
}

fn pose_line(solution: &Solution) -> String {
    let (camera, sigma) = (&solution.camera, &solution.sigma);
    let height_sigma = sigma.center[(2, 2)].max(0.0).sqrt();
    format!(
        "The camera is {:.3} m (+- {:.3}) above the surface, tilted by {:.1} degrees (+- {:.1}) from straight down.",
        camera.height_m(),
        height_sigma,
        camera.tilt_deg(),
        sigma.tilt.to_degrees(),
    )
}

fn focal_line(solution: &Solution) -> String {
    let focal_px = solution.camera.focal_px.x;
    let percent = 100.0 * solution.sigma.ln_focal;
    let source = source_text(solution.focal_source);
    match percent.is_finite() {
        true => format!("Its focal length is {focal_px:.0} px (+- {percent:.1} %): {source}."),
        false => format!("Its focal length is not known; {focal_px:.0} px was assumed."),
    }
}

fn source_text(source: FocalSource) -> &'static str {
    match source {
        FocalSource::Measured => "measured in the picture",
        FocalSource::Mixed => "partly from the picture, partly from prior knowledge",
        FocalSource::Prior => {
            "only from prior knowledge: a picture from nearly straight above does not show it"
        }
        FocalSource::Fixed => "as given",
        FocalSource::Unbounded => "a bound, not a value: nothing constrains it",
    }
}

/// Where the principal point is in the picture, and why that is known.
fn framing_line(label: &Label, solution: &Solution, options: &SolveOptions) -> String {
    let known = principal_text(solution);
    match solution.framing {
        Framing::Whole => {
            format!("{known}: the picture is uncropped, or its crop is known.")
        }
        Framing::Cropped => {
            format!("{known}, solved with the rest: the picture was cropped.")
        }
        Framing::Unknown => {
            let gain = whole_picture_gain(label, solution, options);
            let place = place_for_more(label);
            format!(
                "{known}: it is not known whether the picture was cropped, since its EXIF size is missing or differs. If it \
                 was not, write \"cropped\": false under \"image\"{place}: the principal point is then its centre{gain}."
            )
        }
    }
}

fn principal_text(solution: &Solution) -> String {
    let Point2 { coords: at } = solution.camera.principal_px;
    format!(
        "Its principal point is at ({:.0}, {:.0}) px (+- {:.0})",
        at.x, at.y, solution.sigma.principal_px
    )
}

/// How much better the focal length would be known if the picture were whole; empty where it would
/// not, or the corners do not allow that.
fn whole_picture_gain(label: &Label, solution: &Solution, options: &SolveOptions) -> String {
    let mut whole = label.clone();
    whole.image.cropped = Some(false);
    let fitting = solve(&whole, options).and_then(Solution::fitting);
    let Ok(whole) = fitting else {
        return String::new();
    };
    let [better, known] = [&whole, solution].map(|s| format!("{:.1} %", 100.0 * s.sigma.ln_focal));
    if better == known {
        return String::new();
    }
    format!(" and the focal length known to {better} instead of {known}")
}

fn surface_line(solution: &Solution) -> String {
    let [w, h] = solution.size;
    let scale = solution.fit.px_per_metre;
    format!(
        "On the surface, the rectangle of {w:.4} m x {h:.4} m fits its labelled {} to {:.2} px ({scale:.0} px per metre), \
         regardless of the focal length.",
        solution.fit.labelled(),
        solution.rms_px
    )
}

fn height_line(solution: &Solution) -> String {
    let sigma = &solution.sigma;
    let millimetres = 1000.0 * sigma.reference_height;
    format!(
        "A point {millimetres:.0} mm above the surface is drawn within {:.1} px of its true position.",
        sigma.height_px
    )
}

/// What measuring the height of the lens would bring.
fn height_advice(label: &Label, solution: &Solution, options: &SolveOptions) -> Option<String> {
    if label.camera.height_m.is_some() {
        return None;
    }
    let height = solution.camera.height_m();
    let mut measured = label.clone();
    measured.camera.height_m = Some(height);
    measured.camera.height_sigma_m = Some(TAPE_HEIGHT_SIGMA * height);
    let better = solve(&measured, options).ok()?.sigma.height_px;
    let place = place_for_more(label);
    (better < WORTHWHILE_FACTOR * solution.sigma.height_px).then(|| {
        format!(
            "Measure the height of the lens above the surface (about {height:.2} m) to within {:.0} mm and write it as \
             camera.height_m{place}: that would reduce the {:.1} px to {better:.1}. So would another photo or two of the \
             rectangle at 25 to 40 degrees with the same zoom and camera.id (camera joint).",
            1000.0 * TAPE_HEIGHT_SIGMA * height,
            solution.sigma.height_px
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;

    fn say(tilt: f64) -> String {
        let label = Scenario::realistic().tilted(tilt).view(1, 0).label;
        let options = SolveOptions::default();
        doctor(&label, &solve(&label, &options).unwrap(), &options)
    }

    #[test]
    fn from_above_the_advice_is_to_measure_the_height() {
        let text = say(0.5);
        assert!(
            text.contains("above does not show it") && text.contains("Measure the height"),
            "{text}"
        );
    }

    #[test]
    fn what_is_known_of_the_framing_is_reported() {
        let mut label = Scenario::realistic().tilted(30.0).view(1, 0).label;
        let options = SolveOptions::default();
        let mut say = |cropped: Option<bool>| {
            label.image.cropped = cropped;
            doctor(&label, &solve(&label, &options).unwrap(), &options)
        };
        let unknown = say(None);
        assert!(
            unknown.contains("\"cropped\": false under \"image\"")
                && unknown.contains(" % instead of "),
            "{unknown}"
        );
        assert!(say(Some(false)).contains("the picture is uncropped"));
        assert!(say(Some(true)).contains("the picture was cropped"));
    }

    #[test]
    fn a_gain_that_rounding_hides_is_none() {
        let mut label = Scenario::realistic().tilted(30.0).view(1, 0).label;
        label.image.cropped = Some(false);
        let options = SolveOptions::default();
        let whole = solve(&label, &options).unwrap();
        assert_eq!(whole_picture_gain(&label, &whole, &options), "");
    }

    #[test]
    fn what_another_program_s_label_cannot_say_is_for_one_of_ours() {
        let mut label = Scenario::realistic().tilted(25.0).view(1, 3).label;
        (label.image.cropped, label.surface.source) = (None, Some("cvat".into()));
        let options = SolveOptions::default();
        let solution = solve(&label, &options).unwrap();
        let advice =
            "under \"image\" in petcomp's own label format (`petcomp camera init PHOTO --size";
        let text = doctor(&label, &solution, &options);
        assert!(text.contains(advice), "{text}");
        let mut warnings = solution.warnings.iter();
        let framing = warnings.find(|w| w.code == Code::FramingUnknown).unwrap();
        assert!(framing.message.contains(advice), "{framing:?}");
    }

    #[test]
    fn a_camera_that_does_not_fit_cannot_be_used() {
        let mut label = Scenario::realistic().tilted(30.0).view(1, 0).label;
        let surface = &mut label.surface;
        (surface.width_m, surface.height_m) = (surface.height_m, surface.width_m);
        let options = SolveOptions::default();
        let text = doctor(&label, &solve(&label, &options).unwrap(), &options);
        assert!(
            text.starts_with("This camera cannot be used: ") && text.contains("swap width_m"),
            "{text}"
        );
    }

    #[test]
    fn from_the_side_there_is_no_advice() {
        let text = say(45.0);
        assert!(
            text.contains("measured in the picture") && !text.contains("Measure"),
            "{text}"
        );
    }
}
