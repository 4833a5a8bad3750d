//! Error of the settle stage against run time.
//!
//! Time step and solver iterations are traded against each other; each setting gets the same heaps
//! and the same closed-form cases. Overlap is measured by the stage's own separating-axis test,
//! which is independent of the engine.
//!
//! # Why the default is 1/360 s and 4 iterations
//! Contacts are as stiff as the rate of solver iterations (iterations / step) allows, and overlap
//! falls with the square of that rate, while run time grows with it. Of 150 heaps of 5 to 30 cards,
//! half failed at 1/120 s, which is therefore rejected; at 1/240 s the worst pair overlapped by
//! 0.23 mm, half of what is accepted, and a fifth of the heaps gained energy; at 1/480 s nothing
//! overlapped by more than 0.03 mm. At 1/360 s all of 100 heaps of 20 bottles rest at the first
//! attempt, at three quarters of the time. Shorter steps bring no visible gain.

mod closed_form;
mod diagram;
mod peer;
mod show;

pub(crate) use diagram::measured_diagrams;
pub use peer::{PeerCase, peer_cases};

use super::clock::cpu_seconds;
use super::files::write_texts;
use super::statistics::{median_and_worst, quantile};
use closed_form::{count_wrong_slopes, stack_error_m};
use petcomp::Result;
use petcomp::plot::Chart;
use petcomp::scene::{Scene, SettleOptions};
use petcomp::settle::{SettleVerdict, Settled, heap, settle};
use show::{charts, table};
use std::path::Path;

/// Time steps, as their number per second.
const RATES: [u32; 5] = [240, 360, 480, 960, 1920];
const ITERATIONS: [u32; 4] = [1, 2, 4, 8];
const HEAP_CARDS: usize = 20;
const MS_PER_SECOND: f64 = 1e3;
const MM_PER_M: f64 = 1e3;

/// The result of a setting of the solver.
struct SettleRow {
    /// Time steps per second.
    rate: u32,
    /// Solver iterations per step.
    iterations: u32,
    /// Heaps settled, and how many of them came to rest at the first attempt.
    heaps: usize,
    rested: usize,
    /// Overlap at the end: median and worst, millimetres.
    overlap_mm: [f64; 2],
    /// Spurious energy gain between two steps, percent of the drop's energy: median and worst.
    energy_percent: [f64; 2],
    /// Deviation of the topmost of a stack of ten plates from ten thicknesses, millimetres. Bodies
    /// keep two margins of 0.2 mm between them, so a stack without any overlap has 4.
    stack_mm: f64,
    /// Number of slopes on which a plate slides and should not, or vice versa.
    wrong_slopes: usize,
    /// Median CPU time per heap, milliseconds.
    cpu_ms: f64,
}

impl SettleRow {
    fn is_step(&self, step: f64) -> bool {
        step * f64::from(self.rate) == 1.0
    }

    fn is_default(&self) -> bool {
        let default = SettleOptions::default();
        self.iterations == default.iterations && self.is_step(default.step)
    }
}

/// Measures every setting with this many heaps; `progress` gets the number of the setting and of
/// all settings. Runs on one thread, so that run times are comparable.
fn measure(heaps: u64, progress: impl Fn(u64, u64)) -> Result<Vec<SettleRow>> {
    let settings = settings();
    let heaps = (0..heaps).map(|k| heap(k, HEAP_CARDS));
    let heaps = heaps.collect::<Result<Vec<_>>>()?;
    let mut rows = Vec::new();
    for setting in &settings {
        progress(rows.len() as u64, settings.len() as u64);
        rows.push(measure_setting(setting, &heaps)?);
    }
    Ok(rows)
}

fn settings() -> Vec<SettleOptions> {
    let default = SettleOptions {
        attempts: 1,
        ..SettleOptions::default()
    };
    let rates = RATES.iter();
    rates.flat_map(|rate| at_rate(*rate, default)).collect()
}

/// A number of steps per second, with every number of iterations.
fn at_rate(rate: u32, default: SettleOptions) -> [SettleOptions; 4] {
    ITERATIONS.map(|iterations| SettleOptions {
        step: 1.0 / f64::from(rate),
        iterations,
        ..default
    })
}

fn measure_setting(options: &SettleOptions, heaps: &[Scene]) -> Result<SettleRow> {
    let (ends, times_ms) = settle_heaps(options, heaps)?;
    Ok(SettleRow {
        rate: libm::round(1.0 / options.step) as u32,
        iterations: options.iterations,
        heaps: ends.len(),
        rested: count_rested(&ends),
        overlap_mm: median_and_worst(ends.iter().map(|end| end.overlap * MM_PER_M)),
        energy_percent: median_and_worst(ends.iter().map(|end| end.energy_rise * 100.0)),
        stack_mm: stack_error_m(options)? * MM_PER_M,
        wrong_slopes: count_wrong_slopes(options)?,
        cpu_ms: quantile(times_ms, 0.5),
    })
}

/// The heaps at rest, and the CPU time of each, milliseconds.
fn settle_heaps(options: &SettleOptions, heaps: &[Scene]) -> Result<(Vec<Settled>, Vec<f64>)> {
    let (mut ends, mut times_ms) = (Vec::new(), Vec::new());
    for scene in heaps {
        let start = cpu_seconds();
        ends.push(settle(scene.clone(), options)?);
        times_ms.push((cpu_seconds() - start) * MS_PER_SECOND);
    }
    Ok((ends, times_ms))
}

fn count_rested(ends: &[Settled]) -> usize {
    ends.iter()
        .filter(|end| end.verdict == SettleVerdict::Rested)
        .count()
}

/// Writes the sweep (`settle.csv`, `.md`, `.svg`), with this many heaps for each setting, at least
/// one, into a folder. Returns the number of rows of `settle.csv`.
///
/// # Errors
/// Files that cannot be written.
pub fn write(folder: &Path, heaps: u64, progress: impl Fn(u64, u64)) -> Result<usize> {
    let rows = measure(heaps, progress)?;
    let table = table(&rows);
    let files = [
        ("settle.csv", &*table.csv()),
        ("settle.md", &table.markdown()),
        ("settle.svg", &Chart::row(&charts(&rows))),
    ];
    write_texts(folder, files)?;
    Ok(rows.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_a_line_and_a_point_and_the_default_has_a_ring() {
        let single = SettleOptions {
            attempts: 1,
            ..SettleOptions::default()
        };
        let rows = [measure_setting(&single, &[heap(0, 5).unwrap()]).unwrap()];
        assert_eq!(
            (rows[0].rate, rows[0].rested, rows[0].wrong_slopes),
            (360, 1, 0)
        );
        assert_eq!(table(&rows).rows.len(), 1);
        assert!(charts(&rows).iter().all(|chart| chart.defaults.len() == 1));
    }
}
