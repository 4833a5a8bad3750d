//! The physics' steps: errors of heaps at rest against run time.

use super::{CARDS, PLATES, SettleRow};
use crate::{Diagram, Point};
use petcomp::Quality;
use petcomp::plot::three;
use petcomp::scene::SettleOptions;

/// Length of the heap's typical card, millimetres, of which limits are shares.
const CARD_MM: f64 = 200.0;
const PERCENT: f64 = 100.0;
/// Bodies keep two skins of 0.2 mm between them, so that a stack without overlap is higher by as much for each plate.
const SKIN_MM: f64 = 0.4;

/// Worst overlap, worst energy rise and the error of a stack, each against the time of a heap.
pub fn diagrams(rows: &[SettleRow]) -> Vec<Diagram> {
    let usual = SettleOptions::default();
    let heaps = rows.first().map_or(0, |row| row.heaps);
    let with = |error: fn(&SettleRow) -> f64| Diagram {
        input: format!("{heaps} heaps of {CARDS} cards for each setting"),
        cost: "CPU milliseconds per heap, median".into(),
        points: rows.iter().map(|row| point(row, error(row))).collect(),
        ..Diagram::default()
    };
    vec![
        Diagram {
            file: "settle_overlap".into(),
            title: "settle: overlap at rest".into(),
            error: "worst overlap, mm".into(),
            reference: "separating-axis test, independent of the engine".into(),
            limit: Some((usual.max_overlap * CARD_MM, "more is refused".into())),
            why: why(rows),
            ..with(|row| row.overlap_mm[1])
        },
        Diagram {
            file: "settle_energy".into(),
            title: "settle: energy from nothing".into(),
            error: "worst energy rise, %".into(),
            reference: "conservation of energy (closed form)".into(),
            limit: Some((usual.max_energy_rise * PERCENT, "more is refused".into())),
            ..with(|row| row.energy_percent[1])
        },
        Diagram {
            file: "settle_stack".into(),
            title: "settle: height of a stack".into(),
            error: "error of the height, mm".into(),
            reference: "ten thicknesses, and two skins of 0.2 mm below each plate (closed form)"
                .into(),
            limit: Some((
                usual.max_overlap * CARD_MM,
                "what is accepted of overlaps".into(),
            )),
            ..with(stack_error)
        },
    ]
}

fn point(row: &SettleRow, error: f64) -> Point {
    let options = SettleOptions::default();
    let is_usual = row.ccd == options.ccd;
    let curve = if is_usual {
        format!("1/{} s", row.rate)
    } else {
        "1/480 s, other CCD".into()
    };
    let many = if row.iterations == 1 { "" } else { "s" };
    let setting = if is_usual {
        format!("{} iteration{many}", row.iterations)
    } else {
        format!("{} CCD stops", row.ccd)
    };
    Point::new(curve, setting, row.cpu_ms, error).used_where(|q: Quality| {
        let settings = q.settle(options);
        is_usual && settings.iterations == row.iterations && is_step(row, settings.step)
    })
}

/// What no single error shows: which settings are right in everything, and which of them costs least.
fn why(rows: &[SettleRow]) -> String {
    let usual = SettleOptions::default();
    let is_default = |row: &&SettleRow| {
        row.ccd == usual.ccd && row.iterations == usual.iterations && is_step(row, usual.step)
    };
    let right: Vec<&SettleRow> = rows.iter().filter(|row| is_right(row)).collect();
    let best = right.iter().min_by(|a, b| a.cpu_ms.total_cmp(&b.cpu_ms));
    let (Some(best), Some(default)) = (best, rows.iter().find(is_default)) else {
        return String::new();
    };
    let judged = if is_right(default) {
        "is one of them"
    } else {
        "is NOT one of them"
    };
    format!(
        "A setting is right where every heap comes to a good end at the first try, all three errors are under their limits, and \
         plates slide on slopes as the closed form says: {} of {} are, and the default {judged}. The cheapest of them is \
         1/{} s with {} iterations and {} CCD stops, at {} of the default's cost.",
        right.len(),
        rows.len(),
        best.rate,
        best.iterations,
        best.ccd,
        three(best.cpu_ms / default.cpu_ms)
    )
}

fn is_step(row: &SettleRow, step: f64) -> bool {
    step * f64::from(row.rate) == 1.0
}

/// Every error of a setting is as small as is asked.
fn is_right(row: &SettleRow) -> bool {
    let usual = SettleOptions::default();
    let overlap = usual.max_overlap * CARD_MM;
    row.rested == row.heaps
        && row.wrong_slopes == 0
        && row.overlap_mm[1] <= overlap
        && row.energy_percent[1] <= usual.max_energy_rise * PERCENT
        && stack_error(row) <= overlap
}

/// How far the stack is from its thicknesses and skins, millimetres.
fn stack_error(row: &SettleRow) -> f64 {
    (row.stack_mm - SKIN_MM * PLATES as f64).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(rate: u32, iterations: u32, ccd: u32) -> SettleRow {
        SettleRow {
            rate,
            iterations,
            ccd,
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
        let found = diagrams(&[row(480, 4, 1), row(240, 4, 1), row(480, 4, 0)]);
        assert_eq!(found.len(), 3);
        assert!(
            found
                .iter()
                .all(|d| d.points.iter().filter(|p| p.is_default()).count() == 1)
        );
        assert_eq!(found[0].points[2].curve, "1/480 s, other CCD");
    }
    #[test]
    fn the_cheapest_setting_that_is_right_in_everything_is_told() {
        let fine = |rate, cpu_ms| SettleRow {
            rested: 4,
            wrong_slopes: 0,
            cpu_ms,
            ..row(rate, 4, 1)
        };
        let told = why(&[
            fine(480, 20.0),
            fine(240, 10.0),
            SettleRow {
                stack_mm: 1.0,
                ..fine(960, 1.0)
            },
        ]);
        assert!(
            told.contains("2 of 3 are") && told.contains("1/240 s") && told.contains("0.500"),
            "{told}"
        );
        assert!(told.contains("is one of them") && why(&[]).is_empty());
        let late = SettleRow {
            rested: 3,
            ..fine(480, 20.0)
        };
        assert!(why(&[late, fine(960, 40.0)]).contains("is NOT one of them"));
    }
}
