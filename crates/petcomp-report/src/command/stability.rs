//! `petcomp-report stability`: every stage on stiff and extreme input.

use crate::ReportFlags;
use petcomp_report::stability;
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
    let progress = common.progress("trying");
    let rows = stability::write(&args.output, &args.stage, |done, of| progress.at(done, of))?;
    drop(progress);
    let failed: Vec<_> = rows.iter().filter(|row| !row.outcome.passed).collect();
    for row in &failed {
        println!(
            "{}",
            format_args!("FAIL {}: {}: {}", row.stage, row.name, row.outcome.measured)
        );
    }
    let table = args.output.join("stability.md");
    println!(
        "{}",
        format_args!(
            "{}: {} of {} pass",
            table.display(),
            rows.len() - failed.len(),
            rows.len()
        )
    );
    anyhow::ensure!(
        failed.is_empty(),
        "{} of {} cases fail",
        failed.len(),
        rows.len()
    );
    Ok(())
}
