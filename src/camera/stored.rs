//! Cameras that were solved before and stored next to their labels, and whether they still match them.

use super::error::SolveError;
use super::file::{CameraFile, SolvedFrom, checksum, has_checksum};
use super::label::Label;
use super::label_check::check_label;
use super::options::SolveOptions;
use super::pinhole::Camera;
use super::read::LabelledPhoto;
use super::solution::Solution;
use super::solve::solve;
use crate::diagnostic::Diagnostic;
use crate::error::{Error, Result};
use crate::io;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A labelled photo's camera.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoCamera {
    /// The camera.
    pub camera: Camera,
    /// OpenCV's first coefficient of its lens's radial distortion.
    pub k1: f64,
    /// Width and height of the rectangle as fitted, metres.
    pub size: [f64; 2],
    /// Warnings to review.
    pub warnings: Vec<Diagnostic>,
    /// The camera was read from `NAME.camera.json`, not solved again.
    pub stored: bool,
    /// Why a stored camera was not used.
    pub stale: Option<String>,
}

/// The labels that are there.
type LabelsByName<'a> = BTreeMap<&'a str, &'a Label>;

/// The cameras of labelled photos, in order: that beside a label (`NAME.camera.json`) where it is
/// there and was solved from this label, or else that of the label. One that does not fit its label
/// is refused, unless `force`d here or when it was solved.
///
/// # Errors
/// A label with an impossible value, or that no camera can have seen, or that none fits; a camera
/// file that cannot be right.
pub(crate) fn photo_cameras(labels: &[LabelledPhoto], force: bool) -> Result<Vec<PhotoCamera>> {
    let found = labels.iter().map(with_camera_file);
    let found: Vec<(LabelledPhoto, Option<CameraFile>)> = found.collect::<Result<_>>()?;
    let known = found.iter().map(|(labelled, _)| labelled);
    let known = known.map(|l| (l.name.as_str(), &l.label)).collect();
    found
        .iter()
        .map(|(labelled, file)| PhotoCamera::new(labelled, file.as_ref(), &known, force))
        .collect()
}

/// The camera of one of these labelled photos, as [`photo_cameras`] finds it: nothing else has to
/// be right.
///
/// # Errors
/// As [`photo_cameras`], of this photo alone.
pub(crate) fn photo_camera(
    labelled: &LabelledPhoto,
    labels: &[LabelledPhoto],
    force: bool,
) -> Result<PhotoCamera> {
    let (labelled, file) = with_camera_file(labelled)?;
    let sized = |label: &LabelledPhoto| {
        with_stored_size(label, read_camera_file(label).ok().flatten().as_ref())
    };
    let known: Vec<LabelledPhoto> = labels.iter().map(sized).collect();
    // Of a label without sides nobody knows what it was solved with.
    let known = known.iter().filter(|l| l.label.surface.has_side());
    let known = known.map(|l| (l.name.as_str(), &l.label)).collect();
    PhotoCamera::new(&labelled, file.as_ref(), &known, force)
}

/// A label that may be right, with the size that its camera was solved with, and that camera's file.
fn with_camera_file(labelled: &LabelledPhoto) -> Result<(LabelledPhoto, Option<CameraFile>)> {
    check_label(&labelled.label).map_err(|error| in_label(error, labelled))?;
    let file = read_camera_file(labelled)?;
    Ok((with_stored_size(labelled, file.as_ref()), file))
}

impl PhotoCamera {
    /// The stored camera, unless it does not match its label any more.
    fn new(
        labelled: &LabelledPhoto,
        file: Option<&CameraFile>,
        known: &LabelsByName<'_>,
        force: bool,
    ) -> Result<Self> {
        let Some(file) = file else {
            return Self::solved(labelled, force);
        };
        let Some(why) = staleness(file, labelled, known) else {
            return Ok(Self::stored(file));
        };
        let path = camera_path(labelled);
        Ok(Self {
            stale: Some(format!("{}: {why}; solved again", path.display())),
            ..Self::solved(labelled, force)?
        })
    }

    fn stored(file: &CameraFile) -> Self {
        Self {
            camera: file.camera(),
            k1: file.k1(),
            size: file.size(),
            warnings: file.found.warnings.clone(),
            stored: true,
            stale: None,
        }
    }

    fn solved(labelled: &LabelledPhoto, force: bool) -> Result<Self> {
        let solved = solve(&labelled.label, &SolveOptions::default());
        let usable = match force {
            true => solved,
            false => solved.and_then(Solution::fitting),
        };
        usable
            .map(Self::from)
            .map_err(|error| located_error(error, labelled))
    }
}

impl From<Solution> for PhotoCamera {
    fn from(solution: Solution) -> Self {
        Self {
            camera: solution.camera,
            k1: solution.k1(),
            size: solution.size,
            warnings: solution.warnings,
            stored: false,
            stale: None,
        }
    }
}

fn camera_path(labelled: &LabelledPhoto) -> PathBuf {
    labelled.beside("camera.json")
}

/// The camera file of a label, where there is one.
fn read_camera_file(labelled: &LabelledPhoto) -> Result<Option<CameraFile>> {
    let path = camera_path(labelled);
    let file = path.exists().then(|| checked_camera_file(&path, labelled));
    file.transpose().map_err(|error| with_advice(error, &path))
}

/// The error of a camera file, with what to do about it.
fn with_advice(error: Error, path: &Path) -> Error {
    let (message, place) = (error.to_string(), format!("{}: ", path.display()));
    let what = message.strip_prefix(&place).unwrap_or(&message);
    let what = format!("{what}; delete it, or run `petcomp camera solve` again");
    Error::file(path, what)
}

fn checked_camera_file(path: &Path, labelled: &LabelledPhoto) -> Result<CameraFile> {
    let file: CameraFile = io::read_json(path)?;
    file.check(labelled.label.image_size())
        .map_err(|e| e.in_file(path))?;
    Ok(file)
}

fn in_label(error: SolveError, labelled: &LabelledPhoto) -> Error {
    Error::from(error).in_file(&labelled.source)
}

/// The error of a label, or where its sides are missing, where to give them.
fn located_error(error: SolveError, labelled: &LabelledPhoto) -> Error {
    if labelled.label.surface.has_side() {
        return in_label(error, labelled);
    }
    Error::file(
        &labelled.source,
        "width and height of the rectangle are missing, expected surface.width_m and height_m in the label, surface_size \
         in the recipe, or a camera file from `petcomp camera solve` with --size",
    )
}

/// A label without sides, with those that its camera was solved with.
fn with_stored_size(labelled: &LabelledPhoto, file: Option<&CameraFile>) -> LabelledPhoto {
    let mut labelled = labelled.clone();
    let surface = &mut labelled.label.surface;
    let from = file.and_then(|f| f.solved_from.as_ref());
    if let Some(from) = from.filter(|_| !surface.has_side()) {
        [surface.width_m, surface.height_m] = from.size_m;
    }
    labelled
}

/// Why a camera does not match its label any more; `known` are the labels that are there.
fn staleness(
    file: &CameraFile,
    labelled: &LabelledPhoto,
    known: &LabelsByName<'_>,
) -> Option<String> {
    let Some(from) = &file.solved_from else {
        let older = modified(&camera_path(labelled)) < modified(&labelled.source);
        return older.then(|| "older than its label".to_owned());
    };
    if !has_checksum(&labelled.label, from.label_crc32) {
        return Some("solved from another version of its label, or with another size".into());
    }
    let name = changed_companion(from, known)?;
    Some(format!("solved together with another version of {name}"))
}

/// The first label among those that were solved together which is there and has another checksum.
fn changed_companion<'a>(from: &'a SolvedFrom, known: &LabelsByName<'_>) -> Option<&'a String> {
    let mut together = from.together.iter();
    let changed = together.find(|&(name, &crc)| {
        let now = known.get(name.as_str());
        now.is_some_and(|now| !has_checksum(now, crc))
    });
    changed.map(|(name, _)| name)
}

fn modified(path: &Path) -> Option<std::time::SystemTime> {
    std::fs::metadata(path).ok()?.modified().ok()
}

/// The checksums of labels by name: what one of those that are solved together keeps of them.
fn label_checksums<'a>(
    member: &LabelledPhoto,
    labels: impl IntoIterator<Item = &'a LabelledPhoto>,
) -> BTreeMap<String, u32> {
    labels
        .into_iter()
        .map(|labelled| (labelled.name_from(member), checksum(&labelled.label)))
        .collect()
}

impl CameraFile {
    /// The camera of a photo, with the checksums of those that it was solved together with, itself
    /// among them.
    pub fn solved_together(
        member: &LabelledPhoto,
        solution: &Solution,
        all: &[LabelledPhoto],
    ) -> Self {
        let mut file = Self::new(&member.label, solution);
        if let Some(from) = file.solved_from.as_mut().filter(|_| all.len() > 1) {
            from.together = label_checksums(member, all);
        }
        file
    }

    /// Whether it was solved from this label alone, as it is, with the sides that were given then
    /// where it has none.
    pub fn is_of(&self, labelled: &LabelledPhoto) -> bool {
        let from = self.solved_from.as_ref();
        if from.is_some_and(|from| !from.together.is_empty()) {
            return false;
        }
        let labelled = with_stored_size(labelled, Some(self));
        staleness(self, &labelled, &BTreeMap::new()).is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::simulate::Scenario;
    use crate::camera::{LabelPoint, read_labels};
    use crate::color::Albedo;

    fn camera_of(labelled: &LabelledPhoto, force: bool) -> Result<PhotoCamera> {
        photo_cameras(std::slice::from_ref(labelled), force).map(|mut all| all.remove(0))
    }

    struct Desk(tempfile::TempDir);

    impl Desk {
        fn new() -> Self {
            Self(tempfile::tempdir().unwrap())
        }

        fn path(&self, name: &str) -> PathBuf {
            self.0.path().join(name)
        }

        fn label(&self, k: u64) -> Label {
            let mut label = Scenario::realistic().tilted(30.0).view(3, k).label;
            label.surface.id = "tray".into();
            label
        }

        fn write(&self, label: &Label) -> LabelledPhoto {
            io::write_json(self.path("a.label.json"), label).unwrap();
            read_labels(self.path("a.label.json"), None)
                .unwrap()
                .remove(0)
        }

        /// A camera file whose focal length differs from that of a camera solved anew.
        fn store(&self, labelled: &LabelledPhoto, edit: impl Fn(&mut CameraFile)) {
            let solution = solve(&labelled.label, &SolveOptions::default()).unwrap();
            let mut file = CameraFile::new(&labelled.label, &solution);
            file.found.model.f_px = 3333.0;
            edit(&mut file);
            io::write_json(self.path("a.camera.json"), &file).unwrap();
        }
    }

    #[test]
    fn a_camera_beside_its_label_is_used_until_the_label_changes() {
        let desk = Desk::new();
        let mut label = desk.label(0);
        let labelled = desk.write(&label);
        assert!(!camera_of(&labelled, false).unwrap().stored);
        desk.store(&labelled, |_| {});
        let found = camera_of(&labelled, false).unwrap();
        assert!(found.stored && found.camera.focal_px.x == 3333.0 && found.stale.is_none());
        // Written anew with other spaces and a younger time: still the same label.
        let text = serde_json::to_string(&label).unwrap();
        io::write_text(desk.path("a.label.json"), &text).unwrap();
        assert!(
            camera_of(
                &read_labels(desk.path("a.label.json"), None).unwrap()[0],
                false
            )
            .unwrap()
            .stored
        );
        label.surface.corners_px.as_mut().unwrap()[0][0] += 1.0;
        let found = camera_of(&desk.write(&label), false).unwrap();
        assert!(!found.stored && found.camera.focal_px.x != 3333.0);
        assert!(
            found
                .stale
                .unwrap()
                .contains("a.camera.json: solved from another version of its label")
        );
    }

    #[test]
    fn a_camera_is_of_the_label_that_it_was_solved_from() {
        let desk = Desk::new();
        let labelled = desk.write(&desk.label(0));
        let solution = solve(&labelled.label, &SolveOptions::default()).unwrap();
        let file = CameraFile::new(&labelled.label, &solution);
        let [mut without_sides, mut moved] = [labelled.clone(), labelled.clone()];
        let surface = &mut without_sides.label.surface;
        (surface.width_m, surface.height_m) = (None, None);
        moved.label.surface.corners_px.as_mut().unwrap()[0][0] += 1.0;
        let found = [&labelled, &without_sides, &moved].map(|label| file.is_of(label));
        assert_eq!(found, [true, true, false]);
    }

    #[test]
    fn a_file_without_a_checksum_counts_by_its_time() {
        let desk = Desk::new();
        let labelled = desk.write(&desk.label(0));
        desk.store(&labelled, |file| file.solved_from = None);
        assert!(camera_of(&labelled, false).unwrap().stored);
        let file = std::fs::File::options()
            .write(true)
            .open(desk.path("a.camera.json"))
            .unwrap();
        file.set_modified(std::time::SystemTime::UNIX_EPOCH)
            .unwrap();
        assert!(
            camera_of(&labelled, false)
                .unwrap()
                .stale
                .unwrap()
                .contains("older than its label")
        );
    }

    #[test]
    fn a_change_of_a_label_that_was_solved_with_it_is_noticed() {
        let desk = Desk::new();
        let labelled = desk.write(&desk.label(0));
        let other = desk.label(1);
        let path = desk.path("b.label.json");
        io::write_json(&path, &other).unwrap();
        let mut labels = [
            labelled.clone(),
            read_labels(&path, None).unwrap().remove(0),
        ];
        desk.store(&labelled, |file| {
            file.solved_from.as_mut().unwrap().together = label_checksums(&labelled, &labels)
        });
        assert!(photo_cameras(&labels, false).unwrap()[0].stored);
        labels[1].label.surface.corners_px.as_mut().unwrap()[0][0] += 1.0;
        let stale = photo_cameras(&labels, false)
            .unwrap()
            .remove(0)
            .stale
            .unwrap();
        assert!(
            stale.contains("together with another version of b"),
            "{stale}"
        );
        assert!(
            camera_of(&labelled, false).unwrap().stored,
            "a copy of a part of the photos"
        );
    }

    #[test]
    fn photos_of_one_name_in_two_folders_make_no_camera_stale() {
        let desk = Desk::new();
        let labels = [("left", 0), ("right", 1)].map(|(side, k)| {
            io::create_folder(desk.path(side)).unwrap();
            let path = desk.path(&format!("{side}/a.label.json"));
            io::write_json(&path, &desk.label(k)).unwrap();
            read_labels(&path, None).unwrap().remove(0)
        });
        let solution = solve(&labels[0].label, &SolveOptions::default()).unwrap();
        let file = CameraFile::solved_together(&labels[0], &solution, &labels);
        let together = &file.solved_from.as_ref().unwrap().together;
        assert_eq!(together.keys().collect::<Vec<_>>(), ["../right/a", "a"]);
        io::write_json(desk.path("left/a.camera.json"), &file).unwrap();
        assert!(camera_of(&labels[0], false).unwrap().stored);
    }

    /// Two labels with points, and what makes each a label that no camera differs by.
    fn noted_labels(desk: &Desk) -> [[LabelledPhoto; 2]; 2] {
        [("a", 0), ("b", 1)].map(|(name, k)| {
            let mut label = desk.label(k);
            let [px, ..] = label.surface.corners_px.unwrap();
            let [w, h] = [label.surface.width_m, label.surface.height_m].map(Option::unwrap);
            label.points = vec![LabelPoint {
                xyz_m: [-w / 2.0, h / 2.0, 0.0],
                px,
                sigma_px: None,
                note: None,
            }];
            let bare = desk.write(&label);
            label.surface.albedo = Some(Albedo::Luminance(0.2));
            label.surface.source = Some("manual".into());
            label.points[0].note = Some("rim".into());
            let noted = desk.write(&label);
            [bare, noted].map(|labelled| LabelledPhoto {
                name: name.into(),
                ..labelled
            })
        })
    }

    #[test]
    fn albedo_source_and_notes_of_a_label_make_no_camera_stale() {
        let desk = Desk::new();
        let [[bare, noted], [other_bare, other_noted]] = noted_labels(&desk);
        let together = label_checksums(&bare, [&bare, &other_bare]);
        desk.store(&bare, |file| {
            file.solved_from.as_mut().unwrap().together = together.clone()
        });
        let found = photo_cameras(&[noted.clone(), other_noted.clone()], false).unwrap();
        assert_eq!(found[0].stale, None);
        // Files of older versions: the CRC-32 of the whole label.
        let whole = |l: &LabelledPhoto| crc32fast::hash(&serde_json::to_vec(&l.label).unwrap());
        desk.store(&noted, |file| {
            let from = file.solved_from.as_mut().unwrap();
            from.label_crc32 = whole(&noted);
            from.together = [("b".to_owned(), whole(&other_noted))].into();
        });
        let found = photo_cameras(&[noted, other_noted.clone()], false).unwrap();
        assert_eq!(found[0].stale, None);
        let found = photo_cameras(&[bare, other_noted], false).unwrap();
        assert!(found[0].stale.is_some());
    }

    #[test]
    fn a_value_that_no_camera_depends_on_is_checked_beside_a_stored_camera_too() {
        let desk = Desk::new();
        let mut label = desk.label(0);
        desk.store(&desk.write(&label), |_| {});
        label.surface.albedo = Some(Albedo::Luminance(10.0));
        let error = camera_of(&desk.write(&label), false).unwrap_err();
        let told = "a.label.json: surface.albedo: 10, expected 0.001 to 1 (a share of the light)";
        assert!(error.to_string().ends_with(told), "{error}");
    }

    #[test]
    fn a_broken_camera_file_is_named() {
        let desk = Desk::new();
        let labelled = desk.write(&desk.label(0));
        type Edit = fn(&mut CameraFile);
        let edits: [(Edit, &str); 7] = [
            (|f| f.version = 2, "version: 2, expected 1"),
            (
                |f| f.image.width = 1,
                "image: 1 x 3000 pixels, expected 4000 x 3000",
            ),
            (|f| f.found.model.f_px = -1.0, "model.f_px: -1e0"),
            (
                |f| f.found.model.principal_point_px[0] = 1e300,
                "model.principal_point_px: 1e300",
            ),
            (|f| f.found.opencv.r[0][0] = 7.0, "opencv.R: not a rotation"),
            (|f| f.found.opencv.t = [0.0, 0.0, -1.0], "below the surface"),
            (|f| f.found.surface.width_m = 0.0, "surface: 0e0"),
        ];
        for (edit, expected) in edits {
            desk.store(&labelled, edit);
            let error = camera_of(&labelled, true).unwrap_err().to_string();
            assert!(
                error.contains(expected) && error.contains("a.camera.json: "),
                "{error}"
            );
            assert!(
                error.ends_with("delete it, or run `petcomp camera solve` again"),
                "{error}"
            );
        }
        io::write_text(desk.path("a.camera.json"), "{").unwrap();
        assert!(
            camera_of(&labelled, false)
                .unwrap_err()
                .to_string()
                .contains("a.camera.json: line 1")
        );
    }

    #[test]
    fn a_camera_that_does_not_fit_needs_force() {
        let desk = Desk::new();
        let mut label = desk.label(0);
        let surface = &mut label.surface;
        (surface.width_m, surface.height_m) = (surface.height_m, surface.width_m);
        let labelled = desk.write(&label);
        let error = camera_of(&labelled, false).unwrap_err().to_string();
        assert!(
            error.contains("a.label.json") && error.contains("swap width_m and height_m"),
            "{error}"
        );
        assert!(!camera_of(&labelled, true).unwrap().stored);
        let solution = solve(&label, &SolveOptions::default()).unwrap();
        assert!(CameraFile::new(&label, &solution).forced);
        io::write_json(
            desk.path("a.camera.json"),
            &CameraFile::new(&labelled.label, &solution),
        )
        .unwrap();
        assert!(
            camera_of(&labelled, false).unwrap().stored,
            "forced when it was solved"
        );
    }
}
