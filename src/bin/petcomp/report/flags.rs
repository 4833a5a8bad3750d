//! `petcomp report flags`: whether a wrong cut-out says so.

use crate::common::Common;
use petcomp::report::flags;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder with photos and their truth, as the sample world has them
    #[arg(long, value_name = "FOLDER")]
    truth: PathBuf,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let progress = common.progress("cutting out");
    let table = flags::write(&args.truth, &args.output, |done, of| progress.at(done, of))?;
    drop(progress);
    common.say(table.markdown().trim_end());
    common.say(format_args!("{}: flags.csv and flags.md", args.output.display()));
    Ok(())
}
