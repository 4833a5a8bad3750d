//! Labels from files, ours and other programs', completed with their photos' EXIF data.

use super::error::SolveError;
use super::focal::plausible_equivalents;
use super::import::{self, Annotation, PictureNames};
use super::label::{Label, LabelImage};
use super::pinhole::Camera;
use super::solution::Solution;
use crate::bounds::{CAMERA, SURFACE, number};
use crate::error::{Error, Result};
use crate::io;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// How our label files are named: the photo's name, then this.
pub(crate) const LABEL_SUFFIX: &str = ".label.json";
/// What our labels say that they are.
const OWN_FORMAT: &str = "plane-label";
/// How camera files are named.
const CAMERA_SUFFIX: &str = ".camera.json";
/// What they say that they are.
const CAMERA_FORMAT: &str = "plane-camera";
/// Relative noise of a focal length that was recorded together with a digital zoom, or is reckoned
/// from the resolution of a sensor: of a picture of half the size it is twice as long.
const ROUGH_FOCAL_SIGMA: f64 = 0.25;

/// A label, and where it and its camera are stored.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledPhoto {
    /// The label, completed with its photo's EXIF data.
    pub label: Label,
    /// The file that it was read from; one of another program may hold many labels.
    pub source: PathBuf,
    /// What its files are called: `bg0001` of `bg0001.label.json`, or of another program's
    /// `bg0001.jpg`.
    pub name: String,
    /// Read from a label of ours, not from another program's.
    pub(super) is_ours: bool,
}

impl LabelledPhoto {
    /// A file of its own: `bg0001.camera.json` for the ending `camera.json`.
    pub fn beside(&self, ending: &str) -> PathBuf {
        self.source
            .with_file_name(format!("{}.{ending}", self.name))
    }

    /// What its files are called, seen from the folder of another label: `../right/bg0001`.
    pub(crate) fn name_from(&self, other: &Self) -> String {
        let own = io::absolute(&self.source.with_file_name(&self.name));
        let (Ok(own), Ok(from)) = (own, io::absolute(&other.source)) else {
            return self.name.clone();
        };
        let folder = from.parent().unwrap_or(Path::new(""));
        io::relative(&own, folder)
            .to_string_lossy()
            .replace('\\', "/")
    }

    /// Its photo, if that exists.
    pub fn photo(&self) -> Option<PathBuf> {
        photo_of(&self.label, &self.source)
    }

    fn has_file_of_its_own(&self) -> bool {
        let start = format!("{}.", self.name);
        self.source
            .file_name()
            .is_some_and(|file| file.to_string_lossy().starts_with(&start))
    }

    /// Both would have one camera file, or are of one photo. Only files that are called labels may
    /// hold several of that: of another name one is a copy.
    fn repeats(&self, other: &Self) -> bool {
        let is_named = |one: &Self| ends_with(&one.source, LABEL_SUFFIX);
        let is_of_its_photo = self.label.image.file == other.label.image.file;
        self.name == other.name || is_of_its_photo && !(is_named(self) && is_named(other))
    }
}

impl std::fmt::Display for LabelledPhoto {
    /// The file, and the picture where the file alone does not identify it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.source.display())?;
        if self.has_file_of_its_own() {
            Ok(())
        } else {
            write!(f, " ({})", self.name)
        }
    }
}

/// Reads a label (`NAME.label.json`), with its photo's EXIF focal length where it gives none
/// itself.
///
/// # Errors
/// As [`read_labels`]; a file with several labels.
pub fn read_label(path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    let mut labels = read_labels(path, None)?;
    match labels.len() {
        1 => Ok(labels.remove(0).label),
        n => Err(Error::file(path, format!("{n} labels, expected one"))),
    }
}

/// Reads the labels of a file: one of ours, or an array of them, or what LabelMe, CVAT ("for
/// images") or Label Studio (JSON or JSON-MIN) wrote. `size` is the rectangle's width and height,
/// metres, for labels without them.
///
/// # Errors
/// A file that cannot be read or understood, or is a photo instead of a label; a photo whose size
/// differs from its label's, whose pixels are not square, or whose path leads out of the label's
/// folder; two photos of one name.
pub fn read_labels(path: impl AsRef<Path>, size: Option<[f64; 2]>) -> Result<Vec<LabelledPhoto>> {
    let path = path.as_ref();
    let text = label_text(path)?;
    let annotations = import::annotations(&text).map_err(|e| e.in_file(path))?;
    labels_of(path, &text, annotations, size)
}

/// The labels of a file that was read: another program's, or else ours.
fn labels_of(
    path: &Path,
    text: &str,
    annotations: Option<Vec<Annotation>>,
    size: Option<[f64; 2]>,
) -> Result<Vec<LabelledPhoto>> {
    let labels = match annotations {
        Some(annotations) => annotations
            .iter()
            .map(|annotation| imported_label(annotation, path))
            .collect::<Result<Vec<_>>>()?,
        None => own_labels(text, path)?,
    };
    if labels.is_empty() {
        return Err(Error::file(path, "no label, expected at least one"));
    }
    let mut found = Vec::with_capacity(labels.len());
    for labelled in labels {
        push_new(&mut found, completed(labelled, size)?)?;
    }
    Ok(found)
}

/// Reads the labels of a folder in order of name, ours whatever their files are called. Files that
/// are of no label format are left out, and so are other programs' labels of photos that have one
/// of ours.
///
/// # Errors
/// As [`read_labels`]; a folder that cannot be read; a photo that is labelled twice.
pub(crate) fn labels_in(folder: &Path, size: Option<[f64; 2]>) -> Result<Vec<LabelledPhoto>> {
    labels_for(None, folder, size)
}

/// The same where one photo alone is asked for: files that cannot be used are left out, but for the
/// one that is called as it is, and so is what labels another photo once more.
pub(crate) fn labels_beside(
    name: &str,
    folder: &Path,
    size: Option<[f64; 2]>,
) -> Result<Vec<LabelledPhoto>> {
    labels_for(Some(name), folder, size)
}

/// The labels of a folder, one for each photo; all have to be right, or what concerns the photo
/// that is asked for alone.
fn labels_for(
    alone: Option<&str>,
    folder: &Path,
    size: Option<[f64; 2]>,
) -> Result<Vec<LabelledPhoto>> {
    let mut all = read_all(alone, folder, size)?;
    // Ours first: another program's does not replace it.
    all.sort_by_key(|labelled| !labelled.is_ours);
    let mut found: Vec<LabelledPhoto> = Vec::with_capacity(all.len());
    for labelled in all {
        let mut same = found.iter().filter(|other| labelled.repeats(other));
        let concerned = is_asked_for(alone, &labelled.name)
            || same.any(|other| is_asked_for(alone, &other.name));
        match push_new(&mut found, labelled) {
            Err(error) if !concerned => log::info!("{error}; skipped"),
            outcome => outcome?,
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

/// All labels of the files of a folder.
fn read_all(
    alone: Option<&str>,
    folder: &Path,
    size: Option<[f64; 2]>,
) -> Result<Vec<LabelledPhoto>> {
    let mut all = Vec::new();
    for path in label_paths(folder)? {
        match labels_if_any(&path, size) {
            Ok(Some(labels)) => all.extend(labels),
            Ok(None) => log::info!("{}: not a label", path.display()),
            Err(error) if is_asked_for(alone, &label_name(&path)) => return Err(error),
            // The photo that is asked for may be among those that it labels.
            Err(error) if may_hold_several(&path) => log::warn!("{error}; skipped"),
            Err(error) => log::info!("{error}; skipped"),
        }
    }
    Ok(all)
}

fn is_asked_for(alone: Option<&str>, name: &str) -> bool {
    alone.is_none_or(|alone| alone == name)
}

/// A file that begins as an array of labels does, or as CVAT's XML.
fn may_hold_several(path: &Path) -> bool {
    label_text(path).is_ok_and(|text| text.trim_start().starts_with(['[', '<']))
}

/// Adds a label of a photo that has none yet; leaves another program's out where one of ours is
/// there.
fn push_new(found: &mut Vec<LabelledPhoto>, labelled: LabelledPhoto) -> Result<()> {
    match found.iter().find(|other| labelled.repeats(other)) {
        None => found.push(labelled),
        Some(ours) if ours.is_ours && !labelled.is_ours => {
            let source = ours.source.display();
            log::info!("{labelled}: skipped in favour of {source}");
        }
        Some(other) => {
            let photo = stem(Path::new(&labelled.label.image.file));
            let what = format!(
                "labels {photo} again, after {other}, expected one label and one camera file per photo"
            );
            return Err(Error::file(&labelled.source, what));
        }
    }
    Ok(())
}

/// The files of a folder that may hold labels, in order of name.
fn label_paths(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = io::entries(folder)?
        .iter()
        .map(|entry| entry.path())
        .filter(|path| may_be_label(path))
        .collect();
    paths.sort();
    Ok(paths)
}

fn ends_with(path: &Path, suffix: &str) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().ends_with(suffix))
}

/// Whether a file is named as a camera file; patterns such as `*.json` match these, too.
pub fn is_called_camera(path: &Path) -> bool {
    ends_with(path, CAMERA_SUFFIX)
}

fn may_be_label(path: &Path) -> bool {
    let is_json = ends_with(path, ".json") && !is_called_camera(path);
    (is_json || ends_with(path, ".xml")) && !io::is_apple_double(path)
}

/// The labels of a file; none where it is not called a label and holds none of ours or of another
/// program.
///
/// # Errors
/// Labels of another program that are badly formed; as [`read_labels`] for a file that is called a
/// label.
fn labels_if_any(path: &Path, size: Option<[f64; 2]>) -> Result<Option<Vec<LabelledPhoto>>> {
    let is_called_one = ends_with(path, LABEL_SUFFIX);
    let text = match label_text(path) {
        Ok(text) => text,
        Err(e) if is_called_one => return Err(e),
        Err(_) => return Ok(None),
    };
    let annotations = import::annotations(&text).map_err(|e| e.in_file(path))?;
    if annotations.is_none() && !is_called_one && !is_own_label(&text) {
        return Ok(None);
    }
    labels_of(path, &text, annotations, size).map(Some)
}

/// The text is a camera that was solved from a label.
fn is_camera(text: &str) -> bool {
    text.contains(CAMERA_FORMAT)
        && io::parse_json::<Value>(text).is_ok_and(|value| value["format"] == CAMERA_FORMAT)
}

/// The text is a label of ours, or an array of them.
fn is_own_label(text: &str) -> bool {
    // Large files of other programs are not parsed once more.
    text.contains(OWN_FORMAT)
        && io::parse_json::<Value>(text)
            .is_ok_and(|value| says_where(value.get(0).unwrap_or(&value)))
}

/// A label of ours that says where its surface is; without corners and points it is a map of
/// markers, or not filled in.
fn says_where(label: &Value) -> bool {
    let (corners, points) = (&label["surface"]["corners_px"], &label["points"]);
    label["format"] == OWN_FORMAT && (corners.is_array() || points.is_array())
}

/// The text of a label; for a photo instead of one, the error says what to do.
fn label_text(path: &Path) -> Result<String> {
    io::read_text(path).map_err(|error| match io::read_header(path) {
        Err(_) => error,
        Ok(_) => photo_instead(path),
    })
}

/// The error of a photo that was given instead of its label.
fn photo_instead(photo: &Path) -> Error {
    let label = photo.with_file_name(format!("{}{LABEL_SUFFIX}", stem(photo)));
    let next = if label.is_file() {
        format!("its label is {}", label.display())
    } else {
        let photo = photo.display();
        format!("`petcomp camera init {photo} --size WIDTHxHEIGHT` writes one")
    };
    Error::file(photo, format!("a picture, expected a label; {next}"))
}

/// A label of ours, or an array of them.
fn own_labels(text: &str, path: &Path) -> Result<Vec<LabelledPhoto>> {
    if is_camera(text) {
        let what = format!("a solved camera ({CAMERA_FORMAT}), expected a label ({OWN_FORMAT})");
        return Err(Error::file(path, what));
    }
    parse_own_labels(text, path).map_err(|e| e.in_file(path))
}

fn parse_own_labels(text: &str, path: &Path) -> Result<Vec<LabelledPhoto>> {
    if !text.trim_start().starts_with('[') {
        let label = io::parse_json(text)?;
        return Ok(vec![own_label(label, label_name(path), path)?]);
    }
    let labels = io::parse_json::<Vec<Label>>(text)?.into_iter();
    // Each of several in a file goes by its photo's name.
    labels
        .map(|label| {
            let name = stem(Path::new(&label.image.file));
            own_label(label, name, path)
        })
        .collect()
}

/// A label whose photo, where it names one, lies in or below its folder.
fn own_label(label: Label, name: String, path: &Path) -> Result<LabelledPhoto> {
    if !label.image.file.is_empty() {
        io::below("", &label.image.file).map_err(|e| e.within("image"))?;
    }
    Ok(LabelledPhoto {
        label,
        source: path.into(),
        name,
        is_ours: true,
    })
}

/// `bg0001` of `bg0001.label.json`, or of `bg0001.json`.
fn label_name(path: &Path) -> String {
    let file = stem(path);
    file.strip_suffix(".label")
        .map_or(file.clone(), str::to_owned)
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default()
}

/// The label for another program's annotation, its photo searched for beside the file.
fn imported_label(annotation: &Annotation, path: &Path) -> Result<LabelledPhoto> {
    let file = annotated_file(annotation, path)?;
    if file.is_empty() {
        return Err(Error::file(path, "no picture name"));
    }
    let name = stem(Path::new(&file));
    let mut label = io::below("", &file)
        .and_then(|_| annotation.label())
        .map_err(|e| e.within(&file).in_file(path))?;
    if annotation.size.is_none() {
        fill_in_size(&mut label.image, &path.with_file_name(&file))?;
    }
    label.image.file = file;
    Ok(LabelledPhoto {
        label,
        source: path.into(),
        name,
        is_ours: false,
    })
}

/// Takes over the size of the label's photo.
fn fill_in_size(image: &mut LabelImage, photo: &Path) -> Result<()> {
    let header = io::read_header(photo)?;
    (image.width, image.height) = (header.width as u32, header.height as u32);
    Ok(())
}

/// The name of an annotation's photo: of several pictures the only one that is there, or of the
/// others that are named beside them.
fn annotated_file(annotation: &Annotation, path: &Path) -> Result<String> {
    let pictures = &annotation.pictures;
    let mut there = files_there(pictures, path);
    let count = there.len();
    if count == 0 {
        there = files_there(&annotation.others, path);
    }
    let file = match (there.as_slice(), pictures.as_slice()) {
        (&[one], _) => one,
        (_, [names]) => possible_files(names).last().unwrap_or_default(),
        (_, []) => "",
        _ => return Err(several_pictures(annotation, count).in_file(path)),
    };
    Ok(file.to_owned())
}

/// Those files of pictures that are there, each once.
fn files_there<'a>(pictures: &'a [PictureNames], path: &Path) -> Vec<&'a str> {
    let there = pictures.iter().filter_map(|names| file_there(names, path));
    let there: BTreeSet<&str> = there.collect();
    there.into_iter().collect()
}

/// The first of a picture's names that is there, in or below the folder or directly in it.
fn file_there<'a>(names: &'a [String], path: &Path) -> Option<&'a str> {
    possible_files(names).find(|name| path.with_file_name(name).is_file())
}

/// The error of an annotation that may be of several pictures, so many of which are there.
fn several_pictures(annotation: &Annotation, there: usize) -> Error {
    let names = annotation.pictures.iter().filter_map(|names| names.last());
    let names: Vec<&str> = names.map(String::as_str).collect();
    let what = format!(
        "an annotation that may be of {}, expected exactly one of them in this folder, found {there}",
        names.join(" or ")
    );
    Error::value(&annotation.at, what)
}

fn possible_files(names: &[String]) -> impl Iterator<Item = &str> {
    let names = names.iter().map(String::as_str);
    let inside = names.clone().filter(|file| io::below("", file).is_ok());
    inside.chain(names.map(|file| file.rsplit('/').next().unwrap_or_default()))
}

/// With the sides that were given where the label has none, and with its photo's EXIF data.
fn completed(mut labelled: LabelledPhoto, size: Option<[f64; 2]>) -> Result<LabelledPhoto> {
    let surface = &mut labelled.label.surface;
    if let Some(size) = size.filter(|_| !surface.has_side()) {
        surface.set_size(size);
    }
    check_size(&labelled.label).map_err(|e| e.in_file(&labelled.source))?;
    Ok(LabelledPhoto {
        label: with_photo(labelled.label, &labelled.source)?,
        ..labelled
    })
}

/// A label that was read from `path`, with the focal length of its photo's EXIF data where it gives
/// none itself; as it is where the photo is not there. Unless the label says whether the photo is
/// cropped, its EXIF data do: it is where they state another shape, and whole where they state its
/// size or an integer multiple of it.
///
/// # Errors
/// A photo that cannot be read, or has another size than the label says, or pixels that are not
/// square.
pub fn with_photo(mut label: Label, path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    let Some(photo) = photo_of(&label, path) else {
        return Ok(label);
    };
    check_inside(&label, path)?;
    let header = io::read_header(&photo)?;
    check_photo_size(&label, &photo, &header).map_err(|e| e.in_file(path))?;
    header.check_square_pixels(&photo)?;
    apply_exif(&mut label, &header);
    Ok(label)
}

/// Refuses a photo that is reached through a link out of the folder of its label.
fn check_inside(label: &Label, path: &Path) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    io::inside(folder, &label.image.file)
        .map(drop)
        .map_err(|e| e.within("image").in_file(path))
}

/// Checks that a photo has the size that its label states.
fn check_photo_size(label: &Label, photo: &Path, header: &io::Header) -> Result<()> {
    let (w, h, [width, height]) = (header.width, header.height, label.image_size());
    if [w, h] == [width as usize, height as usize] {
        return Ok(());
    }
    let photo = photo.display();
    let what = format!("{width} x {height} pixels, but {photo} has {w} x {h}");
    Err(Error::value("image", what))
}

/// Takes over what the photo's file says of its camera and the label does not.
pub(crate) fn apply_exif(label: &mut Label, header: &io::Header) {
    if header.cropped || header.whole {
        label.image.cropped.get_or_insert(header.cropped);
    }
    if label.camera.focal_px.is_none() && label.camera.focal_35mm.is_none() {
        label.camera.focal_35mm = equivalent_mm(label, header);
        let is_rough = header.digital_zoom || header.focal_by_sensor;
        if is_rough && label.camera.focal_35mm.is_some() {
            label.camera.focal_sigma.get_or_insert(ROUGH_FOCAL_SIGMA);
        }
    }
}

/// The focal length that the photo's file states, as a 35 mm camera's, where that can be right;
/// some state 0 for none.
pub(crate) fn equivalent_mm(label: &Label, header: &io::Header) -> Option<f64> {
    let mm = header.focal_35mm.unwrap_or_default();
    let plausible = plausible_equivalents(label.taken_size());
    plausible.contains(&mm).then_some(mm)
}

/// Checks that a surface with objects on it can have the label's sides, which may be in centimetres
/// by mistake.
///
/// # Errors
/// [`Error::Value`] that names the side.
pub fn check_size(label: &Label) -> Result<()> {
    check_side("surface.width_m", label.surface.width_m)?;
    check_side("surface.height_m", label.surface.height_m)
}

fn check_side(at: &str, metres: Option<f64>) -> Result<()> {
    metres.map_or(Ok(()), |metres| SURFACE.check(at, metres))
}

/// Checks that a solution's camera is near enough to see objects on the surface: how far it is
/// follows from the label's lengths.
///
/// # Errors
/// [`Solution::misfit`] where swapped width and height explain the distance; otherwise
/// [`Error::Value`] with the distance.
pub fn check_distance(solution: &Solution) -> Result<()> {
    check_camera_distance(&solution.camera).map_err(|too_far| match solution.misfit() {
        Some(
            misfit @ SolveError::NoFit {
                exchanged: Some(_), ..
            },
        ) => misfit.into(),
        _ => too_far,
    })
}

/// The same of a camera alone, as a file stores it.
pub(crate) fn check_camera_distance(camera: &Camera) -> Result<()> {
    let distance = camera.center().coords.norm();
    if CAMERA.contains(distance) {
        return Ok(());
    }
    let metres = number((1e3 * distance).round() / 1e3);
    // Another unit of the size may explain the distance.
    let question = CAMERA
        .unit_meant(distance)
        .map_or(String::new(), |unit| format!("; is the size in {unit}s?"));
    let what = format!("the camera would be {metres} m away, expected {CAMERA}{question}");
    Err(Error::value("surface", what))
}

/// The picture of a label that was read from `path`, where it is there.
pub(crate) fn photo_of(label: &Label, path: impl AsRef<Path>) -> Option<PathBuf> {
    let photo = path.as_ref().with_file_name(&label.image.file);
    (!label.image.file.is_empty() && photo.is_file()).then_some(photo)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::camera::{SolveOptions, solve};
    use crate::image::Image;
    use crate::pixel::Srgb8;
    use exif::experimental::Writer;
    use exif::{Field, In, Rational, Tag, Value};

    /// Writes a picture of 90 x 60 pixels with EXIF data.
    pub(in crate::camera) fn write_photo(
        path: &Path,
        notes: impl IntoIterator<Item = (Tag, Value)>,
    ) {
        io::write(path, &Image::<Srgb8>::new(90, 60)).unwrap();
        let field = |(tag, value)| Field {
            tag,
            ifd_num: In::PRIMARY,
            value,
        };
        let fields: Vec<Field> = notes.into_iter().map(field).collect();
        let (mut writer, mut notes) = (Writer::new(), std::io::Cursor::new(Vec::new()));
        fields.iter().for_each(|f| writer.push_field(f));
        writer.write(&mut notes, false).unwrap();
        let (mut jpeg, notes) = (std::fs::read(path).unwrap(), notes.into_inner());
        let length = (notes.len() + 8) as u16;
        jpeg.splice(
            2..2,
            [0xff, 0xe1]
                .into_iter()
                .chain(length.to_be_bytes())
                .chain(*b"Exif\0\0")
                .chain(notes),
        );
        std::fs::write(path, jpeg).unwrap();
    }

    /// The focal length of a 35 mm equivalent.
    pub(in crate::camera) fn equivalent(mm: u16) -> (Tag, Value) {
        (Tag::FocalLengthIn35mmFilm, Value::Short(vec![mm]))
    }

    /// A label of a photo of 90 x 60 pixels with EXIF data: a 35 mm equivalent of 28 mm, a digital
    /// zoom, and the size it was taken in.
    fn label_of_photo(zoom: [u32; 2], [width, height]: [u32; 2]) -> Label {
        label_by_notes([
            equivalent(28),
            (Tag::DigitalZoomRatio, rational(zoom)),
            (Tag::PixelXDimension, Value::Long(vec![width])),
            (Tag::PixelYDimension, Value::Long(vec![height])),
        ])
    }

    fn rational([num, denom]: [u32; 2]) -> Value {
        Value::Rational(vec![Rational { num, denom }])
    }

    /// A label of a photo of 90 x 60 pixels with these EXIF data.
    fn label_by_notes(notes: impl IntoIterator<Item = (Tag, Value)>) -> Label {
        let folder = tempfile::tempdir().unwrap();
        write_photo(&folder.path().join("a.jpg"), notes);
        let [label] = labels_of_photos(["a.jpg"]);
        with_photo(label, folder.path().join("a.label.json")).unwrap()
    }

    #[test]
    fn a_photo_whose_pixels_are_not_square_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.exr");
        let options = io::WriteOptions {
            canvas: io::Canvas {
                pixel_aspect: 2.0,
                ..io::Canvas::default()
            },
            ..io::WriteOptions::default()
        };
        io::write_with(&photo, &Image::<Srgb8>::new(90, 60), &options).unwrap();
        let [label] = labels_of_photos(["a.exr"]);
        let path = folder.path().join("a.label.json");
        for refused in [
            with_photo(label, &path),
            crate::camera::init_label(&photo, &path, None),
        ] {
            let told = refused.unwrap_err().to_string();
            let expected = "a.exr: pixels are 2 times as wide as high, expected square ones: \
                            resample it to square pixels first";
            assert!(told.ends_with(expected), "{told}");
        }
    }

    #[test]
    fn of_two_pictures_that_are_there_neither_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("export.json");
        let annotation = Annotation {
            pictures: ["a.jpg", "b.jpg"]
                .map(|name| vec![name.to_owned()])
                .to_vec(),
            at: "[2]".into(),
            ..Annotation::default()
        };
        let assert_refused = |there: usize| {
            let told = annotated_file(&annotation, &path).unwrap_err().to_string();
            let expected = format!(
                "export.json: [2]: an annotation that may be of a.jpg or b.jpg, \
                 expected exactly one of them in this folder, found {there}"
            );
            assert!(told.ends_with(&expected), "{told}");
        };
        assert_refused(0);
        std::fs::write(folder.path().join("b.jpg"), "").unwrap();
        assert_eq!(annotated_file(&annotation, &path).unwrap(), "b.jpg");
        std::fs::write(folder.path().join("a.jpg"), "").unwrap();
        assert_refused(2);
    }

    /// Pictures by the names of each.
    fn named(pictures: &[&[&str]]) -> Vec<PictureNames> {
        pictures
            .iter()
            .map(|names| names.iter().map(ToString::to_string).collect())
            .collect()
    }

    #[test]
    fn a_picture_that_is_there_under_another_name_is_taken_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("export.json");
        std::fs::write(folder.path().join("bg.jpg"), "").unwrap();
        // In a cloud and beside the export; uploaded twice.
        for (pictures, others) in [
            (named(&[&["9f.jpg"]]), named(&[&["9f.jpg"], &["bg.jpg"]])),
            (
                named(&[&["1-bg.jpg", "bg.jpg"], &["2-bg.jpg", "bg.jpg"]]),
                vec![],
            ),
        ] {
            let annotation = Annotation {
                pictures,
                others,
                ..Annotation::default()
            };
            assert_eq!(annotated_file(&annotation, &path).unwrap(), "bg.jpg");
        }
    }

    #[test]
    fn two_photos_of_one_name_in_a_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let labels = labels_of_photos(["left/001.png", "right/001.png"]);
        let path = folder.path().join("all.label.json");
        io::write_json(&path, &labels).unwrap();
        let refusal = read_labels(&path, None).unwrap_err().to_string();
        assert!(refusal.contains("labels 001 again"), "{refusal}");
    }

    /// Labels of photos with these names.
    fn labels_of_photos<const N: usize>(files: [&str; N]) -> [Label; N] {
        files.map(|file| {
            let mut label = Label::new([90, 60], [[0.0; 2]; 4], [0.6, 0.4]);
            label.image.file = file.into();
            label
        })
    }

    #[test]
    fn two_labels_of_ours_of_one_photo_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [label] = labels_of_photos(["a.jpg"]);
        io::write_json(folder.path().join("a.label.json"), &label).unwrap();
        let list = serde_json::json!([label]);
        for (older, content) in [
            ("old.label.json", &list),
            ("old.json", &list),
            ("old.json", &list[0]),
        ] {
            let path = folder.path().join(older);
            io::write_json(&path, content).unwrap();
            let refusal = labels_in(folder.path(), None).unwrap_err().to_string();
            let names_both = refusal.contains("a.label.json") && refusal.contains(older);
            assert!(names_both, "{refusal}");
            std::fs::remove_file(path).unwrap();
        }
    }

    #[test]
    fn labels_of_ours_are_found_whatever_their_file_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let list = labels_of_photos(["a.jpg", "b.jpg"]);
        io::write_json(folder.path().join("labels.json"), &list).unwrap();
        let [other] = labels_of_photos(["d.jpg"]);
        io::write_json(folder.path().join("c.json"), &other).unwrap();
        std::fs::write(folder.path().join("notes.json"), "[\"plane-label\"]").unwrap();
        // What `petcomp camera markers --map` takes.
        let map = r#"{"format": "plane-label", "image": {"file": "a.jpg"}, "markers": {}}"#;
        std::fs::write(folder.path().join("map.json"), map).unwrap();
        std::fs::write(folder.path().join("._c.label.json"), [0, 5, 22, 7]).unwrap();
        let found = labels_in(folder.path(), None).unwrap();
        let names: Vec<&str> = found.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["a", "b", "c"]);
    }

    #[test]
    fn a_file_that_is_no_label_stands_in_the_way_of_its_own_photo_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [label] = labels_of_photos(["a.jpg"]);
        io::write_json(folder.path().join("a.label.json"), &label).unwrap();
        std::fs::write(folder.path().join("b.label.json"), "{").unwrap();
        let found = labels_beside("a", folder.path(), None).unwrap();
        assert_eq!((found.len(), found[0].name.as_str()), (1, "a"));
        for refused in [
            labels_beside("b", folder.path(), None),
            labels_in(folder.path(), None),
        ] {
            let told = refused.unwrap_err().to_string();
            assert!(told.contains("b.label.json: "), "{told}");
        }
    }

    #[test]
    fn a_photo_that_is_labelled_twice_stands_in_its_own_way_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = labels_of_photos(["a.jpg", "b.jpg"]);
        io::write_json(folder.path().join("a.label.json"), &a).unwrap();
        io::write_json(folder.path().join("b.label.json"), &b).unwrap();
        // Of the same photo, with a name of its own.
        io::write_json(folder.path().join("copy.json"), &b).unwrap();
        io::write_json(folder.path().join("old.label.json"), &[&b]).unwrap();
        let found = labels_beside("a", folder.path(), None).unwrap();
        let names: Vec<&str> = found.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["a", "b"]);
        let refusal = labels_beside("b", folder.path(), None).unwrap_err();
        assert!(refusal.to_string().contains("labels b again"), "{refusal}");
    }

    #[test]
    fn a_broken_array_may_have_held_any_label() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("all.label.json");
        let may_hold = |text: &str| {
            std::fs::write(&path, text).unwrap();
            may_hold_several(&path)
        };
        assert!(may_hold(" [{") && may_hold("<annotations>"));
        assert!(!may_hold("{") && !may_hold(""));
    }

    #[test]
    fn a_byte_order_mark_is_no_mistake() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.label.json");
        let [label] = labels_of_photos(["a.jpg"]);
        let text = serde_json::to_string(&label).unwrap();
        std::fs::write(&path, format!("\u{feff}{text}")).unwrap();
        assert_eq!(read_label(&path).unwrap(), label);
    }

    #[test]
    fn a_photo_gives_its_focal_length() {
        let label = label_of_photo([0, 1], [4500, 3000]);
        assert_eq!(
            (
                label.camera.focal_35mm,
                label.camera.focal_sigma,
                label.image.cropped
            ),
            (Some(28.0), None, Some(false))
        );
    }

    #[test]
    fn an_impossible_focal_length_of_a_photo_is_passed_over() {
        for mm in [0, 4, 5000] {
            let label = label_by_notes([equivalent(mm)]);
            assert_eq!(label.camera.focal_35mm, None, "{mm}");
        }
    }

    #[test]
    fn exchanged_sides_come_before_the_distance_that_they_give() {
        let corners = [
            [500.0, 500.0],
            [3500.0, 502.0],
            [3501.0, 2500.0],
            [500.0, 2501.0],
        ];
        let mut label = Label::new([4000, 3000], corners, [0.4, 0.6]);
        label.camera.focal_35mm = Some(26.0);
        let solution = solve(&label, &SolveOptions::default()).unwrap();
        let refusal = check_distance(&solution).unwrap_err().to_string();
        assert!(refusal.contains("swap width_m and height_m"), "{refusal}");
    }

    #[test]
    fn a_zoomed_photo_gives_it_less_precisely() {
        let label = label_of_photo([3, 2], [4500, 3000]);
        assert_eq!(
            (label.camera.focal_35mm, label.camera.focal_sigma),
            (Some(28.0), Some(0.25))
        );
    }

    /// 180 pixels on 22.5 mm of a sensor, in a picture that was halved and states its new size.
    #[test]
    fn a_focal_length_by_the_sensor_s_resolution_is_within_its_errors_when_it_was_halved() {
        let label = label_by_notes([
            (Tag::FocalLength, rational([20, 1])),
            (Tag::FocalPlaneXResolution, rational([80, 1])),
            (Tag::FocalPlaneResolutionUnit, Value::Short(vec![3])),
            (Tag::PixelXDimension, Value::Long(vec![90])),
            (Tag::PixelYDimension, Value::Long(vec![60])),
        ]);
        let stated = label.camera.focal_35mm.unwrap();
        let truth = 20.0 * 36f64.hypot(24.0) / 22.5_f64.hypot(15.0);
        let sigmas = libm::log(stated / truth) / label.camera.focal_sigma.unwrap();
        assert!(sigmas > 1.0 && sigmas < 3.0, "{stated} mm, {truth} mm");
    }

    #[test]
    fn a_photo_of_another_shape_than_it_was_taken_in_is_cropped() {
        assert_eq!(
            label_of_photo([0, 1], [4000, 3000]).image.cropped,
            Some(true)
        );
        assert_eq!(
            label_of_photo([0, 1], [3000, 4500]).image.cropped,
            Some(false),
            "turned"
        );
        assert_eq!(
            label_of_photo([0, 1], [2205, 1470]).image.cropped,
            None,
            "reduced, or cut out in its own shape"
        );
    }
}
