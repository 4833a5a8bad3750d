//! `petcomp-report work`: the counted work of scenes.

use crate::ReportFlags;
use petcomp_report::work;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let rows = common.with_progress("counting", |progress| work::write(&args.output, progress))?;
    let kept = rows.iter().filter(|row| row.is_as_expected()).count();
    let page = args.output.join("work.md");
    println!("{}: {kept} of {} as expected", page.display(), rows.len());
    Ok(())
}
