//! `petcomp camera`: four labelled corners -> camera.

mod export;
mod label;
mod outside;
mod rectify;
mod solve;

use crate::global::GlobalArgs;

#[derive(clap::Subcommand)]
pub(crate) enum CameraCommand {
    /// Write a label for a photo with everything already known; fill in its corners by hand or with
    /// markers
    Init(label::InitLabelArgs),
    /// Solve the camera of each label; write NAME.camera.json and NAME.overlay.png next to it
    Solve(solve::SolveArgs),
    /// Solve photos of one camera together: labels that share camera.id, aspect ratio and lens
    Joint(solve::JointArgs),
    /// Explain in plain words how well each camera is known, and what to measure
    Doctor(solve::LabelFileArgs),
    /// Export solved cameras to another program
    Export(export::ExportCameraArgs),
    /// Detect printed markers (ArUco DICT_4X4_50, AprilTag tag36h11) in a photo and add their
    /// corners to a label as points
    Markers(label::MarkersArgs),
    /// Rectify a photo to a metric top view of the surface, or project an image onto it
    Rectify(rectify::RectifyArgs),
}

pub(crate) fn run(command: &CameraCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        CameraCommand::Init(args) => label::init_label(args, global),
        CameraCommand::Solve(args) => solve::solve_each(args, global),
        CameraCommand::Joint(args) => solve::solve_joint(args, global),
        CameraCommand::Doctor(args) => solve::explain_each(args),
        CameraCommand::Export(args) => export::export_cameras(args),
        CameraCommand::Markers(args) => label::add_markers(args, global),
        CameraCommand::Rectify(args) => rectify::write_view(args),
    }
}
