//! `petcomp camera`: four labelled corners -> camera.

use crate::common::{Batch, Common};
use petcomp::camera::{self, CameraFile, ColmapModel, Label, Solution, SolveOptions};
use petcomp::filter::Pyramid;
use petcomp::{Error, Image, LinearRgb, PremulRgba, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Solve the camera of each label; write NAME.camera.json and NAME.overlay.png beside it
    Solve(SolveArgs),
    /// Solve photos of one camera together: labels that share camera.id and shape of the picture
    Joint(SolveArgs),
    /// Say in plain words what is known how well, and what to measure
    Doctor(SolveArgs),
    /// Say solved cameras as another program does
    Export(ExportArgs),
    /// Find printed markers (ArUco DICT_4X4_50, AprilTag tag36h11) in a photo and add their corners to a label as points
    Markers(MarkersArgs),
    /// Turn a photo into a metric top view of the surface, or lay a picture on it
    Rectify(RectifyArgs),
}

#[derive(clap::Args)]
pub(crate) struct SolveArgs {
    /// Labels: NAME.label.json, or LabelMe files together with --size
    #[arg(required = true)]
    labels: Vec<PathBuf>,
    /// Camera file to write instead; for one label only
    #[arg(short, long, value_name = "CAMERA")]
    output: Option<PathBuf>,
    /// Width and height of the rectangle in metres; the labels are LabelMe's
    #[arg(long, value_name = "WxH", value_parser = dimensions)]
    size: Option<[f64; 2]>,
}

#[derive(clap::Args)]
pub(crate) struct ExportArgs {
    /// Camera files: NAME.camera.json
    #[arg(required = true)]
    cameras: Vec<PathBuf>,
    /// Whose words
    #[arg(long)]
    to: Words,
    /// File (blender, opencv: of one camera) or folder (colmap) to write; without it, blender and opencv are printed
    #[arg(short, long)]
    output: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Words {
    /// A Python script
    Blender,
    /// K, R and t as JSON
    Opencv,
    /// cameras.txt, images.txt and points3D.txt
    Colmap,
}

#[derive(clap::Args)]
pub(crate) struct MarkersArgs {
    /// The photo
    photo: PathBuf,
    /// Label with the markers' family, size and places; its corners may be missing
    #[arg(long, value_name = "LABEL")]
    map: PathBuf,
    /// Label to write
    #[arg(short, long, value_name = "LABEL")]
    output: PathBuf,
}

#[derive(clap::Args)]
pub(crate) struct RectifyArgs {
    /// The photo (its size is that of the result with --back)
    photo: PathBuf,
    /// Its label
    label: PathBuf,
    /// Picture to write
    #[arg(short, long)]
    output: PathBuf,
    /// Pixels per metre of the top view; by default those of the photo at the rectangle's centre
    #[arg(long, value_name = "N")]
    px_per_metre: Option<f64>,
    /// Lay this picture on the rectangle instead, as the photo would show it
    #[arg(long, value_name = "PICTURE")]
    back: Option<PathBuf>,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Solve(args) => solve(args, common),
        Command::Joint(args) => joint(args, common),
        Command::Doctor(args) => doctor(args, common),
        Command::Export(args) => export(args, common),
        Command::Markers(args) => markers(args, common),
        Command::Rectify(args) => rectify(args),
    }
}

fn solve(args: &SolveArgs, common: &Common) -> anyhow::Result<()> {
    anyhow::ensure!(args.output.is_none() || args.labels.len() == 1, "-o: {} labels, expected one", args.labels.len());
    let one = |path| {
        let label = read_label(path, args.size)?;
        write(args, path, &label, &solved(path, &label)?, common)
    };
    if let [path] = &args.labels[..] {
        return one(path);
    }
    let mut batch = Batch::default();
    args.labels.iter().for_each(|path| batch.count(one(path)));
    batch.finish()
}

fn joint(args: &SolveArgs, common: &Common) -> anyhow::Result<()> {
    anyhow::ensure!(args.output.is_none(), "-o: several cameras are written, each beside its label");
    let labels = args.labels.iter().map(|path| read_label(path, args.size)).collect::<petcomp::Result<Vec<_>>>()?;
    for group in camera::one_camera(&labels) {
        let together: Vec<Label> = group.iter().map(|&i| labels[i].clone()).collect();
        let first = &args.labels[group[0]];
        let joint = camera::solve_joint(&together, &SolveOptions::default()).map_err(|e| located(e, first))?;
        for warning in &joint.warnings {
            eprintln!("warning: photos of {}: {warning}", first.display());
        }
        for (&i, photo) in group.iter().zip(joint.photos) {
            let path = &args.labels[i];
            write(args, path, &labels[i], &photo.map_err(|e| located(e, path))?, common)?;
        }
    }
    Ok(())
}

fn doctor(args: &SolveArgs, common: &Common) -> anyhow::Result<()> {
    for path in &args.labels {
        let label = read_label(path, args.size)?;
        let solution = solved(path, &label)?;
        common.say(format_args!("{}", path.display()));
        common.say(camera::doctor(&label, &solution, &SolveOptions::default()));
    }
    Ok(())
}

fn export(args: &ExportArgs, common: &Common) -> anyhow::Result<()> {
    let files = args.cameras.iter().map(io::read_json::<CameraFile>).collect::<petcomp::Result<Vec<_>>>()?;
    let text = match args.to {
        Words::Colmap => return export_colmap(args, &files),
        _ if files.len() != 1 => anyhow::bail!("{} cameras, expected one for this format", files.len()),
        Words::Blender => files[0].camera().to_blender_script(),
        Words::Opencv => serde_json::to_string_pretty(&files[0].camera().to_opencv())? + "\n",
    };
    match &args.output {
        Some(path) => io::write_text(path, &text)?,
        None => common.say(text.trim_end()),
    }
    Ok(())
}

fn export_colmap(args: &ExportArgs, files: &[CameraFile]) -> anyhow::Result<()> {
    let folder =
        args.output.as_ref().ok_or_else(|| anyhow::anyhow!("-o: missing, expected a folder for COLMAP's files"))?;
    let cameras: Vec<_> = files.iter().map(|f| (f.image.file.as_str(), f.camera())).collect();
    let model = ColmapModel::new(cameras.iter().map(|(name, camera)| (*name, camera)));
    io::create_folder(folder)?;
    io::write_text(folder.join("cameras.txt"), &model.cameras)?;
    io::write_text(folder.join("images.txt"), &model.images)?;
    Ok(io::write_text(folder.join("points3D.txt"), &model.points)?)
}

fn markers(args: &MarkersArgs, common: &Common) -> anyhow::Result<()> {
    let label: Label = io::read_json(&args.map)?;
    let known = label.points.len();
    let photo: Image<LinearRgb> = io::read(&args.photo)?;
    let label = camera::with_markers(label, &photo).map_err(|e| e.in_file(&args.map))?;
    io::write_json(&args.output, &label)?;
    common.say(format_args!("{}: {} marker corners", args.output.display(), label.points.len() - known));
    Ok(())
}

fn rectify(args: &RectifyArgs) -> anyhow::Result<()> {
    let label = read_label(&args.label, None)?;
    let solution = solved(&args.label, &label)?;
    let header = io::read_header(&args.photo)?;
    let seen = solution.camera.resized([header.width as u32, header.height as u32]);
    if let Some(picture) = &args.back {
        let picture = Pyramid::new(io::read::<PremulRgba>(picture)?);
        return Ok(io::write(&args.output, &camera::project_picture(&picture, &seen, solution.size))?);
    }
    let px_per_metre = args.px_per_metre.unwrap_or(solution.fit.px_per_metre);
    let photo = Pyramid::new(io::read::<LinearRgb>(&args.photo)?);
    Ok(io::write(&args.output, &camera::rectify(&photo, &seen, solution.size, px_per_metre)?)?)
}

/// A label of ours, or with dimensions given one of LabelMe's.
fn read_label(path: &Path, size: Option<[f64; 2]>) -> petcomp::Result<Label> {
    match size {
        Some(size) => {
            let label = camera::from_labelme(&io::read_text(path)?, size).map_err(|e| e.in_file(path))?;
            camera::check_size(&label)?;
            camera::with_photo(label, path)
        }
        None => camera::read_label(path),
    }
}

fn solved(path: &Path, label: &Label) -> petcomp::Result<Solution> {
    let solution = camera::solve(label, &SolveOptions::default()).map_err(|e| located(e, path))?;
    camera::check_distance(&solution).map_err(|e| e.in_file(path))?;
    Ok(solution)
}

fn located(error: camera::SolveError, path: &Path) -> Error {
    Error::from(error).in_file(path)
}

/// Writes the camera and, where the photo is there, the overlay; says what was found.
fn write(args: &SolveArgs, path: &Path, label: &Label, solution: &Solution, common: &Common) -> anyhow::Result<()> {
    let target = args.output.clone().unwrap_or_else(|| beside(path, "camera.json"));
    io::write_json(&target, &CameraFile::new(label, solution))?;
    if let Some(photo) = camera::photo_of(label, path) {
        let photo: Image<LinearRgb> = io::read(photo)?;
        io::write(beside(&target, "overlay.png"), &camera::overlay(&photo, solution))?;
    }
    report(path, solution, common);
    Ok(())
}

/// `bg.camera.json` of `bg.label.json`.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.strip_suffix(".json").unwrap_or(&name);
    let stem = stem.strip_suffix(".label").or(stem.strip_suffix(".camera")).unwrap_or(stem);
    path.with_file_name(format!("{stem}.{ending}"))
}

fn report(path: &Path, solution: &Solution, common: &Common) {
    let camera = &solution.camera;
    let (tilt, height) = (camera.tilt().to_degrees(), camera.center().z);
    let (focal, percent) = (camera.focal_px.x, 100.0 * solution.sigma.ln_focal);
    common.say(format_args!(
        "{}: tilt {tilt:.1} deg, height {height:.3} m, focal length {focal:.0} px (+- {percent:.1} %, {:?}), corners to {:.2} px, \
         {:.0} mm above the surface to {:.1} px",
        path.display(),
        solution.focal_source,
        solution.rms_px,
        1000.0 * solution.sigma.reference_height,
        solution.sigma.height_px,
    ));
    for warning in &solution.warnings {
        eprintln!("warning: {}: {warning}", path.display());
    }
}

pub(crate) fn dimensions(text: &str) -> Result<[f64; 2], String> {
    let side = |part: &str| part.trim().parse::<f64>().map_err(|e| format!("\"{part}\": {e}"));
    let (w, h) = text.split_once('x').ok_or_else(|| format!("\"{text}\", expected WIDTHxHEIGHT as in 0.6x0.4"))?;
    Ok([side(w)?, side(h)?])
}
