//! Error of the matting methods against run time, on photos with known mattes.
//!
//! The truth is a renderer's: light added, transmittance with and without the object's own shadow, coverage, screen.
//! Every method sees the same photos and finds the object itself. The two-screen method sees two shots made of the truth
//! by `F + T K`, with the noise of the same sensor: on the photo's screen, green or blue, and on the other one. (The
//! photo itself departs from the model by what blurs and refracts the screen, which a second shot would do alike.)

mod diagram;
mod made;
mod method;
pub(super) mod score;
mod search;
pub(super) mod truth;

pub use diagram::diagrams;
pub use method::MattingMethod;
pub use score::Score;
pub use search::searches;

use super::clock::cpu_seconds;
use petcomp::Image;
use petcomp::LinearRgb;
use petcomp::Result;
use petcomp::io;
use petcomp::plot::{Axis, Chart, Page, Table};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::path::Path;
use truth::{Known, Truths};

/// What a method made of a photo.
#[derive(Clone, Debug, PartialEq)]
pub struct MatteRow {
    /// Name of the photo.
    pub photo: String,
    /// The method.
    pub method: MattingMethod,
    /// Its errors; nothing where it gave no cut-out.
    pub score: Option<Score>,
    /// Why a person should look at the cut-out, or why there is none.
    pub doubts: Vec<String>,
    /// CPU time from the photo in memory to the cut-out on one thread, milliseconds.
    pub time_ms: f64,
}

/// Errors of a method over all photos.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MethodSummary {
    /// The method.
    pub method: MattingMethod,
    /// Means; of the outline's overlap and of the time the median, of the box the 95 % quantile.
    pub score: Score,
    /// Photos without a cut-out.
    pub failed: usize,
    /// Share of the photos whose box is right to 2 pixels.
    pub box_within_2_px: f64,
    /// Photos with a box more than 2 pixels off or an outline overlapping by less than 0.95, and no doubt.
    pub silently_wrong: usize,
    /// Median run time, milliseconds.
    pub time_ms: f64,
}

/// A box that a person would draw, pixels.
pub(super) const GOOD_BOX_PX: f64 = 2.0;
/// The outline that is promised.
pub(super) const GOOD_IOU: f64 = 0.95;
/// Shots made of each photo's truth: their noise is drawn from seeds of their own.
const SHOTS: u64 = 2;
/// New backgrounds per photo.
const BACKGROUNDS: u64 = 3;
/// Longest side of a patch of a new background, pixels.
const PATCH_PX: usize = 24;

/// Measures every method on every photo of a folder with truth; `progress` hears of each photo and of how many there are.
///
/// # Errors
/// A folder without truth, or files of it that cannot be read.
pub fn measure(folder: &Path, progress: impl Fn(u64, u64)) -> Result<Vec<MatteRow>> {
    let truths = Truths::in_folder(folder)?;
    measure_known(truths.len(), |i| truths.read(i), progress)
}

/// Measures every method on so many photos.
fn measure_known(
    count: usize,
    read: impl Fn(usize) -> Result<Known>,
    progress: impl Fn(u64, u64),
) -> Result<Vec<MatteRow>> {
    // One thread, so that run times can be compared.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let mut rows = Vec::new();
    for i in 0..count {
        progress(i as u64, count as u64);
        let known = read(i)?;
        let on = |screen: &Image<LinearRgb>, shot: u64| known.on(screen, SHOTS * i as u64 + shot);
        let shots = [on(&known.screen, 0), on(&known.other_screen(), 1)];
        let backgrounds: Vec<_> = (0..BACKGROUNDS)
            .map(|k| background(known.photo.size(), k))
            .collect();
        for method in MattingMethod::ALL {
            let work = || row(method, &known, &shots, &backgrounds);
            rows.push(
                one.as_ref()
                    .map_or_else(|_| work(), |pool| pool.install(work)),
            );
        }
    }
    Ok(rows)
}

fn row(
    method: MattingMethod,
    known: &Known,
    shots: &[Image<LinearRgb>; 2],
    backgrounds: &[Image<LinearRgb>],
) -> MatteRow {
    let start = cpu_seconds();
    let cut = method.run(known, shots);
    let time_ms = 1e3 * (cpu_seconds() - start);
    let (score, doubts) = match &cut {
        Ok(cut) => {
            let doubts = cut
                .found
                .diagnostics
                .iter()
                .filter(|d| d.needs_review())
                .map(ToString::to_string)
                .collect();
            (Some(Score::new(cut, known, backgrounds)), doubts)
        }
        Err(error) => (None, vec![error.to_string()]),
    };
    MatteRow {
        photo: known.name.clone(),
        method,
        score,
        doubts,
        time_ms,
    }
}

/// A background that nobody has seen: patches of random colours and sizes.
fn background((w, h): (usize, usize), seed: u64) -> Image<LinearRgb> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut share = move || (f64::from(rng.next_u32()) / f64::from(u32::MAX)) as f32;
    let mut image = Image::filled(w, h, LinearRgb::grey(0.2));
    for _ in 0..w * h * 4 / (PATCH_PX * PATCH_PX).max(1) {
        let color = LinearRgb::new(share(), share(), share());
        let mut place = |len: usize| (share() * len as f32) as usize;
        let (x, y, across, down) = (place(w), place(h), 1 + place(PATCH_PX), 1 + place(PATCH_PX));
        for row in y..(y + down).min(h) {
            image.row_mut(row)[x..(x + across).min(w)].fill(color);
        }
    }
    image
}

/// Normal numbers: sums of twelve uniform ones.
pub(super) fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    move || {
        (0..12)
            .map(|_| f64::from(rng.next_u32()) / f64::from(u32::MAX))
            .sum::<f64>()
            - 6.0
    }
}

/// Errors over all photos, a line per method.
pub fn summaries(rows: &[MatteRow]) -> Vec<MethodSummary> {
    MattingMethod::ALL
        .into_iter()
        .map(|method| summary(rows, method))
        .collect()
}

fn summary(rows: &[MatteRow], method: MattingMethod) -> MethodSummary {
    let own: Vec<&MatteRow> = rows.iter().filter(|row| row.method == method).collect();
    let scored: Vec<(&MatteRow, Score)> = own
        .iter()
        .filter_map(|row| row.score.map(|score| (*row, score)))
        .collect();
    let values = |of: fn(&Score) -> f64| scored.iter().map(move |(_, s)| of(s));
    let count = scored.len().max(1) as f64;
    let mean = |of: fn(&Score) -> f64| values(of).sum::<f64>() / count;
    let wrong = |s: &Score| s.box_px > GOOD_BOX_PX || s.iou < GOOD_IOU;
    MethodSummary {
        method,
        score: Score {
            sad: mean(|s| s.sad),
            mse: mean(|s| s.mse),
            gradient: mean(|s| s.gradient),
            mae_lit: mean(|s| s.mae_lit),
            psnr_lit: mean(|s| s.psnr_lit),
            mae_shaded: mean(|s| s.mae_shaded),
            psnr_shaded: mean(|s| s.psnr_shaded),
            residue: mean(|s| s.residue),
            iou: quantile(values(|s| s.iou), 0.5),
            box_px: quantile(values(|s| s.box_px), 0.95),
        },
        failed: own.len() - scored.len(),
        box_within_2_px: values(|s| s.box_px).filter(|b| *b <= GOOD_BOX_PX).count() as f64 / count,
        silently_wrong: scored
            .iter()
            .filter(|(row, s)| row.doubts.is_empty() && wrong(s))
            .count(),
        time_ms: quantile(own.iter().map(|row| row.time_ms), 0.5),
    }
}

/// The value that a share of the values is not above; 0 of nothing.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let rank = libm::round(share * values.len().saturating_sub(1) as f64) as usize;
    values.get(rank).copied().unwrap_or(0.0)
}

/// The table method x error x time.
pub fn table(summaries: &[MethodSummary]) -> Table {
    let mut table = Table::new([
        "method",
        "MAE lit (F+VB)",
        "PSNR, dB",
        "MAE shaded (F+TB)",
        "PSNR, dB",
        "SAD, 1000 px",
        "MSE",
        "gradient, 1000",
        "residue",
        "outline IoU, median",
        "box, 95 %, px",
        "box within 2 px",
        "silently wrong",
        "no cut-out",
        "time, ms",
    ]);
    for s in summaries {
        let e = &s.score;
        table.push([
            s.method.name().to_owned(),
            format!("{:.5}", e.mae_lit),
            format!("{:.1}", e.psnr_lit),
            format!("{:.5}", e.mae_shaded),
            format!("{:.1}", e.psnr_shaded),
            format!("{:.2}", e.sad),
            format!("{:.5}", e.mse),
            format!("{:.2}", e.gradient),
            format!("{:.5}", e.residue),
            format!("{:.4}", e.iou),
            format!("{:.2}", e.box_px),
            format!("{:.0} %", 100.0 * s.box_within_2_px),
            s.silently_wrong.to_string(),
            s.failed.to_string(),
            format!("{:.0}", s.time_ms),
        ]);
    }
    table
}

/// Every photo with every method.
pub fn details(rows: &[MatteRow]) -> Table {
    let mut table = Table::new([
        "photo",
        "method",
        "mae_lit",
        "psnr_lit",
        "mae_shaded",
        "psnr_shaded",
        "sad",
        "mse",
        "gradient",
        "residue",
        "iou",
        "box_px",
        "time_ms",
        "doubts",
    ]);
    for row in rows {
        let e = row.score.unwrap_or_default();
        let errors = [
            e.mae_lit,
            e.psnr_lit,
            e.mae_shaded,
            e.psnr_shaded,
            e.sad,
            e.mse,
            e.gradient,
            e.residue,
            e.iou,
            e.box_px,
        ];
        let number = |v: f64| {
            if row.score.is_some() {
                format!("{v:.6}")
            } else {
                String::new()
            }
        };
        let head = [row.photo.clone(), row.method.name().to_owned()];
        let tail = [format!("{:.1}", row.time_ms), row.doubts.join("; ")];
        table.push(head.into_iter().chain(errors.map(number)).chain(tail));
    }
    table
}

/// Error against run time, a point per method: over backgrounds lit by themselves, and in the object's own shadow.
pub fn chart(summaries: &[MethodSummary]) -> String {
    type Error = fn(&Score) -> f64;
    let errors: [(&str, Error); 2] = [
        ("new background, lit by itself", |s| s.mae_lit),
        ("new background, shaded by the object", |s| s.mae_shaded),
    ];
    let across = Axis::over_decades(
        "run time per photo, one thread, ms",
        summaries.iter().map(|s| s.time_ms),
    );
    let both = errors
        .iter()
        .flat_map(|(_, error)| summaries.iter().map(|s| error(&s.score)));
    let up = Axis::over_decades("mean absolute error, linear light", both);
    let chart = |(title, error): (&str, Error)| Chart {
        title: title.into(),
        names: summaries.iter().map(|s| s.method.name().into()).collect(),
        across: across.clone(),
        up: up.clone(),
        curves: summaries
            .iter()
            .map(|s| vec![[s.time_ms, error(&s.score)]])
            .collect(),
        defaults: summaries
            .iter()
            .filter(|s| s.method == MattingMethod::Physical)
            .map(|s| [s.time_ms, error(&s.score)])
            .collect(),
    };
    Chart::row(&errors.map(chart))
}

/// Measures and writes `matte.csv`, `matte.md`, `matte.svg` and `matte.html` into a folder.
///
/// # Errors
/// Those of [`measure`]; files that cannot be written.
pub fn write(
    truth: &Path,
    folder: &Path,
    progress: impl Fn(u64, u64),
) -> Result<Vec<MethodSummary>> {
    let rows = measure(truth, progress)?;
    let summaries = summaries(&rows);
    let (table, chart) = (table(&summaries), chart(&summaries));
    io::create_folder(folder)?;
    io::write_text(folder.join("matte.csv"), &details(&rows).csv())?;
    io::write_text(
        folder.join("matte.md"),
        &format!("# Error of the mattes\n\n{}", table.markdown()),
    )?;
    io::write_text(folder.join("matte.svg"), &chart)?;
    let mut page = Page::new("Error of the mattes");
    page.table(&table)
        .chart(
            &chart,
            "Error against run time; the ring is the default method.",
        )
        .table(&details(&rows));
    io::write_text(folder.join("matte.html"), &page.document())?;
    Ok(summaries)
}
