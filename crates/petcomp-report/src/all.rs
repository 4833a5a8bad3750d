//! All measurements in one document: error against run time of every approximate stage, the
//! qualities that lie on those curves, other programs, and extreme cases.
//!
//! Inputs are generated in code or come with the repository (the golden scenes of Blender's
//! Cycles), so a fresh clone is sufficient; photos with known mattes and other programs'
//! measurements are added if they exist.

use super::section::{Document, Section};
use super::{
    Diagram, camera, color, encode, keying, label, light, machine, matte, peers, render, scale,
    settle, stability, work,
};
use petcomp::{Quality, Result};
use std::path::{Path, PathBuf};

#[expect(
    missing_docs,
    reason = "its documentation would be the program's: clap prints it"
)]
#[derive(clap::Args)]
pub struct AllOptions {
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    pub output: PathBuf,
    /// Folder of other programs' measurements, as written by `make peers`; skipped if missing
    #[arg(long, value_name = "FOLDER", default_value = "target/peers")]
    peers: PathBuf,
    /// Folder of photos with ground truth for the mattes, laid out like the sample world; by
    /// default synthetic photos
    #[arg(long, value_name = "FOLDER")]
    truth: Option<PathBuf>,
    /// Folder of golden scenes with Cycles' images; skipped if missing
    #[arg(long, value_name = "FOLDER", default_value = "golden/render")]
    golden: PathBuf,
    /// Fewer runs and inputs: a preview in half a minute, with noisier times
    #[arg(long)]
    quick: bool,
    /// Date to show on the page
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    date: String,
}

/// Amount of work per measurement.
struct Amount {
    views: u64,
    bottles: usize,
    heaps: u64,
    runs: usize,
}

const QUICK_AMOUNT: Amount = Amount {
    views: 20,
    bottles: 1,
    heaps: 2,
    runs: 1,
};

const FULL_AMOUNT: Amount = Amount {
    views: 200,
    bottles: 4,
    heaps: 10,
    runs: 5,
};

/// One measurement: the diagrams of a stage.
type Measure = fn(&AllOptions, &Amount) -> Result<Vec<Diagram>>;

/// The measurements, in the order of the data.
const STAGES: [Measure; 10] = [
    |_, _| color::diagrams(),
    |options, _| matte::diagrams(options.truth.as_deref()),
    |_, amount| matte::searches(amount.bottles),
    |_, _| keying::diagrams(),
    |_, amount| Ok(camera::diagrams(amount.views)),
    |_, amount| settle::measured_diagrams(amount.heaps),
    |_, _| light::diagrams(),
    |options, amount| render::diagrams(&options.golden, amount.runs),
    |_, _| label::diagrams(),
    |_, _| encode::diagrams(),
];

const SLOW_SECTIONS: [fn() -> Result<Section>; 3] =
    [stability_of_stages, counted_work, memory_and_scale];

/// Measures everything; `progress` gets the number of the step and of all steps.
///
/// Times are CPU seconds of one thread. Takes about three minutes on two to four cores, or half a
/// minute in the quick mode, which leaves out extreme cases, counted work and scale.
fn measure(options: &AllOptions, progress: impl Fn(u64, u64)) -> Result<Document> {
    let slow: &[fn() -> Result<Section>] = if options.quick { &[] } else { &SLOW_SECTIONS };
    let steps = (STAGES.len() + slow.len()) as u64;
    let mut sections = quick_sections(options, |done| progress(done, steps))?;
    for (done, section) in (STAGES.len() as u64..).zip(slow) {
        progress(done, steps);
        sections.push(section()?);
    }
    progress(steps, steps);
    Ok(Document {
        title: "petcomp: accuracy, speed and cost of every stage".into(),
        sections,
    })
}

fn quick_sections(options: &AllOptions, progress: impl Fn(u64)) -> Result<Vec<Section>> {
    let diagrams = measure_stages(options, progress)?;
    let others = peers::read_comparisons(&options.peers)?;
    Ok(vec![
        about_report(options),
        error_curves(&diagrams),
        quality_table(),
        other_programs(&others, &options.peers),
    ])
}

fn measure_stages(options: &AllOptions, progress: impl Fn(u64)) -> Result<Vec<Diagram>> {
    let amount = if options.quick {
        QUICK_AMOUNT
    } else {
        FULL_AMOUNT
    };
    let mut diagrams = Vec::new();
    for (done, stage) in (0..).zip(STAGES) {
        progress(done);
        diagrams.extend(stage(options, &amount)?);
    }
    Ok(diagrams)
}

/// Measures everything and writes `report.html`, `report.md` and the data of each plot and table
/// (`.csv`) into a folder.
///
/// # Errors
/// An input that cannot be read; a thread or scratch folder that cannot be created; a system
/// without Linux's `/proc`, which memory and scale need; files that cannot be written. Nothing is
/// written before everything is measured.
pub fn write(options: &AllOptions, progress: impl Fn(u64, u64)) -> Result<()> {
    measure(options, progress)?.write(&options.output)
}

fn about_report(options: &AllOptions) -> Section {
    let quick = if options.quick {
        " It is a quick run (`--quick`): times are from few runs; extreme cases, counted work and scale are left out."
    } else {
        ""
    };
    Section::new("About this report")
        .text(format!(
            "One run of `petcomp-report all` on the machine below. Times are median CPU seconds of one thread; errors \
             are the same in every run.{quick}"
        ))
        .table("machine", machine::machine_table(&options.date))
}

fn error_curves(diagrams: &[Diagram]) -> Section {
    Section::new("Error against run time")
        .text(
            "Each point is a setting: further left is cheaper, further down is more accurate. Points that no other \
             beats in both form the efficient (Pareto) front. A ring marks the default. Names in brackets are the \
             qualities that use a setting.",
        )
        .table("defaults", Diagram::summary(diagrams))
        .diagrams(diagrams)
}

fn quality_table() -> Section {
    Section::new("Quality")
        .text(
            "`--quality draft|normal|reference` moves every approximate stage of a run along its curve at once. Stages \
             missing from the table are exact at every quality, or so fast that there is nothing to gain: colour \
             transfer, the keyer, masks and boxes, the camera.",
        )
        .table("quality", Quality::table())
}

fn other_programs(comparisons: &[peers::PeerComparison], folder: &Path) -> Section {
    let section = Section::new("Other programs");
    if comparisons.is_empty() {
        let folder = folder.display();
        return section.text(format!(
            "There are no measurements in {folder}: `make peers` runs the other programs that are available."
        ));
    }
    let diagrams = comparisons.iter().map(peers::PeerComparison::diagram);
    let diagrams: Vec<_> = diagrams.filter(|d| !d.points.is_empty()).collect();
    comparisons
        .iter()
        .fold(section, |section, c| section.text(c.missing()))
        .text("Measured in one run of `make peers`, on the same cores and the same input.")
        .table("peers", peers::ratios(comparisons))
        .diagrams(&diagrams)
        .table("peers_commands", peers::commands(comparisons))
}

fn stability_of_stages() -> Result<Section> {
    let rows = stability::measure("", |_, _| ())?;
    let passed = rows.iter().filter(|row| row.outcome.passed).count();
    Ok(Section::new("Stability")
        .text(format!(
            "{passed} of {} stiff and extreme cases pass.",
            rows.len()
        ))
        .table("stability_summary", stability::summary(&rows))
        .table("stability", stability::table(&rows)))
}

fn counted_work() -> Result<Section> {
    let rows = work::measure(|_, _| ())?;
    let kept = rows.iter().filter(|row| row.is_as_expected()).count();
    Ok(Section::new("Cost of scene features")
        .text(format!(
            "Work is counted, not timed, and the same in every run and on every machine. A marked zero is guaranteed; \
             {kept} of {} scenes are as expected.",
            rows.len()
        ))
        .table("work", work::table(&rows).transposed()))
}

fn memory_and_scale() -> Result<Section> {
    let measured = scale::measure(scale::DEFAULT_SECONDS, scale::core_count(), |_, _| ())?;
    let tables = scale::tables(&measured)?;
    let mut section = Section::new("Memory and scale");
    for (svg, caption) in scale::charts(&measured)? {
        section = section.figure("scale_points", svg, caption, tables[0].1.clone());
    }
    for (title, table) in tables {
        let file = title.to_lowercase().replace(' ', "_");
        section = section
            .text(format!("{title}:"))
            .table(format!("scale_{file}"), table);
    }
    Ok(section)
}
