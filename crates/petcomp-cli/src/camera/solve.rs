//! `petcomp camera solve`, `joint` and `doctor`: cameras from labels.

use super::outside::warn_of_outside;
use crate::batch::FileBatch;
use crate::diagnostics::report_diagnostics;
use crate::global::GlobalArgs;
use crate::print;
use crate::values::parse_metres;
use petcomp::camera::{self, Camera, CameraFile, Label, LabelledPhoto};
use petcomp::camera::{Solution, SolveError, SolveOptions};
use petcomp::{Code, Diagnostic, Error, Image, LinearRgb, io};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct LabelFileArgs {
    /// Labels: NAME.label.json; or files of LabelMe, CVAT (for images) or Label Studio, together
    /// with --size
    #[arg(required = true)]
    labels: Vec<PathBuf>,
    /// Width and height of the rectangle, metres, for labels that do not state them
    #[arg(long, value_name = "WxH", value_parser = parse_metres)]
    size: Option<[f64; 2]>,
}

#[derive(clap::Args)]
pub(crate) struct SolveArgs {
    #[command(flatten)]
    labels: LabelFileArgs,
    /// Camera file to write instead of NAME.camera.json; for one label only
    #[arg(short, long, value_name = "CAMERA")]
    output: Option<PathBuf>,
    /// Also write cameras that do not fit their labels
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
pub(crate) struct JointArgs {
    #[command(flatten)]
    labels: LabelFileArgs,
    /// Also write cameras that do not fit their labels
    #[arg(long)]
    force: bool,
}

impl LabelFileArgs {
    /// The given files, without the cameras of an earlier run that a pattern may have matched too.
    fn files(&self) -> Vec<&Path> {
        let given = || self.labels.iter().map(PathBuf::as_path);
        let labels: Vec<&Path> = given()
            .filter(|path| !camera::is_called_camera(path))
            .collect();
        match labels.is_empty() {
            true => given().collect(),
            false => labels,
        }
    }

    /// All labels of all files.
    fn read_all(&self) -> petcomp::Result<Vec<LabelledPhoto>> {
        let files = self.files().into_iter().map(|path| self.read_file(path));
        Ok(files.collect::<petcomp::Result<Vec<_>>>()?.concat())
    }

    fn read_file(&self, path: &Path) -> petcomp::Result<Vec<LabelledPhoto>> {
        camera::read_labels(path, self.size)
    }

    /// Calls `act` for every label; if there are several, an unusable one does not stop the others.
    fn for_each(&self, act: impl Fn(&LabelledPhoto) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let files = self.files();
        if let [path] = files[..]
            && let [labelled] = &self.read_file(path)?[..]
        {
            return act(labelled);
        }
        let mut batch = FileBatch::default();
        for path in files {
            match self.read_file(path) {
                Ok(labels) => labels.iter().for_each(|one| batch.count(act(one))),
                Err(error) => batch.count(Err(error.into())),
            }
        }
        batch.finish()
    }
}

impl SolveArgs {
    /// A file can hold only one camera, and must not be a label or a photo as well.
    fn check_output(&self) -> anyhow::Result<()> {
        if let Some(output) = &self.output {
            io::check_distinct(self.labels.files(), [output])?;
            let count = self.labels.read_all()?.len();
            anyhow::ensure!(count == 1, "-o: {count} labels, expected one");
        }
        Ok(())
    }
}

/// Solves each label separately.
pub(super) fn solve_each(args: &SolveArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    args.check_output()?;
    args.labels.for_each(|labelled| {
        let solution = accepted(solved(labelled)?, labelled, args.force)?;
        let file = CameraFile::new(&labelled.label, &solution);
        let beside = || labelled.beside("camera.json");
        let target = args.output.clone().unwrap_or_else(beside);
        write_camera(&target, labelled, &file, &solution)?;
        report_solution(labelled, &solution, global);
        Ok(())
    })
}

/// Solves the labels of each camera together.
pub(super) fn solve_joint(args: &JointArgs, global: &GlobalArgs) -> anyhow::Result<()> {
    let labels = args.labels.read_all()?;
    let mut batch = FileBatch::default();
    for group in camera::group_by_camera(&labels_of(&labels)) {
        let members: Vec<LabelledPhoto> = group.iter().map(|&i| labels[i].clone()).collect();
        if let [alone] = &members[..]
            && labels.len() > 1
        {
            log::warn!(
                "{alone}: solved alone: no other label has the same camera.id, picture shape and lens, or it was cropped and has no principal point"
            );
        }
        match solve_together(&members) {
            Ok(photos) => members.iter().zip(photos).for_each(|(member, photo)| {
                batch.count(accept_member(member, photo, &members, args.force, global));
            }),
            Err(error) => batch.count(Err(error.into())),
        }
    }
    batch.finish()
}

/// Solves photos of one camera, and reports those that contradict the others.
fn solve_together(members: &[LabelledPhoto]) -> petcomp::Result<Vec<JointOutcome>> {
    for member in members {
        warn_of_outside(member, &member.label);
    }
    let joint = camera::solve_joint(&labels_of(members), &SolveOptions::default())
        .map_err(|e| located(e, &members[0]))?;
    for outlier in &joint.outliers {
        report_diagnostics(&members[outlier.photo], &[outlier.diagnostic()]);
    }
    Ok(joint.photos)
}

/// The outcome of a photo that was solved together with others.
type JointOutcome = Result<Solution, SolveError>;

fn labels_of(photos: &[LabelledPhoto]) -> Vec<Label> {
    photos.iter().map(|photo| photo.label.clone()).collect()
}

/// Writes and reports the camera of a photo that was solved together with others.
fn accept_member(
    member: &LabelledPhoto,
    outcome: JointOutcome,
    all: &[LabelledPhoto],
    force: bool,
    global: &GlobalArgs,
) -> anyhow::Result<()> {
    let solution = outcome.map_err(|e| located(e, member))?;
    let solution = accepted(possible(solution, member)?, member, force)?;
    let file = CameraFile::solved_together(member, &solution, all);
    write_camera(&member.beside("camera.json"), member, &file, &solution)?;
    report_solution(member, &solution, global);
    Ok(())
}

/// Explains in plain words how well each camera is known.
pub(super) fn explain_each(args: &LabelFileArgs) -> anyhow::Result<()> {
    args.for_each(|labelled| {
        let solution = solved(labelled)?;
        let options = SolveOptions::default();
        print::line(labelled);
        print::text(camera::doctor(&labelled.label, &solution, &options));
        accepted(solution, labelled, false)?;
        Ok(())
    })
}

pub(super) fn solved(labelled: &LabelledPhoto) -> petcomp::Result<Solution> {
    warn_of_outside(labelled, &labelled.label);
    let solution = camera::solve(&labelled.label, &SolveOptions::default());
    possible(solution.map_err(|e| located(e, labelled))?, labelled)
}

/// A solution whose camera can see objects on the surface.
fn possible(solution: Solution, labelled: &LabelledPhoto) -> petcomp::Result<Solution> {
    camera::check_distance(&solution).map_err(|e| e.in_file(&labelled.source))?;
    Ok(solution)
}

/// A solution that fits its label, through a lens that can have taken the photo; with `force`, any.
pub(super) fn accepted(
    solution: Solution,
    labelled: &LabelledPhoto,
    force: bool,
) -> petcomp::Result<Solution> {
    if force {
        return Ok(solution);
    }
    if let Some(error) = solution.misfit() {
        report_diagnostics(labelled, causes_of_misfit(&solution));
        return Err(needs_force(&labelled.source, error.into()));
    }
    // Pictures may show only the middle of the photo.
    camera::check_lens(&solution.camera, solution.k1())
        .map_err(|e| needs_force(&labelled.source, e))?;
    Ok(solution)
}

/// The warnings that do not repeat that no camera fits, and are not about the camera found.
fn causes_of_misfit(solution: &Solution) -> impl Iterator<Item = &Diagnostic> {
    let others = [
        Code::PoorFit,
        Code::SidesSwapped,
        Code::PoseAmbiguous,
        Code::HeightUncertain,
    ];
    let warnings = solution.warnings.iter();
    warnings.filter(move |warning| !others.contains(&warning.code))
}

fn needs_force(label: &Path, why: Error) -> Error {
    let advised = |what: &dyn std::fmt::Display| format!("{what}; --force accepts it anyway");
    match why {
        Error::Value { at, what } => Error::value(at, advised(&what)).in_file(label),
        other => Error::file(label, advised(&other)),
    }
}

fn located(error: SolveError, labelled: &LabelledPhoto) -> Error {
    Error::from(error).in_file(&labelled.source)
}

/// Writes the camera and, if the photo exists, the overlay.
fn write_camera(
    target: &Path,
    labelled: &LabelledPhoto,
    file: &CameraFile,
    solution: &Solution,
) -> anyhow::Result<()> {
    io::check_distinct(labelled.photo(), [target, &overlay_beside(target)])?;
    io::write_json(target, file)?;
    match labelled.photo() {
        Some(photo) => write_overlay(target, &photo, solution)?,
        None => log::warn!(
            "{labelled}: image.file: \"{}\" is missing: no overlay is drawn, and its size and EXIF data are not checked",
            labelled.label.image.file
        ),
    }
    Ok(())
}

fn write_overlay(camera: &Path, photo: &Path, solution: &Solution) -> petcomp::Result<()> {
    let photo: Image<LinearRgb> = io::read(photo)?;
    io::write(overlay_beside(camera), &camera::overlay(&photo, solution))
}

/// `bg.overlay.png` for `bg.camera.json`.
fn overlay_beside(camera: &Path) -> PathBuf {
    let name = camera.file_name().unwrap_or_default().to_string_lossy();
    camera.with_file_name(format!("{}.overlay.png", camera_stem(&name)))
}

fn camera_stem(name: &str) -> &str {
    let stem = name.strip_suffix(".json").unwrap_or(name);
    stem.strip_suffix(".camera").unwrap_or(stem)
}

fn report_solution(labelled: &LabelledPhoto, solution: &Solution, global: &GlobalArgs) {
    global.print_status(format_args!(
        "{labelled}: {}, {}, {}",
        describe_view(&solution.camera),
        describe_focal(solution),
        describe_errors(solution)
    ));
    report_diagnostics(labelled, &solution.warnings);
}

fn describe_view(camera: &Camera) -> String {
    let (tilt, height) = (camera.tilt().to_degrees(), camera.center().z);
    format!("tilt {tilt:.1} deg, height {height:.3} m")
}

fn describe_focal(solution: &Solution) -> String {
    let (focal, percent) = (solution.camera.focal_px.x, 100.0 * solution.sigma.ln_focal);
    let source = solution.focal_source;
    format!("focal length {focal:.0} px (+- {percent:.1} %, {source})")
}

fn describe_errors(solution: &Solution) -> String {
    format!(
        "{} to {:.2} px, {:.0} mm above the surface to {:.1} px",
        solution.fit.labelled(),
        solution.rms_px,
        1000.0 * solution.sigma.reference_height,
        solution.sigma.height_px
    )
}
