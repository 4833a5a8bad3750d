//! `petcomp-report stability`: every stage on stiff and extreme input.

use crate::ReportFlags;
use petcomp_report::stability::{self, CaseResult};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Stage to test; by default all
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true
    )]
    stage: String,
}

/// Fails if a case fails, after all have been written.
pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let rows = common.with_progress("trying", |progress| {
        stability::write(&args.output, &args.stage, progress)
    })?;
    let failed = print_failures(&rows);
    let (all, table) = (rows.len(), args.output.join("stability.md"));
    println!("{}: {} of {all} pass", table.display(), all - failed);
    anyhow::ensure!(failed == 0, "{failed} of {all} cases fail");
    Ok(())
}

/// Prints the failed cases; returns their number.
fn print_failures(rows: &[CaseResult]) -> usize {
    let failed = rows.iter().filter(|row| !row.outcome.passed);
    failed.inspect(|row| print_failure(row)).count()
}

fn print_failure(row: &CaseResult) {
    let measured = &row.outcome.measured;
    println!("FAIL {}: {}: {measured}", row.stage, row.case.name);
}
