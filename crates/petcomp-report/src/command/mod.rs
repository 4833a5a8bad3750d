//! `petcomp-report`: how good a stage is, measured: one file per stage.

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

/// What a report of photos with known mattes needs.
#[derive(clap::Args)]
pub(crate) struct TruthArgs {
    /// Folder with photos and their truth, as the sample world has them
    #[arg(long, value_name = "FOLDER")]
    truth: PathBuf,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Everything that is measured on one page, in about three minutes: report.html, report.md and
    /// the data as CSV
    All(AllOptions),
    /// Error of the camera solver against run time and against tilt: camera.csv, camera.md and
    /// plots (SVG)
    Camera(camera::Args),
    /// Error of the settle stage against run time: settle.csv, settle.md and a plot (SVG)
    Settle(settle::Args),
    /// Every stage on stiff and extreme input: stability.csv and stability.md
    Stability(stability::Args),
    /// Error of the matting methods against run time, on photos with known mattes: matte.csv,
    /// matte.md, matte.svg, matte.html; and of captures over new backgrounds: display.csv,
    /// display.md
    Matte(matte::Args),
    /// Whether wrong cut-outs are flagged, on photos with known outlines made harder in many ways:
    /// flags.csv, flags.md
    Flags(TruthArgs),
    /// Error of the renderer against run time, beside Cycles: render.csv, render.md, a plot and the
    /// golden scenes
    Render(RenderReportOptions),
    /// What scenes pay for, counted: work.csv and work.md
    Work(work::Args),
    /// Memory and rate by threads, pixels and cards, and a million pictures: scale.csv, scale.md
    /// and charts (SVG)
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
