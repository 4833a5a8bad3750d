//! Reads truth and detections from folders of YOLO text files.

use super::known_rows::KnownRows;
use super::{
    Detection, EvalImage, GroundTruth, Picture, check_confidence, filled_lines, in_line,
    is_confidence,
};
use crate::error::{Error, Result};
use crate::geom::{BBox, Point2};
use crate::io::{self, Format};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Ground truth of a folder of images: a sheet for each of them, without detections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct YoloTruth {
    /// In order of the images' names.
    pub sheets: Vec<EvalImage>,
    /// Width and height of each image, pixels.
    pub sizes: Vec<[u32; 2]>,
    /// The images, if they were found.
    pub pictures: Vec<Option<Picture>>,
    /// How many keypoint numbers follow the box in a label, and in a detection; they are not
    /// evaluated.
    pub keypoint_numbers: usize,
}

/// Reads `NAME.txt` in a folder of labels and its subfolders: `class cx cy w h`, as shares of the
/// image, one box per line; for outlines (`class x1 y1 x2 y2 ..`) the bounding box is used. Rows
/// with equal class, box and keypoints count once, as in training.
///
/// The images are in the folder `images` or its subfolders, by default where YOLO expects them: the
/// same path with its last `labels` replaced by `images`. An image without a label file contains no
/// objects. Sizes come from the images; if `size` is given, it applies to all of them. Overlaps do
/// not depend on it, but COCO's area ranges do.
///
/// # Errors
/// [`Error::File`] for a folder without labels or that of a whole dataset, a label without an image
/// if no `size` is given, files of the same name in several folders or with names that are not
/// UTF-8, or a bad line.
pub fn read_yolo_truth(
    labels: &Path,
    images: Option<&Path>,
    size: Option<[u32; 2]>,
) -> Result<YoloTruth> {
    read_pose_truth(labels, images, size, 0)
}

/// Like [`read_yolo_truth`], for labels with this many keypoint numbers after the box.
pub(crate) fn read_pose_truth(
    labels: &Path,
    images: Option<&Path>,
    size: Option<[u32; 2]>,
    keypoints: usize,
) -> Result<YoloTruth> {
    refuse_dataset(labels)?;
    let folder = LabelFolder::open(labels, images)?;
    if folder.labels.is_empty() {
        return Err(Error::file(labels, "no label files, expected NAME.txt"));
    }
    let names = folder.names().into_par_iter();
    let all: Vec<_> = names
        .map(|name| folder.read(name, size, keypoints))
        .collect::<Result<_>>()?;
    Ok(YoloTruth::from_images(all, keypoints))
}

/// The folder of a whole dataset has the labels of all its parts, and text files that are not labels.
fn refuse_dataset(folder: &Path) -> Result<()> {
    let is_file = |name: &&str| folder.join(name).is_file();
    let file = ["data.yaml", "dataset.json"].into_iter().find(is_file);
    let parts = [
        "labels/val",
        "labels",
        "valid/labels",
        "val/labels",
        "train/labels",
    ];
    let mut parts = parts.into_iter().map(|part| folder.join(part));
    let (Some(file), Some(labels)) = (file, parts.find(|part| part.is_dir())) else {
        return Ok(());
    };
    let what = format!(
        "a dataset (it has {file}), expected a folder of labels, such as {}",
        labels.display()
    );
    Err(Error::file(folder, what))
}

/// The ground truth of an image, its size, and the image if it was found.
struct LabelledImage {
    sheet: EvalImage,
    size: [u32; 2],
    picture: Option<Picture>,
    /// Rows of its label that are ignored as duplicates.
    repeated: usize,
}

/// Files by name without folder and extension.
type FilesByName = BTreeMap<String, PathBuf>;

/// A folder of labels and the folder of its images, whose files have the same names.
struct LabelFolder {
    labels: FilesByName,
    images: FilesByName,
    image_folder: PathBuf,
}

impl LabelFolder {
    fn open(labels: &Path, images: Option<&Path>) -> Result<Self> {
        let beside = || io::with_last_step(labels, "labels", "images");
        let image_folder = images.map_or_else(beside, Path::to_path_buf);
        let images = picture_files(&image_folder)?;
        let is_label = |path: &Path| !is_class_list(path) || images.contains_key("classes");
        Ok(Self {
            labels: text_files(labels, is_label)?,
            images,
            image_folder,
        })
    }

    /// The names of all images, in order.
    fn names(&self) -> BTreeSet<&String> {
        self.labels.keys().chain(self.images.keys()).collect()
    }

    fn read(&self, name: &str, size: Option<[u32; 2]>, keypoints: usize) -> Result<LabelledImage> {
        let [label, image] =
            [&self.labels, &self.images].map(|files| files.get(name).map(PathBuf::as_path));
        let size = match (size, image) {
            (Some(size), _) => size,
            (None, Some(image)) => image_size(image)?,
            (None, None) => return Err(self.missing_image(name)),
        };
        let truth = truth_of(label, size, keypoints)?;
        let sheet = EvalImage {
            group: sequence_beside(image, label),
            ..EvalImage::new(name, truth.boxes)
        };
        Ok(LabelledImage {
            sheet,
            size,
            picture: image.map(|path| picture_of(path.into(), size)),
            repeated: truth.repeated,
        })
    }

    /// The error for a label without an image.
    fn missing_image(&self, name: &str) -> Error {
        let label = self.labels[name].display();
        let what = format!(
            "no image \"{name}\" (.jpg, .png, ..) for {label} to take the size from; give their folder (--images) or their size (--size)"
        );
        Error::file(&self.image_folder, what)
    }
}

/// The ground truth of images, each with its label where YOLO expects it: the same path with its
/// last `images` replaced by `labels`. An image without a label file contains no objects.
///
/// # Errors
/// [`Error::File`] for an image that cannot be read, or a bad line.
pub fn read_yolo_truth_of(images: &[PathBuf]) -> Result<YoloTruth> {
    read_pose_truth_of(images, 0)
}

/// Like [`read_yolo_truth_of`], for labels with this many keypoint numbers after the box.
pub(crate) fn read_pose_truth_of(images: &[PathBuf], keypoints: usize) -> Result<YoloTruth> {
    let all = images.par_iter().map(|image| read_image(image, keypoints));
    let all = all.collect::<Result<_>>()?;
    Ok(YoloTruth::from_images(all, keypoints))
}

fn read_image(image: &Path, keypoints: usize) -> Result<LabelledImage> {
    let size = image_size(image)?;
    let label = Some(label_of(image)).filter(|label| label.exists());
    let truth = truth_of(label.as_deref(), size, keypoints)?;
    let name = image.file_stem().unwrap_or_default().to_string_lossy();
    let sheet = EvalImage {
        group: sequence_beside(Some(image), None),
        ..EvalImage::new(name, truth.boxes)
    };
    Ok(LabelledImage {
        sheet,
        size,
        picture: Some(picture_of(image.into(), size)),
        repeated: truth.repeated,
    })
}

/// What eval needs from a sidecar written by petcomp: whether the picture is part of a belt sequence.
#[derive(Deserialize)]
struct Sidecar {
    scene: SidecarScene,
}

#[derive(Deserialize)]
struct SidecarScene {
    belt: Option<SidecarBelt>,
}

#[derive(Deserialize)]
struct SidecarBelt {
    sequence: u64,
}

/// The belt sequence of an image, prefixed with the folder of its sidecars, found by the sidecar
/// that belongs to the image or its label; empty for any other image.
fn sequence_beside(image: Option<&Path>, label: Option<&Path>) -> String {
    let sidecar =
        |path: &Path, step| io::with_last_step(path, step, "scenes").with_extension("json");
    let by_image = image.map(|path| sidecar(path, "images"));
    let by_label = label.map(|path| sidecar(path, "labels"));
    // Usually the same file.
    let by_label = by_label.filter(|path| by_image.as_ref() != Some(path));
    let mut sidecars = [by_image, by_label].into_iter().flatten();
    sidecars
        .find_map(|path| sequence_in(&path))
        .unwrap_or_default()
}

/// None for a JSON that is not the sidecar of a belt's picture.
fn sequence_in(sidecar: &Path) -> Option<String> {
    let belt = io::read_json_data::<Sidecar>(sidecar).ok()?.scene.belt?;
    let folder = sidecar.parent().unwrap_or(Path::new("")).display();
    Some(format!("{folder}/{}", belt.sequence))
}

/// Where YOLO expects the label of an image: its path with the last `images` replaced by `labels`.
pub fn label_of(image: &Path) -> PathBuf {
    io::with_last_step(image, "images", "labels").with_extension("txt")
}

/// The list of class names that LabelImg writes next to its labels.
pub(crate) fn is_class_list(path: &Path) -> bool {
    path.ends_with("classes.txt")
}

/// Extensions of the images that Ultralytics 8.4 accepts, whether petcomp reads them or not.
const TRAINED_EXTENSIONS: [&str; 13] = [
    "avif", "bmp", "dng", "heic", "heif", "jp2", "jpeg", "jpg", "mpo", "png", "tif", "tiff", "webp",
];

/// Whether a trainer treats a file as an image, judged by its name.
pub(crate) fn is_image(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|e| TRAINED_EXTENSIONS.contains(&e.as_str()))
}

/// Whether a file name is that of an image, for a trainer or for petcomp.
pub(super) fn is_picture(path: &Path) -> bool {
    is_image(path) || Format::from_extension(path).is_some()
}

/// Empty if there is no label file.
fn truth_of(label: Option<&Path>, size: [u32; 2], keypoints: usize) -> Result<LabelTruth> {
    label.map_or_else(
        || Ok(LabelTruth::default()),
        |label| read_truth(label, size, keypoints),
    )
}

fn picture_of(path: PathBuf, size: [u32; 2]) -> Picture {
    Picture {
        path,
        size: size.map(f64::from),
    }
}

/// Adds detections from `NAME.txt` in a folder and its subfolders: `class cx cy w h confidence`,
/// optionally followed by a track id.
///
/// An image without a file has no detections; a file without an image is an error, since its name
/// may be misspelt.
///
/// # Errors
/// [`Error::File`] for a folder that cannot be read, a name that is missing from the truth or
/// ambiguous there, files of the same name in several folders or with names that are not UTF-8, or
/// a bad line.
pub fn read_yolo_detections(folder: &Path, truth: &mut YoloTruth) -> Result<()> {
    let (known, files) = (truth.places_by_name()?, text_files(folder, |_| true)?);
    if files.is_empty() {
        let folder = folder.display();
        log::warn!("{folder}: no NAME.txt, so there are no detections in any image");
    }
    let found: Vec<(usize, Vec<Detection>)> = files
        .par_iter()
        .map(|(name, path)| {
            let &i = known
                .get(name.as_str())
                .ok_or_else(|| Error::file(path, no_image(name, known.len())))?;
            let keypoints = truth.keypoint_numbers;
            Ok((i, read_detections(path, truth.sizes[i], keypoints)?))
        })
        .collect::<Result<_>>()?;
    for (i, found) in found {
        truth.sheets[i].found = found;
    }
    Ok(())
}

impl YoloTruth {
    fn from_images(images: Vec<LabelledImage>, keypoint_numbers: usize) -> Self {
        let mut truth = Self {
            keypoint_numbers,
            ..Self::default()
        };
        warn_repeated(&images);
        for image in images {
            truth.sheets.push(image.sheet);
            truth.sizes.push(image.size);
            truth.pictures.push(image.picture);
        }
        truth
    }

    fn places_by_name(&self) -> Result<BTreeMap<&str, usize>> {
        let mut places = BTreeMap::new();
        for (place, sheet) in self.sheets.iter().enumerate() {
            if let Some(first) = places.insert(sheet.image.as_str(), place) {
                return Err(same_name(self.path_of(place), self.path_of(first)));
            }
        }
        Ok(places)
    }

    /// The path of an image, if known.
    fn path_of(&self, place: usize) -> &Path {
        let picture = self.pictures.get(place).and_then(Option::as_ref);
        let name = Path::new(&self.sheets[place].image);
        picture.map_or(name, |picture| picture.path.as_path())
    }
}

fn warn_repeated(images: &[LabelledImage]) {
    let count: usize = images.iter().map(|image| image.repeated).sum();
    if let Some(first) = images.iter().find(|image| image.repeated > 0) {
        let name = &first.sheet.image;
        log::warn!(
            "labels: rows with the same class, box and keypoints count once, as in training: {count} are ignored, the first in image \"{name}\""
        );
    }
}

/// The error for a name that no image has.
pub(super) fn no_image(name: &str, count: usize) -> String {
    format!("no image \"{name}\" in the truth of {count} images")
}

fn read_truth(path: &Path, size: [u32; 2], keypoints: usize) -> Result<LabelTruth> {
    let rows = parse_truth(&io::read_text(path)?, size, keypoints);
    rows.map_err(|what| Error::file(path, what))
}

fn read_detections(path: &Path, size: [u32; 2], keypoints: usize) -> Result<Vec<Detection>> {
    let rows = parse_detections(&io::read_text(path)?, size, keypoints);
    rows.map_err(|what| Error::file(path, what))
}

/// The parsed value, or what is wrong with the text.
type Parsed<T> = std::result::Result<T, String>;

/// The content of a label.
#[derive(Debug, Default, PartialEq)]
struct LabelTruth {
    boxes: Vec<GroundTruth>,
    /// Rows that are ignored, as trainers do: each repeats class, box and keypoints of an earlier one.
    repeated: usize,
}

fn parse_truth(text: &str, size: [u32; 2], keypoints: usize) -> Parsed<LabelTruth> {
    let mut rows = parse_rows(text, 0, keypoints)?;
    let (count, mut known) = (rows.len(), KnownRows::default());
    rows.retain(|row| known.insert(row.numbers()));
    let boxes = rows.iter();
    let boxes = boxes.map(|row| GroundTruth::new(row.class, row.bbox(size)));
    Ok(LabelTruth {
        boxes: boxes.collect(),
        repeated: count - rows.len(),
    })
}

/// Parses lines that have a confidence at the end.
fn parse_detections(text: &str, size: [u32; 2], keypoints: usize) -> Parsed<Vec<Detection>> {
    let rows = parse_rows(text, 1, keypoints)?.into_iter();
    let found = rows.map(|row| Detection::new(row.class, row.bbox(size), row.confidence));
    Ok(found.collect())
}

/// The sheet of a label text and a detection text, for the fuzzers.
pub(crate) fn sheet_of(truth: &str, found: &str, size: [u32; 2]) -> Parsed<EvalImage> {
    let truth = parse_truth(truth, size, 0)?.boxes;
    Ok(EvalImage {
        found: parse_detections(found, size, 0)?,
        ..EvalImage::new("", truth)
    })
}

/// The wanted text files below a folder.
fn text_files(folder: &Path, is_wanted: impl Fn(&Path) -> bool) -> Result<FilesByName> {
    let is_text = |path: &Path| path.extension().is_some_and(|e| e == "txt");
    let is_wanted = |path: &Path| is_text(path) && is_wanted(path);
    by_name(io::files_below(folder, is_wanted, usize::MAX)?)
}

/// The pictures below a folder; none if the folder does not exist.
fn picture_files(folder: &Path) -> Result<FilesByName> {
    if !folder.is_dir() {
        return Ok(FilesByName::new());
    }
    let mut paths = io::files_below(folder, is_picture, usize::MAX)?;
    // For equal names JPEG and PNG come first, since a page can show them directly, and unreadable
    // formats last.
    paths.sort_by_cached_key(|path| {
        let format = Format::from_extension(path);
        let is_shown = matches!(format, Some(Format::Jpeg | Format::Png));
        (!is_shown, format.is_none(), path.clone())
    });
    by_name(paths)
}

/// Files by the name that an image and its label share.
///
/// Of files with the same name in one folder the first counts; in different folders they belong to
/// different images that cannot be distinguished.
fn by_name(paths: Vec<PathBuf>) -> Result<FilesByName> {
    let mut files = FilesByName::new();
    for path in paths {
        match files.entry(io::stem_text(&path)?.to_owned()) {
            Entry::Vacant(place) => {
                place.insert(path);
            }
            Entry::Occupied(first) if first.get().parent() == path.parent() => {}
            Entry::Occupied(first) => return Err(same_name(&path, first.get())),
        }
    }
    Ok(files)
}

fn same_name(path: &Path, first: &Path) -> Error {
    let first = first.display();
    let what = format!(
        "the same name as {first}, expected another: folders do not distinguish images; for several runs, give each one's own folder"
    );
    Error::file(path, what)
}

fn image_size(image: &Path) -> Result<[u32; 2]> {
    let header = io::read_header(image)?;
    Ok([header.width as u32, header.height as u32])
}

/// A line: class, box as shares of the image, keypoints and confidence.
struct LabelRow {
    class: u32,
    shares: BBox,
    keypoints: Vec<f64>,
    confidence: f64,
}

/// Boxes may extend beyond the image, but not by more than this many times its side.
const MAX_SHARE: f64 = 10.0;

/// Numbers of a box: `cx cy w h`.
const BOX_NUMBERS: usize = 4;

/// Lines with `extra` numbers (a confidence or none) at their end.
fn parse_rows(text: &str, extra: usize, keypoints: usize) -> Parsed<Vec<LabelRow>> {
    filled_lines(text)
        .map(|(i, line)| parse_row(line, extra, keypoints).map_err(|what| in_line(i, &what)))
        .collect()
}

fn parse_row(line: &str, extra: usize, keypoints: usize) -> Parsed<LabelRow> {
    let mut words = line.split_ascii_whitespace();
    let class = parse_class(words.next().unwrap_or_default())?;
    let mut numbers = words.map(parse_finite).collect::<Parsed<Vec<f64>>>()?;
    let keypoints = take_keypoints(&mut numbers, extra, keypoints)?;
    let (place, rest) = split_extra(&numbers, extra)?;
    check_shares(place)?;
    let shares = box_around(place).ok_or_else(|| too_few(&numbers, extra))?;
    let confidence = rest.first().copied().unwrap_or(1.0);
    check_confidence(confidence)
        .map_err(|what| format!("{what}; is it a track id? (save_conf=True)"))?;
    Ok(LabelRow {
        class,
        shares,
        keypoints,
        confidence,
    })
}

/// Removes the keypoint numbers that follow the box; a row may omit them.
fn take_keypoints(numbers: &mut Vec<f64>, extra: usize, keypoints: usize) -> Parsed<Vec<f64>> {
    // A confidence may be followed by a track id.
    let ends = |behind: usize| (extra..=2 * extra).contains(&behind);
    let is_box = numbers.len().checked_sub(BOX_NUMBERS).is_some_and(ends);
    if keypoints == 0 || is_box {
        return Ok(Vec::new());
    }
    let behind = numbers.len().checked_sub(BOX_NUMBERS + keypoints);
    if !behind.is_some_and(ends) {
        let count = numbers.len();
        let confidence = if extra == 0 {
            ""
        } else {
            ", and a confidence (save_conf=True)"
        };
        return Err(format!(
            "{count} numbers after the class, expected cx cy w h and {keypoints} of keypoints (kpt_shape){confidence}"
        ));
    }
    let taken = numbers.drain(BOX_NUMBERS..BOX_NUMBERS + keypoints);
    Ok(taken.collect())
}

/// The numbers of the box or outline, and those after them.
fn split_extra(numbers: &[f64], extra: usize) -> Parsed<(&[f64], &[f64])> {
    let extra = extra + usize::from(extra > 0 && has_track_id(numbers));
    let count = numbers.len().checked_sub(extra);
    let count = count.ok_or_else(|| too_few(numbers, extra))?;
    Ok(numbers.split_at(count))
}

/// Whether a tracker wrote them: the numbers of the box or outline, an even count, then `confidence
/// id`.
fn has_track_id(numbers: &[f64]) -> bool {
    match *numbers {
        [_, _, _, _, .., confidence, id] if numbers.len().is_multiple_of(2) => {
            is_confidence(confidence) && id >= 1.0 && id.fract() == 0.0
        }
        _ => false,
    }
}

/// An integer, also as `numpy.savetxt` writes one: `0.000000000000000000e+00`.
pub(crate) fn parse_class(text: &str) -> Parsed<u32> {
    let number = text.parse::<f64>().ok();
    let is_class = |n: &f64| n.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(n);
    let class = number.filter(is_class).map(|n| n as u32);
    class.ok_or_else(|| format!("class {text}, expected an integer from 0"))
}

fn parse_finite(word: &str) -> Parsed<f64> {
    match word.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("\"{word}\", expected a number")),
    }
}

/// Fails for pixels instead of shares, and for a box with a negative side.
fn check_shares(place: &[f64]) -> Parsed<()> {
    if let Some(far) = place.iter().find(|share| share.abs() > MAX_SHARE) {
        return Err(format!(
            "{far}, expected a fraction of the image, 0 to 1; is it in pixels?"
        ));
    }
    match *place {
        [_, _, w, h] if w < 0.0 || h < 0.0 => {
            Err(format!("a box of {w} x {h}, expected sides of at least 0"))
        }
        _ => Ok(()),
    }
}

/// The box of `cx cy w h`, or around an outline; none for other counts of numbers.
fn box_around(place: &[f64]) -> Option<BBox> {
    match *place {
        [cx, cy, w, h] => Some(centered_box([cx, cy], [w, h])),
        _ if place.len() >= 6 && place.len().is_multiple_of(2) => {
            let points = place.chunks_exact(2);
            Some(BBox::around(points.map(|p| Point2::new(p[0], p[1]))))
        }
        _ => None,
    }
}

fn centered_box([cx, cy]: [f64; 2], [w, h]: [f64; 2]) -> BBox {
    BBox {
        x0: cx - w / 2.0,
        y0: cy - h / 2.0,
        x1: cx + w / 2.0,
        y1: cy + h / 2.0,
    }
}

fn too_few(numbers: &[f64], extra: usize) -> String {
    let expected = if extra == 0 {
        "cx cy w h, or an outline"
    } else {
        "cx cy w h confidence"
    };
    format!(
        "{} numbers after the class, expected {expected}",
        numbers.len()
    )
}

impl LabelRow {
    /// All numbers that distinguish the object from those of other rows.
    fn numbers(&self) -> impl Iterator<Item = f64> {
        let BBox { x0, y0, x1, y1 } = self.shares;
        let place = [f64::from(self.class), x0, y0, x1, y1].into_iter();
        place.chain(self.keypoints.iter().copied())
    }

    fn bbox(&self, size: [u32; 2]) -> BBox {
        let ([w, h], shares) = (size.map(f64::from), self.shares);
        BBox {
            x0: shares.x0 * w,
            y0: shares.y0 * h,
            x1: shares.x1 * w,
            y1: shares.y1 * h,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::tests::bbox;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        folder
    }

    const BOX: &str = "0 0.5 0.5 1 1\n";

    #[test]
    fn labels_and_detections_may_lie_in_folders_below() {
        let labels = folder(&[
            ("a.txt", BOX),
            ("room1/b.txt", BOX),
            ("room1/classes.txt", "x"),
        ]);
        let mut truth = read_yolo_truth(labels.path(), None, Some([9, 9])).unwrap();
        let found = folder(&[("labels/b.txt", "0 0.5 0.5 1 1 0.25\n")]);
        read_yolo_detections(found.path(), &mut truth).unwrap();
        let counts = truth.sheets.iter().map(|sheet| {
            let counts = (sheet.truth.len(), sheet.found.len());
            (sheet.image.as_str(), counts)
        });
        assert_eq!(Vec::from_iter(counts), [("a", (1, 0)), ("b", (1, 1))]);
    }

    #[test]
    fn a_whole_dataset_is_no_folder_of_labels() {
        for file in ["data.yaml", "dataset.json"] {
            let flat = folder(&[(file, ""), ("a.txt", BOX)]);
            assert!(read_yolo_truth(flat.path(), None, Some([9, 9])).is_ok());
            let set = folder(&[(file, ""), ("labels/val/a.txt", BOX)]);
            let told = read_yolo_truth(set.path(), None, Some([9, 9])).unwrap_err();
            let (told, labels) = (told.to_string(), set.path().join("labels/val"));
            assert!(told.contains(file), "{told}");
            assert!(told.ends_with(&labels.display().to_string()), "{told}");
        }
    }

    #[test]
    fn images_of_one_name_are_refused_and_files_of_one_image_are_not() {
        let labels = folder(&[("a.txt", BOX), ("room1/a.txt", BOX)]);
        let told = read_yolo_truth(labels.path(), None, Some([9, 9])).unwrap_err();
        let told = told.to_string();
        assert!(
            told.contains("room1/a.txt: the same name as ") && told.contains("/a.txt, expected")
        );
        assert!(told.ends_with("give each one's own folder"), "{told}");
        let labels = folder(&[("a.txt", BOX)]);
        let images = folder(&[("a.jpg", ""), ("a.heic", "")]);
        let truth = read_yolo_truth(labels.path(), Some(images.path()), Some([9, 9])).unwrap();
        let picture = truth.pictures[0].as_ref().unwrap();
        assert!(picture.path.ends_with("a.jpg"));
        std::fs::create_dir(images.path().join("room1")).unwrap();
        std::fs::write(images.path().join("room1/a.jpg"), "").unwrap();
        let told = read_yolo_truth(labels.path(), Some(images.path()), Some([9, 9])).unwrap_err();
        assert!(
            told.to_string().contains("room1/a.jpg: the same name as "),
            "{told}"
        );
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn names_that_are_no_text_are_refused_and_not_taken_for_each_other() {
        use std::os::unix::ffi::OsStrExt;
        let labels = folder(&[("a.txt", BOX)]);
        for name in [&b"\xfe.txt"[..], b"\xff.txt"] {
            let odd = std::ffi::OsStr::from_bytes(name);
            std::fs::write(labels.path().join(odd), BOX).unwrap();
        }
        let told = read_yolo_truth(labels.path(), None, Some([9, 9])).unwrap_err();
        assert!(told.to_string().contains("not UTF-8"), "{told}");
    }

    #[test]
    fn boxes_and_outlines_become_pixels() {
        let labels = folder(&[
            ("a.txt", "1 0.5 0.5 0.2 0.4\n\n2 0 0 0.5 0 0.5 0.25\n"),
            ("b.txt", ""),
        ]);
        let truth = read_yolo_truth(labels.path(), None, Some([100, 200])).unwrap();
        let boxes = [0, 1].map(|i| truth.sheets[0].truth[i].bbox);
        let expected = [bbox(40.0, 60.0, 20.0, 80.0), bbox(0.0, 0.0, 50.0, 50.0)];
        assert_eq!(boxes, expected);
        let empty = &truth.sheets[1];
        assert_eq!((empty.image.as_str(), empty.truth.len()), ("b", 0));
    }

    #[test]
    fn detections_come_with_confidence_and_may_be_missing() {
        let labels = folder(&[("a.txt", "1 0.5 0.5 0.2 0.4\n"), ("b.txt", BOX)]);
        let mut truth = read_yolo_truth(labels.path(), None, Some([100, 200])).unwrap();
        let found = folder(&[("b.txt", "0 0.5 0.5 1 1 0.25\n")]);
        read_yolo_detections(found.path(), &mut truth).unwrap();
        let [none, one] = [0, 1].map(|i| &truth.sheets[i].found);
        assert_eq!((none.len(), one[0].confidence), (0, 0.25));
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_class() {
        let labels = folder(&[("a.txt", "\u{feff}3 0.5 0.5 0.2 0.4\n")]);
        let found = folder(&[("a.txt", "\u{feff}3 0.5 0.5 0.2 0.4 0.9\n")]);
        let mut truth = read_yolo_truth(labels.path(), None, Some([100, 200])).unwrap();
        read_yolo_detections(found.path(), &mut truth).unwrap();
        let sheet = &truth.sheets[0];
        assert_eq!((sheet.truth[0].class, sheet.found[0].class), (3, 3));
    }

    #[test]
    fn lines_may_end_as_on_any_system() {
        for end in ["\n", "\r\n", "\r"] {
            let rows = [
                "0 0.5 0.5 0.2 0.4",
                "",
                "1 0.2 0.2 0.1 0.1",
                "2 0.8 0.8 0.1 0.1",
            ]
            .join(end);
            let classes = |text: &str| {
                let sheet = sheet_of(text, "", [10, 10])?;
                Ok::<Vec<u32>, String>(sheet.truth.iter().map(|b| b.class).collect())
            };
            assert_eq!(classes(&rows).unwrap(), [0, 1, 2], "{end:?}");
            let said = classes(&rows.replace("2 0.8", "2 x")).unwrap_err();
            assert!(said.starts_with("line 4: "), "{said}");
        }
    }

    #[test]
    fn the_id_of_a_track_is_no_confidence() {
        let parsed = |line: &str| parse_detections(line, [10, 10], 0);
        let said = "line 1: 7, expected a confidence, 0 to 1; is it a track id? (save_conf=True)";
        assert_eq!(parsed("0 0.5 0.5 0.2 0.2 7").unwrap_err(), said);
        let tracked = parsed("0 0.5 0.5 0.2 0.2 0.25 7").unwrap();
        assert_eq!(tracked, parsed("0 0.5 0.5 0.2 0.2 0.25").unwrap());
        let outline = "0 0.2 0.2 0.4 0.2 0.4 0.4 0.9";
        assert_eq!(
            parsed(&format!("{outline} 7")).unwrap(),
            parsed(outline).unwrap()
        );
        for bad in ["0 0.5 0.5 0.2 0.2 7 0.25", "0 0.1 0.1 0.2 0.2 0.3 0.25"] {
            let told = parsed(bad).unwrap_err();
            assert!(told.contains("6 numbers after the class"), "{told}");
        }
    }

    #[test]
    fn keypoints_behind_a_box_are_left_aside() {
        let (place, size) = ("1 0.5 0.5 0.2 0.4", [10, 10]);
        let truth = |points: &str| parse_truth(&format!("{place} {points}"), size, 6);
        let boxes = parse_truth(place, size, 0);
        assert_eq!(truth("0.1 0.2 2 0.9 0.8 1"), boxes);
        assert_eq!(truth(""), boxes);
        let expected =
            "line 1: 6 numbers after the class, expected cx cy w h and 6 of keypoints (kpt_shape)";
        assert_eq!(truth("0.1 0.2").unwrap_err(), expected);
        let found = |points: &str, end: &str| {
            let line = format!("{place} {points} {end}");
            parse_detections(&line, size, 6).unwrap()
        };
        for end in ["0.25", "0.25 7"] {
            assert_eq!(found("0.1 0.2 0.9 0.9 0.8 0.7", end), found("", "0.25"));
        }
        let unsure = parse_detections(&format!("{place} 0.1 0.2 2 0.9 0.8 1"), size, 6);
        let expected = "line 1: 10 numbers after the class, expected cx cy w h and 6 of keypoints (kpt_shape), and a confidence (save_conf=True)";
        assert_eq!(unsure.unwrap_err(), expected);
    }

    #[test]
    fn repeated_rows_are_one_object() {
        let counts = |text: &str, keypoints| {
            let truth = parse_truth(text, [10, 10], keypoints).unwrap();
            (truth.boxes.len(), truth.repeated)
        };
        let other_class = "1 0.5 0.5 0.2 0.4";
        let rows = format!("0 0.5 0.5 0.2 0.4\n{other_class}\n0 0.50 0.5 0.2 0.4\n");
        assert_eq!(counts(&rows, 0), (2, 1));
        let place = "0 0.5 0.5 0.2 0.4";
        let poses = format!("{place} 0.1 0.2\n{place} 0.1 0.3\n{place} 0.1 0.2\n");
        assert_eq!(counts(&poses, 2), (2, 1));
    }

    #[test]
    fn frames_of_a_belt_are_grouped_by_their_sidecars() {
        let scene =
            |belt: &str| format!(r#"{{"index": 3, "scene": {{"image": [8, 6], "belt": {belt}}}}}"#);
        let [frame, still] = [r#"{"sequence": 4, "frame": 0}"#, "null"].map(scene);
        let set = folder(&[
            ("labels/val/a.txt", BOX),
            ("labels/val/b.txt", BOX),
            ("labels/val/c.txt", BOX),
            ("scenes/val/a.json", frame.as_str()),
            ("scenes/val/b.json", still.as_str()),
        ]);
        let labels = set.path().join("labels/val");
        let truth = read_yolo_truth(&labels, None, Some([9, 9])).unwrap();
        let groups = truth.sheets.iter().map(|sheet| sheet.group.as_str());
        let groups: Vec<&str> = groups.collect();
        assert!(groups[0].ends_with("scenes/val/4"), "{groups:?}");
        assert_eq!(groups[1..], ["", ""]);
    }

    #[test]
    fn bad_lines_are_named() {
        let said = |line: &str| {
            let labels = folder(&[("a.txt", line)]);
            read_yolo_truth(labels.path(), None, Some([9, 9]))
                .unwrap_err()
                .to_string()
        };
        assert!(said("0 0.5 0.5 0.1\n").contains("a.txt: line 1: 3 numbers after the class"));
        assert!(said("0 0.5 0.5 0.1 0.1\ncap 0 0 0 0\n").contains("line 2: class cap, expected"));
        assert!(said("0 0.5 NaN 0.1 0.1").contains("\"NaN\", expected a number"));
        assert!(said("0 0.5 1e999 0.1 0.1").contains("\"1e999\", expected a number"));
        assert!(
            said("0 320 240 100 80")
                .contains("320, expected a fraction of the image, 0 to 1; is it in pixels?")
        );
        assert!(
            said("0 0.5 0.5 -0.1 0.1")
                .contains("a box of -0.1 x 0.1, expected sides of at least 0")
        );
        for class in ["4294967296", "-1", "0.5", "inf"] {
            let expected = format!("class {class}, expected an integer from 0");
            assert!(said(&format!("{class} 0.5 0.5 0.1 0.1")).contains(&expected));
        }
    }

    #[test]
    fn a_class_may_be_written_as_a_float() {
        for class in ["2", "2.0", "2.000000000000000000e+00"] {
            let labels = folder(&[("a.txt", &format!("{class} 0.5 0.5 0.1 0.1"))]);
            let truth = read_yolo_truth(labels.path(), None, Some([9, 9])).unwrap();
            assert_eq!(truth.sheets[0].truth[0].class, 2);
        }
    }

    #[test]
    fn a_detection_for_an_unknown_image_is_refused() {
        let labels = folder(&[("a.txt", "")]);
        let mut truth = read_yolo_truth(labels.path(), None, Some([9, 9])).unwrap();
        let said = read_yolo_detections(folder(&[("c.txt", "")]).path(), &mut truth)
            .unwrap_err()
            .to_string();
        assert!(said.contains("no image \"c\""), "{said}");
    }

    #[test]
    fn sizes_come_from_the_images_beside_the_labels() {
        let root = tempfile::tempdir().unwrap();
        for part in ["labels/val", "images/val"] {
            std::fs::create_dir_all(root.path().join(part)).unwrap();
        }
        std::fs::write(root.path().join("labels/val/a.txt"), "0 0.5 0.5 1 1\n").unwrap();
        let labels = root.path().join("labels/val");
        assert!(
            read_yolo_truth(&labels, None, None)
                .unwrap_err()
                .to_string()
                .contains("to take the size from")
        );
        let image = crate::Image::filled(8, 6, crate::LinearRgb::WHITE);
        io::write(root.path().join("images/val/a.png"), &image).unwrap();
        assert_eq!(
            read_yolo_truth(&labels, None, None).unwrap().sizes,
            [[8, 6]]
        );
    }

    /// A set of photos as written by a camera and a labelling program: one file name in capitals,
    /// one image without objects and hence without a label file.
    fn photo_set(images: &str) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for folder in ["labels/val", images] {
            std::fs::create_dir_all(root.path().join(folder)).unwrap();
        }
        let label = root.path().join("labels/val/IMG_1.txt");
        std::fs::write(label, "0 0.5 0.5 1 1\n").unwrap();
        let image = crate::Image::filled(8, 6, crate::LinearRgb::WHITE);
        let list = root.path().join("labels/val/classes.txt");
        std::fs::write(list, "cap\nnone\n").unwrap();
        for name in ["IMG_1.JPG", "IMG_2.tiff", "notes.md"] {
            let path = root.path().join(images).join(name);
            match name {
                "notes.md" => std::fs::write(path, "").unwrap(),
                _ => io::write(path, &image).unwrap(),
            }
        }
        root
    }

    #[test]
    fn an_image_without_a_label_file_shows_nothing_and_can_have_false_alarms() {
        let root = photo_set("images/val");
        let mut truth = read_yolo_truth(&root.path().join("labels/val"), None, None).unwrap();
        let counts: Vec<_> = truth
            .sheets
            .iter()
            .map(|sheet| (sheet.image.as_str(), sheet.truth.len()))
            .collect();
        assert_eq!(counts, [("IMG_1", 1), ("IMG_2", 0)]);
        assert_eq!(truth.sizes, [[8, 6]; 2]);
        let found = folder(&[("IMG_2.txt", "0 0.5 0.5 1 1 0.25\n")]);
        read_yolo_detections(found.path(), &mut truth).unwrap();
        assert_eq!(truth.sheets[1].found.len(), 1);
    }

    #[test]
    fn images_may_lie_anywhere() {
        let root = photo_set("photos");
        let (labels, images) = (root.path().join("labels/val"), root.path().join("photos"));
        let said = read_yolo_truth(&labels, None, None)
            .unwrap_err()
            .to_string();
        assert!(said.contains("images/val: no image \"IMG_1\""), "{said}");
        assert!(said.contains("labels/val/IMG_1.txt to take"), "{said}");
        let truth = read_yolo_truth(&labels, Some(&images), None).unwrap();
        assert_eq!(truth.sizes, [[8, 6]; 2]);
        assert!(truth.pictures.iter().all(Option::is_some));
    }

    #[test]
    fn an_image_of_a_kind_that_is_not_read_is_named() {
        let root = photo_set("images/val");
        let image = root.path().join("images/val/IMG_3.webp");
        std::fs::write(image, b"RIFF\x10\0\0\0WEBPVP8 ").unwrap();
        let told = read_yolo_truth(&root.path().join("labels/val"), None, None);
        let told = told.unwrap_err().to_string();
        assert!(told.contains("IMG_3.webp: is WebP"), "{told}");
    }
}
