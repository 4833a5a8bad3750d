//! `petcomp camera`: four labelled corners -> camera.

use crate::common::Common;
use petcomp::camera::{self, Label, Solution, SolveOptions};
use petcomp::{Error, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Solve the camera of each label and write NAME.camera.json beside it
    Solve {
        /// Labels: NAME.label.json
        #[arg(required = true)]
        labels: Vec<PathBuf>,
        /// Camera file to write instead; for one label only
        #[arg(short, long, value_name = "CAMERA")]
        output: Option<PathBuf>,
    },
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    let Command::Solve { labels, output } = command;
    anyhow::ensure!(output.is_none() || labels.len() == 1, "-o: {} labels, expected one", labels.len());
    for path in labels {
        let label: Label = io::read_json(path)?;
        let solution = camera::solve(&label, &SolveOptions::default()).map_err(|e| Error::from(e).in_file(path))?;
        let target = output.clone().unwrap_or_else(|| beside(path));
        io::write_json(&target, &solution.camera)?;
        report(path, &solution, common);
    }
    Ok(())
}

/// `bg.camera.json` of `bg.label.json`.
fn beside(label: &Path) -> PathBuf {
    let name = label.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.strip_suffix(".json").map_or(name.as_str(), |n| n.strip_suffix(".label").unwrap_or(n));
    label.with_file_name(format!("{stem}.camera.json"))
}

fn report(path: &Path, solution: &Solution, common: &Common) {
    let camera = &solution.camera;
    let (tilt, height) = (camera.tilt().to_degrees(), camera.center().z);
    let focal = camera.focal_px.x;
    common
        .say(format_args!("{}: tilt {tilt:.1} deg, height {height:.3} m, focal length {focal:.0} px", path.display()));
    for warning in &solution.warnings {
        eprintln!("warning: {}: {warning}", path.display());
    }
}
