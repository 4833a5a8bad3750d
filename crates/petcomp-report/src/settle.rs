//! Error of the settle stage against run time.
//!
//! Time step, solver iterations and CCD are changed one against another; each setting sees the same heaps and the same
//! closed-form cases. Overlap is measured by the stage's own separating-axis test, which shares nothing with the engine.
//!
//! # Why the default is 1/480 s and 4 iterations
//! Contacts are as stiff as the rate of solver iterations (iterations / step) bears, and overlap falls with its square;
//! run time grows with it. Of 150 heaps of 5 to 30 cards, half ended wrong at 1/120 s, which is therefore refused; at 1/240 s
//! the worst pair overlapped by 0.23 mm, half of what is accepted, and a fifth of the heaps gained energy; at 1/480 s
//! nothing overlapped by more than 0.03 mm. Shorter steps buy what no picture shows.

mod diagram;

pub use diagram::diagrams;

use super::clock::cpu_seconds;
use petcomp::geom::UnitQuaternion;
use petcomp::plot::{Axis, Chart, Table};
use petcomp::scene::{Object, Placement, Scene, SettleOptions};
use petcomp::settle::{SettleVerdict, Settled, heap, settle};
use petcomp::{Error, Result, io};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// Time steps, as the number of them in a second.
const RATES: [u32; 4] = [240, 480, 960, 1920];
const ITERATIONS: [u32; 4] = [1, 2, 4, 8];
/// CCD stops in a step, at the default step and iterations.
const CCD: [u32; 3] = [0, 1, 4];
/// Cards in a heap.
const CARDS: usize = 20;
/// Plates in the stack of the closed form, and their thickness, metres.
const PLATES: usize = 10;
const PLATE: f64 = 0.005;
/// Slopes of the closed form, as shares of the slope at which a plate begins to slide.
const SLOPES: [f64; 4] = [0.8, 0.95, 1.05, 1.2];

/// Options of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettleReportOptions {
    /// Heaps for each setting. Default: 20.
    pub heaps: u64,
}

impl Default for SettleReportOptions {
    fn default() -> Self {
        Self { heaps: 20 }
    }
}

/// What a setting of the solver gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleRow {
    /// Time steps in a second.
    pub rate: u32,
    /// Solver iterations in a step.
    pub iterations: u32,
    /// CCD stops in a step.
    pub ccd: u32,
    /// Heaps settled, and how many of them came to a good end at the first try.
    pub heaps: usize,
    /// See [`heaps`](Self::heaps).
    pub rested: usize,
    /// Overlap at the end: median and worst, millimetres.
    pub overlap_mm: [f64; 2],
    /// Energy that appeared between two steps, percent of the drop's: median and worst.
    pub energy_percent: [f64; 2],
    /// How far the topmost of a stack of ten plates is from ten thicknesses, millimetres. Bodies keep two skins of 0.2 mm
    /// between them, so a stack without any overlap has 4.
    pub stack_mm: f64,
    /// Slopes on which a plate slides and should not, or the other way round.
    pub wrong_slopes: usize,
    /// Median CPU time of a heap, milliseconds.
    pub cpu_ms: f64,
}

/// Measures every setting; `progress` hears of each and of how many there are. One thread, so that run times mean something.
///
/// # Errors
/// None that a caller can cause: the scenes are made here.
pub fn measure(
    options: &SettleReportOptions,
    progress: impl Fn(u64, u64),
) -> Result<Vec<SettleRow>> {
    let settings = settings();
    let heaps = (0..options.heaps)
        .map(|k| heap(k, CARDS))
        .collect::<Result<Vec<_>>>()?;
    let of = |(i, setting): (usize, &SettleOptions)| {
        progress(i as u64, settings.len() as u64);
        row(setting, &heaps)
    };
    settings.iter().enumerate().map(of).collect()
}

fn settings() -> Vec<SettleOptions> {
    let usual = SettleOptions {
        attempts: 1,
        ..SettleOptions::default()
    };
    let pairs = RATES
        .iter()
        .flat_map(|rate| ITERATIONS.map(|iterations| (*rate, iterations)));
    let swept = pairs.map(|(rate, iterations)| SettleOptions {
        step: 1.0 / f64::from(rate),
        iterations,
        ..usual
    });
    let stops = CCD
        .into_iter()
        .filter(|ccd| *ccd != usual.ccd)
        .map(|ccd| SettleOptions { ccd, ..usual });
    swept.chain(stops).collect()
}

fn row(options: &SettleOptions, heaps: &[Scene]) -> Result<SettleRow> {
    let (mut ends, mut times) = (Vec::new(), Vec::new());
    for scene in heaps {
        let start = cpu_seconds();
        ends.push(settle(scene.clone(), options)?);
        times.push((cpu_seconds() - start) * 1e3);
    }
    let wrong = SLOPES
        .iter()
        .map(|slope| slides_rightly(*slope, options))
        .collect::<Result<Vec<_>>>()?;
    Ok(SettleRow {
        rate: libm::round(1.0 / options.step) as u32,
        iterations: options.iterations,
        ccd: options.ccd,
        heaps: ends.len(),
        rested: ends
            .iter()
            .filter(|end| end.verdict == SettleVerdict::Rested)
            .count(),
        overlap_mm: median_and_worst(ends.iter().map(|end| end.overlap * 1e3)),
        energy_percent: median_and_worst(ends.iter().map(|end| end.energy_rise * 100.0)),
        stack_mm: stack_error(options)? * 1e3,
        wrong_slopes: wrong.iter().filter(|right| !**right).count(),
        cpu_ms: median_and_worst(times.into_iter())[0],
    })
}

/// Median and greatest; zero of nothing.
pub(super) fn median_and_worst(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    [values.len() / 2, values.len().wrapping_sub(1)].map(|i| values.get(i).copied().unwrap_or(0.0))
}

/// Plates of 200 x 80 mm, level, in the middle of the tray, their lower faces at these heights.
fn plates(bottoms: &[f64]) -> Result<Scene> {
    let mut scene = heap(0, bottoms.len())?;
    let lay = |(object, bottom): (&mut Object, &f64)| {
        (object.size, object.thickness, object.mass) = ([0.2, 0.08], PLATE, 0.03);
        let (above, height) = ([0.0; 2], bottom + PLATE / 2.0);
        object.placement = Placement::Drop {
            above,
            height,
            rotation: UnitQuaternion::identity(),
        };
    };
    scene.objects.iter_mut().zip(bottoms).for_each(lay);
    Ok(scene)
}

/// How far the top of a stack of n plates is from n times their thickness, metres; infinite where it does not rest.
fn stack_error(options: &SettleOptions) -> Result<f64> {
    let bottoms: Vec<f64> = (0..PLATES)
        .map(|i| 2.0 * PLATE * i as f64 + PLATE)
        .collect();
    // What is measured is the error, so no error is refused.
    let end = settle(
        plates(&bottoms)?,
        &SettleOptions {
            max_overlap: 1.0,
            max_energy_rise: 1000.0,
            ..*options
        },
    )?;
    let error = |object: &Object| {
        height(object).map_or(f64::INFINITY, |z| (z - (PLATES as f64 - 0.5) * PLATE).abs())
    };
    Ok(end.scene.objects.last().map_or(f64::INFINITY, error))
}

fn height(object: &Object) -> Option<f64> {
    match object.placement {
        Placement::At(pose) => Some(pose.translation.z),
        Placement::Drop { .. } => None,
    }
}

/// Whether a plate on a slope of so many times the critical one slides if that is more than 1, and else stays.
fn slides_rightly(share: f64, options: &SettleOptions) -> Result<bool> {
    let mut scene = plates(&[0.001])?;
    let slope = libm::atan(share * scene.surface.friction);
    let start = -0.15;
    if let Some(Placement::Drop { above, .. }) = scene
        .objects
        .first_mut()
        .map(|object| &mut object.placement)
    {
        above[0] = start;
    }
    let gravity = [libm::sin(slope), 0.0, -libm::cos(slope)].map(|x| 9.81 * x);
    let end = settle(
        scene,
        &SettleOptions {
            gravity,
            ..*options
        },
    )?;
    // A plate that stays slips while it lands; one that slides stops at the wall, 0.25 m away.
    let slid = end
        .scene
        .objects
        .first()
        .is_some_and(|object| match object.placement {
            Placement::At(pose) => pose.translation.x - start > 0.1,
            Placement::Drop { .. } => share > 1.0,
        });
    Ok(slid == (share > 1.0))
}

/// The sweep as a table.
pub fn table(rows: &[SettleRow]) -> Table {
    let mut table = Table::new([
        "steps per s",
        "iterations",
        "ccd",
        "heaps",
        "rested",
        "overlap median mm",
        "overlap worst mm",
        "energy rise median %",
        "energy rise worst %",
        "stack error mm (4 is skin)",
        "wrong slopes",
        "time ms",
    ]);
    for r in rows {
        let whole = [r.rate, r.iterations, r.ccd].map(|n| n.to_string());
        let counts = [r.heaps, r.rested].map(|n| n.to_string());
        let ([o, worst_o], [e, worst_e]) = (r.overlap_mm, r.energy_percent);
        let errors = [o, worst_o, e, worst_e, r.stack_mm].map(|x| format!("{x:.4}"));
        let last = [r.wrong_slopes.to_string(), format!("{:.1}", r.cpu_ms)];
        table.push(whole.into_iter().chain(counts).chain(errors).chain(last));
    }
    table
}

/// The sweep as charts against run time: worst overlap, energy rise, and error of the stack; a ring where the default is.
pub fn charts(rows: &[SettleRow]) -> Vec<Chart> {
    type Error = fn(&SettleRow) -> f64;
    let usual = SettleOptions::default();
    let swept: Vec<&SettleRow> = rows.iter().filter(|r| r.ccd == usual.ccd).collect();
    let across = Axis::over_decades("time of a heap of 20, ms", swept.iter().map(|r| r.cpu_ms));
    let errors: [(&str, Error); 3] = [
        ("worst overlap, mm", |r| r.overlap_mm[1]),
        ("worst energy rise, %", |r| r.energy_percent[1]),
        ("error of a stack, mm", |r| r.stack_mm),
    ];
    let chart = |(title, error): (&str, Error)| Chart {
        title: format!("{title}, against time"),
        names: RATES
            .map(|rate| format!("1/{rate} s: 1, 2, 4, 8 iterations"))
            .into(),
        across: across.clone(),
        up: Axis::over_decades(title, swept.iter().map(|r| error(r))),
        curves: RATES
            .map(|rate| {
                swept
                    .iter()
                    .filter(|r| r.rate == rate)
                    .map(|r| [r.cpu_ms, error(r)])
                    .collect()
            })
            .into(),
        defaults: swept
            .iter()
            .filter(|r| f64::from(r.rate) * usual.step == 1.0 && r.iterations == usual.iterations)
            .map(|r| [r.cpu_ms, error(r)])
            .collect(),
    };
    errors.map(chart).into()
}

/// A heap for another program to settle, and what became of it here.
#[derive(Clone, Debug, Serialize)]
pub struct PeerCase {
    /// What it is.
    pub name: String,
    /// Before the fall.
    pub scene: Scene,
    /// Width, height and thickness of the box that falls, for each object, metres.
    pub boxes: Vec<[f64; 3]>,
    /// After it.
    pub settled: Scene,
    /// Times of five runs, milliseconds, one thread.
    pub wall_ms: Vec<f64>,
}

/// Heaps of 5, 20 and 60 cards for the comparison in `tests/benches/peers/settle.py`.
///
/// # Errors
/// A heap that does not settle.
pub fn peer_cases() -> Result<Vec<PeerCase>> {
    const RUNS: usize = 5;
    let options = SettleOptions::default();
    let mut cases = Vec::new();
    for (cards, k) in [5, 20, 60]
        .into_iter()
        .flat_map(|cards| (0..3).map(move |k| (cards, k)))
    {
        let scene = heap(k, cards)?;
        let run = |_| {
            let start = Instant::now();
            let end = settle(scene.clone(), &options).and_then(Settled::into_scene)?;
            Ok((end, start.elapsed().as_secs_f64() * 1e3))
        };
        let runs: Vec<(Scene, f64)> = (0..RUNS).map(run).collect::<Result<_>>()?;
        cases.push(PeerCase {
            name: format!("{cards} cards, heap {k}"),
            boxes: scene
                .objects
                .iter()
                .map(|object| (options.half_body(object) * 2.0).into())
                .collect(),
            settled: runs[0].0.clone(),
            scene,
            wall_ms: runs.iter().map(|run| run.1).collect(),
        });
    }
    Ok(cases)
}

/// Writes the sweep (`settle.csv`, `.md`, `.svg`) into a folder.
///
/// # Errors
/// [`Error::Value`] for no heaps; files that cannot be written.
pub fn write(
    folder: &Path,
    options: &SettleReportOptions,
    progress: impl Fn(u64, u64),
) -> Result<Vec<SettleRow>> {
    if options.heaps == 0 {
        return Err(Error::value("heaps", "0, expected at least 1"));
    }
    let rows = measure(options, progress)?;
    io::create_folder(folder)?;
    io::write_text(folder.join("settle.csv"), &table(&rows).csv())?;
    io::write_text(folder.join("settle.md"), &table(&rows).markdown())?;
    io::write_text(folder.join("settle.svg"), &Chart::row(&charts(&rows)))?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_meets_the_closed_forms() {
        let options = SettleOptions::default();
        // Contacts hold bodies up to twice their skin of 0.2 mm apart.
        assert!(stack_error(&options).unwrap() < PLATES as f64 * 0.0004);
        assert!(
            SLOPES
                .iter()
                .all(|slope| slides_rightly(*slope, &options).unwrap())
        );
    }

    #[test]
    fn a_row_is_a_line_and_a_point_and_the_default_has_a_ring() {
        let usual = SettleOptions {
            attempts: 1,
            ..SettleOptions::default()
        };
        let rows = [row(&usual, &[heap(0, 5).unwrap()]).unwrap()];
        assert_eq!(
            (rows[0].rate, rows[0].rested, rows[0].wrong_slopes),
            (480, 1, 0)
        );
        assert_eq!(table(&rows).rows.len(), 1);
        assert!(charts(&rows).iter().all(|chart| chart.defaults.len() == 1));
    }
}
