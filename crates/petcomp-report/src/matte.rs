//! Error of the matting methods against run time, on photos with known mattes.
//!
//! The truth is a renderer's: light added, transmittance with and without the object's own shadow,
//! coverage, screen. Every method gets the same photos and finds the object itself. The two-screen
//! method gets two shots composed from the truth as `F + T K`, with the noise of the same sensor:
//! on the photo's screen, green or blue, and on the other one. (The photo itself deviates from the
//! model through blur and refraction of the screen, which would be the same in a second shot.)

mod diagram;
mod made;
mod method;
mod random;
pub(super) mod score;
mod search;
mod show;
mod summary;
pub(super) mod truth;

pub(super) use diagram::diagrams;
pub(super) use method::{MattingMethod, largest_channel};
pub(super) use random::{normal, uniform};
pub(super) use search::searches;

use super::clock::cpu_seconds;
use super::files::write_texts;
use petcomp::plot::{Page, Table};
use petcomp::{Diagnostic, Image, LinearRgb, Result};
use random::patched_background;
use score::Score;
use show::{chart, details, table};
use std::path::Path;
use summary::{MethodSummary, summaries};
use truth::{Known, Truths};

/// The result of a method for a photo.
struct MatteRow {
    photo: String,
    method: MattingMethod,
    /// Its errors; none without a cut-out.
    score: Option<Score>,
    /// Why the cut-out needs review, or why there is none.
    warnings: Vec<String>,
    /// CPU time from the photo in memory to the cut-out on one thread, milliseconds.
    time_ms: f64,
}

/// Error of a box that a person would draw, pixels.
pub(super) const GOOD_BOX_PX: f64 = 2.0;
/// The promised overlap of the outline.
pub(super) const GOOD_IOU: f64 = 0.95;
/// Shots composed from each photo's truth: their noise has seeds of its own.
const SHOTS_PER_PHOTO: u64 = 2;
const MS_PER_SECOND: f64 = 1e3;
/// New backgrounds per photo.
const BACKGROUNDS_PER_PHOTO: u64 = 3;

/// The messages of the diagnostics that need review.
pub(super) fn review_messages(diagnostics: &[Diagnostic]) -> Vec<String> {
    let needing_review = diagnostics.iter().filter(|d| d.needs_review());
    needing_review.map(ToString::to_string).collect()
}

/// Measures every method on every photo of a folder with truth; `progress` gets the number of the
/// photo and of all photos.
fn measure(folder: &Path, progress: impl Fn(u64, u64)) -> Result<Vec<MatteRow>> {
    let truths = Truths::in_folder(folder)?;
    measure_known(truths.len(), |i| truths.read(i), progress)
}

/// Measures every method on a number of photos.
fn measure_known(
    count: usize,
    read: impl Fn(usize) -> Result<Known>,
    progress: impl Fn(u64, u64),
) -> Result<Vec<MatteRow>> {
    // One thread, so that run times are comparable.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let mut rows = Vec::new();
    for i in 0..count {
        progress(i as u64, count as u64);
        let inputs = MattingInputs::new(read(i)?, i as u64);
        for method in MattingMethod::ALL {
            rows.push(match &one {
                Ok(pool) => pool.install(|| inputs.row(method)),
                Err(_) => inputs.row(method),
            });
        }
    }
    Ok(rows)
}

/// A photo with its truth, and the inputs derived from them.
struct MattingInputs {
    known: Known,
    /// Those of the two-screen method.
    shots: [Image<LinearRgb>; 2],
    backgrounds: Vec<Image<LinearRgb>>,
}

impl MattingInputs {
    /// The inputs of photo `i`.
    fn new(known: Known, i: u64) -> Self {
        let seed = SHOTS_PER_PHOTO * i;
        let size = known.photo.size();
        Self {
            shots: [
                known.on(&known.screen, seed),
                known.on(&known.other_screen(), seed + 1),
            ],
            backgrounds: (0..BACKGROUNDS_PER_PHOTO)
                .map(|k| patched_background(size, k))
                .collect(),
            known,
        }
    }

    fn row(&self, method: MattingMethod) -> MatteRow {
        let start = cpu_seconds();
        let cut = method.run(&self.known.photo, &self.shots);
        let time_ms = MS_PER_SECOND * (cpu_seconds() - start);
        let (score, warnings) = match cut {
            Ok(cut) => (
                Some(Score::new(&cut, &self.known, &self.backgrounds)),
                review_messages(&cut.found.diagnostics),
            ),
            Err(error) => (None, vec![error.to_string()]),
        };
        MatteRow {
            photo: self.known.name.clone(),
            method,
            score,
            warnings,
            time_ms,
        }
    }
}

/// Measures and writes `matte.csv`, `matte.md`, `matte.svg` and `matte.html` into a folder.
///
/// # Errors
/// A folder without truth; files that cannot be read or written.
pub fn write(truth: &Path, folder: &Path, progress: impl Fn(u64, u64)) -> Result<Table> {
    let rows = measure(truth, progress)?;
    let summaries = summaries(&rows);
    let (details, table) = (details(&rows), table(&summaries));
    let chart = chart(&summaries);
    let mut page = Page::new(TITLE);
    page.table(&table).chart(&chart, CAPTION).table(&details);
    let files = [
        ("matte.csv", &*details.csv()),
        ("matte.md", &format!("# {TITLE}\n\n{}", table.markdown())),
        ("matte.svg", &chart),
        ("matte.html", &page.document()),
    ];
    write_texts(folder, files)?;
    Ok(table)
}

const TITLE: &str = "Error of the mattes";
const CAPTION: &str = "Error against run time; the ring is the default method.";
