//! `petcomp report`: how good a stage is, measured on simulated data.

use crate::common::Common;
use petcomp::report::camera::{self, CameraReportOptions};
use std::path::PathBuf;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Error of the camera solver against run time and against tilt: camera.csv, camera.md and plots (SVG)
    Camera(Args),
}

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Simulated views per kind of camera, noise and tilt
    #[arg(long, value_name = "N", default_value_t = CameraReportOptions::default().views)]
    views: u64,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    let Command::Camera(args) = command;
    let progress = common.progress("measuring");
    let rows =
        camera::write(&args.output, &CameraReportOptions { views: args.views }, |done, of| progress.at(done, of))?;
    drop(progress);
    common.say(format_args!("{}: camera.csv ({} lines), camera.md and six plots", args.output.display(), rows.len()));
    Ok(())
}
