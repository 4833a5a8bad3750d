//! `petcomp-report settle`: the settle stage on heaps and closed forms.

use crate::ReportFlags;
use petcomp::io;
use petcomp_report::settle;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Heaps per solver setting, 1 to 10000
    #[arg(
        long,
        value_name = "N",
        default_value_t = 20,
        value_parser = clap::value_parser!(u64).range(1..=10_000)
    )]
    heaps: u64,
    /// Settle heaps for a comparison with another program instead, and write their scenes, final
    /// states and times as JSON
    #[arg(long, value_name = "FILE")]
    peers: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    if let Some(path) = &args.peers {
        return Ok(io::write_document(path, &settle::peer_cases()?)?);
    }
    let lines = common.with_progress("measuring", |progress| {
        settle::write(&args.output, args.heaps, progress)
    })?;
    common.print_line(format_args!(
        "{}: settle.csv ({lines} lines), settle.md and a plot",
        args.output.display()
    ));
    Ok(())
}
