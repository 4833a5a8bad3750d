//! `petcomp camera export`: cameras in the formats of other programs.

use crate::print;
use petcomp::camera::{CameraFile, ColmapModel, OpencvCamera};
use petcomp::io;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct ExportCameraArgs {
    /// Camera files: NAME.camera.json
    #[arg(required = true)]
    cameras: Vec<PathBuf>,
    /// Target program
    #[arg(long)]
    to: ExportFormat,
    /// File (blender, opencv: one camera only) or folder (colmap) to write; by default blender and
    /// opencv are printed
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum ExportFormat {
    /// Python script
    Blender,
    /// K, R, t and dist (k1, k2, p1, p2) as JSON
    Opencv,
    /// cameras.txt, images.txt and points3D.txt
    Colmap,
}

pub(super) fn export_cameras(args: &ExportCameraArgs) -> anyhow::Result<()> {
    io::check_distinct(&args.cameras, &args.output)?;
    let files = args.cameras.iter().map(io::read_json);
    let files: Vec<CameraFile> = files.collect::<petcomp::Result<_>>()?;
    let output = args.output.as_deref();
    match args.to {
        ExportFormat::Colmap => {
            check_names(&args.cameras, &files)?;
            write_colmap(output, &files)
        }
        ExportFormat::Blender => {
            let file = only_file(&files)?;
            warn_of_bent_lines(&args.cameras[0], file);
            write_or_print(output, &file.camera().to_blender_script())
        }
        ExportFormat::Opencv => write_or_print(output, &opencv_document(only_file(&files)?)?),
    }
}

/// Blender's cameras have no lens distortion.
fn warn_of_bent_lines(path: &Path, file: &CameraFile) {
    if file.k1() != 0.0 {
        let (path, k1) = (path.display(), file.k1());
        log::warn!(
            "{path}: k1 = {k1:.4} of its lens is left out, as Blender's cameras have no distortion"
        );
    }
}

/// The input of OpenCV's functions.
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

/// COLMAP distinguishes pictures only by their names.
fn check_names(paths: &[PathBuf], files: &[CameraFile]) -> anyhow::Result<()> {
    let mut named = BTreeMap::new();
    for (path, file) in paths.iter().zip(files) {
        let (shown, name) = (path.display(), &file.image.file);
        anyhow::ensure!(
            !name.is_empty(),
            "{shown}: image.file: empty, expected the picture's name for COLMAP"
        );
        if let Some(other) = named.insert(name, path) {
            anyhow::bail!(
                "{shown}: image.file: \"{name}\", which {} also has; COLMAP needs a different name for each picture: \
                 export these cameras to separate folders",
                other.display()
            );
        }
    }
    Ok(())
}

fn write_colmap(folder: Option<&Path>, files: &[CameraFile]) -> anyhow::Result<()> {
    let folder = folder
        .ok_or_else(|| anyhow::anyhow!("-o: missing, expected a folder for COLMAP's files"))?;
    let model = colmap_model(files);
    io::create_folder(folder)?;
    io::write_text(folder.join("cameras.txt"), &model.cameras)?;
    io::write_text(folder.join("images.txt"), &model.images)?;
    io::write_text(folder.join("points3D.txt"), &model.points)?;
    Ok(())
}

fn colmap_model(files: &[CameraFile]) -> ColmapModel {
    let cameras: Vec<_> = files.iter().map(CameraFile::camera).collect();
    let views = files.iter().zip(&cameras);
    ColmapModel::new(views.map(|(file, camera)| (&*file.image.file, camera, file.k1())))
}
