//! The physics' steps: errors of heaps at rest against run time.

use super::{CARDS, PLATES, Row};
use crate::quality::Quality;
use crate::report::{Diagram, Point};
use crate::scene::SettleOptions;

/// Length of the heap's typical card, millimetres, of which limits are shares.
const CARD_MM: f64 = 200.0;
const PERCENT: f64 = 100.0;
/// Bodies keep two skins of 0.2 mm between them, so that a stack without overlap is higher by as much for each plate.
const SKIN_MM: f64 = 0.4;

/// Worst overlap, worst energy rise and the error of a stack, each against the time of a heap.
pub fn diagrams(rows: &[Row]) -> Vec<Diagram> {
    let usual = SettleOptions::default();
    let heaps = rows.first().map_or(0, |row| row.heaps);
    let with = |error: fn(&Row) -> f64| Diagram {
        input: format!("{heaps} heaps of {CARDS} cards for each setting"),
        cost: "CPU milliseconds per heap, median".into(),
        points: rows.iter().map(|row| point(row, error(row))).collect(),
        why: why(rows),
        ..Diagram::default()
    };
    vec![
        Diagram {
            file: "settle_overlap".into(),
            title: "settle: overlap at rest".into(),
            error: "worst overlap, mm".into(),
            reference: "separating-axis test, independent of the engine".into(),
            limit: Some((usual.max_overlap * CARD_MM, "more is refused".into())),
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
            reference: "ten thicknesses, and two skins of 0.2 mm below each plate (closed form)".into(),
            limit: Some((usual.max_overlap * CARD_MM, "what is accepted of overlaps".into())),
            ..with(|row| (row.stack_mm - SKIN_MM * PLATES as f64).abs())
        },
    ]
}

fn point(row: &Row, error: f64) -> Point {
    let options = SettleOptions::default();
    let is_usual = row.ccd == options.ccd;
    let curve = if is_usual { format!("1/{} s", row.rate) } else { "1/480 s, other CCD".into() };
    let many = if row.iterations == 1 { "" } else { "s" };
    let setting =
        if is_usual { format!("{} iteration{many}", row.iterations) } else { format!("{} CCD stops", row.ccd) };
    Point::new(curve, setting, row.cpu_ms, error).used_where(|q: Quality| {
        let settings = q.settle(options);
        is_usual && settings.iterations == row.iterations && settings.step * f64::from(row.rate) == 1.0
    })
}

/// What no single error shows: how many heaps came to a good end at the first try.
fn why(rows: &[Row]) -> String {
    let options = SettleOptions::default();
    let share = |row: &Row| format!("{} of {} at 1/{} s x {}", row.rested, row.heaps, row.rate, row.iterations);
    let usual = |row: &&Row| row.ccd == options.ccd && row.iterations == options.iterations;
    let told: Vec<_> = rows.iter().filter(usual).map(share).collect();
    let wrong = rows.iter().filter(|row| row.wrong_slopes > 0).count();
    format!(
        "Heaps that came to a good end at the first try: {}. A setting counts only where all three errors are small at \
         once; {wrong} of {} settings also let a plate slide, or stay, where the closed form says otherwise.",
        told.join(", "),
        rows.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(rate: u32, iterations: u32, ccd: u32) -> Row {
        Row {
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
        for diagram in &found {
            assert_eq!(diagram.points.iter().filter(|p| p.is_default()).count(), 1);
            assert!(
                diagram.why.contains("3 of 4 at 1/480 s x 4") && diagram.why.contains("3 of 3 settings"),
                "{}",
                diagram.why
            );
        }
        assert_eq!(found[0].points[2].curve, "1/480 s, other CCD");
    }
}
