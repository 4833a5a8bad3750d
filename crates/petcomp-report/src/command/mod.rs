//! `petcomp-report`: measures how well each stage works; one file per report.

mod all;
mod camera;
mod flags;
mod matte;
mod render;
mod scale;
mod settle;
mod stability;
mod work;

use crate::ReportFlags;
use petcomp_report::all::AllOptions;
use petcomp_report::render::RenderReportOptions;
use std::path::PathBuf;

/// Arguments of reports on photos with known mattes.
#[derive(clap::Args)]
pub(crate) struct TruthArgs {
    /// Folder of photos with ground truth, laid out like the sample world
    #[arg(long, value_name = "FOLDER")]
    truth: PathBuf,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Measure everything on one page, in about three minutes: report.html, report.md and the data
    /// as CSV
    All(AllOptions),
    /// Measure the error of the camera solver against run time and tilt: camera.csv, camera.md and
    /// plots (SVG)
    Camera(camera::Args),
    /// Measure the error of the settle stage against run time: settle.csv, settle.md and a plot
    /// (SVG)
    Settle(settle::Args),
    /// Test every stage on stiff and extreme input: stability.csv and stability.md
    Stability(stability::Args),
    /// Measure the error of the matting methods against run time on photos with known mattes
    /// (matte.csv, matte.md, matte.svg, matte.html), and of captures over new backgrounds
    /// (display.csv, display.md)
    Matte(matte::Args),
    /// Measure whether wrong cut-outs are flagged, on photos with known outlines degraded in many
    /// ways: flags.csv, flags.md
    Flags(TruthArgs),
    /// Measure the error of the renderer against run time, compared with Cycles: render.csv,
    /// render.md, a plot and the golden scenes
    Render(RenderReportOptions),
    /// Count the work that each feature of a scene costs: work.csv and work.md
    Work(work::Args),
    /// Measure memory and throughput by threads, pixels and cards, and for a million images:
    /// scale.csv, scale.md and charts (SVG)
    Scale(scale::Args),
}

pub(crate) fn run(command: &Command, common: &ReportFlags) -> anyhow::Result<()> {
    use Command::*;
    match command {
        All(args) => all::run(args, common),
        Camera(args) => camera::run(args, common),
        Settle(args) => settle::run(args, common),
        Stability(args) => stability::run(args, common),
        Matte(args) => matte::run(args, common),
        Flags(args) => flags::run(args, common),
        Render(args) => render::run(args, common),
        Work(args) => work::run(args, common),
        Scale(args) => scale::run(args, common),
    }
}
