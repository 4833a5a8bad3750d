//! `petcomp camera export`: cameras in the files of other programs.

use crate::print;
use petcomp::camera::{CameraFile, ColmapModel, OpencvCamera};
use petcomp::io;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct ExportCameraArgs {
    /// Camera files: NAME.camera.json
    #[arg(required = true)]
    cameras: Vec<PathBuf>,
    /// For which program
    #[arg(long)]
    to: ExportFormat,
    /// File (blender, opencv: of one camera) or folder (colmap) to write; without it, blender and
    /// opencv are printed
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum ExportFormat {
    /// A Python script
    Blender,
    /// K, R, t and dist (k1, k2, p1, p2) as JSON
    Opencv,
    /// cameras.txt, images.txt and points3D.txt
    Colmap,
}

pub(super) fn export_cameras(args: &ExportCameraArgs) -> anyhow::Result<()> {
    let (files, output) = (args.read_cameras()?, args.output.as_deref());
    match args.to {
        ExportFormat::Colmap => write_colmap(output, &files),
        ExportFormat::Blender => write_or_print(output, &blender_script(only_file(&files)?)),
        ExportFormat::Opencv => write_or_print(output, &opencv_document(only_file(&files)?)?),
    }
}

impl ExportCameraArgs {
    fn read_cameras(&self) -> petcomp::Result<Vec<CameraFile>> {
        self.cameras.iter().map(io::read_json).collect()
    }
}

/// Blender's cameras have no lens that bends lines.
fn blender_script(file: &CameraFile) -> String {
    if file.k1() != 0.0 {
        let (photo, k1) = (&file.image.file, file.k1());
        log::warn!("{photo}: k1 = {k1:.4} of its lens is left out, Blender's cameras have none");
    }
    file.camera().to_blender_script()
}

/// What OpenCV's functions take.
#[derive(serde::Serialize)]
struct OpencvDocument {
    #[serde(flatten)]
    camera: OpencvCamera,
    /// k1, k2, p1 and p2.
    dist: [f64; 4],
}

fn opencv_document(file: &CameraFile) -> serde_json::Result<String> {
    let document = OpencvDocument {
        camera: file.camera().to_opencv(),
        dist: [file.k1(), 0.0, 0.0, 0.0],
    };
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}

fn write_or_print(output: Option<&Path>, text: &str) -> anyhow::Result<()> {
    match output {
        Some(path) => io::write_text(path, text)?,
        None => print::text(text.trim_end()),
    }
    Ok(())
}

fn only_file(files: &[CameraFile]) -> anyhow::Result<&CameraFile> {
    match files {
        [file] => Ok(file),
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
    let cameras: Vec<_> = files.iter().map(CameraFile::camera).collect();
    let views = files.iter().zip(&cameras);
    ColmapModel::new(views.map(|(file, camera)| (&*file.image.file, camera, file.k1())))
}
