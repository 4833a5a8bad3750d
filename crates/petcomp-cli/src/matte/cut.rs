//! `petcomp matte cut`: the object without its background.

use super::picture_files::canvas_of_cut_out;
use super::segment::log_search;
use crate::diagnostics::report_diagnostics;
use crate::documents::read_options;
use crate::global::GlobalArgs;
use petcomp::LinearRgb;
use petcomp::io::{self, WriteOptions};
use petcomp::matte::{CutOutOptions, cut_out};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct CutArgs {
    /// Photo of one object on a uniform screen or board
    photo: PathBuf,
    /// Cut-out to write: .exr (scene-linear, premultiplied) or .png; an .exr from an .exr photo
    /// keeps its position in the photo, unless it is scaled down to the option `longest_side`
    #[arg(short, long, value_name = "PICTURE")]
    output: PathBuf,
    /// TOML file with options that override the defaults
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
}

pub(crate) fn run(args: &CutArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let inputs = std::iter::once(&args.photo).chain(&args.options);
    io::check_distinct(inputs, [&args.output])?;
    let options = read_options(args.options.as_deref(), CutOutOptions::check)?;
    let photo = io::read::<LinearRgb>(&args.photo)?;
    let cut = cut_out(&photo, &options).map_err(|e| e.in_file(&args.photo))?;
    let written = WriteOptions {
        canvas: canvas_of_cut_out(&args.photo, photo.size(), &cut)?,
        ..WriteOptions::default()
    };
    io::write_with(&args.output, &cut.to_rgba(), &written)?;
    log_search(&args.photo, &cut.segmentation);
    report_diagnostics(args.photo.display(), &cut.diagnostics);
    let (w, h) = cut.film.size();
    let method = cut.method;
    global.print_written(&args.output, format_args!("{w} x {h}, matte by {method}"));
    Ok(())
}
