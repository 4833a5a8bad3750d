//! `petcomp camera`: four labelled corners -> camera.

mod export;
mod label;
mod outside;
mod rectify;
mod solve;

use crate::global::GlobalArgs;

#[derive(clap::Subcommand)]
pub(crate) enum CameraCommand {
    /// Write a label for a photo, with everything that is known already; its corners are filled in
    /// by hand or by markers
    Init(label::InitLabelArgs),
    /// Solve the camera of each label; write NAME.camera.json and NAME.overlay.png beside it
    Solve(solve::SolveArgs),
    /// Solve photos of one camera together: labels that share camera.id, shape of the picture and
    /// lens
    Joint(solve::JointArgs),
    /// Say in plain words what is known how well, and what to measure
    Doctor(solve::LabelFileArgs),
    /// Write solved cameras as another program does
    Export(export::ExportCameraArgs),
    /// Find printed markers (ArUco DICT_4X4_50, AprilTag tag36h11) in a photo and add their corners
    /// to a label as points
    Markers(label::MarkersArgs),
    /// Turn a photo into a metric top view of the surface, or lay a picture on it
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
