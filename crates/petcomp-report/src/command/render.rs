//! `petcomp-report render`: the renderer against Cycles and against the quadrature of its
//! definition.

use super::count;
use crate::ReportFlags;
use petcomp_report::render::{self, RenderReportOptions};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene file of the reference renderer: a golden one, or one that `scene export` wrote
    #[arg(default_value = "golden/render/pile_of_20/scene.json")]
    scene: PathBuf,
    /// Folder to write
    #[arg(short, long, value_name = "FOLDER", default_value = "report")]
    output: PathBuf,
    /// Width and height of the pictures, 1 to 4096
    #[arg(
        long,
        num_args = 2,
        value_names = ["W", "H"],
        default_values_t = [320, 240],
        value_parser = clap::value_parser!(u32).range(1..=4096)
    )]
    size: Vec<u32>,
    /// Cycles' pictures of the same scene and size, made by tests/benches/peers/render.py
    #[arg(long, value_name = "FOLDER", default_value = "report/cycles")]
    cycles: PathBuf,
    /// Golden scenes to compare as well
    #[arg(long, value_name = "FOLDER", default_value = "golden/render")]
    golden: PathBuf,
    /// Renderings per preset, of which the median is reported, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = count(1..=1000))]
    repeats: usize,
    /// Errors against Cycles at which to search for the quickest settings
    #[arg(long, value_name = "RMSE", value_delimiter = ',')]
    quickest_at: Vec<f64>,
}

pub(crate) fn run(args: &Args, common: &ReportFlags) -> anyhow::Result<()> {
    let (rows, golden) = render::write(&args.output, &args.options())?;
    println!("{}", render::table(&rows).markdown());
    common.print_line(format_args!(
        "{}: render.csv, render.md, render.svg; {} golden pictures",
        args.output.display(),
        golden.len()
    ));
    Ok(())
}

impl Args {
    fn options(&self) -> RenderReportOptions {
        RenderReportOptions {
            scene: self.scene.clone(),
            size: [self.size[0], self.size[1]],
            cycles: self.cycles.clone(),
            golden: self.golden.clone(),
            repeats: self.repeats,
            quickest_at: self.quickest_at.clone(),
        }
    }
}
