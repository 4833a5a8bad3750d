//! `petcomp-report experiments`: our trainings beside the paper's.

use crate::ReportFlags;
use petcomp_report::experiments;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of runs: KEY/RUN/metrics.json as `petcomp eval -o` writes it, with KEY such as
    /// combined/all or real/25
    runs: PathBuf,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let table = experiments::write(&args.output, &args.runs)?;
    println!("{}", table.markdown());
    common.print_line(args.output.join("experiments.html").display());
    Ok(())
}
