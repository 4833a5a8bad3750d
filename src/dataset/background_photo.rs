//! Labelled photos of the place that scenes are set in.

use crate::asset;
use crate::camera::{self, LabelledPhoto, PhotoCamera};
use crate::dataset::paths::folder_of;
use crate::dataset::photo_memory::PhotoMemory;
use crate::error::{Error, Result};
use crate::filter;
use crate::geom::{Point2, Point3};
use crate::image::{Image, Roi};
use crate::io::{self, Format, FromFile};
use crate::light::{MeasuredPlate, PlateMeasures};
use crate::lru::LruCache;
use crate::pixel::{Coverage, LinearRgb, Mix};
use crate::scene::{Background, CameraSource, Wall};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::slice;
use std::sync::Arc;

/// Share of a photo below which cropping it to the pictures' shape is worth a warning.
const SMALL_SHOWN_SHARE: f64 = 0.75;
/// A rectangle counts as cut off if a corner is outside by more than this part of a picture's side.
const CUT_OFF_SHARE: f64 = 0.02;

/// A labelled photo: its camera is found once; its pixels are read when a picture needs them and
/// they are no longer in memory.
#[derive(Debug)]
pub(crate) struct BackgroundPhoto {
    /// What a recipe sees of it.
    pub(crate) background: Background,
    /// The file that labels it.
    pub(crate) label: PathBuf,
    /// The photo's file.
    pub(crate) photo: PathBuf,
    /// The part of it that is shown.
    pub(crate) kept: Roi,
    /// What the user should know about it; warned of when it was solved, and shown in the report.
    pub(crate) notes: Vec<String>,
    taken: [u32; 2],
    image: [u32; 2],
    /// What was measured of the photo at the picture's size, and at larger ones for views that zoom
    /// in.
    measures: Vec<PlateMeasures>,
    /// The mask of what hides objects, next to the photo.
    pub(crate) front: Option<PathBuf>,
    /// Shared by all places.
    memory: Arc<PhotoMemory>,
}

/// Zoom from one size of a plate to the next: a plate enlarged or reduced by this factor neither
/// blurs nor aliases much.
const ZOOM_STEP: f64 = 1.25;
/// A zoom that exceeds a step only in its last digits needs no more than that step.
const EPSILON: f64 = 1e-9;

/// A photo at one size, and what was measured of it.
#[derive(Clone, Debug)]
pub(crate) struct ReadPlate<'a> {
    pub(crate) image: Arc<Image<LinearRgb>>,
    measures: &'a PlateMeasures,
}

impl ReadPlate<'_> {
    pub(crate) fn measured(&self) -> MeasuredPlate<'_> {
        MeasuredPlate::new(&self.image, self.measures)
    }
}

/// How labelled photos are opened.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BackgroundOptions {
    /// Width and height of the pictures to generate, pixels.
    pub(crate) image: [u32; 2],
    /// Width and height of the rectangle, metres, for labels that do not state them.
    pub(crate) surface_size: Option<[f64; 2]>,
    /// Accept cameras that do not fit their labels.
    pub(crate) force: bool,
}

impl BackgroundPhoto {
    /// The labelled photos of a folder in order of name.
    pub(crate) fn all(folder: &Path, options: BackgroundOptions) -> Result<Vec<Self>> {
        let labels = camera::labels_in(folder, options.surface_size)?;
        if labels.is_empty() {
            let what = "no label found, expected at least one NAME.label.json, or a file of LabelMe, CVAT or Label Studio";
            return Err(Error::file(folder, what));
        }
        let sightings = camera::photo_cameras(&labels, options.force)?;
        let places = Self::open_seen(&labels, &sightings, options.image)?;
        warn_of_unlabelled(folder, &places);
        Ok(places)
    }

    /// Only the labelled photo of this name, whose label and camera alone have to be valid; all of
    /// them if none has the name.
    pub(crate) fn named(
        name: &str,
        folder: &Path,
        options: BackgroundOptions,
    ) -> Result<Vec<Self>> {
        let labels = camera::labels_beside(name, folder, options.surface_size)?;
        let Some(labelled) = labels.iter().find(|labelled| labelled.name == name) else {
            return Self::all(folder, options);
        };
        let seen = camera::photo_camera(labelled, &labels, options.force)?;
        Self::open_seen(slice::from_ref(labelled), &[seen], options.image)
    }

    fn open_seen(
        labels: &[LabelledPhoto],
        sightings: &[PhotoCamera],
        image: [u32; 2],
    ) -> Result<Vec<Self>> {
        warn_of_cameras(labels, sightings);
        let memory = Arc::new(PhotoMemory::of_bytes(asset::most_bytes()));
        let opened = labels
            .iter()
            .zip(sightings)
            .map(|(label, seen)| Self::open(label, seen, image, &memory));
        let places = opened.collect::<Result<Vec<_>>>()?;
        warn_of_shapes(&places);
        Ok(places)
    }

    /// All that the labelled photo of this name and the others of its folder are read from,
    /// including those that were not opened or whose labels cannot be used.
    pub(crate) fn files_beside(
        name: &str,
        folder: &Path,
        size: Option<[f64; 2]>,
    ) -> Result<Vec<PathBuf>> {
        let (labels, others) = match camera::labels_in(folder, size) {
            Ok(labels) => (labels, Vec::new()),
            // A label that cannot be used may belong to any of the photos.
            Err(_) => (
                camera::labels_beside(name, folder, size)?,
                photos_and_labels(folder).collect(),
            ),
        };
        let files = labels.iter().flat_map(|labelled| {
            let photo = labelled.photo();
            let front = photo.as_deref().and_then(front_beside);
            let own = [labelled.source.clone(), labelled.beside("camera.json")];
            own.into_iter().chain(photo).chain(front)
        });
        Ok(files.chain(others).collect())
    }

    fn open(
        labelled: &LabelledPhoto,
        seen: &PhotoCamera,
        image: [u32; 2],
        memory: &Arc<PhotoMemory>,
    ) -> Result<Self> {
        let photo = photo_path(labelled)?;
        let shown = Roi::middle_of(labelled.label.image_size(), image);
        camera::check_camera_distance(&seen.camera)
            .and_then(|()| camera::check_lens(&seen.camera.cropped(shown), seen.k1))
            .map_err(|e| e.in_file(&labelled.source))?;
        let mut background = Self::cropped_to(image, labelled, seen, photo, memory);
        background.notes.extend(background.shape_note());
        Ok(background)
    }

    /// The middle part of a photo that has the shape of the picture.
    fn cropped_to(
        image: [u32; 2],
        labelled: &LabelledPhoto,
        seen: &PhotoCamera,
        photo: PathBuf,
        memory: &Arc<PhotoMemory>,
    ) -> Self {
        let taken = labelled.label.image_size();
        let kept = Roi::middle_of(taken, image);
        Self {
            background: Background {
                name: labelled.name.clone(),
                size: seen.size,
                camera: CameraSource::Known(seen.camera.covering(image)),
                k1: seen.k1,
                shown_share: kept.width.max(kept.height) as f64 / f64::from(taken[0].max(taken[1])),
                albedo: labelled.label.surface.albedo,
                wall: wall_of(labelled, seen.size),
            },
            label: labelled.source.clone(),
            notes: seen.warnings.iter().map(ToString::to_string).collect(),
            taken,
            kept,
            image,
            measures: no_measures(kept, image),
            front: front_beside(&photo),
            memory: memory.clone(),
            photo,
        }
    }

    /// Fails if pictures were generated from a photo or mask with other checksums; from now on none
    /// can be.
    pub(crate) fn check_files(&self, photo: u32, front: Option<u32>) -> Result<()> {
        let files = &self.memory.files;
        files.check(&self.photo, photo)?;
        let mut front = self.front.iter().zip(front);
        front.try_for_each(|(mask, crc32)| files.check(mask, crc32))
    }

    /// Fails if a scene's rectangle was labelled in a photo of another shape; the picture itself is
    /// the middle of the photo.
    pub(crate) fn check_labelled(&self, camera: &CameraSource) -> Result<()> {
        let CameraSource::Rectangle { photo, .. } = *camera else {
            return Ok(());
        };
        let sizes = [self.taken, self.image];
        if sizes
            .iter()
            .any(|&size| camera::have_same_shape(photo, size))
        {
            return Ok(());
        }
        let [w, h] = self.taken;
        let what = format!("{photo:?}, expected the shape of the plate's photo, {w} x {h}");
        Err(Error::value("camera.rectangle.photo", what))
    }

    /// The share of the photo that pictures show.
    fn part(&self) -> f64 {
        let [w, h] = self.taken.map(f64::from);
        self.kept.width as f64 * self.kept.height as f64 / (w * h)
    }

    /// A note if only a part of the photo fits into the pictures' shape, and what that leaves of
    /// its rectangle.
    fn shape_note(&self) -> Option<String> {
        if self.part() == 1.0 {
            return None;
        }
        let [w, h] = self.taken;
        let Roi { width, height, .. } = self.kept;
        let cut = match self.cuts_off() {
            true => ", without a part of the rectangle",
            false => "",
        };
        Some(format!(
            "of {w} x {h} pixels the middle {width} x {height} are shown{cut}"
        ))
    }

    /// Whether a corner of the rectangle that the photo shows is outside the pictures.
    fn cuts_off(&self) -> bool {
        let CameraSource::Known(camera) = self.background.camera else {
            return false;
        };
        let (size, whole) = (self.image.map(f64::from), self.uncropped_size());
        self.surface_corners()
            .into_iter()
            .filter_map(|corner| camera.project(corner))
            .any(|(px, _)| is_within(px, size, whole) && !is_within(px, size, size))
    }

    /// Whether little of it is shown, or a part of the surface is not.
    fn is_misshapen(&self) -> bool {
        self.part() < SMALL_SHOWN_SHARE || self.cuts_off()
    }

    /// The whole photo at the scale of the pictures, pixels.
    fn uncropped_size(&self) -> [f64; 2] {
        let ([w, h], [whole_w, whole_h]) = (self.image.map(f64::from), self.taken.map(f64::from));
        let Roi { width, height, .. } = self.kept;
        [w * (whole_w / width as f64), h * (whole_h / height as f64)]
    }

    fn surface_corners(&self) -> [Point3<f64>; 4] {
        let [x, y] = self.background.size.map(|side| side / 2.0);
        let corners = [[-x, y], [x, y], [x, -y], [-x, -y]];
        corners.map(|[x, y]| Point3::new(x, y, 0.0))
    }

    /// The photo at the picture's size, scene-linear.
    pub(crate) fn plate(&self) -> Result<ReadPlate<'_>> {
        self.plate_at_level(0)
    }

    /// The photo at the size that a view that zooms in needs, as far as it has the pixels.
    pub(crate) fn plate_for_zoom(&self, zoom: f64) -> Result<ReadPlate<'_>> {
        self.plate_at_level(self.level_for_zoom(zoom))
    }

    /// What hides objects in this place according to a mask, at the size of the plate for the same
    /// zoom; none without a mask.
    pub(crate) fn front_mask(&self, zoom: f64) -> Result<Option<Arc<Image<Coverage>>>> {
        let level = self.level_for_zoom(zoom);
        let read = |path: &PathBuf| self.at_level(path, level, &self.memory.masks);
        self.front.as_ref().map(read).transpose()
    }

    fn level_for_zoom(&self, zoom: f64) -> usize {
        let level = (zoom.ln() / ZOOM_STEP.ln() - EPSILON).ceil().max(0.0) as usize;
        level.min(self.measures.len() - 1)
    }

    fn plate_at_level(&self, level: usize) -> Result<ReadPlate<'_>> {
        Ok(ReadPlate {
            image: self.at_level(&self.photo, level, &self.memory.plates)?,
            measures: &self.measures[level],
        })
    }

    /// The shown part of a picture of the photo's size, from memory if it is there.
    fn at_level<P: FromFile + Mix>(
        &self,
        path: &Path,
        level: usize,
        memory: &LruCache<Arc<Image<P>>>,
    ) -> Result<Arc<Image<P>>> {
        let name = format!("{level} {}", self.background.name);
        if let Some(known) = memory.get(&name) {
            return Ok(known);
        }
        let read = self.shown_part(path, self.size_at_level(level))?;
        Ok(memory.insert(&name, Arc::new(read)))
    }

    /// The picture's size times the zoom, at most that of the photo.
    fn size_at_level(&self, level: usize) -> [usize; 2] {
        let detail = detail_of(self.kept, self.image).max(1.0);
        let scale = ZOOM_STEP.powi(level as i32).min(detail);
        self.image
            .map(|side| (f64::from(side) * scale).round() as usize)
    }

    /// The shown part of a picture of the photo's size, resized.
    fn shown_part<P: FromFile + Mix>(
        &self,
        path: &Path,
        [width, height]: [usize; 2],
    ) -> Result<Image<P>> {
        self.memory.files.read(path, |photo: Image<P>| {
            self.check_size(path, photo.size())?;
            Ok(filter::resize(&photo.into_crop(self.kept), width, height))
        })
    }

    fn check_size(&self, path: &Path, (w, h): (usize, usize)) -> Result<()> {
        if [w, h] == self.taken.map(|side| side as usize) {
            return Ok(());
        }
        let [label_w, label_h] = self.taken;
        let what = format!("{w} x {h} pixels, but its label says {label_w} x {label_h}");
        Err(Error::file(path, what))
    }
}

/// Warns of cameras: of each that is outdated and not used; once for all of those solved now that
/// have warnings. What was reported when a camera was solved is not repeated.
fn warn_of_cameras(labels: &[LabelledPhoto], sightings: &[PhotoCamera]) {
    for stale in sightings.iter().filter_map(|seen| seen.stale.as_ref()) {
        log::warn!("{stale}");
    }
    for (labelled, seen) in labels.iter().zip(sightings) {
        for warning in &seen.warnings {
            log::info!("{labelled}: {warning}");
        }
    }
    let unreported = unreported_names(labels, sightings);
    if let [first, ..] = unreported.as_slice() {
        let solved = sightings.iter().filter(|seen| !seen.stored).count();
        let count = unreported.len();
        let more = if count > 1 { ", ..." } else { "" };
        log::warn!(
            "{count} of {solved} newly solved cameras have warnings ({first}{more}): `petcomp camera doctor` explains them"
        );
    }
}

/// Photos whose cameras have warnings that were not shown when they were solved.
fn unreported_names<'a>(labels: &'a [LabelledPhoto], sightings: &[PhotoCamera]) -> Vec<&'a str> {
    let pairs = labels.iter().zip(sightings);
    pairs
        .filter(|(_, seen)| !seen.stored && !seen.warnings.is_empty())
        .map(|(labelled, _)| labelled.name.as_str())
        .collect()
}

/// Warns once for all photos whose shape differs from the pictures', if that crops much of them.
fn warn_of_shapes(places: &[BackgroundPhoto]) {
    let odd: Vec<_> = places.iter().filter(|place| place.is_misshapen()).collect();
    let least = odd.iter().min_by(|a, b| a.part().total_cmp(&b.part()));
    if let Some(least) = least
        && let Some(note) = least.shape_note()
    {
        let (count, of, name) = (odd.len(), places.len(), &least.background.name);
        let [w, h] = least.image;
        log::warn!(
            "{count} of {of} backgrounds differ in aspect ratio from the pictures ({w} x {h}): {name}: {note}; change \
             scene.image or crop them"
        );
    }
}

/// Warns once for all photos next to the labels that none of these labels belongs to.
fn warn_of_unlabelled(folder: &Path, places: &[BackgroundPhoto]) {
    let photos = places.iter().filter_map(|place| place.photo.file_stem());
    let labelled: BTreeSet<_> = photos.collect();
    let unlabelled = unlabelled_photos(folder, &labelled);
    if let Some(first) = unlabelled.first() {
        let (folder, count) = (folder.display(), unlabelled.len());
        let of = count + labelled.len();
        let (tell, more) = match count {
            1 => ("has no label and is not used", ""),
            _ => ("have no label and are not used", ", ..."),
        };
        log::warn!("{folder}: {count} of {of} photos {tell} ({first}{more})");
    }
}

/// Names of the photos of a folder, in order, whose stem differs from those of the labelled photos
/// and that were not derived from them.
fn unlabelled_photos(folder: &Path, labelled: &BTreeSet<&OsStr>) -> Vec<String> {
    let photos = files_in(folder).into_iter().filter(|path| is_photo(path));
    let is_labelled = |path: &PathBuf| path.file_stem().is_some_and(|s| labelled.contains(s));
    let unlabelled = photos.filter(|path| !is_labelled(path));
    let names =
        unlabelled.filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// The photos of a folder, and what may be their labels and cameras.
fn photos_and_labels(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let is_label = |path: &Path| ["json", "xml"].iter().any(|e| io::has_extension(path, e));
    files_in(folder)
        .into_iter()
        .filter(move |path| is_photo(path) || is_label(path))
}

fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    paths.filter(|path| path.is_file()).collect()
}

/// A picture that is neither hidden, nor an overlay or a mask of a photo, nor of a kind used for
/// environment maps.
fn is_photo(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let is_made = name.ends_with(".overlay.png") || name.ends_with(".front.png");
    // Environment maps may be in the same folder as the photos.
    let is_other = matches!(
        Format::from_extension(path),
        None | Some(Format::Exr | Format::Hdr)
    );
    !name.starts_with('.') && !is_made && !is_other
}

/// The walls of a surface of this size, as its label says.
fn wall_of(labelled: &LabelledPhoto, size: [f64; 2]) -> Option<Wall> {
    let wall = labelled.label.surface.wall?;
    Some(Wall::new(size, wall.height_m, wall.slope_deg))
}

/// Pixels of a photo for each pixel of its pictures.
fn detail_of(kept: Roi, image: [u32; 2]) -> f64 {
    kept.width as f64 / f64::from(image[0])
}

/// Room for the measurements of plates of every size up to the photo's.
fn no_measures(kept: Roi, image: [u32; 2]) -> Vec<PlateMeasures> {
    let steps = detail_of(kept, image).ln() / ZOOM_STEP.ln();
    let larger = steps.ceil().max(0.0) as usize;
    (0..=larger).map(|_| PlateMeasures::default()).collect()
}

/// The mask next to a photo of what hides objects, `NAME.front.png`, if there is one.
fn front_beside(photo: &Path) -> Option<PathBuf> {
    let mask = photo.with_extension("front.png");
    mask.is_file().then_some(mask)
}

/// The photo that a label names, in the label's folder.
fn photo_path(labelled: &LabelledPhoto) -> Result<PathBuf> {
    io::inside(folder_of(&labelled.source), &labelled.label.image.file)
        .map_err(|e| e.within("image").in_file(&labelled.source))
}

/// Whether a pixel is in a frame of size `seen` about the middle of a picture of size `size`, or
/// close to it.
fn is_within(px: Point2<f64>, size: [f64; 2], seen: [f64; 2]) -> bool {
    is_within_side(px.x, size[0], seen[0]) && is_within_side(px.y, size[1], seen[1])
}

fn is_within_side(at: f64, size: f64, seen: f64) -> bool {
    (at - size / 2.0).abs() < (0.5 + CUT_OFF_SHARE) * seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Label, tilted_camera};
    use std::sync::Weak;

    const TAKEN: [usize; 2] = [16, 12];

    /// A photo four times as large as the pictures, in shades of its own.
    fn place(folder: &Path, name: &str, memory: &Arc<PhotoMemory>) -> BackgroundPhoto {
        let ([width, height], image) = (TAKEN, [4, 3]);
        let shade = |x: usize, y: usize| LinearRgb::grey((name.len() * (x + width * y)) as f32);
        let photo = folder.join(name).with_extension("exr");
        io::write(&photo, &Image::from_fn(width, height, shade)).unwrap();
        let kept = Roi::middle_of(TAKEN.map(|side| side as u32), image);
        BackgroundPhoto {
            background: Background::new(name, [0.4, 0.3], CameraSource::Known(tilted_camera())),
            label: folder.join(name).with_extension("label.json"),
            kept,
            notes: Vec::new(),
            taken: TAKEN.map(|side| side as u32),
            image,
            measures: no_measures(kept, image),
            front: front_beside(&photo),
            memory: memory.clone(),
            photo,
        }
    }

    /// The plates of places, each at three sizes.
    fn plates(places: &[BackgroundPhoto]) -> impl Iterator<Item = Arc<Image<LinearRgb>>> {
        let sizes = |place: &BackgroundPhoto| [1.0, 2.0, 4.0].map(|zoom| plate(place, zoom));
        places.iter().flat_map(sizes)
    }

    fn plate(place: &BackgroundPhoto, zoom: f64) -> Arc<Image<LinearRgb>> {
        place.plate_for_zoom(zoom).unwrap().image
    }

    #[test]
    fn corners_are_of_the_whole_photo_or_of_the_picture() {
        let folder = tempfile::tempdir().unwrap();
        let memory = Arc::new(PhotoMemory::of_bytes(1 << 20));
        let square = BackgroundPhoto {
            image: [4, 4],
            ..place(folder.path(), "a", &memory)
        };
        let checked = |photo| {
            square.check_labelled(&CameraSource::Rectangle {
                corners_px: [[0.0; 2]; 4],
                photo,
                focal_px: None,
            })
        };
        for photo in [[16, 12], [1600, 1200], [400, 400]] {
            checked(photo).unwrap();
        }
        let refusal = checked([400, 200]).unwrap_err().to_string();
        assert_eq!(
            refusal,
            "camera.rectangle.photo: [400, 200], expected the shape of the plate's photo, 16 x 12"
        );
    }

    #[test]
    fn plates_stay_within_their_memory_and_are_read_again_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let pixels = TAKEN[0] * TAKEN[1];
        let most_bytes = pixels * size_of::<LinearRgb>();
        let masks_bytes = pixels * size_of::<Coverage>();
        let memory = Arc::new(PhotoMemory::of_bytes(most_bytes + masks_bytes));
        let places = ["a", "bb", "ccc"].map(|name| place(folder.path(), name, &memory));
        let first: Vec<_> = plates(&places).map(|plate| (*plate).clone()).collect();
        let known: Vec<_> = plates(&places)
            .map(|plate| Arc::downgrade(&plate))
            .collect();
        let kept = known.iter().filter_map(Weak::upgrade);
        let bytes: usize = kept.map(|plate| size_of_val(plate.pixels())).sum();
        assert!((1..=most_bytes).contains(&bytes), "{bytes}");
        assert!(plates(&places).map(|plate| (*plate).clone()).eq(first));
    }

    #[test]
    fn plates_that_fit_are_read_once() {
        let folder = tempfile::tempdir().unwrap();
        let memory = Arc::new(PhotoMemory::of_bytes(1 << 20));
        let places = ["a", "bb"].map(|name| place(folder.path(), name, &memory));
        let first: Vec<_> = plates(&places)
            .map(|plate| Arc::downgrade(&plate))
            .collect();
        assert!(first.iter().all(|plate| plate.upgrade().is_some()));
    }

    #[test]
    fn a_mask_is_as_large_as_the_plate() {
        let folder = tempfile::tempdir().unwrap();
        let mask = Image::from_fn(TAKEN[0], TAKEN[1], |x, _| Coverage(f32::from(x < 5)));
        io::write(folder.path().join("a.front.png"), &mask).unwrap();
        let memory = Arc::new(PhotoMemory::of_bytes(1 << 20));
        let place = place(folder.path(), "a", &memory);
        let front = |zoom| place.front_mask(zoom).unwrap().unwrap();
        for zoom in [1.0, 1.5, 4.0] {
            assert_eq!(front(zoom).size(), plate(&place, zoom).size());
        }
        assert_eq!(*front(4.0), mask);
    }

    #[test]
    fn a_photo_whose_label_cannot_be_used_is_among_the_inputs() {
        let folder = tempfile::tempdir().unwrap();
        let mut label = Label::new([16, 12], [[0.0; 2]; 4], [0.6, 0.4]);
        label.image.file = "a.png".into();
        io::write_json(folder.path().join("a.label.json"), &label).unwrap();
        let others = ["b.jpg", "b.label.json"].map(|name| folder.path().join(name));
        others
            .iter()
            .for_each(|path| std::fs::write(path, "{").unwrap());
        let inputs = BackgroundPhoto::files_beside("a", folder.path(), None).unwrap();
        for path in others {
            assert!(inputs.contains(&path), "{}: {inputs:?}", path.display());
        }
    }

    #[test]
    fn photos_without_a_label_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let files = [
            "a.jpg",
            "a.heic",
            "a.overlay.png",
            "a.front.png",
            "a.label.json",
            "c.png",
            "B.JPG",
            "._a2.jpg",
            ".hidden.png",
            "sky.exr",
            "sky.hdr",
            "notes.txt",
        ];
        for file in files {
            std::fs::write(folder.path().join(file), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("more.png")).unwrap();
        let labelled = BTreeSet::from([OsStr::new("a")]);
        let unlabelled = unlabelled_photos(folder.path(), &labelled);
        assert_eq!(unlabelled, ["B.JPG", "c.png"]);
    }
}
