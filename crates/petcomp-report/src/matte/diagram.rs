//! The matting methods: error against run time.

use super::{MattingMethod, MethodSummary, Score, made, measure, measure_known, summaries};
use crate::diagram::invisible_error;
use crate::{Diagram, Point};
use petcomp::Result;
use petcomp::plot::three;
use std::path::Path;

const SECONDS_PER_MS: f64 = 1e-3;

/// Error over new backgrounds and overlap of the outline, each against time: on photos with truth
/// from a folder, or on synthetic ones.
pub(crate) fn diagrams(truth: Option<&Path>) -> Result<Vec<Diagram>> {
    let (rows, input, source) = if let Some(truth) = truth {
        let rows = measure(truth, |_, _| ())?;
        (rows, KNOWN_INPUT, "ground truth of the photos' renderer")
    } else {
        let rows = measure_known(made::PHOTO_COUNT, |i| Ok(made::photo(i)), |_, _| ())?;
        (rows, MADE_INPUT, "the formula that generates the photos")
    };
    let photos = rows.len() / MattingMethod::ALL.len();
    let input = format!("{photos} {input}");
    Ok(summary_diagrams(&summaries(&rows), &input, source))
}

const MADE_INPUT: &str = "synthetic photos of see-through bottles, 600 x 320";
const KNOWN_INPUT: &str = "photos with known mattes";

fn summary_diagrams(summaries: &[MethodSummary], input: &str, source: &str) -> Vec<Diagram> {
    let lit = error_diagram(summaries, |s| s.mae_lit);
    let shaded = error_diagram(summaries, |s| s.mae_shaded);
    vec![
        Diagram {
            file: "matte_lit".into(),
            title: "matte: on new backgrounds".into(),
            input: input.into(),
            reference: source.into(),
            ..lit
        },
        Diagram {
            file: "matte_shaded".into(),
            title: "matte: in the object's own shadow".into(),
            input: input.into(),
            reference: source.into(),
            ..shaded
        },
    ]
}

fn error_diagram(summaries: &[MethodSummary], error: fn(&Score) -> f64) -> Diagram {
    Diagram {
        error: "mean absolute error, scene-linear".into(),
        cost: "CPU seconds per photo".into(),
        points: summaries.iter().map(|s| s.point(error(&s.score))).collect(),
        limit: invisible_error(),
        why: why_default(summaries, error),
        ..Diagram::default()
    }
}

/// How the default compares with the paper's method.
fn why_default(summaries: &[MethodSummary], error: fn(&Score) -> f64) -> String {
    let [physical, paper] = [MattingMethod::Physical, MattingMethod::Paper]
        .map(|method| error_of(summaries, method, error));
    format!(
        "Times include finding the object. Two screens need a second photo of each object. The default has \
         {} of the error of the paper's keyer.",
        three(physical / paper)
    )
}

fn error_of(summaries: &[MethodSummary], method: MattingMethod, error: fn(&Score) -> f64) -> f64 {
    let own = summaries.iter().find(|s| s.method == method);
    own.map_or(0.0, |s| error(&s.score))
}

impl MethodSummary {
    fn point(&self, error: f64) -> Point {
        let is_default = self.method == MattingMethod::Physical;
        let seconds = self.time_ms * SECONDS_PER_MS;
        Point::new(self.method.name(), "", seconds, error).used_where(|_| is_default)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_a_point_and_the_physical_one_has_the_ring() {
        let found = summary_diagrams(&summaries(&[]), "", "");
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
