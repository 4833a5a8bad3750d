//! A label for a new photo: its EXIF data, and what is left to be filled in.

use super::label::{Framing, Label, LabelCamera, LabelSurface};
use super::read::{apply_exif, equivalent_mm};
use crate::error::{Error, Result};
use crate::io;
use serde::Serialize;
use std::path::Path;

/// The label, to be written to `path`, of a photo: its size, what its EXIF data say of the lens and
/// of its framing, and the surface, markers and camera of another label of the same rectangle. Its
/// corners are missing.
///
/// # Errors
/// A file that is not a picture, or has pixels that are not square; a photo that is not in or
/// below the label's folder.
pub fn init_label(photo: &Path, path: &Path, like: Option<&Label>) -> Result<Label> {
    let header = io::read_header(photo)?;
    header.check_square_pixels(photo)?;
    let mut label = Label::new(
        [header.width as u32, header.height as u32],
        [[0.0; 2]; 4],
        [1.0; 2],
    );
    label.image.file = file_below(photo, path)?;
    label.surface = LabelSurface {
        id: "surface".into(),
        ..LabelSurface::default()
    };
    if let Some(like) = like {
        copy_shared(&mut label, like);
    }
    if equivalent_mm(&label, &header).is_some() {
        // A lens that zooms has another focal length in each photo: the other photo's, which its
        // label may have from EXIF data, gives way to the photo's own.
        label.camera.forget_equivalent();
    }
    apply_exif(&mut label, &header);
    let camera = &mut label.camera;
    camera.focal_fixed &= camera.focal_px.is_some() || camera.focal_35mm.is_some();
    Ok(label)
}

/// Takes over from another label of the same rectangle what the photos share: the lens, and what
/// was cut off the picture, hold for pictures of the same size, the camera's name for all.
fn copy_shared(label: &mut Label, like: &Label) {
    label.surface = LabelSurface {
        corners_px: None,
        source: None,
        ..like.surface.clone()
    };
    label.markers = like.markers.clone();
    if like.image_size() == label.image_size() {
        let principal = like.camera.principal_point_px;
        label.image.crop = like.image.crop;
        label.camera = LabelCamera {
            principal_point_px: principal.map(|stated| like.pixel(stated).into()),
            height_m: None,
            height_sigma_m: None,
            ..like.camera.clone()
        };
    }
    label.camera.id = like.camera.id.clone();
}

/// The photo as a label at `path` names it.
fn file_below(photo: &Path, path: &Path) -> Result<String> {
    let folder = io::absolute(path)?
        .parent()
        .map(Path::to_path_buf)
        .unwrap_or_default();
    let relative = io::relative(&io::absolute(photo)?, &folder);
    if io::below("", &relative).is_err() {
        let what = format!(
            "is neither in the folder of {} nor in one above it",
            photo.display()
        );
        return Err(Error::file(path, what));
    }
    Ok(relative.to_string_lossy().replace('\\', "/"))
}

/// A label as text, with comments on what is left to be filled in.
#[derive(Serialize)]
struct CommentedLabel<'a> {
    #[serde(rename = "_todo", skip_serializing_if = "Vec::is_empty")]
    todo: Vec<&'static str>,
    #[serde(flatten)]
    label: &'a Label,
}

/// The text of a label file, in which what is missing is there to be filled in: corners of `null`,
/// and what they mean.
///
/// # Errors
/// [`Error::Value`] for a value that JSON cannot express.
pub fn commented(label: &Label) -> Result<String> {
    let commented = CommentedLabel {
        todo: open_questions(label),
        label: &with_null_corners(label),
    };
    let text = serde_json::to_string_pretty(&commented).map_err(|e| Error::value("label", e))?;
    Ok(with_folded_lists(&text) + "\n")
}

/// With corners to be filled in, where there are none.
fn with_null_corners(label: &Label) -> Label {
    let mut shown = label.clone();
    if lacks_corners(label) {
        // NaN is written as null.
        shown.surface.corners_px = Some([[f64::NAN; 2]; 4]);
    }
    shown
}

fn lacks_corners(label: &Label) -> bool {
    label.surface.corners_px.is_none() && label.points.is_empty()
}

/// What is left to be filled in.
fn open_questions(label: &Label) -> Vec<&'static str> {
    let corners = lacks_corners(label).then_some(CORNERS_QUESTION);
    let framing = (label.framing() == Framing::Unknown).then_some(FRAMING_QUESTION);
    corners.into_iter().chain(framing).collect()
}

const CORNERS_QUESTION: &str = "surface.corners_px: x and y of the rectangle's corners in pixels from the top left of the \
     picture, clockwise from the rectangle's top left; the side from the first to the second is width_m";
const FRAMING_QUESTION: &str =
    "image: add \"cropped\": true if the picture was cropped, false if it was not";

/// Pretty JSON, its lists of numbers in one line each.
pub fn with_folded_lists(text: &str) -> String {
    let mut folded = FoldedLines::default();
    for line in text.lines() {
        folded.push(line);
    }
    folded.lines.join("\n")
}

/// Lines of JSON, and the list of numbers that is open at their end.
#[derive(Default)]
struct FoldedLines {
    lines: Vec<String>,
    list: Option<String>,
}

impl FoldedLines {
    fn push(&mut self, line: &str) {
        let part = line.trim();
        match &mut self.list {
            _ if line.ends_with('[') => {
                self.close_list();
                self.list = Some(line.to_owned());
            }
            Some(open) if part.starts_with(']') => {
                *open = format!("{}{part}", open.trim_end());
                self.close_list();
            }
            Some(open) if is_number(part) => {
                *open += part;
                *open += if part.ends_with(',') { " " } else { "" };
            }
            _ => {
                self.close_list();
                self.lines.push(line.to_owned());
            }
        }
    }

    fn close_list(&mut self) {
        self.lines.extend(self.list.take());
    }
}

/// An element of a list of numbers, `null` among them.
fn is_number(part: &str) -> bool {
    part.trim_end_matches(',').parse::<f64>().is_ok() || part.starts_with("null")
}

#[cfg(test)]
mod tests {
    use super::super::label::{Crop, PixelOrigin};
    use super::super::read::tests::{equivalent, write_photo};
    use super::*;
    use crate::image::Image;
    use crate::pixel::Srgb8;

    /// A photo of 90 x 60 pixels without EXIF data.
    fn bare_photo(folder: &tempfile::TempDir) -> std::path::PathBuf {
        let photo = folder.path().join("a.png");
        io::write(&photo, &Image::<Srgb8>::new(90, 60)).unwrap();
        photo
    }

    #[test]
    fn a_label_from_nothing_reads_back_without_its_corners() {
        let folder = tempfile::tempdir().unwrap();
        let photo = bare_photo(&folder);
        let path = folder.path().join("a.label.json");
        let mut label = init_label(&photo, &path, None).unwrap();
        (label.surface.width_m, label.surface.height_m) = (Some(0.56), Some(0.37));
        let text = commented(&label).unwrap();
        assert!(
            text.contains("[null, null],\n")
                && text.contains("\"cropped\\\": true if the picture was cropped"),
            "{text}"
        );
        io::write_text(&path, &text).unwrap();
        assert_eq!(crate::camera::read_label(&path).unwrap(), label);
        let filled = text.replace("[null, null]", "[1, 2]");
        io::write_text(&path, &filled).unwrap();
        assert_eq!(
            crate::camera::read_label(&path).unwrap().surface.corners_px,
            Some([[1.0, 2.0]; 4])
        );
    }

    #[test]
    fn another_label_of_the_rectangle_lends_what_the_photos_share() {
        let folder = tempfile::tempdir().unwrap();
        let photo = bare_photo(&folder);
        let mut like = Label::new([90, 60], [[1.0; 2]; 4], [0.6, 0.4]);
        (like.surface.id, like.camera.id) = ("tray".into(), Some("phone".into()));
        (like.camera.focal_px, like.camera.height_m) = (Some(80.0), Some(1.0));
        let label = init_label(&photo, &folder.path().join("a.label.json"), Some(&like)).unwrap();
        assert_eq!(
            (label.surface.id.as_str(), label.surface.width_m),
            ("tray", Some(0.6))
        );
        assert_eq!(
            (label.surface.corners_px, label.camera.height_m),
            (None, None)
        );
        assert_eq!(
            (label.camera.id.as_deref(), label.camera.focal_px),
            (Some("phone"), Some(80.0))
        );
    }

    #[test]
    fn the_lens_comes_with_the_frame_that_it_is_stated_in() {
        let folder = tempfile::tempdir().unwrap();
        let photo = bare_photo(&folder);
        let path = photo.with_extension("label.json");
        let mut like = Label::new([90, 60], [[1.0; 2]; 4], [0.6, 0.4]);
        like.pixel_origin = PixelOrigin::Center;
        like.camera.principal_point_px = Some([44.0, 30.0]);
        like.image.crop = Some(Crop {
            offset_px: [5.0, 0.0],
            width: 100,
            height: 60,
        });
        let label = init_label(&photo, &path, Some(&like)).unwrap();
        assert_eq!(label.pixel_origin, PixelOrigin::Corner);
        assert_eq!(label.camera.principal_point_px, Some([44.5, 30.5]));
        assert_eq!(label.image.crop, like.image.crop);
        like.image.width = 91;
        let other = init_label(&photo, &path, Some(&like)).unwrap();
        assert_eq!(
            (other.image.crop, other.camera),
            (None, LabelCamera::default())
        );
    }

    #[test]
    fn each_photo_of_a_zoom_keeps_its_own_focal_length() {
        let folder = tempfile::tempdir().unwrap();
        let new_label = |name: &str, like: Option<&Label>| {
            let photo = folder.path().join(name);
            init_label(&photo, &photo.with_extension("label.json"), like).unwrap()
        };
        write_photo(&folder.path().join("wide.jpg"), [equivalent(26)]);
        write_photo(&folder.path().join("tele.jpg"), [equivalent(77)]);
        io::write(folder.path().join("bare.jpg"), &Image::<Srgb8>::new(90, 60)).unwrap();
        let mut wide = new_label("wide.jpg", None);
        (wide.camera.focal_sigma, wide.camera.focal_fixed) = (Some(0.01), true);
        let known = |label: Label| {
            let camera = label.camera;
            (camera.focal_35mm, camera.focal_sigma, camera.focal_fixed)
        };
        let tele = known(new_label("tele.jpg", Some(&wide)));
        assert_eq!(tele, (Some(77.0), None, false));
        let bare = known(new_label("bare.jpg", Some(&wide)));
        assert_eq!(bare, (Some(26.0), Some(0.01), true));
        wide.camera.focal_px = Some(80.0);
        let measured = new_label("tele.jpg", Some(&wide)).camera;
        assert_eq!(
            (measured.focal_px, measured.focal_fixed),
            (Some(80.0), true)
        );
    }

    #[test]
    fn a_label_lies_beside_its_photo_or_above_it() {
        let at = |path: &str| file_below(Path::new("/photos/a/b.jpg"), Path::new(path));
        assert_eq!(
            (
                at("/photos/a/b.label.json").unwrap(),
                at("/photos/x.json").unwrap()
            ),
            ("b.jpg".into(), "a/b.jpg".into())
        );
        assert!(
            at("/labels/b.label.json")
                .unwrap_err()
                .to_string()
                .contains("is neither in the folder of")
        );
    }
}
