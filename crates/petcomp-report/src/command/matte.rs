//! `petcomp-report matte`: the matting methods on photos with known mattes, and over new
//! backgrounds.

use crate::ReportFlags;
use petcomp_report::{display, matte};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of photos with ground truth, laid out like the sample world
    #[arg(long, value_name = "FOLDER", required_unless_present = "display")]
    truth: Option<PathBuf>,
    /// Folder of bottles on a display and over new backgrounds, laid out like golden/capture
    #[arg(long, value_name = "FOLDER")]
    display: Option<PathBuf>,
    /// With --display: write a strip of a bottle over a background, such as "soft/b02 text"
    #[arg(long, value_name = "BOTTLE BACKGROUND", requires = "display")]
    strip: Vec<String>,
    /// Folder to write into
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    if let Some(truth) = &args.truth {
        let table = common.with_progress("measuring", |progress| {
            matte::write(truth, &args.output, progress)
        })?;
        println!("{}", table.markdown().trim_end());
    }
    if let Some(set) = &args.display {
        let strips = args.strip.iter().filter_map(|strip| strip.split_once(' '));
        let strips: Vec<_> = strips.collect();
        if !strips.is_empty() {
            return Ok(display::write_strips(set, &args.output, &strips)?);
        }
        let table = common.with_progress("measuring", |progress| {
            display::write(set, &args.output, progress)
        })?;
        println!("{}", table.markdown().trim_end());
    }
    common.print_line(format_args!("written to {}", args.output.display()));
    Ok(())
}
