//! `petcomp-report scale`: memory and rate, and what a million pictures take.

use super::count;
use crate::ReportFlags;
use petcomp_report::scale::{self, ScaleCase, ScaleOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// About how many seconds of work each point is measured for, 0 to 3600; more is finer
    #[arg(long, value_name = "N", default_value_t = ScaleOptions::default().seconds, value_parser = seconds)]
    seconds: f64,
    /// Most threads, 1 to 1024; by default one per core
    #[arg(long, value_name = "N", default_value_t = ScaleOptions::default().threads, value_parser = count(1..=1024))]
    most_threads: usize,
    /// Instead, measure this point in this process and print it (JSON)
    #[arg(long, value_name = "JSON", hide = true)]
    case: Option<String>,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text
        .parse::<f64>()
        .ok()
        .filter(|seconds| (0.0..=3600.0).contains(seconds));
    number.ok_or_else(|| format!("{text}, expected 0 to 3600"))
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    if let Some(case) = &args.case {
        let case: ScaleCase = serde_json::from_str(case)?;
        println!(
            "{}",
            serde_json::to_string(&scale::run(&case, args.seconds)?)?
        );
        return Ok(());
    }
    let options = ScaleOptions {
        seconds: args.seconds,
        threads: args.most_threads,
        ..ScaleOptions::default()
    };
    let progress = common.progress("measuring");
    let measured = scale::write(&args.output, &options, |done, of| progress.at(done, of))?;
    drop(progress);
    for (title, table) in scale::tables(&measured)? {
        println!("{}", format_args!("{title}\n{}", table.markdown()));
    }
    common.say(format_args!(
        "{}: scale.csv, scale.md and two charts",
        args.output.display()
    ));
    Ok(())
}
