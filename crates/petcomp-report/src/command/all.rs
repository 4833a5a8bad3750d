//! `petcomp-report all`: everything that is measured, on one page.

use crate::ReportFlags;
use petcomp_report::all::{self, AllOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Other programs' measurements, as `make peers` writes them; left out where there are none
    #[arg(long, value_name = "FOLDER", default_value = "target/peers")]
    peers: PathBuf,
    /// Photos with their truth, as the sample world has them, for the mattes; by default photos made in code
    #[arg(long, value_name = "FOLDER")]
    truth: Option<PathBuf>,
    /// Golden scenes with Cycles' pictures; left out where there are none
    #[arg(long, value_name = "FOLDER", default_value = "golden/render")]
    golden: PathBuf,
    /// Fewer runs and inputs: a look in half a minute, with noisier times
    #[arg(long)]
    quick: bool,
    /// When it is made, to be told on the page
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    date: String,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let options = AllOptions {
        golden: args.golden.clone(),
        peers: args.peers.clone(),
        truth: args.truth.clone().unwrap_or_default(),
        quick: args.quick,
        date: args.date.clone(),
    };
    // Extreme cases are to be warned of; what comes of them is in the tables.
    log::set_max_level(log::LevelFilter::Error);
    let progress = common.progress("measuring");
    all::write(&args.output, &options, |done, of| progress.at(done, of))?;
    drop(progress);
    common.say(format_args!(
        "look at {}",
        args.output.join("report.html").display()
    ));
    Ok(())
}
