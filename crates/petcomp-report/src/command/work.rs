//! `petcomp-report work`: what scenes pay for, counted.

use crate::ReportFlags;
use petcomp_report::work;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let progress = common.progress("counting");
    let rows = work::write(&args.output, |done, of| progress.at(done, of))?;
    drop(progress);
    let kept = rows.iter().filter(|row| row.is_as_promised()).count();
    println!(
        "{}",
        format_args!(
            "{}: {kept} of {} as promised",
            args.output.join("work.md").display(),
            rows.len()
        )
    );
    Ok(())
}
