//! Labels from files, with what their photos know.

use super::label::Label;
use super::solution::Solution;
use crate::bounds::{CAMERA, SURFACE, number};
use crate::error::{Error, Result};
use crate::io;
use std::path::{Path, PathBuf};

/// Relative noise of a focal length that was noted together with a digital zoom.
const ZOOMED_SIGMA: f64 = 0.25;

/// Reads a label (`NAME.label.json`), with what its photo knows of the focal length where it says nothing itself.
///
/// # Errors
/// A file that cannot be read or understood; a photo that does not lie with its label, or has another size than it says.
pub fn read_label(path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    let label: Label = io::read_json(path)?;
    check_size(&label).map_err(|e| e.in_file(path))?;
    if !label.image.file.is_empty() {
        io::below("", &label.image.file).map_err(|e| e.within("image").in_file(path))?;
    }
    with_photo(label, path)
}

/// A label that was read from `path`, with the focal length of its photo's EXIF data where it says nothing itself; as it
/// is where the photo is not there. A photo of another shape than its EXIF data tell of counts as cropped.
///
/// # Errors
/// A photo that cannot be read, or has another size than the label says.
pub fn with_photo(mut label: Label, path: impl AsRef<Path>) -> Result<Label> {
    let path = path.as_ref();
    let Some(photo) = photo_of(&label, path) else { return Ok(label) };
    let folder = path.parent().unwrap_or(Path::new(""));
    io::inside(folder, &label.image.file).map_err(|e| e.within("image").in_file(path))?;
    let header = io::read_header(&photo)?;
    let (seen, told) = ([header.width, header.height], label.image_size().map(|side| side as usize));
    if seen != told {
        let what = format!("{told:?} pixels, but {} has {seen:?}", photo.display());
        return Err(Error::value("image", what).in_file(path));
    }
    if header.cropped && label.image.crop.is_none() {
        log::warn!("{}: its EXIF data tell of another shape; taken as cropped", photo.display());
        label.image.cropped = true;
    }
    if label.camera.focal_px.is_none() && label.camera.focal_35mm.is_none() {
        label.camera.focal_35mm = header.focal_35mm.filter(|mm| *mm > 0.0);
        if header.digital_zoom && label.camera.focal_35mm.is_some() {
            label.camera.focal_sigma.get_or_insert(ZOOMED_SIGMA);
        }
    }
    Ok(label)
}

/// Sides that a surface with objects on it can have; a label may be in centimetres by mistake.
///
/// # Errors
/// [`Error::Value`] that names the side.
pub fn check_size(label: &Label) -> Result<()> {
    let sides = [("surface.width_m", label.surface.width_m), ("surface.height_m", label.surface.height_m)];
    sides.into_iter().try_for_each(|(at, side)| side.map_or(Ok(()), |metres| SURFACE.check(at, metres)))
}

/// A camera that is near enough to see objects on the surface: how far it is follows from the label's lengths.
///
/// # Errors
/// [`Error::Value`] with the distance.
pub fn check_distance(solution: &Solution) -> Result<()> {
    let distance = solution.camera.center().coords.norm();
    if CAMERA.contains(distance) {
        return Ok(());
    }
    let unit = CAMERA.unit_meant(distance).map_or(String::new(), |unit| format!("; is the size in {unit}s?"));
    let what =
        format!("the camera would be {} m away, expected {CAMERA}{unit}", number((1e3 * distance).round() / 1e3));
    Err(Error::value("surface", what))
}

/// The picture of a label that was read from `path`, where it is there.
pub fn photo_of(label: &Label, path: impl AsRef<Path>) -> Option<PathBuf> {
    let photo = path.as_ref().with_file_name(&label.image.file);
    (!label.image.file.is_empty() && photo.is_file()).then_some(photo)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, Srgb8};
    use exif::experimental::Writer;
    use exif::{Field, In, Rational, Tag, Value};

    /// A label of a photo of 90 x 60 pixels with EXIF data: a 35 mm equivalent of 28 mm, a digital zoom, and the size it was
    /// taken in.
    fn photo_told(zoom: [u32; 2], taken: [u32; 2]) -> Label {
        let folder = tempfile::tempdir().unwrap();
        let photo = folder.path().join("a.jpg");
        io::write(&photo, &Image::<Srgb8>::new(90, 60)).unwrap();
        let [num, denom] = zoom;
        let fields = [
            (Tag::FocalLengthIn35mmFilm, Value::Short(vec![28])),
            (Tag::DigitalZoomRatio, Value::Rational(vec![Rational { num, denom }])),
            (Tag::PixelXDimension, Value::Long(vec![taken[0]])),
            (Tag::PixelYDimension, Value::Long(vec![taken[1]])),
        ];
        let fields = fields.map(|(tag, value)| Field { tag, ifd_num: In::PRIMARY, value });
        let (mut writer, mut notes) = (Writer::new(), std::io::Cursor::new(Vec::new()));
        fields.iter().for_each(|f| writer.push_field(f));
        writer.write(&mut notes, false).unwrap();
        let (mut jpeg, notes) = (std::fs::read(&photo).unwrap(), notes.into_inner());
        let length = (notes.len() + 8) as u16;
        jpeg.splice(2..2, [0xff, 0xe1].into_iter().chain(length.to_be_bytes()).chain(*b"Exif\0\0").chain(notes));
        std::fs::write(&photo, jpeg).unwrap();
        let mut label = Label::new([90, 60], [[0.0; 2]; 4], [0.6, 0.4]);
        label.image.file = "a.jpg".into();
        with_photo(label, folder.path().join("a.label.json")).unwrap()
    }

    #[test]
    fn a_photo_tells_its_focal_length() {
        let label = photo_told([0, 1], [4500, 3000]);
        assert_eq!((label.camera.focal_35mm, label.camera.focal_sigma, label.image.cropped), (Some(28.0), None, false));
    }

    #[test]
    fn a_zoomed_photo_tells_it_less_surely() {
        let label = photo_told([3, 2], [4500, 3000]);
        assert_eq!((label.camera.focal_35mm, label.camera.focal_sigma), (Some(28.0), Some(0.25)));
    }

    #[test]
    fn a_photo_of_another_shape_than_it_was_taken_in_is_cropped() {
        assert!(photo_told([0, 1], [4000, 3000]).image.cropped);
        assert!(!photo_told([0, 1], [3000, 4500]).image.cropped, "turned");
    }
}
