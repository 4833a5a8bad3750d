//! The `petcomp` program: reads arguments, calls the library, writes results.
// What prints, and does not panic where nobody can take it, is print.rs.
#![warn(clippy::unwrap_used, clippy::print_stderr, clippy::print_stdout)]

mod asset;
mod camera;
mod common;
mod dataset;
mod demo;
mod diff;
mod doctor;
mod eval;
mod label;
mod matte;
mod print;
mod render;
mod scene;
mod settle;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// From photographs to labelled training images.
///
/// Photos on a green or blue screen become cut-outs (matte, asset); a photo of a place with four marked corners becomes
/// a camera (camera); a recipe becomes scenes (scene), which settle, are rendered over the photo and labelled (dataset).
#[derive(Parser)]
#[command(
    name = "petcomp",
    version,
    propagate_version = true,
    infer_subcommands = false
)]
struct Cli {
    #[command(flatten)]
    common: common::Common,
    #[command(subcommand)]
    stage: Stage,
}

#[derive(Subcommand)]
enum Stage {
    /// Make a sample dataset from the photographs in the repository
    Demo(demo::Args),
    /// Photo -> matte and cut-out
    #[command(subcommand)]
    Matte(matte::Command),
    /// Cut-outs with real size and class, kept in a folder
    #[command(subcommand)]
    Asset(asset::Command),
    /// Four labelled corners -> camera
    #[command(subcommand)]
    Camera(camera::Command),
    /// Recipe -> scene
    #[command(subcommand)]
    Scene(scene::Command),
    /// Let a scene's dropped objects come to rest
    Settle(settle::Args),
    /// Scene -> picture
    Render(render::Args),
    /// Scene -> outlines, boxes, visibility
    Label(label::Args),
    /// Recipe -> images with labels, ready to train on
    #[command(subcommand)]
    Dataset(dataset::Command),
    /// Detections against the truth: average precision, curves, confusion
    Eval(eval::Args),
    /// Compare two pictures, with the flags and exit codes of OpenImageIO's idiff
    Diff(diff::Args),
    /// What this machine has, and whether petcomp works on it
    Doctor(doctor::Args),
}

fn main() -> ExitCode {
    let arguments = diff::accept_idiff_spelling(std::env::args_os());
    let matches = common::with_short_help(Cli::command()).try_get_matches_from(arguments);
    let cli = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(said) => return print::usage(&said),
    };
    match cli.common.apply().and_then(|()| run(&cli)) {
        Ok(code) => code,
        Err(error) => common::report(&error),
    }
}

fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    let common = &cli.common;
    match &cli.stage {
        Stage::Demo(args) => demo::run(args, common)?,
        Stage::Matte(command) => matte::run(command, common)?,
        Stage::Asset(command) => asset::run(command, common)?,
        Stage::Camera(command) => camera::run(command, common)?,
        Stage::Scene(command) => scene::run(command, common)?,
        Stage::Settle(args) => settle::run(args, common)?,
        Stage::Render(args) => render::run(args, common)?,
        Stage::Label(args) => label::run(args, common)?,
        Stage::Dataset(command) => dataset::run(command, common)?,
        Stage::Eval(args) => eval::run(args, common)?,
        Stage::Diff(args) => return diff::run(args, common),
        Stage::Doctor(args) => return doctor::run(args),
    }
    Ok(ExitCode::SUCCESS)
}
