//! The matting methods: error against run time.

use super::{MattingMethod, MethodSummary, Score, made, measure, measure_known, summaries};
use crate::{Diagram, Point};
use petcomp::Result;
use petcomp::plot::three;
use std::path::Path;

const MILLI: f64 = 1e-3;
/// An error over a new background that nobody sees: half of a code of 8 bits at middle grey.
const UNSEEN: f64 = 0.004;

/// Error over new backgrounds and overlap of the outline, each against time: on photos with truth of a folder, or on made ones
/// where that is empty.
///
/// # Errors
/// A folder without truth, or files of it that cannot be read.
pub fn diagrams(truth: &Path) -> Result<Vec<Diagram>> {
    let is_made = truth.as_os_str().is_empty();
    let rows = if is_made {
        measure_known(made::COUNT, |i| Ok(made::made(i)), |_, _| ())?
    } else {
        measure(truth, |_, _| ())?
    };
    let photos = rows.len() / MattingMethod::ALL.len();
    let input = match is_made {
        true => format!("{photos} photos of see-through bottles made in code, 600 x 320"),
        false => format!("{photos} photos with known mattes"),
    };
    let source = if is_made {
        "the formula that the photos are made by"
    } else {
        "what the photos' renderer knows"
    };
    Ok(of(&summaries(&rows), &input, source))
}

fn of(summaries: &[MethodSummary], input: &str, source: &str) -> Vec<Diagram> {
    type Error = fn(&Score) -> f64;
    let errors: [(&str, &str, &str, Error); 2] = [
        (
            "matte_lit",
            "matte: on new backgrounds",
            "mean absolute error, scene-linear",
            |s| s.mae_lit,
        ),
        (
            "matte_shaded",
            "matte: in the object's own shadow",
            "mean absolute error, scene-linear",
            |s| s.mae_shaded,
        ),
    ];
    let diagram = |(file, title, error, of): (&str, &str, &str, Error)| Diagram {
        file: file.into(),
        title: title.into(),
        input: input.into(),
        error: error.into(),
        cost: "CPU seconds per photo".into(),
        reference: source.into(),
        points: summaries.iter().map(|s| point(s, of(&s.score))).collect(),
        limit: Some((UNSEEN, "half of an 8-bit code at middle grey".into())),
        why: why(summaries, of),
        ..Diagram::default()
    };
    errors.map(diagram).into()
}

/// What the default is worth beside the paper's method.
fn why(summaries: &[MethodSummary], error: fn(&Score) -> f64) -> String {
    let of = |method| {
        summaries
            .iter()
            .find(|s| s.method == method)
            .map_or(0.0, |s: &MethodSummary| error(&s.score))
    };
    let share = three(of(MattingMethod::Physical) / of(MattingMethod::Paper));
    format!(
        "Times include finding the object. Two screens need a second photo of each object. The default has \
         {share} of the error of the paper's keyer."
    )
}

fn point(summary: &MethodSummary, error: f64) -> Point {
    let is_default = summary.method == MattingMethod::Physical;
    Point::new(summary.method.name(), "", summary.time_ms * MILLI, error).used_where(|_| is_default)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_a_point_and_the_physical_one_has_the_ring() {
        let found = of(&summaries(&[]), "", "");
        assert!(
            found
                .iter()
                .all(|d| d.points.len() == MattingMethod::ALL.len())
        );
        assert!(
            found
                .iter()
                .all(|d| d.default_point().is_some_and(|p| p.curve == "physical"))
        );
    }
}
