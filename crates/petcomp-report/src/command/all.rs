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
    /// Photos with their truth, as the sample world has them, for the mattes; by default photos
    /// made in code
    #[arg(long, value_name = "FOLDER")]
    truth: Option<PathBuf>,
    /// Golden scenes with Cycles' pictures; left out where there are none
    #[arg(long, value_name = "FOLDER", default_value = "golden/render")]
    golden: PathBuf,
    /// Fewer runs and inputs: a preview in half a minute, with noisier times
    #[arg(long)]
    quick: bool,
    /// Date to show on the page
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    date: String,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    // Extreme cases warn as they should; their results are in the tables.
    log::set_max_level(log::LevelFilter::Error);
    common.with_progress("measuring", |progress| {
        all::write(&args.output, &args.options(), progress)
    })?;
    let page = args.output.join("report.html");
    common.print_line(format_args!("look at {}", page.display()));
    Ok(())
}

impl Args {
    fn options(&self) -> AllOptions {
        AllOptions {
            golden: self.golden.clone(),
            peers: self.peers.clone(),
            truth: self.truth.clone().unwrap_or_default(),
            quick: self.quick,
            date: self.date.clone(),
        }
    }
}
