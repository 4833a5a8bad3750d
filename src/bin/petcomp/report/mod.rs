//! `petcomp report`: how good a stage is, measured: one file per stage.

mod camera;
mod render;

use crate::common::Common;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Error of the camera solver against run time and against tilt: camera.csv, camera.md and plots (SVG)
    Camera(camera::Args),
    /// Error of the renderer against run time, beside Cycles: render.csv, render.md, a plot and the golden scenes
    Render(render::Args),
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Camera(args) => camera::run(args, common),
        Command::Render(args) => render::run(args, common),
    }
}
