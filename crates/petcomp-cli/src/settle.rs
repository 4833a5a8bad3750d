//! `petcomp settle`: dropped objects come to rest.

use crate::common::Common;
use petcomp::dataset::DatasetConfig;
use petcomp::settle::{SettleOptions, preview, settle_traced, trace_csv};
use petcomp::{Quality, Scene, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene, TOML or JSON
    scene: PathBuf,
    /// Scene to write, TOML or JSON by its extension
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
    /// Settle options to use instead of the scene's own settings or the defaults, as TOML
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    /// draft, normal or reference: how finely the fall is computed; by default what the options say
    #[arg(long)]
    quality: Option<Quality>,
    /// Where every object was during the fall, as CSV: a line for each 60th of a second and object
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Picture of what lies where, from above and from the side
    #[arg(long, value_name = "FILE")]
    preview: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let scene: Scene = io::read_document(&args.scene)?;
    let options = match &args.options {
        Some(path) => read_options(path)?,
        None => scene_options(&scene, &args.scene)?,
    };
    let options = args
        .quality
        .map_or(options, |quality| quality.settle(options));
    // 60 a second at the default step.
    let every = if args.trace.is_some() { 8 } else { 0 };
    let (settled, samples) =
        settle_traced(scene, &options, every).map_err(|e| e.in_file(&args.scene))?;
    // Written for a failed fall too: it shows what went wrong.
    if let Some(path) = &args.trace {
        io::write_text(path, &trace_csv(&samples))?;
    }
    let (seconds, rejected) = (settled.seconds, settled.rejected.len());
    let mut rest = settled.into_scene()?;
    if let Some(files) = &rest.files {
        rest.files = Some(files.moved(&args.scene, &args.output)?);
    }
    io::write_document(&args.output, &rest)?;
    if let Some(path) = &args.preview {
        io::write(path, &preview(&rest, &options))?;
    }
    common.say(format_args!(
        "{}: at rest after {seconds:.2} s, {rejected} attempts rejected",
        args.output.display()
    ));
    Ok(())
}

fn scene_options(scene: &Scene, path: &Path) -> petcomp::Result<SettleOptions> {
    let config = DatasetConfig::from_settings(&scene.settings, &[]).map_err(|e| e.in_file(path))?;
    Ok(config.scene.settle)
}

fn read_options(path: &Path) -> petcomp::Result<SettleOptions> {
    let options: SettleOptions = io::read_toml(path)?;
    options.check().map_err(|e| e.in_file(path))?;
    Ok(options)
}
