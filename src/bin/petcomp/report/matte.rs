//! `petcomp report matte`: the matting methods on photos with known mattes.

use crate::common::Common;
use petcomp::report::matte;
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
    let progress = common.progress("measuring");
    let summaries = matte::write(&args.truth, &args.output, |done, of| progress.at(done, of))?;
    drop(progress);
    common.say(matte::table(&summaries).markdown().trim_end());
    common.say(format_args!("{}: matte.csv, matte.md, matte.svg and matte.html", args.output.display()));
    Ok(())
}
