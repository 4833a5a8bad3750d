//! What scenes pay for: every scene here has something or lacks it, and the table shows what that costs, counted.
//!
//! Each scene goes the whole way that the program takes: files are opened, what is unknown is found out, the picture is
//! made, or its labels, or a dataset of it, and what comes out is written. Numbers are the same at every run, on every
//! machine, and at any thread count.

mod cases;
#[cfg(test)]
mod tests;
mod world;

use cases::{Asked, WorkCase, cases};
use petcomp::PremulRgba;
use petcomp::dataset::{Pipeline, generate};
use petcomp::plot::Table;
use petcomp::work::{self, Kind, LARGE_BYTES, Work};
use petcomp::{Error, Result, io};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use world::FixtureFolder;

/// A scene and the work that it made.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkRow {
    /// Name of the scene.
    pub scene: &'static str,
    /// What is in it, and what is asked for.
    pub about: &'static str,
    /// How much of each kind was done; of kinds that this program cannot count there is none.
    pub counts: Vec<(Kind, u64)>,
    /// Kinds that are promised to be none.
    pub absent: Vec<Kind>,
}

impl WorkRow {
    /// Every promise is kept.
    pub fn is_as_promised(&self) -> bool {
        self.counts
            .iter()
            .all(|(kind, count)| *count == 0 || !self.absent.contains(kind))
    }
}

/// Makes every scene and counts; `progress` hears of each and of how many there are.
///
/// # Errors
/// A temporary folder that cannot be written; no threads.
pub fn measure(progress: impl Fn(u64, u64)) -> Result<Vec<WorkRow>> {
    let world = FixtureFolder::make()?;
    let cases = cases(&world);
    let of = |(i, case): (usize, &WorkCase)| {
        progress(i as u64, cases.len() as u64);
        row(&world, case)
    };
    cases.iter().enumerate().map(of).collect()
}

fn row(world: &FixtureFolder, case: &WorkCase) -> Result<WorkRow> {
    let counts = counts(&work_of(world, case)?, allocations_are_told()?);
    Ok(WorkRow {
        scene: case.name,
        about: case.about,
        counts,
        absent: case.absent(),
    })
}

fn counts(work: &Work, with_allocations: bool) -> Vec<(Kind, u64)> {
    let kinds = Kind::ALL
        .into_iter()
        .filter(|kind| with_allocations || *kind != Kind::LargeAllocations);
    kinds.map(|kind| (kind, work[kind])).collect()
}

/// The work of a scene from its files to what comes out.
fn work_of(world: &FixtureFolder, case: &WorkCase) -> Result<Work> {
    let folder = tempfile::tempdir().map_err(|e| Error::value("temporary folder", e))?;
    let (done, work) = counted(|| make(world, case, folder.path()))?;
    done.map(|()| work)
}

fn counted<T: Send>(job: impl FnOnce() -> T + Send) -> Result<(T, Work)> {
    work::counted(job).map_err(|e| Error::value("threads", e))
}

/// Makes what a case asks for and writes it into a folder.
fn make(world: &FixtureFolder, case: &WorkCase, folder: &Path) -> Result<()> {
    let scene = case.scene.clone();
    let pipeline = Pipeline::open_for(world.config(), &scene)?;
    match case.asked {
        Asked::Picture => {
            let (scene, shot) = pipeline.resolve(scene)?;
            let (_, frame) = pipeline.shoot(&scene, &shot);
            io::write(folder.join("picture.png"), &frame.map(PremulRgba::color))
        }
        Asked::Labels => io::write_json(folder.join("labels.json"), &pipeline.label(scene)?),
        Asked::Dataset => {
            let plan = pipeline.plan(1, 0, folder)?;
            generate(
                &plan,
                |_| pipeline.take(scene.clone()),
                &|_| {},
                &AtomicBool::new(false),
            )
            .map(|_| ())
        }
    }
}

/// Whether the allocator of this program tells what it gives.
fn allocations_are_told() -> Result<bool> {
    let (_, work) = counted(|| drop(std::hint::black_box(vec![1_u8; LARGE_BYTES])))?;
    Ok(work[Kind::LargeAllocations] > 0)
}

/// Measures and writes `work.csv` and `work.md` into a folder.
///
/// # Errors
/// As [`measure`]; files that cannot be written.
pub fn write(folder: impl AsRef<Path>, progress: impl Fn(u64, u64)) -> Result<Vec<WorkRow>> {
    let folder = folder.as_ref();
    io::create_folder(folder)?;
    let rows = measure(progress)?;
    io::write_text(folder.join("work.csv"), &csv(&rows).csv())?;
    io::write_text(folder.join("work.md"), &markdown(&rows))?;
    Ok(rows)
}

/// Scenes by kinds of work, in whole numbers; a zero that is promised is marked, and so is a promise that is not kept.
pub fn table(rows: &[WorkRow]) -> Table {
    let told = |row: &WorkRow, kind: Kind, count: u64| match (row.absent.contains(&kind), count) {
        (true, 0) => "0 ✓".to_owned(),
        (true, _) => format!("{count} ✗"),
        (false, _) => count.to_string(),
    };
    scenes_by_kinds(rows, told)
}

/// The same numbers without marks.
fn csv(rows: &[WorkRow]) -> Table {
    scenes_by_kinds(rows, |_, _, count| count.to_string())
}

fn scenes_by_kinds(rows: &[WorkRow], told: impl Fn(&WorkRow, Kind, u64) -> String) -> Table {
    let kinds: Vec<Kind> = rows.first().map_or(Vec::new(), |row| {
        row.counts.iter().map(|(kind, _)| *kind).collect()
    });
    let mut table = Table::new(
        ["scene", "what is in it"]
            .into_iter()
            .chain(kinds.iter().map(|kind| kind.name())),
    );
    for row in rows {
        let counts = row
            .counts
            .iter()
            .map(|(kind, count)| told(row, *kind, *count));
        table.push(
            [row.scene, row.about]
                .into_iter()
                .map(String::from)
                .chain(counts),
        );
    }
    table
}

/// The table with what it means.
fn markdown(rows: &[WorkRow]) -> String {
    let kept = rows.iter().filter(|row| row.is_as_promised()).count();
    let head = format!(
        "# What scenes pay for\n\nCounted, not timed; the same numbers at any thread count. ✓ marks a zero that is \
         promised and tested. {kept} of {} scenes are as promised.\n\n",
        rows.len()
    );
    let mut kinds = Table::new(["count", "of what"]);
    Kind::ALL
        .iter()
        .for_each(|kind| kinds.push([kind.name(), kind.meaning()]));
    format!("{head}{}\n{}", table(rows).markdown(), kinds.markdown())
}
