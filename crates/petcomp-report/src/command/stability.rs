//! `petcomp-report stability`: every stage on stiff and extreme input.

use crate::ReportFlags;
use petcomp_report::stability::{self, CaseResult};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Only this stage; all of them otherwise
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    stage: String,
}

/// Fails where a case fails, after all have been written.
pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let rows = common.with_progress("trying", |progress| {
        stability::write(&args.output, &args.stage, progress)
    })?;
    let failed: Vec<_> = rows.iter().filter(|row| !row.outcome.passed).collect();
    failed.iter().for_each(|row| print_failure(row));
    let (failed, all) = (failed.len(), rows.len());
    let table = args.output.join("stability.md");
    println!("{}: {} of {all} pass", table.display(), all - failed);
    anyhow::ensure!(failed == 0, "{failed} of {all} cases fail");
    Ok(())
}

fn print_failure(row: &CaseResult) {
    let measured = &row.outcome.measured;
    println!("FAIL {}: {}: {measured}", row.stage, row.name);
}
