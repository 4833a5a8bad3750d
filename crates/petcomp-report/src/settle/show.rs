//! The sweep as a table and as charts.

use super::{RATES, SettleRow};
use crate::columns::{Column, four, table_of};
use petcomp::plot::{Axis, Chart, Curve, Table};

const COLUMNS: [Column<SettleRow>; 11] = [
    ("steps per s", |r| r.rate.to_string()),
    ("iterations", |r| r.iterations.to_string()),
    ("heaps", |r| r.heaps.to_string()),
    ("rested", |r| r.rested.to_string()),
    ("overlap median mm", |r| four(r.overlap_mm[0])),
    ("overlap worst mm", |r| four(r.overlap_mm[1])),
    ("energy rise median %", |r| four(r.energy_percent[0])),
    ("energy rise worst %", |r| four(r.energy_percent[1])),
    ("stack error mm (4 is margin)", |r| four(r.stack_mm)),
    ("wrong slopes", |r| r.wrong_slopes.to_string()),
    ("time ms", |r| format!("{:.1}", r.cpu_ms)),
];

/// The sweep as a table.
pub(super) fn table(rows: &[SettleRow]) -> Table {
    table_of(&COLUMNS, rows)
}

/// The sweep as charts against run time: worst overlap, energy rise, and error of the stack; a ring
/// marks the default.
pub(super) fn charts(rows: &[SettleRow]) -> Vec<Chart> {
    vec![
        error_chart(rows, "worst overlap, mm", |r| r.overlap_mm[1]),
        error_chart(rows, "worst energy rise, %", |r| r.energy_percent[1]),
        error_chart(rows, "error of a stack, mm", |r| r.stack_mm),
    ]
}

fn error_chart(rows: &[SettleRow], title: &str, error: fn(&SettleRow) -> f64) -> Chart {
    let times = rows.iter().map(|row| row.cpu_ms);
    Chart {
        title: format!("{title}, against time"),
        names: RATES
            .map(|rate| format!("1/{rate} s: 1, 2, 4, 8 iterations"))
            .into(),
        across: Axis::over_decades("time of a heap of 20, ms", times),
        up: Axis::over_decades(title, rows.iter().map(error)),
        curves: RATES
            .map(|rate| curve_of(rows, error, |row| row.rate == rate))
            .into(),
        defaults: curve_of(rows, error, SettleRow::is_default),
    }
}

fn curve_of(
    rows: &[SettleRow],
    error: fn(&SettleRow) -> f64,
    is_shown: impl Fn(&SettleRow) -> bool,
) -> Curve {
    let shown = rows.iter().filter(|row| is_shown(row));
    shown.map(|row| [row.cpu_ms, error(row)]).collect()
}
