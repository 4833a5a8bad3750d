//! `petcomp report`: how good a stage is, measured: one file per stage.

mod camera;
mod matte;

use crate::common::Common;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Error of the camera solver against run time and against tilt: camera.csv, camera.md and plots (SVG)
    Camera(camera::Args),
    /// Error of the matting methods against run time, on photos with known mattes: matte.csv, matte.md, matte.svg, matte.html
    Matte(matte::Args),
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Camera(args) => camera::run(args, common),
        Command::Matte(args) => matte::run(args, common),
    }
}
