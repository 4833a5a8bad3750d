//! `petcomp report camera`: the camera solver on simulated views.

use crate::common::Common;
use petcomp::report::camera::{self, CameraReportOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Simulated views per kind of camera, noise and tilt
    #[arg(long, value_name = "N", default_value_t = CameraReportOptions::default().views)]
    views: u64,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("measuring");
    let rows =
        camera::write(&args.output, &CameraReportOptions { views: args.views }, |done, of| progress.at(done, of))?;
    drop(progress);
    common.say(format_args!("{}: camera.csv ({} lines), camera_coverage.csv, camera.md and six plots", args.output.display(), rows.len()));
    Ok(())
}
