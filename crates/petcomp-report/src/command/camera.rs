//! `petcomp-report camera`: the camera solver on simulated views.

use crate::ReportFlags;
use petcomp_report::camera;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Simulated views per kind of camera, noise and tilt, 1 to 100000
    #[arg(
        long,
        value_name = "N",
        default_value_t = 200,
        value_parser = clap::value_parser!(u64).range(1..=100_000)
    )]
    views: u64,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let lines = common.with_progress("measuring", |progress| {
        camera::write(&args.output, args.views, progress)
    })?;
    common.print_line(format_args!(
        "{}: camera.csv ({lines} lines), camera_coverage.csv, camera.md and six plots",
        args.output.display()
    ));
    Ok(())
}
