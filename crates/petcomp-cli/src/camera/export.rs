//! `petcomp camera export`: cameras in the files of other programs.

use crate::print;
use petcomp::camera::{Camera, CameraFile, ColmapModel};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct ExportCameraArgs {
    /// Camera files: NAME.camera.json
    #[arg(required = true)]
    cameras: Vec<PathBuf>,
    /// For which program
    #[arg(long)]
    to: CameraFormat,
    /// File (blender, opencv: of one camera) or folder (colmap) to write; without it, blender and
    /// opencv are printed
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum CameraFormat {
    /// A Python script
    Blender,
    /// K, R and t as JSON
    Opencv,
    /// cameras.txt, images.txt and points3D.txt
    Colmap,
}

pub(super) fn export_cameras(args: &ExportCameraArgs) -> anyhow::Result<()> {
    let (files, output) = (args.read_cameras()?, args.output.as_deref());
    match args.to {
        CameraFormat::Colmap => write_colmap(output, &files),
        CameraFormat::Blender => write_or_print(output, &only_camera(&files)?.to_blender_script()),
        CameraFormat::Opencv => write_or_print(output, &opencv_document(only_camera(&files)?)?),
    }
}

impl ExportCameraArgs {
    fn read_cameras(&self) -> petcomp::Result<Vec<CameraFile>> {
        self.cameras.iter().map(io::read_json).collect()
    }
}

fn opencv_document(camera: Camera) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&camera.to_opencv())? + "\n")
}

fn write_or_print(output: Option<&Path>, text: &str) -> anyhow::Result<()> {
    match output {
        Some(path) => io::write_text(path, text)?,
        None => print::text(text.trim_end()),
    }
    Ok(())
}

fn only_camera(files: &[CameraFile]) -> anyhow::Result<Camera> {
    match files {
        [file] => Ok(file.camera()),
        _ => anyhow::bail!("{} cameras, expected one for this format", files.len()),
    }
}

fn write_colmap(folder: Option<&Path>, files: &[CameraFile]) -> anyhow::Result<()> {
    let folder = folder
        .ok_or_else(|| anyhow::anyhow!("-o: missing, expected a folder for COLMAP's files"))?;
    Ok(write_model(folder, &colmap_model(files))?)
}

fn write_model(folder: &Path, model: &ColmapModel) -> petcomp::Result<()> {
    io::create_folder(folder)?;
    io::write_text(folder.join("cameras.txt"), &model.cameras)?;
    io::write_text(folder.join("images.txt"), &model.images)?;
    io::write_text(folder.join("points3D.txt"), &model.points)
}

fn colmap_model(files: &[CameraFile]) -> ColmapModel {
    let cameras = files.iter().map(|file| (&*file.image.file, file.camera()));
    let cameras: Vec<_> = cameras.collect();
    ColmapModel::new(cameras.iter().map(|(name, camera)| (*name, camera)))
}
