//! The `petcomp` program: reads arguments, calls the library, writes results. It is a library so
//! that the Python package can include the program.
// Printing, without a panic if the output is closed, is in print.rs.
#![warn(clippy::unwrap_used, clippy::print_stderr, clippy::print_stdout)]

mod asset;
mod batch;
mod camera;
mod capture;
mod dataset;
mod demo;
mod diagnostics;
mod diff;
mod doctor;
mod documents;
mod eval;
mod exit;
mod global;
mod interruption;
mod label;
mod matte;
mod output;
mod print;
mod progress;
mod render;
mod scene;
mod settle;
mod short_help;
#[cfg(feature = "studio")]
mod studio;
mod values;

use crate::global::GlobalArgs;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;

/// Turn photographs into labelled training images.
///
/// Photos taken on a green or blue screen become cut-outs (matte, asset). A photo of a place with
/// four marked corners gives a camera (camera). A recipe gives scenes (scene), which are settled,
/// rendered over the photo and labelled (dataset).
#[derive(Parser)]
#[command(
    name = "petcomp",
    version,
    propagate_version = true,
    infer_subcommands = false
)]
struct Program {
    #[command(flatten)]
    global: GlobalArgs,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Generate a sample dataset from the photographs in the repository
    Demo(demo::DemoArgs),
    #[command(flatten)]
    Stage(StageVerb),
    /// Evaluate detections against ground truth: average precision, curves, confusion matrix
    Eval(eval::EvalArgs),
    /// Compare two images, with the flags of OpenImageIO's idiff
    Diff(diff::DiffArgs),
    /// Serve pages for the browser: label corners, inspect mattes, tune a recipe, browse a dataset
    #[cfg(feature = "studio")]
    Studio(studio::StudioArgs),
    /// Report what this machine has and whether petcomp works on it; exit with status 1 if not
    Doctor(doctor::DoctorArgs),
}

/// The stages, in the order of the data.
#[derive(Subcommand)]
enum StageVerb {
    /// Extract mattes and cut-outs from photos
    #[command(subcommand)]
    Matte(matte::MatteCommand),
    /// Write frames for a display, to measure what an object transmits and how it refracts light
    #[command(subcommand)]
    Capture(capture::CaptureCommand),
    /// Build and inspect a folder of cut-outs with real size and class
    #[command(subcommand)]
    Asset(asset::AssetCommand),
    /// Solve a camera from four labelled corners
    #[command(subcommand)]
    Camera(camera::CameraCommand),
    /// Draw, check and export scenes
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    /// Let the dropped objects of a scene come to rest
    Settle(settle::SettleArgs),
    /// Render a scene to an image
    Render(render::RenderArgs),
    /// Label a scene: outlines, bounding boxes, visibility
    Label(label::LabelArgs),
    /// Generate labelled images from a recipe, ready to train on
    #[command(subcommand)]
    Dataset(dataset::DatasetCommand),
}

/// Runs a command line, which starts with the program's name, and returns its exit status. Call it
/// once per process: it sets up threads, messages and the handling of Ctrl-C.
pub fn run(words: impl Iterator<Item = OsString>) -> u8 {
    match parse_command_line(words) {
        Ok(program) => program
            .start()
            .unwrap_or_else(|error| exit::report_error(&error)),
        Err(message) => print::usage(&message),
    }
}

fn parse_command_line(words: impl Iterator<Item = OsString>) -> Result<Program, clap::Error> {
    let words = diff::accept_idiff_spelling(words);
    let program = values::with_negative_numbers(Program::command());
    let program = short_help::with_short_help(program);
    Program::from_arg_matches(&program.try_get_matches_from(words)?)
}

impl Program {
    fn start(&self) -> anyhow::Result<u8> {
        self.global.apply()?;
        match &self.verb {
            Verb::Demo(args) => demo::run(args, &self.global)?,
            Verb::Stage(stage) => stage.run(&self.global)?,
            Verb::Eval(args) => eval::run(args, &self.global)?,
            Verb::Diff(args) => return diff::run(args, &self.global),
            #[cfg(feature = "studio")]
            Verb::Studio(args) => studio::run(args, &self.global)?,
            Verb::Doctor(args) => return doctor::run(args),
        }
        Ok(exit::SUCCESS_STATUS)
    }
}

impl StageVerb {
    fn run(&self, global: &GlobalArgs) -> anyhow::Result<()> {
        match self {
            Self::Matte(command) => matte::run(command, global),
            Self::Capture(command) => capture::run(command, global),
            Self::Asset(command) => asset::run(command, global),
            Self::Camera(command) => camera::run(command, global),
            Self::Scene(command) => scene::run(command, global),
            Self::Settle(args) => settle::run(args, global),
            Self::Render(args) => render::run(args, global),
            Self::Label(args) => label::run(args, global),
            Self::Dataset(command) => dataset::run(command, global),
        }
    }
}
