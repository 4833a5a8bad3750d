//! `petcomp settle`: dropped objects come to rest.

use crate::common::Common;
use petcomp::settle::{SettleOptions, settle};
use petcomp::{Scene, io};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene, TOML or JSON
    scene: PathBuf,
    /// Scene to write, TOML or JSON by its extension
    #[arg(short, long, value_name = "SCENE")]
    output: PathBuf,
    /// Settle options to use instead of the defaults, as TOML
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, common: &Common) -> anyhow::Result<()> {
    let scene: Scene = io::read_document(&args.scene)?;
    let options = match &args.options {
        Some(path) => io::read_toml(path)?,
        None => SettleOptions::default(),
    };
    let settled = settle(scene, &options).map_err(|e| e.in_file(&args.scene))?;
    let (seconds, rejected) = (settled.seconds, settled.rejected.len());
    io::write_document(&args.output, &settled.into_scene()?)?;
    common.say(format_args!("{}: at rest after {seconds:.2} s, {rejected} tries thrown away", args.output.display()));
    Ok(())
}
