//! The steps of the physics: errors of heaps at rest against run time.

use super::closed_form::PLATE_COUNT;
use super::{HEAP_CARDS, SettleRow, measure};
use crate::{Diagram, Point};
use petcomp::plot::three;
use petcomp::scene::SettleOptions;
use petcomp::{Quality, Result};

/// Length of the heap's typical card, to which limits are relative.
const CARD_LENGTH_MM: f64 = 200.0;
/// Bodies keep two contact margins of 0.2 mm between them, so a stack without overlap is higher by
/// that much per plate.
const PLATE_GAP_MM: f64 = 0.4;

/// Measures every setting with a number of heaps: worst overlap, worst energy rise and the error of
/// a stack, each against the time of a heap.
pub(crate) fn measured_diagrams(heaps: u64) -> Result<Vec<Diagram>> {
    Ok(diagrams(&measure(heaps, |_, _| ())?))
}

fn diagrams(rows: &[SettleRow]) -> Vec<Diagram> {
    vec![
        overlap_diagram(rows),
        energy_diagram(rows),
        stack_diagram(rows),
    ]
}

fn overlap_diagram(rows: &[SettleRow]) -> Diagram {
    Diagram {
        file: "settle_overlap".into(),
        title: "settle: overlap at rest".into(),
        error: "worst overlap, mm".into(),
        reference: "separating-axis test, independent of the engine".into(),
        limit: Some((max_overlap_mm(), "more is rejected".into())),
        why: why_default(rows),
        ..base_diagram(rows, |row| row.overlap_mm[1])
    }
}

fn energy_diagram(rows: &[SettleRow]) -> Diagram {
    Diagram {
        file: "settle_energy".into(),
        title: "settle: spurious energy".into(),
        error: "worst energy rise, %".into(),
        reference: "conservation of energy (closed form)".into(),
        limit: Some((max_energy_percent(), "more is rejected".into())),
        ..base_diagram(rows, |row| row.energy_percent[1])
    }
}

fn stack_diagram(rows: &[SettleRow]) -> Diagram {
    let why_limit = "accepted overlap".into();
    Diagram {
        file: "settle_stack".into(),
        title: "settle: height of a stack".into(),
        error: "error of the height, mm".into(),
        reference:
            "ten thicknesses, and two contact margins of 0.2 mm below each plate (closed form)"
                .into(),
        limit: Some((max_overlap_mm(), why_limit)),
        ..base_diagram(rows, SettleRow::stack_error_mm)
    }
}

fn base_diagram(rows: &[SettleRow], error: fn(&SettleRow) -> f64) -> Diagram {
    let heaps = rows.first().map_or(0, |row| row.heaps);
    Diagram {
        input: format!("{heaps} heaps of {HEAP_CARDS} cards for each setting"),
        cost: "CPU milliseconds per heap, median".into(),
        points: rows.iter().map(|row| row.point(error(row))).collect(),
        ..Diagram::default()
    }
}

fn max_overlap_mm() -> f64 {
    SettleOptions::default().max_overlap * CARD_LENGTH_MM
}

fn max_energy_percent() -> f64 {
    SettleOptions::default().max_energy_rise * 100.0
}

impl SettleRow {
    fn point(&self, error: f64) -> Point {
        let [curve, setting] = self.curve_and_setting();
        Point::new(curve, setting, self.cpu_ms, error)
            .used_where(|quality| self.is_used_by(quality))
    }

    fn curve_and_setting(&self) -> [String; 2] {
        let plural = if self.iterations == 1 { "" } else { "s" };
        [
            format!("1/{} s", self.rate),
            format!("{} iteration{plural}", self.iterations),
        ]
    }

    fn is_used_by(&self, quality: Quality) -> bool {
        let settings = quality.settle(SettleOptions::default());
        settings.iterations == self.iterations && self.is_step(settings.step)
    }

    /// Whether every error of a setting is small enough.
    fn is_right(&self) -> bool {
        self.rested == self.heaps
            && self.wrong_slopes == 0
            && self.overlap_mm[1] <= max_overlap_mm()
            && self.energy_percent[1] <= max_energy_percent()
            && self.stack_error_mm() <= max_overlap_mm()
    }

    /// Deviation of the stack from its thicknesses and margins, millimetres.
    fn stack_error_mm(&self) -> f64 {
        (self.stack_mm - PLATE_GAP_MM * PLATE_COUNT as f64).abs()
    }
}

/// What no single error shows: which settings are right in everything, and which of them is
/// cheapest.
fn why_default(rows: &[SettleRow]) -> String {
    let right: Vec<&SettleRow> = rows.iter().filter(|row| row.is_right()).collect();
    let best = right.iter().min_by(|a, b| a.cpu_ms.total_cmp(&b.cpu_ms));
    let default = rows.iter().find(|row| row.is_default());
    let (Some(best), Some(default)) = (best, default) else {
        return String::new();
    };
    let judged = if default.is_right() { "is" } else { "is NOT" };
    format!(
        "A setting is right if every heap comes to rest at the first attempt, all three errors are below their limits, \
         and plates slide on slopes as in the closed form: {} of {} are, and the default {judged} one of them. The \
         cheapest of them is 1/{} s with {} iterations, at {} of the default's cost.",
        right.len(),
        rows.len(),
        best.rate,
        best.iterations,
        three(best.cpu_ms / default.cpu_ms)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(rate: u32, iterations: u32) -> SettleRow {
        SettleRow {
            rate,
            iterations,
            heaps: 4,
            rested: 3,
            overlap_mm: [0.01, 0.02],
            energy_percent: [0.1, 0.2],
            stack_mm: 3.9,
            wrong_slopes: 1,
            cpu_ms: 20.0,
        }
    }

    #[test]
    fn each_error_has_a_diagram_and_the_default_its_ring() {
        let found = diagrams(&[row(360, 4), row(240, 4)]);
        assert_eq!(found.len(), 3);
        assert!(
            found
                .iter()
                .all(|d| d.points.iter().filter(|p| p.is_default()).count() == 1)
        );
        assert_eq!(found[0].points[1].curve, "1/240 s");
    }

    #[test]
    fn the_cheapest_setting_that_is_right_in_everything_is_named() {
        let fine = |rate, cpu_ms| SettleRow {
            rested: 4,
            wrong_slopes: 0,
            cpu_ms,
            ..row(rate, 4)
        };
        let why = why_default(&[
            fine(360, 20.0),
            fine(240, 10.0),
            SettleRow {
                stack_mm: 1.0,
                ..fine(960, 1.0)
            },
        ]);
        assert!(
            why.contains("2 of 3 are") && why.contains("1/240 s") && why.contains("0.500"),
            "{why}"
        );
        assert!(why.contains("is one of them") && why_default(&[]).is_empty());
        let late = SettleRow {
            rested: 3,
            ..fine(360, 20.0)
        };
        assert!(why_default(&[late, fine(960, 40.0)]).contains("is NOT one of them"));
    }
}
