//! Cost of scene features: every scene here has a feature or lacks it, and the table shows the
//! counted work.
//!
//! Each scene runs through the whole program: files are opened, unknowns are solved, and the
//! picture, its labels or a dataset is generated and written. Numbers are the same in every run, on
//! every machine, and with any number of threads.

mod cases;
#[cfg(test)]
mod tests;
mod world;

use crate::files::write_texts;
use cases::{Asked, WorkCase, cases};
use petcomp::PremulRgba;
use petcomp::dataset::{Pipeline, generate};
use petcomp::plot::Table;
use petcomp::scene::Scene;
use petcomp::work::{self, Kind, LARGE_BYTES, Work};
use petcomp::{Error, Result, io};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use world::FixtureFolder;

/// A scene and its counted work.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkRow {
    /// Name of the scene.
    pub scene: &'static str,
    /// Its contents, and what is generated from it.
    pub about: &'static str,
    /// Work of each kind; kinds that this program cannot count are left out.
    pub counts: Vec<(Kind, u64)>,
    /// Kinds whose count must be zero.
    pub absent: Vec<Kind>,
}

impl WorkRow {
    /// Whether every count that must be zero is.
    pub fn is_as_expected(&self) -> bool {
        self.counts
            .iter()
            .all(|(kind, count)| *count == 0 || !self.absent.contains(kind))
    }
}

/// Processes every scene and counts its work; `progress` gets the number of finished scenes and of
/// all scenes.
///
/// # Errors
/// A temporary folder that cannot be written; no threads.
pub fn measure(progress: impl Fn(u64, u64)) -> Result<Vec<WorkRow>> {
    let world = FixtureFolder::new()?;
    let cases = cases(&world);
    let numbered = cases.iter().enumerate();
    numbered
        .map(|(i, case)| {
            progress(i as u64, cases.len() as u64);
            measured_row(&world, case)
        })
        .collect()
}

fn measured_row(world: &FixtureFolder, case: &WorkCase) -> Result<WorkRow> {
    let work = work_of(world, case)?;
    Ok(WorkRow {
        scene: case.name,
        about: case.about,
        counts: counts(&work, counts_allocations()?),
        absent: case.absent(),
    })
}

fn counts(work: &Work, with_allocations: bool) -> Vec<(Kind, u64)> {
    Kind::ALL
        .into_iter()
        .filter(|kind| with_allocations || *kind != Kind::LargeAllocations)
        .map(|kind| (kind, work[kind]))
        .collect()
}

/// The work of a scene from its files to the output.
fn work_of(world: &FixtureFolder, case: &WorkCase) -> Result<Work> {
    let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
    let (done, work) = counted(|| make_case(world, case, folder.path()))?;
    done.map(|()| work)
}

fn counted<T: Send>(job: impl FnOnce() -> T + Send) -> Result<(T, Work)> {
    work::counted(job).map_err(|e| Error::value("threads", e))
}

/// Generates the output of a case and writes it into a folder.
fn make_case(world: &FixtureFolder, case: &WorkCase, folder: &Path) -> Result<()> {
    let scene = case.scene.clone();
    let pipeline = Pipeline::open_for(world.config(), &scene)?;
    match case.asked {
        Asked::Picture => make_picture(&pipeline, scene, folder),
        Asked::Labels => io::write_json(folder.join("labels.json"), &pipeline.label(scene)?),
        Asked::Dataset => make_dataset(&pipeline, &scene, folder),
    }
}

fn make_picture(pipeline: &Pipeline, scene: Scene, folder: &Path) -> Result<()> {
    let (scene, shot) = pipeline.resolve(scene)?;
    let (_, frame) = pipeline.shoot(&scene, &shot);
    io::write(folder.join("picture.png"), &frame.map(PremulRgba::color))
}

fn make_dataset(pipeline: &Pipeline, scene: &Scene, folder: &Path) -> Result<()> {
    let plan = pipeline.plan(1, 0, folder)?;
    let running = AtomicBool::new(false);
    generate(&plan, |_| pipeline.take(scene.clone()), &|_| {}, &running)?;
    Ok(())
}

/// Whether the allocator of this program counts large allocations.
fn counts_allocations() -> Result<bool> {
    let (_, work) = counted(|| drop(std::hint::black_box(vec![1_u8; LARGE_BYTES])))?;
    Ok(work[Kind::LargeAllocations] > 0)
}

/// Measures and writes `work.csv` and `work.md` into a folder.
///
/// # Errors
/// As [`measure`]; files that cannot be written.
pub fn write(folder: impl AsRef<Path>, progress: impl Fn(u64, u64)) -> Result<Vec<WorkRow>> {
    let rows = measure(progress)?;
    let data = csv(&rows).csv();
    let files = [("work.csv", &*data), ("work.md", &markdown(&rows))];
    write_texts(folder.as_ref(), files)?;
    Ok(rows)
}

/// Scenes by kinds of work, as integers; required zeros are marked, and so are counts that should
/// be zero but are not.
pub fn table(rows: &[WorkRow]) -> Table {
    scenes_by_kinds(rows, marked)
}

fn marked(row: &WorkRow, kind: Kind, count: u64) -> String {
    match (row.absent.contains(&kind), count) {
        (true, 0) => "0 ✓".to_owned(),
        (true, _) => format!("{count} ✗"),
        (false, _) => count.to_string(),
    }
}

/// The same numbers without marks.
fn csv(rows: &[WorkRow]) -> Table {
    scenes_by_kinds(rows, |_, _, count| count.to_string())
}

fn scenes_by_kinds(rows: &[WorkRow], shown: impl Fn(&WorkRow, Kind, u64) -> String) -> Table {
    let counts = rows.first().map_or(&[][..], |row| &row.counts);
    let kinds = counts.iter().map(|(kind, _)| kind.name());
    let mut table = Table::new(["scene", "contents"].into_iter().chain(kinds));
    for row in rows {
        let names = [row.scene, row.about].map(String::from);
        let counts = row.counts.iter();
        let counts = counts.map(|(kind, count)| shown(row, *kind, *count));
        table.push(names.into_iter().chain(counts));
    }
    table
}

/// The table with its explanation.
fn markdown(rows: &[WorkRow]) -> String {
    let kept = rows.iter().filter(|row| row.is_as_expected()).count();
    let head = format!(
        "# Cost of scene features\n\nCounted, not timed; the same numbers with any number of threads. ✓ marks a zero \
         that is guaranteed and tested. {kept} of {} scenes are as expected.\n\n",
        rows.len()
    );
    format!(
        "{head}{}\n{}",
        table(rows).markdown(),
        meanings().markdown()
    )
}

fn meanings() -> Table {
    let mut kinds = Table::new(["count", "meaning"]);
    for kind in Kind::ALL {
        kinds.push([kind.name(), kind.meaning()]);
    }
    kinds
}
