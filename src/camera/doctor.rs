//! A solution in plain words: what is known how well, and what to measure to know it better.

use super::focal::FocalSource;
use super::label::{Framing, Label};
use super::options::SolveOptions;
use super::solution::Solution;
use super::solve::solve;
use super::warning::Warning;
use std::fmt::Write;

/// A tape measure's error of the camera height that the advice speaks of.
const HEIGHT_ADVICE: f64 = 0.03;
/// An improvement is worth a sentence from this factor on.
const WORTH_IT: f64 = 0.8;

/// What a person should know of a solution, a few lines of plain words.
pub fn doctor(label: &Label, solution: &Solution, options: &SolveOptions) -> String {
    let mut text = String::new();
    let misfit = solution
        .misfit()
        .map(|error| format!("This camera is worth nothing: {error}."));
    let lines = [
        view(solution),
        focal(solution),
        framing(label, solution, options),
        surface(solution),
        above(solution),
    ];
    for line in misfit.into_iter().chain(lines) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{line}");
    }
    for warning in solution
        .warnings
        .iter()
        .filter(|w| !matches!(w, Warning::FramingUnknown { .. }))
    {
        let _ = writeln!(text, "Beware: {warning}.");
    }
    if let Some(advice) = advice(label, solution, options) {
        let _ = writeln!(text, "{advice}");
    }
    text
}

fn view(solution: &Solution) -> String {
    let (camera, sigma) = (&solution.camera, &solution.sigma);
    let height_sigma = sigma.center[(2, 2)].max(0.0).sqrt();
    format!(
        "The camera stands {:.3} m (+- {:.3}) above the surface and looks {:.1} degrees (+- {:.1}) away from straight down.",
        camera.center().z,
        height_sigma,
        camera.tilt().to_degrees(),
        sigma.tilt.to_degrees(),
    )
}

fn focal(solution: &Solution) -> String {
    let focal_px = solution.camera.focal_px.x;
    let percent = 100.0 * solution.sigma.ln_focal;
    let known = match solution.focal_source {
        FocalSource::Measured => "the corners themselves tell it",
        FocalSource::Mixed => "partly from the corners, partly from what was known before",
        FocalSource::Prior => {
            "only from what was known before: seen from so nearly above, the corners do not tell it"
        }
        FocalSource::Fixed => "as given",
        FocalSource::Unbounded => "a bound, not a value: nothing tells it",
    };
    match percent.is_finite() {
        true => format!("Its focal length is {focal_px:.0} px (+- {percent:.1} %): {known}."),
        false => format!("Its focal length is not known; {focal_px:.0} px was taken."),
    }
}

/// Where the middle of the lens is in the picture, and why that is known.
fn framing(label: &Label, solution: &Solution, options: &SolveOptions) -> String {
    let (camera, sigma_px) = (&solution.camera, solution.sigma.principal_px);
    let [x, y] = [camera.principal_px.x, camera.principal_px.y];
    let known = format!("Its principal point is at ({x:.0}, {y:.0}) px (+- {sigma_px:.0})");
    match solution.framing {
        Framing::Whole => {
            format!("{known}: the picture is whole, or it is known of which part it is.")
        }
        Framing::Cropped => {
            format!("{known}, found with the rest: the picture is a part of a larger one.")
        }
        Framing::Unknown => {
            let (now, whole) = (100.0 * solution.sigma.ln_focal, if_whole(label, options));
            let gain = whole.map_or(String::new(), |percent| {
                format!(" and the focal length known to {percent:.1} % instead of {now:.1} %")
            });
            format!(
                "{known}: nothing says that the picture is whole, its EXIF size is missing or another one. If it is, write \
                 \"cropped\": false under \"image\": the principal point is then its middle{gain}."
            )
        }
    }
}

/// How well the focal length would be known if the picture were whole, percent; none where the corners deny that it is.
fn if_whole(label: &Label, options: &SolveOptions) -> Option<f64> {
    let mut whole = label.clone();
    whole.image.cropped = Some(false);
    let solution = solve(&whole, options)
        .ok()
        .filter(|s| s.misfit().is_none())?;
    Some(100.0 * solution.sigma.ln_focal)
}

fn surface(solution: &Solution) -> String {
    let [w, h] = solution.size;
    let scale = solution.fit.px_per_metre;
    format!(
        "On the surface the rectangle of {w:.4} m x {h:.4} m fits its labelled corners to {:.2} px ({scale:.0} px per metre), \
         whatever the focal length.",
        solution.rms_px
    )
}

fn above(solution: &Solution) -> String {
    let sigma = &solution.sigma;
    let millimetres = 1000.0 * sigma.reference_height;
    format!(
        "A point {millimetres:.0} mm above the surface is drawn within {:.1} px of its true place.",
        sigma.height_px
    )
}

/// What measuring the height of the lens would bring.
fn advice(label: &Label, solution: &Solution, options: &SolveOptions) -> Option<String> {
    if label.camera.height_m.is_some() {
        return None;
    }
    let height = solution.camera.center().z;
    let mut measured = label.clone();
    measured.camera.height_m = Some(height);
    measured.camera.height_sigma_m = Some(HEIGHT_ADVICE * height);
    let better = solve(&measured, options).ok()?.sigma.height_px;
    (better < WORTH_IT * solution.sigma.height_px).then(|| {
        format!(
            "Measure the height of the lens above the surface (about {height:.2} m) to {:.0} mm and write it as \
             camera.height_m: that would bring {:.1} px down to {better:.1}. So would another photo or two of the rectangle at \
             25 to 40 degrees with the same zoom (camera joint).",
            1000.0 * HEIGHT_ADVICE * height,
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
            text.contains("the corners do not tell it") && text.contains("Measure the height"),
            "{text}"
        );
    }

    #[test]
    fn what_is_known_of_the_framing_is_said() {
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
        assert!(say(Some(false)).contains("the picture is whole"));
        assert!(say(Some(true)).contains("a part of a larger one"));
    }

    #[test]
    fn a_camera_that_does_not_fit_is_said_to_be_worth_nothing() {
        let mut label = Scenario::realistic().tilted(30.0).view(1, 0).label;
        let surface = &mut label.surface;
        (surface.width_m, surface.height_m) = (surface.height_m, surface.width_m);
        let options = SolveOptions::default();
        let text = doctor(&label, &solve(&label, &options).unwrap(), &options);
        assert!(
            text.starts_with("This camera is worth nothing: ") && text.contains("exchange width_m"),
            "{text}"
        );
    }

    #[test]
    fn from_the_side_there_is_no_advice() {
        let text = say(45.0);
        assert!(
            text.contains("the corners themselves tell it") && !text.contains("Measure"),
            "{text}"
        );
    }
}
