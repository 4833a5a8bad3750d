//! `petcomp camera`: four labelled corners -> camera.

use crate::common::{Batch, Common};
use crate::print;
use petcomp::camera::{
    self, CameraFile, ColmapModel, Label, LabelledPhoto, Solution, SolveOptions,
};
use petcomp::filter::Pyramid;
use petcomp::{Error, Image, LinearRgb, PremulRgba, io};
use std::path::{Path, PathBuf};

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Write a label for a photo, with everything that is known already; its corners are filled in by hand or by markers
    Init(InitArgs),
    /// Solve the camera of each label; write NAME.camera.json and NAME.overlay.png beside it
    Solve(SolveArgs),
    /// Solve photos of one camera together: labels that share camera.id and shape of the picture
    Joint(JointArgs),
    /// Say in plain words what is known how well, and what to measure
    Doctor(LabelArgs),
    /// Say solved cameras as another program does
    Export(ExportArgs),
    /// Find printed markers (ArUco DICT_4X4_50, AprilTag tag36h11) in a photo and add their corners to a label as points
    Markers(MarkersArgs),
    /// Turn a photo into a metric top view of the surface, or lay a picture on it
    Rectify(RectifyArgs),
}

#[derive(clap::Args)]
pub(crate) struct InitArgs {
    /// The photo
    photo: PathBuf,
    /// Width and height of the rectangle in metres: 0.56x0.37
    #[arg(long, value_name = "WxH", value_parser = dimensions, required_unless_present = "like")]
    size: Option<[f64; 2]>,
    /// Its corners in pixels, "x,y x,y x,y x,y": top left, top right, bottom right, bottom left
    #[arg(long, value_name = "CORNERS", value_parser = corners)]
    corners: Option<[[f64; 2]; 4]>,
    /// Label of another photo of the same rectangle: its size, its markers and its camera's name are taken over, and the
    /// markers looked for
    #[arg(long, value_name = "LABEL")]
    like: Option<PathBuf>,
    /// Label to write instead of NAME.label.json beside the photo
    #[arg(short, long, value_name = "LABEL")]
    output: Option<PathBuf>,
    /// Replace a label that is there
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
pub(crate) struct LabelArgs {
    /// Labels: NAME.label.json, or files of LabelMe, CVAT (for images) or Label Studio together with --size
    #[arg(required = true)]
    labels: Vec<PathBuf>,
    /// Width and height of the rectangle in metres, for labels that do not say them
    #[arg(long, value_name = "WxH", value_parser = dimensions)]
    size: Option<[f64; 2]>,
}

#[derive(clap::Args)]
pub(crate) struct SolveArgs {
    #[command(flatten)]
    labels: LabelArgs,
    /// Camera file to write instead; for one label only
    #[arg(short, long, value_name = "CAMERA")]
    output: Option<PathBuf>,
    /// Write cameras that do not fit their labels, too
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
pub(crate) struct JointArgs {
    #[command(flatten)]
    labels: LabelArgs,
    /// Write cameras that do not fit their labels, too
    #[arg(long)]
    force: bool,
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
    /// Width and height of the rectangle in metres, for labels that do not say them
    #[arg(long, value_name = "WxH", value_parser = dimensions)]
    size: Option<[f64; 2]>,
    /// Take a camera that does not fit its label, too
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Init(args) => init(args, common),
        Command::Solve(args) => solve(args, common),
        Command::Joint(args) => joint(args, common),
        Command::Doctor(args) => doctor(args),
        Command::Export(args) => export(args),
        Command::Markers(args) => markers(args, common),
        Command::Rectify(args) => rectify(args),
    }
}

fn init(args: &InitArgs, common: &Common) -> anyhow::Result<()> {
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| label_beside(&args.photo));
    anyhow::ensure!(
        args.force || !path.exists(),
        "{}: is there already, and --force is not given",
        path.display()
    );
    let like = args.like.as_deref().map(camera::read_label).transpose()?;
    let mut label = camera::init_label(&args.photo, &path, like.as_ref())?;
    if let Some([w, h]) = args.size {
        (label.surface.width_m, label.surface.height_m) = (Some(w), Some(h));
    }
    label.surface.corners_px = args.corners;
    let known = label.points.len();
    if label.markers.is_some() {
        let photo: Image<LinearRgb> = io::read(&args.photo)?;
        label = camera::with_markers(label, &photo).map_err(|e| e.in_file(&args.photo))?;
    }
    io::write_text(&path, &camera::commented(&label)?)?;
    let found = label.points.len() - known;
    let corners = match (args.corners, found) {
        (_, 1..) => format!("{found} marker corners found"),
        (Some(_), _) => "corners as given".into(),
        _ => "fill in surface.corners_px (top left, top right, bottom right, bottom left)".into(),
    };
    common.say(format_args!(
        "{}: {corners}; then `petcomp camera solve {}`",
        path.display(),
        path.display()
    ));
    Ok(())
}

/// `photos/bg.label.json` of `photos/bg.jpg`.
fn label_beside(photo: &Path) -> PathBuf {
    let stem = photo
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default();
    photo.with_file_name(format!("{stem}.label.json"))
}

impl LabelArgs {
    /// All labels of all files.
    fn read(&self) -> anyhow::Result<Vec<LabelledPhoto>> {
        let files = self
            .labels
            .iter()
            .map(|path| camera::read_labels(path, self.size));
        Ok(files.collect::<petcomp::Result<Vec<_>>>()?.concat())
    }

    /// Does something with every label; where there are several, one that cannot be used does not stop the others.
    fn each(&self, act: impl Fn(&LabelledPhoto) -> anyhow::Result<()>) -> anyhow::Result<()> {
        if let [path] = &self.labels[..]
            && let [labelled] = &camera::read_labels(path, self.size)?[..]
        {
            return act(labelled);
        }
        let mut batch = Batch::default();
        for path in &self.labels {
            match camera::read_labels(path, self.size) {
                Ok(labels) => labels
                    .iter()
                    .for_each(|labelled| batch.count(act(labelled))),
                Err(error) => batch.count(Err(error.into())),
            }
        }
        batch.finish()
    }
}

fn solve(args: &SolveArgs, common: &Common) -> anyhow::Result<()> {
    if args.output.is_some() {
        let count = args.labels.read()?.len();
        anyhow::ensure!(count == 1, "-o: {count} labels, expected one");
    }
    args.labels.each(|labelled| {
        let solution = accepted(solved(labelled)?, labelled, args.force)?;
        let target = args
            .output
            .clone()
            .unwrap_or_else(|| labelled.beside("camera.json"));
        write(
            &target,
            labelled,
            &CameraFile::new(&labelled.label, &solution),
            &solution,
            common,
        )
    })
}

fn joint(args: &JointArgs, common: &Common) -> anyhow::Result<()> {
    let labels = args.labels.read()?;
    let all: Vec<Label> = labels
        .iter()
        .map(|labelled| labelled.label.clone())
        .collect();
    let mut batch = Batch::default();
    for group in camera::group_by_camera(&all) {
        let members: Vec<&LabelledPhoto> = group.iter().map(|&i| &labels[i]).collect();
        joint_camera(&members, args.force, common, &mut batch)?;
    }
    batch.finish()
}

/// Photos of one camera.
fn joint_camera(
    members: &[&LabelledPhoto],
    force: bool,
    common: &Common,
    batch: &mut Batch,
) -> anyhow::Result<()> {
    let labels: Vec<Label> = members.iter().map(|member| member.label.clone()).collect();
    let joint = camera::solve_joint(&labels, &SolveOptions::default())
        .map_err(|e| located(e, members[0]))?;
    for outlier in &joint.outliers {
        common.warn(format_args!(
            "{}: {}",
            members[outlier.photo],
            outlier.diagnostic()
        ));
    }
    for (member, photo) in members.iter().zip(joint.photos) {
        let one = || {
            let solution = accepted(photo.map_err(|e| located(e, member))?, member, force)?;
            let mut file = CameraFile::new(&member.label, &solution);
            if let Some(from) = file.solved_from.as_mut().filter(|_| members.len() > 1) {
                from.together = camera::label_checksums(members.iter().copied());
            }
            write(
                &member.beside("camera.json"),
                member,
                &file,
                &solution,
                common,
            )
        };
        batch.count(one());
    }
    Ok(())
}

fn doctor(args: &LabelArgs) -> anyhow::Result<()> {
    args.each(|labelled| {
        let solution = solved(labelled)?;
        print::line(labelled);
        print::text(camera::doctor(
            &labelled.label,
            &solution,
            &SolveOptions::default(),
        ));
        accepted(solution, labelled, false).map(drop)
    })
}

fn export(args: &ExportArgs) -> anyhow::Result<()> {
    let files = args
        .cameras
        .iter()
        .map(io::read_json::<CameraFile>)
        .collect::<petcomp::Result<Vec<_>>>()?;
    let text = match args.to {
        Words::Colmap => return export_colmap(args, &files),
        _ if files.len() != 1 => {
            anyhow::bail!("{} cameras, expected one for this format", files.len())
        }
        Words::Blender => files[0].camera().to_blender_script(),
        Words::Opencv => serde_json::to_string_pretty(&files[0].camera().to_opencv())? + "\n",
    };
    match &args.output {
        Some(path) => io::write_text(path, &text)?,
        None => print::text(text.trim_end()),
    }
    Ok(())
}

fn export_colmap(args: &ExportArgs, files: &[CameraFile]) -> anyhow::Result<()> {
    let folder = args
        .output
        .as_ref()
        .ok_or_else(|| anyhow::anyhow!("-o: missing, expected a folder for COLMAP's files"))?;
    let cameras: Vec<_> = files
        .iter()
        .map(|f| (f.image.file.as_str(), f.camera()))
        .collect();
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
    common.say(format_args!(
        "{}: {} marker corners",
        args.output.display(),
        label.points.len() - known
    ));
    Ok(())
}

fn rectify(args: &RectifyArgs) -> anyhow::Result<()> {
    let labelled = only(&args.label, args.size)?;
    let solution = accepted(solved(&labelled)?, &labelled, args.force)?;
    let header = io::read_header(&args.photo)?;
    let seen = solution
        .camera
        .resized([header.width as u32, header.height as u32]);
    if let Some(picture) = &args.back {
        let picture = Pyramid::new(io::read::<PremulRgba>(picture)?);
        return Ok(io::write(
            &args.output,
            &camera::project_picture(&picture, &seen, solution.size),
        )?);
    }
    let px_per_metre = args.px_per_metre.unwrap_or(solution.fit.px_per_metre);
    let photo = Pyramid::new(io::read::<LinearRgb>(&args.photo)?);
    Ok(io::write(
        &args.output,
        &camera::rectify(&photo, &seen, solution.size, px_per_metre)?,
    )?)
}

/// The only label of a file.
fn only(path: &Path, size: Option<[f64; 2]>) -> anyhow::Result<LabelledPhoto> {
    let mut labels = camera::read_labels(path, size)?;
    anyhow::ensure!(
        labels.len() == 1,
        "{}: {} labels, expected one",
        path.display(),
        labels.len()
    );
    Ok(labels.remove(0))
}

fn solved(labelled: &LabelledPhoto) -> petcomp::Result<Solution> {
    let solution = camera::solve(&labelled.label, &SolveOptions::default())
        .map_err(|e| located(e, labelled))?;
    camera::check_distance(&solution.camera).map_err(|e| e.in_file(&labelled.source))?;
    Ok(solution)
}

/// A solution that fits its label, or any where that is asked for.
fn accepted(solution: Solution, labelled: &LabelledPhoto, force: bool) -> anyhow::Result<Solution> {
    match solution.misfit() {
        Some(error) if !force => Err(Error::file(
            &labelled.source,
            format!("{error}; --force takes it nevertheless"),
        )
        .into()),
        _ => Ok(solution),
    }
}

fn located(error: camera::SolveError, labelled: &LabelledPhoto) -> Error {
    Error::from(error).in_file(&labelled.source)
}

/// Writes the camera and, where the photo is there, the overlay; says what was found.
fn write(
    target: &Path,
    labelled: &LabelledPhoto,
    file: &CameraFile,
    solution: &Solution,
    common: &Common,
) -> anyhow::Result<()> {
    io::write_json(target, file)?;
    if let Some(photo) = labelled.photo() {
        let photo: Image<LinearRgb> = io::read(photo)?;
        let name = target
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        let stem = name.strip_suffix(".json").unwrap_or(&name);
        let stem = stem.strip_suffix(".camera").unwrap_or(stem);
        io::write(
            target.with_file_name(format!("{stem}.overlay.png")),
            &camera::overlay(&photo, solution),
        )?;
    }
    report(labelled, solution, common);
    Ok(())
}

fn report(labelled: &LabelledPhoto, solution: &Solution, common: &Common) {
    let camera = &solution.camera;
    let (tilt, height) = (camera.tilt().to_degrees(), camera.center().z);
    let (focal, percent) = (camera.focal_px.x, 100.0 * solution.sigma.ln_focal);
    common.say(format_args!(
        "{labelled}: tilt {tilt:.1} deg, height {height:.3} m, focal length {focal:.0} px (+- {percent:.1} %, {}), corners to {:.2} px, \
         {:.0} mm above the surface to {:.1} px",
        format!("{:?}", solution.focal_source).to_lowercase(),
        solution.rms_px,
        1000.0 * solution.sigma.reference_height,
        solution.sigma.height_px,
    ));
    for warning in &solution.warnings {
        common.warn(format_args!("{labelled}: {warning}"));
    }
}

/// Four places of two numbers each.
fn corners(text: &str) -> Result<[[f64; 2]; 4], String> {
    let wrong =
        || format!("\"{text}\", expected four corners as in \"120,80 900,85 905,600 110,590\"");
    let place = |part: &str| {
        let (x, y) = part.split_once(',')?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        Some([number(x)?, number(y)?])
    };
    let places = text
        .split([' ', ';'])
        .filter(|part| !part.is_empty())
        .map(place)
        .collect::<Option<Vec<_>>>();
    places
        .and_then(|places| places.try_into().ok())
        .ok_or_else(wrong)
}

pub(crate) fn dimensions(text: &str) -> Result<[f64; 2], String> {
    let side = |part: &str| {
        part.trim()
            .parse::<f64>()
            .ok()
            .filter(|side| side.is_finite() && *side > 0.0)
    };
    let sides = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| format!("\"{text}\", expected WIDTHxHEIGHT in metres as in 0.6x0.4"))
}
